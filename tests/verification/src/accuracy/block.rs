//! Meshes of the cases: bent blocks of boxes, and an eighth of a thick sphere.

use nalgebra::{Point3, Vector3};
use softgrasp_core::mesh::{MeshError, Surface, TetMesh, signed_volume};

/// Block of boxes over [0, 1]³, mapped by `place`.
///
/// Each box has six tetrahedra around the diagonal between its node of even and its node of odd
/// numbers, so neighbours are mirror images: with an even count along an axis so is the block.
///
/// Shapes: (nx + 1)(ny + 1)(nz + 1) nodes, x first. Units: those of `place`.
///
/// # Errors
/// [`MeshError`] if `place` turns an element flat.
pub fn block(
    counts: [usize; 3],
    place: impl Fn(Vector3<f64>) -> Point3<f64>,
) -> Result<TetMesh, MeshError> {
    let [nx, ny, nz] = counts;
    let number = |at: [usize; 3]| (at[0] + (nx + 1) * (at[1] + (ny + 1) * at[2])) as u32;
    let mut vertices = Vec::with_capacity((nx + 1) * (ny + 1) * (nz + 1));
    for k in 0..=nz {
        for j in 0..=ny {
            for i in 0..=nx {
                let part = |at: usize, count: usize| at as f64 / count as f64;
                vertices.push(place(Vector3::new(part(i, nx), part(j, ny), part(k, nz))));
            }
        }
    }
    let mut tets = Vec::with_capacity(6 * nx * ny * nz);
    for k in 0..nz {
        for j in 0..ny {
            for i in 0..nx {
                let cell = [i, j, k];
                for path in PATHS {
                    let mut at = cell.map(|c| c + c % 2);
                    let mut tet = [number(at); 4];
                    for (corner, axis) in tet[1..].iter_mut().zip(path) {
                        at[axis] = cell[axis] + 1 - cell[axis] % 2;
                        *corner = number(at);
                    }
                    tets.push(tet);
                }
            }
        }
    }
    turned(vertices, tets)
}

/// Orders of the three axes on the way from one end of the diagonal to the other.
const PATHS: [[usize; 3]; 6] = [[0, 1, 2], [0, 2, 1], [1, 0, 2], [1, 2, 0], [2, 0, 1], [2, 1, 0]];

/// Mesh of tetrahedra whose corners may be in any order.
pub(super) fn turned(
    vertices: Vec<Point3<f64>>,
    mut tets: Vec<[u32; 4]>,
) -> Result<TetMesh, MeshError> {
    for tet in &mut tets {
        if signed_volume(&tet.map(|n| vertices[n as usize])) < 0.0 {
            tet.swap(2, 3);
        }
    }
    TetMesh::try_new(vertices, tets, Vec::new())
}

/// The mesh with its inner nodes moved at random, each by up to `reach` along each axis.
///
/// # Errors
/// [`MeshError`] if this turns an element inside out.
pub fn shaken(mesh: &TetMesh, reach: f64) -> Result<TetMesh, MeshError> {
    let outside = Surface::from_mesh(mesh).nodes;
    let mut vertices = mesh.vertices().to_vec();
    for (n, p) in (0u32..).zip(&mut vertices) {
        if outside.binary_search(&n).is_err() {
            let wiggle = |speed: f64| reach * (speed * f64::from(n + 1)).sin();
            *p += Vector3::new(wiggle(1.3), wiggle(2.1), wiggle(3.7));
        }
    }
    mesh.with_vertices(vertices)
}

/// The part x, y, z ≥ 0 of a thick sphere, with nodes exactly on both spheres and on the planes.
///
/// `around` edges along each quarter circle, `through` layers.
///
/// # Errors
/// [`MeshError`] if `around` or `through` is zero.
pub fn octant(inner: f64, outer: f64, around: usize, through: usize) -> Result<TetMesh, MeshError> {
    // Directions: the triangle i + j ≤ around, row by row.
    let mut directions = Vec::new();
    let mut starts = Vec::new();
    for j in 0..=around {
        starts.push(directions.len());
        for i in 0..=around - j {
            let toward = Vector3::new(i as f64, j as f64, (around - i - j) as f64);
            directions.push(toward.normalize());
        }
    }
    let at = |i: usize, j: usize| starts[j] + i;
    let mut triangles = Vec::new();
    for j in 0..around {
        for i in 0..around - j {
            triangles.push([at(i, j), at(i + 1, j), at(i, j + 1)]);
            if i + j + 1 < around {
                triangles.push([at(i + 1, j), at(i, j + 1), at(i + 1, j + 1)]);
            }
        }
    }
    let radius = |layer: usize| inner + (outer - inner) * layer as f64 / through as f64;
    let layers = (0..=through).flat_map(|layer| directions.iter().map(move |d| (layer, d)));
    let vertices = layers.map(|(layer, d)| Point3::from(d * radius(layer))).collect();
    let mut tets = Vec::with_capacity(3 * triangles.len() * through);
    for layer in 0..through {
        for triangle in &mut triangles {
            // The diagonals of a prism's sides go up from the lower number, so neighbours agree.
            triangle.sort_unstable();
            let low = triangle.map(|n| (n + layer * directions.len()) as u32);
            let high = low.map(|n| n + directions.len() as u32);
            tets.push([low[0], low[1], low[2], high[2]]);
            tets.push([low[0], low[1], high[1], high[2]]);
            tets.push([low[0], high[0], high[1], high[2]]);
        }
    }
    turned(vertices, tets)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn volume(mesh: &TetMesh) -> f64 {
        (0..mesh.tets().len()).map(|t| mesh.signed_volume(t)).sum()
    }

    #[test]
    fn boxes_fill_the_block_and_fit_together() {
        let mesh = block([2, 3, 5], |p| Point3::new(2.0 * p.x, 3.0 * p.y, p.z)).unwrap();
        assert_eq!((mesh.node_count(), mesh.tets().len()), (72, 180));
        assert!((volume(&mesh) - 6.0).abs() < 1e-13);
        // Faces that did not fit would be on the surface twice.
        let surface = Surface::from_mesh(&mesh);
        assert_eq!(surface.triangles.len(), 4 * (2 * 3 + 3 * 5 + 5 * 2));
        assert_eq!((surface.non_manifold_edges(), surface.non_manifold_nodes()), (0, 0));
    }

    #[test]
    fn octant_is_closed_and_its_volume_converges() {
        let exact = std::f64::consts::PI / 6.0 * 7.0;
        let off = |n: usize| {
            let mesh = octant(1.0, 2.0, n, n).unwrap();
            let surface = Surface::from_mesh(&mesh);
            assert_eq!((surface.non_manifold_edges(), surface.euler_characteristic()), (0, 2));
            assert_eq!(surface.triangles.len(), 2 * n * n + 3 * 2 * n * n);
            exact - volume(&mesh)
        };
        // Chords lie inside the sphere, by the square of their length.
        let (coarse, fine) = (off(4), off(8));
        assert!(fine > 0.0 && (3.5..4.5).contains(&(coarse / fine)), "{coarse} {fine}");
    }
}
