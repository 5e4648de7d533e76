//! Meshes of ten-node tetrahedra with mid-edge nodes of their own.

use nalgebra::Point3;
use softgrasp_core::fem::QuadraticMesh;
use softgrasp_core::mesh::{BuiltIn, TetMesh};

use crate::questions::object;

/// Share of the radius below which a node is taken for one on the sphere.
const ON_SPHERE: f64 = 1e-9;

/// A sphere whose boundary edges are arcs: mid-edge nodes of the boundary lie on the sphere. Nodes are
/// numbered so that corners and mid-edge nodes alternate.
///
/// # Panics
/// If a sphere cannot have this number of corners.
pub fn round_sphere(corners: usize) -> TetMesh {
    let linear = object(BuiltIn::Sphere, corners);
    let radius = linear.vertices().iter().map(|p| p.coords.norm()).fold(0.0, f64::max);
    let is_on = |p: &Point3<f64>| (p.coords.norm() - radius).abs() < ON_SPHERE * radius;
    with_middles(&linear, |a, b| {
        let middle = nalgebra::center(a, b);
        match is_on(a) && is_on(b) {
            true => Point3::from(middle.coords.normalize() * radius),
            false => middle,
        }
    })
}

/// A linear mesh with mid-edge nodes at `place(corner, corner)`, corners and mid-edge nodes alternating as
/// far as there are corners.
///
/// # Panics
/// If a place is no number.
pub fn with_middles(
    linear: &TetMesh,
    place: impl Fn(&Point3<f64>, &Point3<f64>) -> Point3<f64>,
) -> TetMesh {
    let straight = QuadraticMesh::try_new(linear).expect("few enough nodes");
    let count = linear.node_count() as u32;
    let number = |node: u32| match node.checked_sub(count) {
        None => 2 * node,
        Some(edge) if edge < count => 2 * edge + 1,
        Some(edge) => count + edge,
    };
    let mut vertices = straight.vertices().to_vec();
    let at = |n: u32| linear.vertices()[n as usize];
    for (node, p) in (0..).zip(linear.vertices()) {
        vertices[number(node) as usize] = *p;
    }
    for &[a, b] in straight.edges() {
        let node = straight.middle(a, b).expect("an edge of the mesh");
        vertices[number(node) as usize] = place(&at(a), &at(b));
    }
    let tets = linear.tets().iter().map(|tet| tet.map(number)).collect();
    let middles = straight.tets().iter().map(|tet| std::array::from_fn(|i| number(tet[4 + i])));
    let mesh = TetMesh::try_new(vertices, tets, linear.regions().to_vec()).expect("sound elements");
    mesh.with_mid_edge_nodes(middles.collect()).expect("nodes of the mesh")
}
