//! A rigid body with a closed surface of triangles: a tool, a robot's finger.

use nalgebra::{Matrix3, Point3, Unit, Vector3};

use super::closed_surface::{RigidMeshError, check_closed, pseudonormals, welded};
use super::closest::{
    Barycentric, Deepest, SignedDistance, on_triangle, on_triangle_to_triangle, point_at,
};
use super::deepest::deepest_of;

/// The inside of a closed surface of triangles, and all points within a radius of it.
///
/// Shapes: `boxes` a binary tree of bounding boxes over `order`, children of i at 2i + 1 and 2i + 2.
/// Units: m. Frame: the body's.
#[derive(Clone, Debug)]
pub struct RigidMesh {
    vertices: Vec<Point3<f64>>,
    triangles: Vec<[u32; 3]>,
    /// Normal of every triangle, of its three edges (opposite corner 0, 1, 2) and of its corners:
    /// sums over what meets there, weighted by angle, so that they tell inside from outside.
    normals: Vec<[Vector3<f64>; 7]>,
    boxes: Vec<Node>,
    reach: f64,
    thickness: f64,
    /// Radius by which the body goes beyond its triangles: that of its edges and corners; 0 where they are sharp.
    radius: f64,
}

/// Lowest and highest corner of a bounding box, m.
#[derive(Clone, Copy, Debug)]
struct Bounds {
    low: Point3<f64>,
    high: Point3<f64>,
}

/// A box of the tree and the triangles in it.
#[derive(Clone, Debug)]
struct Node {
    bounds: Bounds,
    /// Range in `triangles`.
    first: usize,
    count: usize,
    /// Position of the second child; the first stands behind its parent. 0 in a leaf.
    second: usize,
}

/// Triangles of a leaf.
const LEAF: usize = 4;
/// Weights below this count as zero: the nearest point is on an edge or at a corner.
const ON_EDGE: f64 = 1e-12;
/// What is missing to 1 of the cosine between the way out and a face's normal, below which the face is nearest.
const FLAT: f64 = 1e-12;

impl RigidMesh {
    /// Triangles with their corners counter-clockwise seen from outside; vertices in the same place
    /// count as one.
    ///
    /// # Errors
    /// [`RigidMeshError`].
    pub fn try_new(
        vertices: &[Point3<f64>],
        triangles: &[[u32; 3]],
    ) -> Result<Self, RigidMeshError> {
        let (vertices, triangles) = welded(vertices, triangles)?;
        check_closed(&triangles)?;
        let corner = |n: u32| vertices[n as usize].coords;
        let volume: f64 = triangles
            .iter()
            .map(|t| corner(t[0]).dot(&corner(t[1]).cross(&corner(t[2]))) / 6.0)
            .sum();
        // Written so that a NaN is refused too.
        let is_outward = volume > 0.0;
        if !is_outward {
            return Err(RigidMeshError::InsideOut { volume });
        }
        let mut sorted = Sorted { vertices: &vertices, triangles, boxes: Vec::new() };
        let count = sorted.triangles.len();
        sorted.split(0, count);
        let Sorted { triangles, boxes, .. } = sorted;
        let normals = pseudonormals(&vertices, &triangles);
        let reach = vertices.iter().map(|v| v.coords.norm()).fold(0.0, f64::max);
        let Bounds { low, high } = boxes[0].bounds;
        let thickness = 0.25 * (high - low).min();
        Ok(Self { vertices, triangles, normals, boxes, reach, thickness, radius: 0.0 })
    }

    /// The body with all points within a radius of it: its edges and corners are rounded, and it has one normal
    /// everywhere outside of its triangles, which contact needs to converge.
    ///
    /// Units: m.
    ///
    /// # Errors
    /// [`RigidMeshError::Radius`].
    pub fn with_radius(self, radius: f64) -> Result<Self, RigidMeshError> {
        match radius >= 0.0 && radius.is_finite() {
            true => Ok(Self { radius, ..self }),
            false => Err(RigidMeshError::Radius { radius }),
        }
    }

    /// Radius of a ball around the origin that holds the body, m.
    pub fn reach(&self) -> f64 {
        self.reach + self.radius
    }

