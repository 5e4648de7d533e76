//! Meshes of the hard cases: blocks, and changes of them.

use nalgebra::{Point3, Vector3};
use softgrasp_core::mesh::{MeshError, TetMesh};

use crate::bricks::bricks;

/// Box from the origin, with six tetrahedra around the same diagonal of every cell.
///
/// Units: m.
///
/// # Errors
/// [`MeshError`] for a box without volume.
pub(super) fn block(cells: [usize; 3], size: [f64; 3]) -> Result<TetMesh, MeshError> {
    bricks(cells, |place| {
        let along = |axis: usize| size[axis] * (place[axis] as f64 / cells[axis] as f64);
        Point3::new(along(0), along(1), along(2))
    })
}

/// Nodes whose positions fulfil a condition, ascending.
pub(super) fn nodes_where(mesh: &TetMesh, is_in: impl Fn(&Point3<f64>) -> bool) -> Vec<u32> {
    let nodes = mesh.vertices().iter().enumerate().filter(|(_, p)| is_in(p));
    nodes.map(|(node, _)| node as u32).collect()
}

/// Node nearest to a position; the first one of equals.
pub(super) fn nearest(mesh: &TetMesh, place: &Point3<f64>) -> u32 {
    let distance = |node: &usize| (mesh.vertices()[*node] - place).norm();
    let nearest = (0..mesh.node_count()).min_by(|a, b| distance(a).total_cmp(&distance(b)));
    nearest.unwrap_or(0) as u32
}

/// The mesh with a region for each element, by the position of its centre.
///
/// # Errors
/// None in practice: there is a label for every element.
pub(super) fn with_regions(
    mesh: &TetMesh,
    region: impl Fn(&Point3<f64>) -> u32,
) -> Result<TetMesh, MeshError> {
    let centre = |tet: usize| {
        let sum: Vector3<f64> = mesh.corners(tet).iter().map(|p| p.coords).sum();
        Point3::from(sum / 4.0)
    };
    let regions = (0..mesh.tets().len()).map(|tet| region(&centre(tet))).collect();
    TetMesh::try_new(mesh.vertices().to_vec(), mesh.tets().to_vec(), regions)
}

/// The mesh with one node moved.
///
/// # Errors
/// [`MeshError`] if this turns an element inside out.
pub(super) fn with_node_at(
    mesh: &TetMesh,
    node: u32,
    place: Point3<f64>,
) -> Result<TetMesh, MeshError> {
    let mut vertices = mesh.vertices().to_vec();
    vertices[node as usize] = place;
    mesh.with_vertices(vertices)
}

/// The mesh in another unit of length.
///
/// # Errors
/// [`MeshError`] if volumes exceed the range of a double.
pub(super) fn in_unit(mesh: &TetMesh, unit: f64) -> Result<TetMesh, MeshError> {
    mesh.with_vertices(mesh.vertices().iter().map(|p| p * unit).collect())
}

/// Mesh together with a shifted copy of it, joined where nodes coincide.
///
/// # Errors
/// [`MeshError`] if the copy is no mesh.
pub(super) fn doubled(mesh: &TetMesh, shift: Vector3<f64>) -> Result<TetMesh, MeshError> {
    let mut vertices = mesh.vertices().to_vec();
    let same = 1e-9 * mesh.size();
    let mut copy = Vec::with_capacity(mesh.node_count());
    for place in mesh.vertices().iter().map(|p| p + shift) {
        let there = mesh.vertices().iter().position(|p| (p - place).norm() <= same);
        copy.push(there.unwrap_or(vertices.len()) as u32);
        if there.is_none() {
            vertices.push(place);
        }
    }
    let copied = mesh.tets().iter().map(|tet| tet.map(|n| copy[n as usize]));
    let tets = mesh.tets().iter().copied().chain(copied).collect();
    TetMesh::try_new(vertices, tets, Vec::new())
}

#[cfg(test)]
mod tests {
    use super::*;
    use softgrasp_core::mesh::Bodies;

    #[test]
    fn block_fills_its_box() {
        let mesh = block([3, 2, 1], [3.0, 1.0, 0.5]).unwrap();
        let volume: f64 = (0..mesh.tets().len()).map(|t| mesh.signed_volume(t)).sum();
        assert!((volume - 1.5).abs() < 1e-14);
        assert_eq!((mesh.node_count(), mesh.tets().len()), (24, 36));
    }

    #[test]
    fn copies_share_a_corner_an_edge_or_nothing() {
        let mesh = block([2; 3], [1.0; 3]).unwrap();
        let of = |shift: [f64; 3]| {
            let both = doubled(&mesh, shift.into()).unwrap();
            (both.node_count(), Bodies::from_mesh(&both).count())
        };
        assert_eq!(of([1.0, 1.0, 1.0]), (53, 1));
        assert_eq!(of([1.0, 0.0, 1.0]), (51, 1));
        assert_eq!(of([3.0, 0.0, 0.0]), (54, 2));
    }
}
