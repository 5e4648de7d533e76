//! The rigid part of an object's motion: mass, inertia, and where forces of one step take it.

use nalgebra::{
    Isometry3, Matrix3, Matrix3x6, Matrix6x3, Point3, Translation3, UnitQuaternion, Vector3,
};

use super::state::ObjectState;
use crate::solve::condensed::FreeBody;

/// Mass, centre and moments of inertia.
///
/// Units: kg, m, kg m². Frame: the object's.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MassProperties {
    /// Mass of the body, kg.
    pub mass: f64,
    /// Centre of mass at rest.
    pub centre: Point3<f64>,
    /// Moments of inertia about the centre.
    pub inertia: Matrix3<f64>,
    /// Inverse of the moments of inertia.
    pub inverse_inertia: Matrix3<f64>,
}

impl MassProperties {
    /// Those of a body of one density, kg/m³; `None` where they are no positive numbers.
    pub fn of(body: &FreeBody, density: f64) -> Option<Self> {
        let (mass, inertia) = (density * body.volume(), density * body.inertia());
        let inverse_inertia = inertia.try_inverse()?;
        let is_sound =
            mass > 0.0 && mass.is_finite() && inverse_inertia.iter().all(|x| x.is_finite());
        is_sound.then_some(Self { mass, centre: body.centre(), inertia, inverse_inertia })
    }
}

impl MassProperties {
    /// This mass with other moments of inertia; `None` where these have no inverse.
    pub(super) fn with_inertia(self, inertia: Matrix3<f64>) -> Option<Self> {
        let inverse_inertia = inertia.try_inverse()?;
        let is_sound = inverse_inertia.iter().all(|x| x.is_finite());
        is_sound.then_some(Self { inertia, inverse_inertia, ..self })
    }
}

/// Force and torque about the centre of mass, in the object's frame.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Wrench {
    /// Force, N.
    pub force: Vector3<f64>,
    /// Torque about the centre of mass, N m.
    pub torque: Vector3<f64>,
}

/// The rigid motion of one step under given forces.
#[derive(Clone, Copy, Debug)]
pub(super) struct RigidMotion {
    /// Pose at the end.
    pub world_from_object: Isometry3<f64>,
    /// Velocity of the centre of mass at the end, world.
    pub velocity: Vector3<f64>,
    /// Angular velocity of the step, world.
    pub angular_velocity: Vector3<f64>,
    /// Angular momentum at the end, world.
    pub angular_momentum: Vector3<f64>,
}

/// The rigid part of a step: state at its beginning, mass, weight, time.
pub(super) struct RigidStep<'a> {
    pub state: &'a ObjectState,
    pub mass: MassProperties,
    /// Acceleration of free fall, m/s², world.
    pub gravity: Vector3<f64>,
    pub seconds: f64,
}

impl RigidStep<'_> {
    /// Motion under a wrench that acts in the frame of the object as it is turned by `turned`.
    pub fn motion(&self, wrench: &Wrench, turned: &UnitQuaternion<f64>) -> RigidMotion {
        let (h, mass) = (self.seconds, &self.mass);
        let start = &self.state.world_from_object;
        let velocity = self.state.velocity + h * (self.gravity + turned * wrench.force / mass.mass);
        let inertia = |turn: &UnitQuaternion<f64>, v: Vector3<f64>| {
            turn * (mass.inertia * (turn.inverse() * v))
        };
        let begun = inertia(&start.rotation, self.state.angular_velocity);
        let angular_momentum = begun + h * (turned * wrench.torque);
        let angular_velocity =
            turned * (mass.inverse_inertia * (turned.inverse() * angular_momentum));
        let rotation = UnitQuaternion::from_scaled_axis(h * angular_velocity) * start.rotation;
        let centre = start * mass.centre + h * velocity;
        let place = centre - rotation * mass.centre.coords;
        RigidMotion {
            world_from_object: Isometry3::from_parts(Translation3::from(place.coords), rotation),
            velocity,
            angular_velocity,
            angular_momentum,
        }
    }

    /// What a change of a force at a point changes in its place, in the object's frame.
    ///
    /// Units: `arm` from the centre of mass, m; result m/N.
    pub fn compliance(&self, arm: &Vector3<f64>) -> Matrix3<f64> {
        self.moved(arm) * self.arms(arm)
    }

    /// Place of a point per change of the wrench, in the object's frame: three columns by the force, three by
    /// the torque.
    ///
    /// Units: `arm` from the centre of mass, m; result m/N, 1/N.
    pub fn moved(&self, arm: &Vector3<f64>) -> Matrix3x6<f64> {
        let square = self.seconds.powi(2);
        let mut moved = Matrix3x6::zeros();
        let shift = Matrix3::identity() * (square / self.mass.mass);
        moved.fixed_view_mut::<3, 3>(0, 0).copy_from(&shift);
        let turning = -square * arm.cross_matrix() * self.mass.inverse_inertia;
        moved.fixed_view_mut::<3, 3>(0, 3).copy_from(&turning);
        moved
    }

    /// Wrench of a force at a point: the force, and its torque.
    ///
    /// Units: `arm` from the centre of mass, m.
    pub fn arms(&self, arm: &Vector3<f64>) -> Matrix6x3<f64> {
        let mut arms = Matrix6x3::zeros();
        arms.fixed_view_mut::<3, 3>(0, 0).fill_with_identity();
        arms.fixed_view_mut::<3, 3>(3, 0).copy_from(&arm.cross_matrix());
        arms
    }
}

impl RigidMotion {
    /// Angular velocity of the object in its end pose with the same angular momentum.
    pub fn settled_angular_velocity(&self, mass: &MassProperties) -> Vector3<f64> {
        let turn = self.world_from_object.rotation;
        turn * (mass.inverse_inertia * (turn.inverse() * self.angular_momentum))
    }
}