    /// A quarter of the smallest width of its bounding box, and the radius, m.
    pub fn thickness(&self) -> f64 {
        self.thickness + self.radius
    }

    /// Signed distance of a point, and the way out.
    pub fn distance(&self, point: &Point3<f64>) -> SignedDistance {
        let sharp = self.distance_from_triangles(point);
        SignedDistance { distance: sharp.distance - self.radius, ..sharp }
    }

    /// Curvature of the surface where it is nearest to a point; `None` where a triangle is nearest, and where
    /// edges are sharp.
    ///
    /// Units: 1/m.
    pub(super) fn curvature(&self, point: &Point3<f64>) -> Option<Matrix3<f64>> {
        if self.radius == 0.0 {
            return None;
        }
        let (_, triangle, weights) = self.nearest_to(point);
        let corners = self.corners(triangle);
        let away = point - point_at(&corners, &weights);
        let normal = away.try_normalize(1e-9 * self.reach)?;
        let pseudonormal = self.pseudonormal(triangle, &weights);
        let across = |along: Vector3<f64>| Matrix3::identity() - along * along.transpose();
        let bends = match weights.map(|weight| weight <= ON_EDGE) {
            [false, false, false] => return None,
            [true, false, false] => across((corners[2] - corners[1]).normalize()),
            [false, true, false] => across((corners[0] - corners[2]).normalize()),
            [false, false, true] => across((corners[1] - corners[0]).normalize()),
            _ => Matrix3::identity(),
        };
        // The edge of triangles in one plane is part of a face; inside, the way out is another.
        let is_face = normal.dot(&self.normals[triangle][0]) > 1.0 - FLAT;
        let is_inside = normal.dot(&pseudonormal) < 0.0;
        (!is_face && !is_inside).then(|| (bends - normal * normal.transpose()) / self.radius)
    }

    /// Signed distance from the triangles, and the way out.
    ///
    /// Source: Bærentzen and Aanæs (2005), signed distance by angle-weighted pseudonormals.
    fn distance_from_triangles(&self, point: &Point3<f64>) -> SignedDistance {
        let (square, triangle, weights) = self.nearest_to(point);
        let pseudonormal = self.pseudonormal(triangle, &weights);
        let away = point - point_at(&self.corners(triangle), &weights);
        let is_inside = away.dot(&pseudonormal) < 0.0;
        let size = square.sqrt();
        let sign = if is_inside { -1.0 } else { 1.0 };
        // At the surface itself the way from it tells nothing.
        let normal = match size > 1e-9 * self.reach {
            true => Unit::new_normalize(sign * away),
            false => Unit::try_new(pseudonormal, f64::MIN_POSITIVE).unwrap_or(Vector3::x_axis()),
        };
        SignedDistance { distance: sign * size, normal }
    }

    /// The deepest point of a triangle: the nearest to the body's triangles where it is outside of them all, by
    /// a search where it crosses them.
    pub(super) fn deepest(&self, corners: &[Point3<f64>; 3]) -> Deepest {
        let [a, b, c] = corners;
        let around = Bounds { low: a.inf(b).inf(c), high: a.sup(b).sup(c) };
        let mut best = ([1.0, 0.0, 0.0], f64::INFINITY);
        self.visit(0, f64::INFINITY, &|bounds| bounds.square_between(&around), &mut |triangle| {
            let found = on_triangle_to_triangle(corners, &self.corners(triangle));
            if found.1 < best.1 {
                best = found;
            }
            best.1
        });
        let (weights, square) = best;
        let distance = self.distance(&point_at(corners, &weights));
        match square > 0.0 && distance.distance > -self.radius {
            true => Deepest { weights, distance },
            false => deepest_of(corners, |point| self.distance(point)),
        }
    }

    /// Square of the distance of a point from the triangles, the nearest triangle, and the point of it.
    fn nearest_to(&self, point: &Point3<f64>) -> (f64, usize, Barycentric) {
        let mut best = (f64::INFINITY, 0, [1.0, 0.0, 0.0]);
        self.visit(0, f64::INFINITY, &|bounds| bounds.square_from(point), &mut |triangle| {
            let corners = self.corners(triangle);
            let weights = on_triangle(&corners, point);
            let square = (point_at(&corners, &weights) - point).norm_squared();
            if square < best.0 {
                best = (square, triangle, weights);
            }
            best.0
        });
        best
    }

