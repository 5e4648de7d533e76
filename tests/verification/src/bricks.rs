//! Blocks of cells of six tetrahedra each, which several reports are about.

use nalgebra::Point3;
use softgrasp_core::mesh::{MeshError, TetMesh, signed_volume};

/// Block of cells with six tetrahedra around the same diagonal of every cell; `place` tells where the node at each
/// place of the grid lies.
///
/// Units: m.
///
/// # Errors
/// [`MeshError`] for a block without volume.
pub(crate) fn bricks(
    cells: [usize; 3],
    place: impl Fn([usize; 3]) -> Point3<f64>,
) -> Result<TetMesh, MeshError> {
    let [a, b, c] = cells;
    let at = |place: [usize; 3]| number(cells, place);
    let places = (0..=c).flat_map(|k| (0..=b).flat_map(move |j| (0..=a).map(move |i| [i, j, k])));
    let vertices: Vec<Point3<f64>> = places.map(place).collect();
    let mut tets = Vec::new();
    for (k, j, i) in (0..c).flat_map(|k| (0..b).flat_map(move |j| (0..a).map(move |i| (k, j, i)))) {
        for axes in [[0, 1, 2], [0, 2, 1], [1, 0, 2], [1, 2, 0], [2, 0, 1], [2, 1, 0]] {
            let mut corner = [i, j, k];
            let mut tet = [at(corner); 4];
            for (position, axis) in axes.into_iter().enumerate() {
                corner[axis] += 1;
                tet[position + 1] = at(corner);
            }
            if signed_volume(&tet.map(|v| vertices[v as usize])) < 0.0 {
                tet.swap(0, 1);
            }
            tets.push(tet);
        }
    }
    TetMesh::try_new(vertices, tets, Vec::new())
}

/// Number of the node at a place of the grid.
pub(crate) fn number([a, b, _]: [usize; 3], [i, j, k]: [usize; 3]) -> u32 {
    (i + (a + 1) * (j + (b + 1) * k)) as u32
}
