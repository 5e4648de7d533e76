//! The points at which contact is looked for in a step: all corners near bodies, few in each triangle.

use nalgebra::Vector3;

use super::features::MaterialPoint;
use super::state::HeldContact;

/// Points of contact.
pub(super) struct Pool {
    /// Corners, each once.
    pub corners: Vec<MaterialPoint>,
    /// Points on edges and inside triangles, in the order in which they were found.
    pub inside: Vec<MaterialPoint>,
}

/// Points of one edge or triangle whose weights differ by less are one point that moves.
const NEAR: f64 = 0.1;
/// Points on one edge or inside one triangle: three say all about a flat triangle.
const POINTS_OF_TRIANGLE: usize = 3;

impl Pool {
    /// All points.
    pub fn iter(&self) -> impl Iterator<Item = &MaterialPoint> {
        self.corners.iter().chain(&self.inside)
    }

    /// Adds a point that is not there yet. A point of the same triangle that is near moves instead: to the
    /// new place, or with a force half of the way there. A force tilts the triangle, so that the deepest
    /// point is on its other side next; all of the way it would go to and fro between two places for ever,
    /// and two points so near would share their force at will. Where the triangle has enough points, one
    /// without a force makes room. Says whether a force has moved.
    pub fn add(&mut self, point: MaterialPoint, forces: &mut [HeldContact]) -> bool {
        if self.iter().any(|other| other.is_same(&point)) {
            return false;
        }
        if point.nodes[0] == point.nodes[1] {
            self.corners.push(point);
            return false;
        }
        let is_beside =
            |other: &MaterialPoint| other.body == point.body && other.nodes == point.nodes;
        let beside: Vec<usize> =
            (0..self.inside.len()).filter(|&at| is_beside(&self.inside[at])).collect();
        let near = beside.iter().copied().find(|&at| self.inside[at].is_near(&point, NEAR));
        if let Some(at) = near {
            let before = std::mem::replace(&mut self.inside[at], point);
            let held = forces.iter_mut().find(|held| before.is_same(&(&**held).into()));
            let has_force = held.is_some();
            if let Some(held) = held {
                let moved = &mut self.inside[at].weights;
                moved.iter_mut().zip(before.weights).for_each(|(w, old)| *w = 0.5 * (*w + old));
                held.weights = *moved;
            }
            return has_force;
        }
        let is_open = |at: &usize| force_at(forces, &self.inside[*at]).is_none();
        if beside.len() >= POINTS_OF_TRIANGLE
            && let Some(open) = beside.into_iter().find(is_open)
        {
            self.inside.remove(open);
        }
        self.inside.push(point);
        false
    }
}

/// Force at a point.
pub(super) fn force_at(forces: &[HeldContact], point: &MaterialPoint) -> Option<Vector3<f64>> {
    forces.iter().find(|held| point.is_same(&(*held).into())).map(|held| held.force)
}

/// One contact for each triangle and body: where its forces act on average, with their sum.
///
/// The next step begins with these; those that it needs besides it finds again.
pub(super) fn merged(contacts: &[HeldContact]) -> Vec<HeldContact> {
    let mut merged: Vec<(HeldContact, f64)> = Vec::with_capacity(contacts.len());
    for contact in contacts {
        let size = contact.force.norm();
        let beside = merged
            .iter_mut()
            .find(|(other, _)| other.body == contact.body && other.nodes == contact.nodes);
        match beside {
            Some((other, sum)) => {
                let share = size / (size + *sum);
                for (weight, new) in other.weights.iter_mut().zip(&contact.weights) {
                    *weight += share * (new - *weight);
                }
                other.force += contact.force;
                *sum += size;
            }
            None => merged.push((*contact, size)),
        }
    }
    merged.into_iter().map(|(contact, _)| contact).collect()
}
