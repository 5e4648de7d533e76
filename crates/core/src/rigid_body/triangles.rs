//! A rigid body with a closed surface of triangles: a tool, a robot's finger.

use std::collections::BTreeMap;

use nalgebra::{Point3, Unit, Vector3};

use super::closest::{Barycentric, area_normal, on_triangle, point_at};
use super::closest::{Deepest, SignedDistance};
use super::deepest::deepest_of;

/// The inside of a closed surface of triangles.
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
}

/// A box of the tree and the triangles in it.
#[derive(Clone, Debug)]
struct Node {
    low: Point3<f64>,
    high: Point3<f64>,
    /// Range in `triangles`.
    first: usize,
    count: usize,
    /// Position of the second child; the first stands behind its parent. 0 in a leaf.
    second: usize,
}

/// Why triangles bound no rigid body.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum RigidMeshError {
    /// No triangle with an area.
    #[error("the surface has no triangle with an area")]
    Empty,
    /// A corner that is not there.
    #[error("triangle {triangle} names vertex {vertex}, but there are {vertex_count} (0-based)")]
    NoSuchVertex {
        /// Index of the triangle, from 0.
        triangle: usize,
        /// The vertex it names.
        vertex: u32,
        /// Vertices there are.
        vertex_count: usize,
    },
    /// A coordinate that is not finite.
    #[error("vertex {vertex} is not finite")]
    NotFinite {
        /// Index of the vertex, from 0.
        vertex: usize,
    },
    /// An edge that does not join exactly two triangles of the same sense.
    #[error(
        "the surface is not closed: the edge between vertices {from} and {to} belongs to {count} \
         triangles of one sense; close it, and turn all triangles outward"
    )]
    Open {
        /// An end of the edge.
        from: u32,
        /// Its other end.
        to: u32,
        /// Triangles that run along it.
        count: usize,
    },
    /// A surface that is turned inside out.
    #[error("the surface encloses the volume {volume:e} m³; turn its triangles outward")]
    InsideOut {
        /// Signed volume that the triangles enclose, m³.
        volume: f64,
    },
}

