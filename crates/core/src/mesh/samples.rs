//! Meshes that tests of other parts share.

use nalgebra::Point3;

use super::{TetMesh, signed_volume};

/// `a` × `a` × `b` cells of edge 1 / `a`, six tetrahedra each.
pub(crate) fn block(a: usize, b: usize) -> TetMesh {
    let at = |i: usize, j: usize, k: usize| (i + (a + 1) * (j + (a + 1) * k)) as u32;
    let mut vertices = Vec::new();
    for (k, j, i) in
        (0..=b).flat_map(|k| (0..=a).flat_map(move |j| (0..=a).map(move |i| (k, j, i))))
    {
        vertices.push(Point3::new(i as f64, j as f64, k as f64) / a as f64);
    }
    let mut tets = Vec::new();
    for (k, j, i) in (0..b).flat_map(|k| (0..a).flat_map(move |j| (0..a).map(move |i| (k, j, i)))) {
        tets.extend(of_cell([i, j, k], at, &vertices));
    }
    TetMesh::try_new(vertices, tets, vec![]).unwrap()
}

/// Six tetrahedra of a cell between its lowest corner and the highest, one for each order of the axes, by the
/// number of the vertex at each place of the lattice.
///
/// Source: Kuhn (1960).
pub(crate) fn of_cell(
    cell: [usize; 3],
    at: impl Fn(usize, usize, usize) -> u32,
    vertices: &[Point3<f64>],
) -> [[u32; 4]; 6] {
    [[0, 1, 2], [0, 2, 1], [1, 0, 2], [1, 2, 0], [2, 0, 1], [2, 1, 0]].map(|axes| {
        let mut corner = cell;
        let mut tet = [at(cell[0], cell[1], cell[2]); 4];
        for (position, axis) in axes.into_iter().enumerate() {
            corner[axis] += 1;
            tet[position + 1] = at(corner[0], corner[1], corner[2]);
        }
        if signed_volume(&tet.map(|v| vertices[v as usize])) < 0.0 {
            tet.swap(0, 1);
        }
        tet
    })
}
