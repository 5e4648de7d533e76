//! Points of the surface at which the object touches bodies: fixed in the material, found as needed.
//!
//! A contact is a point that stays where it is in its triangle while a step is solved. Where a triangle
//! goes deeper into a body between the points that it has, its deepest point becomes one more. So the
//! force on a triangle can move from point to point, the problem with given points is solved exactly,
//! and after a few rounds no part of any triangle is inside a body.

use nalgebra::{Isometry3, Point3, Unit, Vector3};

use super::state::HeldContact;
use crate::rigid_body::{Barycentric, Deepest, RigidShape};

/// A triangle of the boundary surface that is near a body.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Candidate {
    /// Position in the surface's triangles.
    pub triangle: u32,
    /// Position in the list of bodies.
    pub body: u16,
}

/// A point of the surface that a body can touch, by the nodes of its triangle and their weights.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct MaterialPoint {
    pub body: u16,
    pub nodes: [u32; 3],
    pub weights: Barycentric,
}

/// Where a body is from a point.
#[derive(Clone, Copy, Debug)]
pub(super) struct Gap {
    /// Where the point is, in the object's frame.
    pub place: Point3<f64>,
    /// Signed distance from the body, m.
    pub distance: f64,
    /// Out of the body, in the object's frame.
    pub normal: Unit<Vector3<f64>>,
}

/// Weights below this count as zero: the point is on an edge or at a corner.
const ON_EDGE: f64 = 1e-9;
/// Points of one triangle whose weights differ by less are one point.
const SAME: f64 = 1e-7;
/// Cosine between the way out of a body and the way out of the object above which the body is on the
/// other side of the triangle.
const FACING: f64 = 0.3;

impl MaterialPoint {
    /// A corner of the surface.
    pub fn corner(body: u16, node: u32) -> Self {
        Self { body, nodes: [node; 3], weights: [1.0, 0.0, 0.0] }
    }

    /// A point of a triangle; one at a corner is the corner of all triangles there, one on an edge
    /// that of both.
    pub fn new(body: u16, nodes: [u32; 3], weights: Barycentric) -> Self {
        let mut within: Vec<(u32, f64)> =
            nodes.into_iter().zip(weights).filter(|(_, weight)| *weight > ON_EDGE).collect();
        within.sort_unstable_by_key(|(node, _)| *node);
        match within[..] {
            [(node, _)] => Self::corner(body, node),
            [(a, weight), (b, other)] => {
                let share = weight / (weight + other);
                Self { body, nodes: [a, b, b], weights: [share, 1.0 - share, 0.0] }
            }
            _ => Self { body, nodes, weights },
        }
    }

    /// Nodes with a weight.
    pub fn weighted(&self) -> impl Iterator<Item = (u32, f64)> + use<> {
        self.nodes.into_iter().zip(self.weights).filter(|(_, weight)| *weight != 0.0)
    }

    /// Whether two points are one, or too near to tell apart.
    pub fn is_same(&self, other: &Self) -> bool {
        self.is_near(other, SAME)
    }

    /// Whether two points of one triangle have weights that differ by less than a number.
    pub fn is_near(&self, other: &Self, difference: f64) -> bool {
        let near = |(a, b): (&f64, &f64)| (a - b).abs() < difference;
        self.body == other.body
            && self.nodes == other.nodes
            && self.weights.iter().zip(&other.weights).all(near)
    }
}

impl From<&HeldContact> for MaterialPoint {
    fn from(held: &HeldContact) -> Self {
        Self { body: held.body, nodes: held.nodes, weights: held.weights }
    }
}

/// A triangle of the surface, deformed.
///
/// Shapes: corners in order. Units: m. Frame: that of the poses that it is asked about.
pub(super) struct Triangle {
    corners: [Point3<f64>; 3],
    middle: Point3<f64>,
    /// Distance of the farthest corner from the middle.
    reach: f64,
}

impl Triangle {
    pub fn new(corners: [Point3<f64>; 3]) -> Self {
        let [a, b, c] = corners.map(|corner| corner.coords);
        let middle = Point3::from((a + b + c) / 3.0);
        let square = corners.iter().map(|c| (c - middle).norm_squared()).fold(0.0, f64::max);
        Self { corners, middle, reach: square.sqrt() }
    }

