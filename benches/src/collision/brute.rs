//! Brute force: every vertex against every collider. What it finds must not be missed.

use nalgebra::{Point3, Vector3};
use softgrasp_grasp::hand::{FingerColliders, HandColliders};
use softgrasp_grasp::shape::{Cylinder, Sphere};

/// Vertices that are inside a hand, found by testing all.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Inside {
    /// Vertices inside each of the fifteen cylinders and then the five tips, ascending.
    pub by_collider: Vec<Vec<u32>>,
    /// The vertex that each tip certainly touches, see [`contact`].
    pub contacts: [Option<u32>; 5],
}

impl Inside {
    /// Tests every vertex against every collider.
    ///
    /// Frame: that of the points.
    pub fn of(hand: &HandColliders, points: &[Point3<f64>], normals: &[Vector3<f64>]) -> Self {
        let inside = |is_inside: &dyn Fn(&Point3<f64>) -> bool| -> Vec<u32> {
            (0..).zip(points).filter(|(_, p)| is_inside(p)).map(|(n, _)| n).collect()
        };
        let mut by_collider: Vec<Vec<u32>> = hand
            .fingers
            .iter()
            .flat_map(|finger| finger.cylinders)
            .map(|cylinder| inside(&|p| is_in_cylinder(&cylinder, p)))
            .collect();
        by_collider
            .extend(hand.fingers.iter().map(|finger| inside(&|p| is_in_sphere(&finger.tip, p))));
        let contacts = hand.fingers.map(|finger| contact(&finger, points, normals));
        Self { by_collider, contacts }
    }

    /// Whether each segment of a finger contains a vertex; the last counts its cylinder and its tip.
    pub fn collide(&self, finger: usize) -> [bool; 3] {
        let has = |collider: usize| !self.by_collider[collider].is_empty();
        [has(3 * finger), has(3 * finger + 1), has(3 * finger + 2) || has(15 + finger)]
    }

    /// Number of pairs of a collider and a vertex inside it.
    pub fn count(&self) -> usize {
        self.by_collider.iter().map(Vec::len).sum()
    }
}

/// Vertex that a fingertip certainly touches: the one nearest to its contact point of the whole
/// surface, if it lies in the tip's sphere and the contact point is not outside its tangent plane.
///
/// Source: thesis (4.10).
pub(super) fn contact(
    finger: &FingerColliders,
    points: &[Point3<f64>],
    normals: &[Vector3<f64>],
) -> Option<u32> {
    let distance = |p: &Point3<f64>| (p - finger.contact_point).norm_squared();
    let (node, nearest) =
        (0..).zip(points).min_by(|a, b| distance(a.1).total_cmp(&distance(b.1)))?;
    let d = finger.contact_point - nearest;
    let is_behind = d.dot(&normals[node as usize]) <= 0.0;
    (is_behind && is_in_sphere(&finger.tip, nearest)).then_some(node)
}

fn is_in_sphere(sphere: &Sphere, point: &Point3<f64>) -> bool {
    (point - sphere.centre).norm() <= sphere.radius
}

fn is_in_cylinder(cylinder: &Cylinder, point: &Point3<f64>) -> bool {
    let from_base = point - cylinder.base;
    let along = from_base.dot(&cylinder.axis);
    (0.0..=cylinder.length).contains(&along)
        && from_base.cross(&cylinder.axis).norm() <= cylinder.radius
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn vertices_at_known_places_are_inside_or_not() {
        let cylinder = Cylinder {
            base: Point3::new(0.0, 0.0, 1.0),
            axis: Vector3::z_axis(),
            length: 2.0,
            radius: 0.5,
        };
        let inside = [[0.0, 0.0, 1.0], [0.4, 0.2, 2.0], [0.0, 0.5, 3.0]];
        let outside = [[0.0, 0.0, 0.99], [0.4, 0.4, 2.0], [0.0, 0.0, 3.01]];
        assert!(inside.into_iter().all(|p| is_in_cylinder(&cylinder, &p.into())));
        assert!(!outside.into_iter().any(|p| is_in_cylinder(&cylinder, &p.into())));
    }
}
