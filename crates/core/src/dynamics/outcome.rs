//! What a step has found: the new state, the contacts, and how exactly the law of contact is met.

use nalgebra::{Point3, Vector3};

use super::state::ObjectState;
use crate::contact::coulomb::PointState;

/// The end of a step.
#[derive(Clone, Debug, PartialEq)]
pub struct StepOutcome {
    /// What the next step begins with.
    pub state: ObjectState,
    /// Displacement of the nodes asked for, m, in the object's frame.
    pub displacements: Vec<[f64; 3]>,
    /// Points that press.
    pub contacts: Vec<PointContact>,
    /// What each body does to the object, in the order of the bodies.
    pub loads: Vec<BodyLoad>,
    /// Deepest point of the surface in a body at the end, m; 0 where none is inside.
    pub penetration_max: f64,
    /// Longest slip of a pressing point in this step, m.
    pub slip_max: f64,
    /// Largest residual of the natural map at the end, N.
    pub contact_residual: f64,
    /// Residual of the natural map over the largest force of a point; 0 without forces.
    pub contact_residual_rel: f64,
    /// Largest part of a force that lies outside its cone, N.
    pub cone_violation: f64,
    /// `‖K u − f‖ / ‖f‖` of the elastic part at most.
    pub residual_rel: f64,
    /// Whether gaps and residual are within what was asked for.
    pub is_converged: bool,
    /// Times the contact problem was made anew about where it had ended.
    pub rounds: usize,
    /// Sweeps over all points.
    pub sweeps: usize,
    /// Steps of Newton's method.
    pub newton_steps: usize,
    /// Shapes that contact was solved about, one after the other; 1 for a linear step.
    pub shapes: usize,
}

impl StepOutcome {
    /// Whether it meets what was asked for, or its residuals and its penetration are smaller than those of
    /// another outcome.
    pub(super) fn is_nearer_than(&self, other: &Self) -> bool {
        if self.is_converged {
            return true;
        }
        let worst = |of: &Self| of.residual_rel.max(of.contact_residual_rel);
        worst(self) < worst(other) && self.penetration_max <= other.penetration_max
    }

    /// The outcome of the last part of a step, with what the parts before it have added.
    pub(super) fn after(self, before: &Self) -> Self {
        Self {
            slip_max: self.slip_max + before.slip_max,
            penetration_max: self.penetration_max.max(before.penetration_max),
            contact_residual: self.contact_residual.max(before.contact_residual),
            contact_residual_rel: self.contact_residual_rel.max(before.contact_residual_rel),
            cone_violation: self.cone_violation.max(before.cone_violation),
            residual_rel: self.residual_rel.max(before.residual_rel),
            is_converged: self.is_converged && before.is_converged,
            rounds: self.rounds + before.rounds,
            sweeps: self.sweeps + before.sweeps,
            newton_steps: self.newton_steps + before.newton_steps,
            shapes: self.shapes + before.shapes,
            ..self
        }
    }
}

/// A point of the object that presses on a body.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PointContact {
    /// The body.
    pub body: u16,
    /// Nodes of the triangle it lies in.
    pub nodes: [u32; 3],
    /// Their weights.
    pub weights: [f64; 3],
    /// Where it is, m, world.
    pub place: Point3<f64>,
    /// Out of the body, world.
    pub normal: Vector3<f64>,
    /// Force on the object, N, world.
    pub force: Vector3<f64>,
    /// Slip along the body in this step, m, world.
    pub slip: Vector3<f64>,
    /// Whether it sticks.
    pub state: PointState,
}

/// The sum of a body's forces on the object.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct BodyLoad {
    /// Force, N, world.
    pub force: Vector3<f64>,
    /// Torque about the place of the body's pose at the end, N m, world.
    pub torque: Vector3<f64>,
    /// Sum of the normal parts, N.
    pub normal_force: f64,
    /// Points that press.
    pub contacts: usize,
}
