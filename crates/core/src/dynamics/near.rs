//! Candidates that are near their body where a step begins; the others are looked at once, where it ends.
//!
//! A run names every triangle that a body can reach in the worst case, ten times those that it touches. The
//! rounds look at each candidate again and again, so they are played with the near ones. Where another one
//! is inside its body at the end, it joins them and the rounds go on from there.

use nalgebra::{Isometry3, Point3, Vector3};

use super::bodies::MovingBody;
use super::features::{Candidate, Triangle};
use super::state::ObjectState;

/// Displacements of some nodes, found by node.
pub(super) struct NodeField {
    /// Position of every node of the mesh among the values; [`NodeField::ABSENT`] for a node without one.
    place: Vec<u32>,
    pub values: Vec<[f64; 3]>,
}

impl NodeField {
    const ABSENT: u32 = u32::MAX;

    /// Shapes: one value for each of `nodes`. Units: m. Frame: the object's.
    pub fn new(nodes: &[u32], values: Vec<[f64; 3]>, node_count: usize) -> Self {
        let mut place = vec![Self::ABSENT; node_count];
        for (at, &node) in (0u32..).zip(nodes) {
            place[node as usize] = at;
        }
        Self { place, values }
    }

    /// Displacement of a node; zero for one without a value.
    pub fn at(&self, node: u32) -> Vector3<f64> {
        self.values.get(self.place[node as usize] as usize).copied().unwrap_or_default().into()
    }

    /// Displacements of some nodes, in their order.
    pub fn of(&self, nodes: &[u32]) -> Vec<Vector3<f64>> {
        nodes.iter().map(|&node| self.at(node)).collect()
    }
}

/// What can touch in a step.
#[derive(Clone, Copy)]
pub(super) struct Around<'a> {
    /// Places of all nodes at rest, in the object's frame.
    pub vertices: &'a [Point3<f64>],
    /// Triangles of the boundary surface.
    pub triangles: &'a [[u32; 3]],
    pub bodies: &'a [MovingBody],
    pub candidates: &'a [Candidate],
}

impl Around<'_> {
    /// The triangle of a candidate, in the object's frame.
    fn triangle(&self, candidate: &Candidate, displacement: &NodeField) -> Triangle {
        let nodes = self.triangles[candidate.triangle as usize];
        Triangle::new(nodes.map(|node| self.vertices[node as usize] + displacement.at(node)))
    }
}

/// The candidates of a step, and which of them the rounds look at.
pub(super) struct NearCandidates<'a> {
    around: Around<'a>,
    is_near: Vec<bool>,
}

impl<'a> NearCandidates<'a> {
    /// The candidates within a distance of their body: of where it is at the beginning or where it would end
    /// if no force pushed it back, seen from an object that is placed as it is then or there.
    ///
    /// Units: `distance` m.
    pub fn choose(
        around: Around<'a>,
        (state, drifted): (&ObjectState, &Isometry3<f64>),
        begun: &NodeField,
        distance: f64,
    ) -> Self {
        let (from_start, from_end) = (state.world_from_object.inverse(), drifted.inverse());
        let poses = |body: &MovingBody| {
            [from_start * body.world_from_body_start, from_end * body.world_from_body_end]
        };
        let poses: Vec<[Isometry3<f64>; 2]> = around.bodies.iter().map(poses).collect();
        let is_near = |candidate: &Candidate| {
            let body = usize::from(candidate.body);
            let (triangle, shape) = (around.triangle(candidate, begun), &around.bodies[body].shape);
            poses[body].iter().any(|pose| triangle.is_within(shape, pose, distance))
        };
        Self { around, is_near: around.candidates.iter().map(is_near).collect() }
    }

    /// Makes all of them near.
    pub fn add_all(&mut self) {
        self.is_near.fill(true);
    }

    /// The near ones, in the order of all.
    pub fn chosen(&self) -> Vec<Candidate> {
        let both = self.around.candidates.iter().zip(&self.is_near);
        both.filter(|(_, is_near)| **is_near).map(|(candidate, _)| *candidate).collect()
    }

    /// Makes those near that reach deeper into their body than allowed; says whether there were any.
    ///
    /// Shapes: `object_from_bodies` one pose for each body. Units: m.
    pub fn add_missed(
        &mut self,
        object_from_bodies: &[Isometry3<f64>],
        ended: &NodeField,
        allowed: f64,
    ) -> bool {
        let mut has_missed = false;
        for (candidate, is_near) in self.around.candidates.iter().zip(&mut self.is_near) {
            let body = usize::from(candidate.body);
            if !*is_near {
                let triangle = self.around.triangle(candidate, ended);
                let shape = &self.around.bodies[body].shape;
                *is_near = triangle.depth(shape, &object_from_bodies[body]) > allowed;
                has_missed |= *is_near;
            }
        }
        has_missed
    }
}
