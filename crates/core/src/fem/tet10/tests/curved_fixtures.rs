//! Meshes with mid-edge nodes of their own, in and off the middles of their edges.

use std::collections::BTreeMap;

use nalgebra::{Point3, Vector3};

use crate::fem::QuadraticMesh;
use crate::mesh::{TetMesh, mirrored, signed_volume};

/// A linear mesh with mid-edge nodes at `place(corner, corner)`, and its nodes numbered backwards, so that
/// corners are not in front.
pub(crate) fn with_middles(
    linear: &TetMesh,
    place: impl Fn(&Point3<f64>, &Point3<f64>) -> Point3<f64>,
) -> TetMesh {
    let straight = QuadraticMesh::try_new(linear).unwrap();
    let mut vertices = linear.vertices().to_vec();
    let at = |n: u32| &linear.vertices()[n as usize];
    vertices.extend(straight.edges().iter().map(|&[a, b]| place(at(a), at(b))));
    vertices.reverse();
    let last = vertices.len() as u32 - 1;
    let tets = linear.tets().iter().map(|tet| tet.map(|n| last - n)).collect();
    let middles = straight.tets().iter().map(|tet| std::array::from_fn(|i| last - tet[4 + i]));
    let regions = linear.regions().to_vec();
    let mesh = TetMesh::try_new(vertices, tets, regions).unwrap();
    mesh.with_mid_edge_nodes(middles.collect()).unwrap()
}

/// A number between −1 and 1 that belongs to an edge.
fn wave(a: &Point3<f64>, b: &Point3<f64>, seed: f64) -> f64 {
    let sum = (a.coords + b.coords) * 300.0;
    (sum.x * 1.7 + sum.y * 2.9 + sum.z * 4.3 + seed).sin()
}

/// Mid-edge nodes moved along one direction by up to `share` of the edge.
pub(crate) fn bent_along(linear: &TetMesh, direction: Vector3<f64>, share: f64) -> TetMesh {
    with_middles(linear, |a, b| {
        nalgebra::center(a, b) + direction * (share * (a - b).norm() * wave(a, b, 0.0))
    })
}

/// Mid-edge nodes moved anywhere by up to about `share` of the edge.
pub(crate) fn bent(linear: &TetMesh, share: f64) -> TetMesh {
    with_middles(linear, |a, b| {
        let off = Vector3::new(wave(a, b, 0.0), wave(a, b, 1.0), wave(a, b, 2.0));
        nalgebra::center(a, b) + off * (share * (a - b).norm())
    })
}

/// A mid-edge node on the sphere about the origin of the mean radius of its ends.
pub(super) fn on_sphere(a: &Point3<f64>, b: &Point3<f64>) -> Point3<f64> {
    let radius = 0.5 * (a.coords.norm() + b.coords.norm());
    Point3::from((a.coords + b.coords).normalize() * radius)
}

/// A sphere with a hole about the origin: every face of an octahedron divided `times` in four, and
/// `layers` layers of prisms, each as three tetrahedra.
pub(super) fn hollow_sphere((inner, outer): (f64, f64), times: usize, layers: usize) -> TetMesh {
    let axes = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]].map(Vector3::<f64>::from);
    let mut directions: Vec<Vector3<f64>> = axes.iter().flat_map(|axis| [*axis, -axis]).collect();
    let mut faces: Vec<[usize; 3]> =
        (0..8).map(|octant| [octant & 1, 2 + (octant >> 1 & 1), 4 + (octant >> 2)]).collect();
    for _ in 0..times {
        let mut middles = BTreeMap::new();
        let mut middle = |a: usize, b: usize| {
            *middles.entry((a.min(b), a.max(b))).or_insert_with(|| {
                directions.push((directions[a] + directions[b]).normalize());
                directions.len() - 1
            })
        };
        let divided = |[a, b, c]: [usize; 3]| {
            let [ab, bc, ca] = [middle(a, b), middle(b, c), middle(c, a)];
            [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
        };
        faces = faces.into_iter().flat_map(divided).collect();
    }
    let count = directions.len();
    let radius = |layer: usize| inner + (outer - inner) * layer as f64 / layers as f64;
    let of_layer = |layer| directions.iter().map(move |d| Point3::from(d * radius(layer)));
    let vertices: Vec<Point3<f64>> = (0..=layers).flat_map(of_layer).collect();
    let mut tets = Vec::new();
    for (layer, mut face) in (0..layers).flat_map(|layer| faces.iter().map(move |f| (layer, *f))) {
        // The diagonals of a side are the same seen from both prisms.
        face.sort_unstable();
        let [a, b, c] = face.map(|n| (layer * count + n) as u32);
        let [d, e, f] = [a, b, c].map(|n| n + count as u32);
        for tet in [[a, b, c, f], [a, b, e, f], [a, d, e, f]] {
            let is_right = signed_volume(&tet.map(|n| vertices[n as usize])) > 0.0;
            tets.push(if is_right { tet } else { mirrored(tet) });
        }
    }
    TetMesh::try_new(vertices, tets, vec![]).unwrap()
}