/// Triangles of a leaf.
const LEAF: usize = 4;
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
        let extent = boxes[0].high - boxes[0].low;
        let thickness = 0.25 * extent.min();
        Ok(Self { vertices, triangles, normals, boxes, reach, thickness })
    }

    /// Radius of a ball around the origin that holds the body, m.
    pub fn reach(&self) -> f64 {
        self.reach
    }

    /// A quarter of the smallest width of its bounding box, m.
    pub fn thickness(&self) -> f64 {
        self.thickness
    }

    /// Signed distance of a point, and the way out.
    ///
    /// Source: Bærentzen and Aanæs (2005), signed distance by angle-weighted pseudonormals.
    pub fn distance(&self, point: &Point3<f64>) -> SignedDistance {
        let mut best = (f64::INFINITY, 0, [1.0, 0.0, 0.0]);
        self.nearest(0, point, &mut best);
        let (square, triangle, weights) = best;
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

    /// The deepest point of a triangle, by a search.
    pub(super) fn deepest(&self, corners: &[Point3<f64>; 3]) -> Deepest {
        deepest_of(corners, |point| self.distance(point))
    }

    fn corners(&self, triangle: usize) -> [Point3<f64>; 3] {
        self.triangles[triangle].map(|n| self.vertices[n as usize])
    }

    /// The pseudonormal of that part of a triangle which a point of it belongs to.
    fn pseudonormal(&self, triangle: usize, weights: &Barycentric) -> Vector3<f64> {
        let is_zero = weights.map(|w| w <= 1e-12);
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

    fn nearest(&self, node: usize, point: &Point3<f64>, best: &mut (f64, usize, Barycentric)) {
        let Node { first, count, second, .. } = self.boxes[node];
        if second == 0 {
            for triangle in first..first + count {
                let corners = self.corners(triangle);
                let weights = on_triangle(&corners, point);
                let square = (point_at(&corners, &weights) - point).norm_squared();
                if square < best.0 {
                    *best = (square, triangle, weights);
                }
            }
            return;
        }
        let far = |child: usize| self.boxes[child].square_from(point);
        let mut children = [(far(node + 1), node + 1), (far(second), second)];
        if children[1].0 < children[0].0 {
            children.swap(0, 1);
        }
        for (square, child) in children {
            if square < best.0 {
                self.nearest(child, point, best);
            }
        }
    }
}

impl Node {
    fn square_from(&self, point: &Point3<f64>) -> f64 {
        (0..3).map(|k| (point[k] - point[k].clamp(self.low[k], self.high[k])).powi(2)).sum()
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
        self.boxes.push(Node { low, high, first, count, second: 0 });
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

/// Vertices and triangles.
type Triangles = (Vec<Point3<f64>>, Vec<[u32; 3]>);

/// One vertex for each place, and the triangles that have an area.
fn welded(vertices: &[Point3<f64>], triangles: &[[u32; 3]]) -> Result<Triangles, RigidMeshError> {
    if let Some(vertex) = vertices.iter().position(|v| !v.iter().all(|x| x.is_finite())) {
        return Err(RigidMeshError::NotFinite { vertex });
    }
    let mut places: BTreeMap<[u64; 3], u32> = BTreeMap::new();
    let mut kept = Vec::new();
    let mut number = Vec::with_capacity(vertices.len());
    for vertex in vertices {
        // Adding zero makes one zero of both.
        let key = [vertex.x + 0.0, vertex.y + 0.0, vertex.z + 0.0].map(f64::to_bits);
        number.push(*places.entry(key).or_insert_with(|| {
            kept.push(*vertex);
            kept.len() as u32 - 1
        }));
    }
    let mut sound = Vec::with_capacity(triangles.len());
    for (triangle, corners) in triangles.iter().enumerate() {
        let mut named = [0; 3];
        for (named, &vertex) in named.iter_mut().zip(corners) {
            *named = *number.get(vertex as usize).ok_or(RigidMeshError::NoSuchVertex {
                triangle,
                vertex,
                vertex_count: vertices.len(),
            })?;
        }
        if named[0] != named[1] && named[1] != named[2] && named[2] != named[0] {
            sound.push(named);
        }
    }
    match sound.is_empty() {
        true => Err(RigidMeshError::Empty),
        false => Ok((kept, sound)),
    }
}

/// Every edge must be run along once in each sense.
fn check_closed(triangles: &[[u32; 3]]) -> Result<(), RigidMeshError> {
    let mut runs: BTreeMap<(u32, u32), usize> = BTreeMap::new();
    for t in triangles {
        for k in 0..3 {
            *runs.entry((t[k], t[(k + 1) % 3])).or_default() += 1;
        }
    }
    for (&(from, to), &count) in &runs {
        if runs.get(&(to, from)) != Some(&count) {
            return Err(RigidMeshError::Open { from, to, count });
        }
    }
    Ok(())
}

fn pseudonormals(vertices: &[Point3<f64>], triangles: &[[u32; 3]]) -> Vec<[Vector3<f64>; 7]> {
    let mut of_edges: BTreeMap<(u32, u32), Vector3<f64>> = BTreeMap::new();
    let mut of_vertices = vec![Vector3::zeros(); vertices.len()];
    let faces: Vec<Vector3<f64>> = triangles
        .iter()
        .map(|t| {
            let normal = area_normal(&t.map(|n| vertices[n as usize]));
            Unit::try_new(normal, f64::MIN_POSITIVE).map_or(Vector3::zeros(), Unit::into_inner)
        })
        .collect();
    for (t, normal) in triangles.iter().zip(&faces) {
        for k in 0..3 {
            let [at, next, last] = [k, (k + 1) % 3, (k + 2) % 3].map(|k| vertices[t[k] as usize]);
            of_vertices[t[k] as usize] += (next - at).angle(&(last - at)) * normal;
            *of_edges.entry(edge(t[k], t[(k + 1) % 3])).or_insert(Vector3::zeros()) += normal;
        }
    }
    let opposite = |t: &[u32; 3], k: usize| of_edges[&edge(t[(k + 1) % 3], t[(k + 2) % 3])];
    let at = |n: u32| of_vertices[n as usize];
    triangles
        .iter()
        .zip(&faces)
        .map(|(t, normal)| {
            let edges = [opposite(t, 0), opposite(t, 1), opposite(t, 2)];
            [*normal, edges[0], edges[1], edges[2], at(t[0]), at(t[1]), at(t[2])]
        })
        .collect()
}

fn edge(a: u32, b: u32) -> (u32, u32) {
    (a.min(b), a.max(b))
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
