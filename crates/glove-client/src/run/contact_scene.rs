//! Constants of a grasp by contact with friction: hand, object and table.

use nalgebra::Vector3;

/// Constants of an object and of the hand that grasps it with friction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ContactScene {
    /// Coefficient of friction between hand and object, and between table and object.
    pub friction: f64,
    /// Displacement of a finger for each unit of force on it, m/N: the measured finger may close further
    /// than the shown one, which presses by their distance over this.
    pub finger_compliance: f64,
    /// Density of the object, kg/m³.
    pub density: f64,
    /// Time constant with which the shape forgets a force (Kelvin and Voigt), s.
    pub viscosity: f64,
    /// Acceleration of free fall, m/s², in the world frame; −y is down.
    pub gravity: Vector3<f64>,
    /// Height of the table (y in the world frame), m; `None` without a table.
    pub table_y: Option<f64>,
}

impl Default for ContactScene {
    fn default() -> Self {
        Self {
            friction: 0.8,
            finger_compliance: 1e-3,
            density: 1000.0,
            viscosity: 0.02,
            gravity: Vector3::new(0.0, -9.81, 0.0),
            table_y: None,
        }
    }
}
