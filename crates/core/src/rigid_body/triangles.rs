//! A rigid body with a closed surface of triangles: a tool, a robot's finger.

use std::collections::BTreeMap;

use nalgebra::{Point3, Unit, Vector3};

use super::closest::{Barycentric, area_normal, on_triangle, point_at};
use super::closest::{Deepest, SignedDistance};

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
/// Pieces into which a triangle is cut at most while its deepest point is looked for.
const PIECES_MAX: usize = 64;
/// A piece is given up where it can be deeper by this share of its size only.
const NEAR_ENOUGH: f64 = 1e-3;
/// Halvings of the step of the last search around the deepest point found, and ways tried with each.
const HALVINGS: u32 = 34;
const WAYS: u32 = 9;
/// How often steps of one size are tried again where they have led deeper.
const AGAIN: usize = 4;
/// Samples along an edge, and thirds that are taken away around the best of them.
const EDGE_SAMPLES: u32 = 8;
const EDGE_THIRDS: usize = 40;
/// The whole turn, and the turn from one halving to the next: no part of the whole.
const FULL: f64 = std::f64::consts::TAU;
const TURN: f64 = 2.399_963;

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

    /// The deepest point of a triangle: pieces whose middle cannot be near enough are left out, then a
    /// search with ever smaller steps ends at a point from which no step leads deeper.
    pub(super) fn deepest(&self, corners: &[Point3<f64>; 3]) -> Deepest {
        let at = |weights: Barycentric| Deepest {
            weights,
            distance: self.distance(&point_at(corners, &weights)),
        };
        let size = (0..3).map(|i| (corners[i] - corners[(i + 1) % 3]).norm()).fold(0.0, f64::max);
        let whole = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        let mut best = at(whole[0]);
        let consider = |weights: Barycentric, best: &mut Deepest| {
            let found = at(weights);
            if found.distance.distance < best.distance.distance {
                *best = found;
            }
            found.distance.distance
        };
        consider(whole[1], &mut best);
        consider(whole[2], &mut best);
        // Each piece with the smallest distance that can be in it; the most promising comes next.
        let mut pieces = vec![(f64::NEG_INFINITY, whole, size)];
        for _ in 0..PIECES_MAX {
            let next = (0..pieces.len()).min_by(|&a, &b| pieces[a].0.total_cmp(&pieces[b].0));
            let Some((least, piece, size)) = next.map(|at| pieces.swap_remove(at)) else { break };
            if least >= best.distance.distance - NEAR_ENOUGH * size {
                break;
            }
            for quarter in quarters(&piece) {
                let middle =
                    [0, 1, 2].map(|k| (quarter[0][k] + quarter[1][k] + quarter[2][k]) / 3.0);
                // The distance changes by no more than the way gone: two thirds of the longest
                // median, which is below the longest edge.
                let reach = 0.5 * size;
                pieces.push((consider(middle, &mut best) - 0.6 * reach, quarter, reach));
            }
        }
        let mut best = self.descend(best, at);
        for (first, second) in [(0, 1), (1, 2), (2, 0)] {
            let on_edge = deepest_on_edge(first, second, at);
            if on_edge.distance.distance < best.distance.distance {
                best = on_edge;
            }
        }
        best
    }

    /// Steps in all ways, and on in the way that has led deeper (Hooke and Jeeves), ever smaller.
    fn descend(&self, mut best: Deepest, at: impl Fn(Barycentric) -> Deepest) -> Deepest {
        let consider = |moved: Barycentric, best: &mut Deepest| {
            // A step out of the triangle ends at its border.
            let within = moved.map(|weight: f64| weight.max(0.0));
            let sum: f64 = within.iter().sum();
            let found = at(within.map(|weight| weight / sum));
            let is_deeper = found.distance.distance < best.distance.distance;
            if is_deeper {
                *best = found;
            }
            is_deeper
        };
        let (mut step, mut turns) = (0.125, 0);
        for _ in 0..HALVINGS {
            // Steps of one size follow a crease down for as long as they lead deeper.
            for _ in 0..AGAIN {
                let from = best.weights;
                for way in 0..WAYS {
                    // Turned each time, so that no crease stays between two ways for ever.
                    let angle = TURN * f64::from(turns) + FULL * f64::from(way) / f64::from(WAYS);
                    let (a, b) = (step * angle.cos(), step * angle.sin());
                    let [x, y, z] = best.weights;
                    consider([x + a, y + b, z - a - b], &mut best);
                }
                turns += 1;
                if best.weights == from {
                    break;
                }
                let way: [f64; 3] = std::array::from_fn(|k| best.weights[k] - from[k]);
                let on = std::array::from_fn(|k| best.weights[k] + way[k]);
                consider(on, &mut best);
            }
            step *= 0.5;
        }
        best
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

/// The deepest point of an edge: the best of some samples, then a search by thirds around it.
fn deepest_on_edge(first: usize, second: usize, at: impl Fn(Barycentric) -> Deepest) -> Deepest {
    let on = |t: f64| {
        let mut weights = [0.0; 3];
        (weights[first], weights[second]) = (1.0 - t, t);
        at(weights)
    };
    let sample = |k: u32| f64::from(k) / f64::from(EDGE_SAMPLES);
    let depth = |t: f64| on(t).distance.distance;
    let best = (0..=EDGE_SAMPLES).min_by(|&a, &b| depth(sample(a)).total_cmp(&depth(sample(b))));
    let middle = sample(best.unwrap_or(0));
    let (mut low, mut high) = ((middle - sample(1)).max(0.0), (middle + sample(1)).min(1.0));
    for _ in 0..EDGE_THIRDS {
        let third = (high - low) / 3.0;
        match depth(low + third) <= depth(high - third) {
            true => high -= third,
            false => low += third,
        }
    }
    on(0.5 * (low + high))
}

/// A quarter each of a triangle.
fn quarters(piece: &[Barycentric; 3]) -> [[Barycentric; 3]; 4] {
    let middle = |a: usize, b: usize| [0, 1, 2].map(|k| 0.5 * (piece[a][k] + piece[b][k]));
    let (ab, bc, ca) = (middle(0, 1), middle(1, 2), middle(2, 0));
    [[piece[0], ab, ca], [ab, piece[1], bc], [ca, bc, piece[2]], [ab, bc, ca]]
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
            prop_assert!(off.abs() < 2e-3, "{off:e}: {ours:?} {theirs:?}");
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