    /// Whether a point of it can be within a distance of a body.
    pub fn is_within(&self, shape: &RigidShape, pose: &Isometry3<f64>, distance: f64) -> bool {
        // No point is nearer than the middle by more than its distance from there.
        let far = shape.distance(&pose.inverse_transform_point(&self.middle)).distance;
        far.is_nan() || far <= distance + self.reach
    }

    /// The deepest point in a body, where the triangle reaches into it and the body is on the triangle's
    /// outer side; a half space is met by corners alone.
    pub fn deepest(&self, shape: &RigidShape, pose: &Isometry3<f64>) -> Option<Deepest> {
        if matches!(shape, RigidShape::Plane { .. }) || !self.is_within(shape, pose, 0.0) {
            return None;
        }
        let deepest = shape.deepest(&self.corners.map(|c| pose.inverse_transform_point(&c)));
        let out_of_body = pose.rotation * deepest.distance.normal;
        let [a, b, c] = self.corners;
        let outward = (b - a).cross(&(c - a));
        (out_of_body.dot(&outward) < FACING * outward.norm()).then_some(deepest)
    }

    /// How deep it reaches into a body; zero where it does not.
    pub fn depth(&self, shape: &RigidShape, pose: &Isometry3<f64>) -> f64 {
        if !self.is_within(shape, pose, 0.0) {
            return 0.0;
        }
        let of_corner =
            |corner: &Point3<f64>| -shape.distance(&pose.inverse_transform_point(corner)).distance;
        let inside = self.deepest(shape, pose).map(|found| -found.distance.distance);
        self.corners.iter().map(of_corner).chain(inside).fold(0.0, f64::max)
    }
}

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
    /// Corners and points inside triangles.
    pub fn iter(&self) -> impl Iterator<Item = &MaterialPoint> {
        self.corners.iter().chain(&self.inside)
    }

    /// Moves a point to where its force has gone; where another one is already, it goes.
    pub fn roll(&mut self, from: &MaterialPoint, to: MaterialPoint) {
        let Some(place) = self.inside.iter().position(|point| point == from) else { return };
        let others = (0..self.inside.len()).filter(|&other| other != place);
        let mut others = others.map(|other| &self.inside[other]).chain(&self.corners);
        if others.any(|other| other.is_same(&to)) {
            self.inside.remove(place);
        } else if to.nodes[0] == to.nodes[1] {
            self.inside.remove(place);
            self.corners.push(to);
        } else {
            self.inside[place] = to;
        }
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

#[cfg(test)]
mod tests {
    use super::*;

    fn triangle() -> Triangle {
        Triangle::new([[0.0, 0.0, 0.0], [0.01, 0.0, 0.0], [0.0, 0.01, 0.0]].map(Point3::from))
    }

    fn found(shape: &RigidShape, place: Vector3<f64>) -> Option<Deepest> {
        let pose = Isometry3::from_parts(place.into(), Default::default());
        triangle().deepest(shape, &pose)
    }

    #[test]
    fn a_ball_touches_a_large_triangle_inside_it() {
        let ball = RigidShape::sphere(0.001).unwrap();
        let point = found(&ball, Vector3::new(0.003, 0.003, 0.0008)).unwrap();
        assert!((point.distance.distance + 0.0002).abs() < 1e-15);
        assert!((point.distance.normal.z + 1.0).abs() < 1e-12);
        assert!(point.weights.iter().all(|w| *w > 0.2));
    }

    #[test]
    fn a_ball_behind_the_triangle_does_not_touch_it() {
        let ball = RigidShape::sphere(0.001).unwrap();
        assert_eq!(found(&ball, Vector3::new(0.003, 0.003, -0.0008)), None);
    }

    #[test]
    fn a_point_on_an_edge_is_the_same_from_both_triangles() {
        let ours = MaterialPoint::new(3, [7, 4, 9], [0.25, 0.75, 0.0]);
        let theirs = MaterialPoint::new(3, [4, 7, 11], [0.75, 0.25, 1e-12]);
        assert!(ours.is_same(&theirs), "{ours:?} {theirs:?}");
        let corner = MaterialPoint::new(3, [4, 7, 11], [1.0, 0.0, 0.0]);
        assert_eq!(corner, MaterialPoint::corner(3, 4));
    }
}