    fn corners(&self, triangle: usize) -> [Point3<f64>; 3] {
        self.triangles[triangle].map(|n| self.vertices[n as usize])
    }

    /// The pseudonormal of that part of a triangle which a point of it belongs to.
    fn pseudonormal(&self, triangle: usize, weights: &Barycentric) -> Vector3<f64> {
        let is_zero = weights.map(|w| w <= ON_EDGE);
        let normals = &self.normals[triangle];
        match is_zero {
            [false, true, true] => normals[4],
            [true, false, true] => normals[5],
            [true, true, false] => normals[6],
            [true, false, false] => normals[1],
            [false, true, false] => normals[2],
            [false, false, true] => normals[3],
            _ => normals[0],
        }
    }

    /// Goes through the triangles below a node, from near boxes to far ones, and leaves out boxes that are not
    /// nearer than the best triangle.
    ///
    /// Units: `far` is the square of the distance of a box; `consider` takes a triangle and says the square of
    /// the best distance then; `best` is that from before; result the best; m².
    fn visit(
        &self,
        node: usize,
        mut best: f64,
        far: &impl Fn(&Bounds) -> f64,
        consider: &mut impl FnMut(usize) -> f64,
    ) -> f64 {
        let Node { first, count, second, .. } = self.boxes[node];
        if second == 0 {
            return (first..first + count).map(consider).fold(best, f64::min);
        }
        let far_child = |child: usize| (far(&self.boxes[child].bounds), child);
        let mut children = [far_child(node + 1), far_child(second)];
        if children[1].0 < children[0].0 {
            children.swap(0, 1);
        }
        for (square, child) in children {
            if square < best {
                best = self.visit(child, best, far, consider);
            }
        }
        best
    }
}

impl Bounds {
    fn square_from(&self, point: &Point3<f64>) -> f64 {
        (0..3).map(|k| (point[k] - point[k].clamp(self.low[k], self.high[k])).powi(2)).sum()
    }

    fn square_between(&self, other: &Self) -> f64 {
        let apart =
            |k: usize| (self.low[k] - other.high[k]).max(other.low[k] - self.high[k]).max(0.0);
        (0..3).map(|k| apart(k).powi(2)).sum()
    }
}

/// Triangles while they are sorted into boxes.
struct Sorted<'a> {
    vertices: &'a [Point3<f64>],
    triangles: Vec<[u32; 3]>,
    boxes: Vec<Node>,
}

