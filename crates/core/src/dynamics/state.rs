//! What an object is like between two steps, and what a step has found: the new state, the contacts, and how
//! exactly the law of contact is met.

use nalgebra::{Isometry3, Point3, Vector3};

use super::small_system::SmallSystem;
use crate::contact::coulomb::PointState;
use crate::solve::condensed::NodeForce;

/// Pose, velocity and elastic state of an object: all that the next step needs to know of the past.
#[derive(Clone, Debug, PartialEq)]
pub struct ObjectState {
    /// Where the object's mesh is in the world.
    pub world_from_object: Isometry3<f64>,
    /// Velocity of the centre of mass, m/s, world.
    pub velocity: Vector3<f64>,
    /// Angular velocity, rad/s, world.
    pub angular_velocity: Vector3<f64>,
    /// Forces at nodes whose elastic response is the present shape, ascending nodes, N, in the
    /// object's frame. Without viscosity they are the contact forces.
    pub forces: Vec<NodeForce>,
    /// The contacts at the end of the last step.
    pub contacts: Vec<HeldContact>,
}

/// A contact as it was at the end of a step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HeldContact {
    /// The body it is with.
    pub body: u16,
    /// Nodes of the surface triangle that it lies in.
    pub nodes: [u32; 3],
    /// Weights of these nodes; zero for nodes that the contact does not touch.
    pub weights: [f64; 3],
    /// Force on the object, N, in the object's frame.
    pub force: Vector3<f64>,
}

impl ObjectState {
    /// An object at rest and undeformed.
    pub fn at_rest(world_from_object: Isometry3<f64>) -> Self {
        Self {
            world_from_object,
            velocity: Vector3::zeros(),
            angular_velocity: Vector3::zeros(),
            forces: Vec::new(),
            contacts: Vec::new(),
        }
    }

    /// Whether every number is finite.
    pub fn is_finite(&self) -> bool {
        let place = self.world_from_object.translation.vector;
        let turn = self.world_from_object.rotation.coords;
        let vectors = [place, self.velocity, self.angular_velocity];
        let forces = self.forces.iter().map(|(_, f)| *f);
        let held = self.contacts.iter().map(|c| c.force);
        vectors.into_iter().chain(forces).chain(held).all(|v| v.iter().all(|x| x.is_finite()))
            && turn.iter().all(|x| x.is_finite())
            && self.contacts.iter().all(|c| c.weights.iter().all(|w| w.is_finite()))
    }
}

/// The sum of forces at nodes, ascending; forces that are zero are left out.
pub(super) fn summed(mut forces: Vec<NodeForce>) -> Vec<NodeForce> {
    // A stable sort: forces at one node are summed in the order given.
    forces.sort_by_key(|(node, _)| *node);
    let mut sums: Vec<NodeForce> = Vec::with_capacity(forces.len());
    for (node, force) in forces {
        match sums.last_mut() {
            Some((last, sum)) if *last == node => *sum += force,
            _ => sums.push((node, force)),
        }
    }
    sums.retain(|(_, force)| force.iter().any(|x| *x != 0.0));
    sums
}

/// The forces of some contacts at their nodes.
pub(super) fn at_nodes<'a>(contacts: impl IntoIterator<Item = &'a HeldContact>) -> Vec<NodeForce> {
    let of_contact = |c: &HeldContact| {
        let (weights, force) = (c.weights, c.force);
        c.nodes.into_iter().zip(weights).map(move |(node, weight)| (node, weight * force))
    };
    summed(contacts.into_iter().flat_map(of_contact).collect())
}

/// Forces at nodes as one field of all nodes.
///
/// Shapes: `dofs` 3N.
pub(super) fn spread(forces: &[NodeForce], dofs: usize) -> Vec<f64> {
    let mut field = vec![0.0; dofs];
    for (node, force) in forces {
        let at = 3 * *node as usize;
        field[at..at + 3].iter_mut().zip(force.iter()).for_each(|(f, of_node)| *f += of_node);
    }
    field
}

/// A point of a triangle, by weights of its corners.
pub(super) fn mix(corners: &[Vector3<f64>; 3], weights: &[f64; 3]) -> Point3<f64> {
    Point3::from(weights[0] * corners[0] + weights[1] * corners[1] + weights[2] * corners[2])
}

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
    /// Whether it ended before that because it was late.
    pub is_late: bool,
    /// Times the contact problem was made anew about where it had ended.
    pub rounds: usize,
    /// Sweeps over all points.
    pub sweeps: usize,
    /// Steps of Newton's method.
    pub newton_steps: usize,
    /// Shapes that contact was solved about, one after the other; 1 for a linear step.
    pub shapes: usize,
    /// How the forces of the bodies follow from their places at the end; `None` where it was not asked for
    /// or could not be made.
    pub small_system: Option<SmallSystem>,
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

    /// The outcome of a step that could have ended nearer to what is asked for if there had been time.
    pub(super) fn ended_early(self) -> Self {
        Self { is_late: !self.is_converged, ..self }
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
            is_late: self.is_late || before.is_late,
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
    /// The body that it presses on.
    pub body: u16,
    /// Nodes of the triangle it lies in.
    pub nodes: [u32; 3],
    /// Weights of these nodes; their sum is one.
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
