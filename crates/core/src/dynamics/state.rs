//! What an object is like between two steps.

use nalgebra::{Isometry3, Point3, Vector3};

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