impl Sorted<'_> {
    /// Makes the box of a range of triangles and of its halves; its position.
    fn split(&mut self, first: usize, count: usize) -> usize {
        let some = &self.triangles[first..first + count];
        let mut low = Point3::from(Vector3::repeat(f64::INFINITY));
        let mut high = Point3::from(Vector3::repeat(f64::NEG_INFINITY));
        for vertex in some.iter().flatten().map(|&n| self.vertices[n as usize]) {
            (low, high) = (low.inf(&vertex), high.sup(&vertex));
        }
        let place = self.boxes.len();
        self.boxes.push(Node { bounds: Bounds { low, high }, first, count, second: 0 });
        if count > LEAF {
            let axis = (high - low).imax();
            let vertices = self.vertices;
            let middle = |t: &[u32; 3]| t.iter().map(|&n| vertices[n as usize][axis]).sum::<f64>();
            self.triangles[first..first + count]
                .sort_by(|a, b| middle(a).total_cmp(&middle(b)).then_with(|| a.cmp(b)));
            self.split(first, count / 2);
            self.boxes[place].second = self.split(first + count / 2, count - count / 2);
        }
        place
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::super::shape::RigidShape;
    use super::*;

    /// A box as triangles.
    fn cuboid(half: Vector3<f64>) -> RigidMesh {
        let corner = |k: usize| {
            let sign = |bit: usize| if k >> bit & 1 == 1 { 1.0 } else { -1.0 };
            Point3::new(sign(0) * half.x, sign(1) * half.y, sign(2) * half.z)
        };
        let squares =
            [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
        let triangles: Vec<[u32; 3]> =
            squares.iter().flat_map(|s| [[s[0], s[1], s[2]], [s[0], s[2], s[3]]]).collect();
        let vertices: Vec<Point3<f64>> = (0..8).map(corner).collect();
        RigidMesh::try_new(&vertices, &triangles).unwrap()
    }

    proptest! {
        #![proptest_config(ProptestConfig { cases: 64, max_global_rejects: 20_000, ..ProptestConfig::default() })]

        #[test]
        fn box_of_triangles_is_as_far_as_the_box(p in prop::array::uniform3(-1.0..1.0f64)) {
            let half = Vector3::new(0.2, 0.4, 0.3);
            let (mesh, plain) = (cuboid(half), RigidShape::cuboid(half).unwrap());
            let p = Point3::from(p);
            let (ours, theirs) = (mesh.distance(&p), plain.distance(&p));
            prop_assert!((ours.distance - theirs.distance).abs() < 1e-12, "{ours:?} {theirs:?}");
        }

        #[test]
        fn deepest_point_in_triangles_is_that_in_the_box(
            corners in prop::array::uniform3(prop::array::uniform3(-0.6..0.6f64)),
        ) {
            let half = Vector3::new(0.2, 0.4, 0.3);
            let (mesh, plain) = (cuboid(half), RigidShape::cuboid(half).unwrap());
            let corners = corners.map(Point3::from);
            let (ours, theirs) = (mesh.deepest(&corners), plain.deepest(&corners));
            // As near as bodies that touch are; deep in the box the way out has creases.
            prop_assume!((-0.05..0.05).contains(&theirs.distance.distance));
            let off = ours.distance.distance - theirs.distance.distance;
            prop_assert!(off.abs() < 5e-4, "{off:e}: {ours:?} {theirs:?}");
        }

        /// A box of triangles with a radius is a larger box whose edges have that radius.
        #[test]
        fn box_of_triangles_with_a_radius_is_the_rounded_box(
            corners in prop::array::uniform3(prop::array::uniform3(-0.6..0.6f64)),
        ) {
            let (half, radius) = (Vector3::new(0.15, 0.35, 0.25), 0.05);
            let mesh = cuboid(half).with_radius(radius).unwrap();
            let plain = RigidShape::rounded_cuboid(half.add_scalar(radius), radius).unwrap();
            let corners = corners.map(Point3::from);
            let (ours, theirs) = (mesh.deepest(&corners), plain.deepest(&corners));
            // Where it is outside of the triangles the nearest point is exact.
            prop_assume!(theirs.distance.distance > -radius);
            let off = ours.distance.distance - theirs.distance.distance;
            prop_assert!(off.abs() < 1e-12, "{off:e}: {ours:?} {theirs:?}");
            let place = point_at(&corners, &ours.weights);
            let bend = |found: Option<Matrix3<f64>>| found.unwrap_or(Matrix3::zeros());
            let (of_mesh, of_box) = (bend(mesh.curvature(&place)), bend(plain.curvature(&place)));
            prop_assert!((of_mesh - of_box).norm() < 1e-6 / radius, "{of_mesh} {of_box}");
        }
    }

    #[test]
    fn radius_that_is_no_size_is_refused() {
        for radius in [-1e-3, f64::NAN, f64::INFINITY] {
            let refused = cuboid(Vector3::repeat(0.1)).with_radius(radius).err();
            assert!(matches!(refused, Some(RigidMeshError::Radius { .. })));
        }
    }

    #[test]
    fn surfaces_that_bound_nothing_are_refused_by_name() {
        let corners = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        let corners = corners.map(Point3::from);
        let outward = [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]];
        assert!(RigidMesh::try_new(&corners, &outward).is_ok());
        let refused = |triangles: &[[u32; 3]]| RigidMesh::try_new(&corners, triangles).err();
        assert!(matches!(refused(&outward[..3]), Some(RigidMeshError::Open { .. })));
        let inward = outward.map(|[a, b, c]| [a, c, b]);
        assert!(matches!(refused(&inward), Some(RigidMeshError::InsideOut { .. })));
        assert_eq!(refused(&[[0, 0, 1]]), Some(RigidMeshError::Empty));
        let unknown = refused(&[[0, 1, 9]]);
        assert!(matches!(unknown, Some(RigidMeshError::NoSuchVertex { vertex: 9, .. })));
    }
}
