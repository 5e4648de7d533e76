//! The peer: parry3d's bounding volume hierarchy of axis-aligned boxes, in single precision.

use nalgebra::Point3;
use parry3d::bounding_volume::Aabb;
use parry3d::math::Vector;
use parry3d::partitioning::{Bvh, BvhBuildStrategy, BvhWorkspace};
use softgrasp_grasp::hand::HandColliders;
use softgrasp_grasp::shape::{Cylinder, Sphere};

/// Kind of primitive in the peer's leaves.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Leaf {
    /// Boxes of triangles, as usual with parry3d.
    Triangle,
    /// Boxes of vertices, as in the sphere tree.
    Vertex,
}

/// Surface in the peer's number type; converted before the times are measured.
pub(super) type PeerPoints = Vec<Vector>;

/// The peer's tree over one surface.
pub(super) struct Peer {
    leaf: Leaf,
    bvh: Bvh,
    workspace: BvhWorkspace,
}

impl Leaf {
    /// Boxes of all leaves.
    fn boxes<'a>(
        self,
        points: &'a [Vector],
        triangles: &'a [[u32; 3]],
    ) -> Box<dyn Iterator<Item = Aabb> + 'a> {
        match self {
            Self::Vertex => Box::new(points.iter().map(|&p| Aabb { mins: p, maxs: p })),
            Self::Triangle => Box::new(triangles.iter().map(|t| {
                let [a, b, c] = t.map(|n| points[n as usize]);
                Aabb { mins: a.min(b).min(c), maxs: a.max(b).max(c) }
            })),
        }
    }
}

impl Peer {
    /// Boxes of the leaves, then the tree by its default strategy.
    pub fn build(leaf: Leaf, points: &[Vector], triangles: &[[u32; 3]]) -> Self {
        let boxes: Vec<Aabb> = leaf.boxes(points, triangles).collect();
        let bvh = Bvh::from_leaves(BvhBuildStrategy::Binned, &boxes);
        Self { leaf, bvh, workspace: BvhWorkspace::default() }
    }

    /// New boxes of all leaves, then `refit`, which also sorts the nodes for faster queries.
    pub fn refit(&mut self, points: &[Vector], triangles: &[[u32; 3]]) {
        self.update_leaves(points, triangles);
        self.bvh.refit(&mut self.workspace);
    }

    /// New boxes of all leaves, then `refit_without_opt`, which leaves the nodes where they are.
    pub fn refit_in_place(&mut self, points: &[Vector], triangles: &[[u32; 3]]) {
        self.update_leaves(points, triangles);
        self.bvh.refit_without_opt();
    }

    fn update_leaves(&mut self, points: &[Vector], triangles: &[[u32; 3]]) {
        for (index, aabb) in (0..).zip(self.leaf.boxes(points, triangles)) {
            self.bvh.insert_or_update_partially(aabb, index, 0.0);
        }
    }

    /// Appends the leaves whose boxes meet a collider's box.
    pub fn query(&self, collider: &Aabb, out: &mut Vec<u32>) {
        out.extend(self.bvh.intersect_aabb(collider));
    }

    /// Kind of primitive in the leaves.
    pub fn leaf(&self) -> Leaf {
        self.leaf
    }

    /// Shows the leaves whose boxes meet a box until one says that it is enough.
    pub fn visit(&self, aabb: &Aabb, mut is_enough: impl FnMut(&u32) -> bool) {
        for leaf in self.bvh.intersect_aabb(aabb) {
            if is_enough(&leaf) {
                return;
            }
        }
    }

    /// Vertices of a list of leaves, ascending, each once.
    pub fn vertices_of(&self, leaves: &[u32], triangles: &[[u32; 3]]) -> Vec<u32> {
        let mut vertices: Vec<u32> = match self.leaf {
            Leaf::Vertex => leaves.to_vec(),
            Leaf::Triangle => leaves.iter().flat_map(|&t| triangles[t as usize]).collect(),
        };
        vertices.sort_unstable();
        vertices.dedup();
        vertices
    }
}

/// Points in single precision.
pub(super) fn peer_points(points: &[Point3<f64>]) -> PeerPoints {
    points.iter().map(|p| vector([p.x, p.y, p.z])).collect()
}

/// Boxes of the fifteen cylinders and then the five tips of a hand.
pub(super) fn collider_boxes(hand: &HandColliders) -> [Aabb; 20] {
    let mut boxes = [Aabb { mins: Vector::ZERO, maxs: Vector::ZERO }; 20];
    let all = hand.fingers.iter().flat_map(|f| f.cylinders).map(|c| cylinder_box(&c, 0.0));
    let all = all.chain(hand.fingers.iter().map(|f| sphere_box(&f.tip, 0.0)));
    for (slot, aabb) in boxes.iter_mut().zip(all) {
        *slot = aabb;
    }
    boxes
}

/// Box of a cylinder and all that is nearer to it than `margin`, m.
pub(super) fn cylinder_box(cylinder: &Cylinder, margin: f64) -> Aabb {
    let axis = cylinder.axis.into_inner();
    let centre = cylinder.base + axis * (0.5 * cylinder.length);
    // Half the length along each axis, plus the disc of the end seen from that axis.
    let half = axis.map(|a| {
        0.5 * cylinder.length * a.abs() + cylinder.radius * (1.0 - a * a).max(0.0).sqrt() + margin
    });
    aabb(&centre, half.into())
}

/// Box of a sphere and all that is nearer to it than `margin`, m.
pub(super) fn sphere_box(sphere: &Sphere, margin: f64) -> Aabb {
    aabb(&sphere.centre, [sphere.radius + margin; 3])
}

fn aabb(centre: &Point3<f64>, half: [f64; 3]) -> Aabb {
    let end = |sign: f64| vector([0, 1, 2].map(|i| centre[i] + sign * half[i]));
    Aabb { mins: end(-1.0), maxs: end(1.0) }
}

fn vector([x, y, z]: [f64; 3]) -> Vector {
    Vector::new(x as f32, y as f32, z as f32)
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{Unit, Vector3};
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn box_of_a_cylinder_is_as_small_as_its_rim_allows(
            axis in prop::array::uniform3(-1.0..1.0f64),
            length in 0.0..2.0f64,
            radius in 0.1..1.0f64,
        ) {
            let axis = Unit::try_new(Vector3::from(axis), 1e-3);
            prop_assume!(axis.is_some());
            let axis = axis.unwrap();
            let cylinder = Cylinder { base: Point3::new(0.3, -0.2, 0.1), axis, length, radius };
            let aabb = cylinder_box(&cylinder, 0.0);
            // The rim, at many angles: inside the box, and reaching its sides.
            let u = axis.cross(&Vector3::new(0.31, 0.77, -0.56)).normalize();
            let v = axis.cross(&u);
            let rim: Vec<Point3<f64>> = (0..720).flat_map(|i| {
                let (sin, cos) = (f64::from(i) * std::f64::consts::TAU / 720.0).sin_cos();
                let out = (u * cos + v * sin) * radius;
                [cylinder.base + out, cylinder.base + axis.into_inner() * length + out]
            }).collect();
            for i in 0..3 {
                let low = rim.iter().map(|p| p[i]).fold(f64::INFINITY, f64::min);
                let high = rim.iter().map(|p| p[i]).fold(f64::NEG_INFINITY, f64::max);
                prop_assert!((f64::from(aabb.mins[i]) - low).abs() < 1e-4);
                prop_assert!((f64::from(aabb.maxs[i]) - high).abs() < 1e-4);
            }
        }
    }
}
