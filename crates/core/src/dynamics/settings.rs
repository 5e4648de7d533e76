//! How a step in time is made: its length, weight, viscosity, and how exactly it is solved.

use nalgebra::Vector3;

/// How a step is made.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StepSettings {
    /// Length of the step, s.
    pub seconds: f64,
    /// Acceleration of free fall, m/s², world.
    pub gravity: Vector3<f64>,
    /// Density of the object, kg/m³.
    pub density: f64,
    /// Time in which the shape forgets a force (Kelvin and Voigt), s.
    pub viscosity: f64,
    /// Penetration that is small enough, as a share of the object's size.
    pub penetration_rel: f64,
    /// Residual of the contact law that is small enough, as a share of the largest force.
    pub residual_rel: f64,
    /// Most times that the contact problem is made anew.
    pub rounds_max: usize,
    /// Steps of Newton's method after which no further round is begun.
    pub newton_max: usize,
}

impl Default for StepSettings {
    fn default() -> Self {
        Self {
            seconds: 0.01,
            gravity: Vector3::new(0.0, 0.0, -9.81),
            density: 1000.0,
            viscosity: 0.0,
            penetration_rel: 1e-6,
            residual_rel: 1e-9,
            rounds_max: 16,
            newton_max: 400,
        }
    }
}
