//! The cube: a lattice of boxes, six tetrahedra each, with extra nodes in box centres.

use nalgebra::Point3;

use crate::mesh::{MeshError, TetMesh};

/// Cube of edge [`EDGE`] with exactly `nodes` nodes, 27 or more.
///
/// The lattice is the most cubical one that has at most `nodes` nodes and boxes enough to put
/// the missing nodes into their centres; `n³` gives the plain lattice of `(n − 1)³` cubes.
pub(super) fn generate(nodes: usize) -> Result<TetMesh, MeshError> {
    let counts = lattice_counts(nodes);
    let [nx, ny, nz] = counts;
    let step = counts.map(|n| EDGE / (n - 1) as f64);
    let at = |i: f64, d: usize| i * step[d] - 0.5 * EDGE;
    let mut vertices = Vec::with_capacity(nodes);
    for k in 0..nz {
        for j in 0..ny {
            for i in 0..nx {
                vertices.push(Point3::new(at(i as f64, 0), at(j as f64, 1), at(k as f64, 2)));
            }
        }
    }
    let missing = nodes - vertices.len();
    let box_count = (nx - 1) * (ny - 1) * (nz - 1);
    let mut tets = Vec::with_capacity(6 * (box_count + missing));
    for index in 0..box_count {
        let cell = [index % (nx - 1), index / (nx - 1) % (ny - 1), index / ((nx - 1) * (ny - 1))];
        let first = cell[0] + nx * (cell[1] + ny * cell[2]);
        // Spread evenly over the boxes in their order.
        let is_split = (index + 1) * missing / box_count > index * missing / box_count;
        let centre = is_split.then(|| {
            let [x, y, z] = [0, 1, 2].map(|d| at(cell[d] as f64 + 0.5, d));
            vertices.push(Point3::new(x, y, z));
            vertices.len() - 1
        });
        add_box(&mut tets, first, [1, nx, nx * ny], centre);
    }
    TetMesh::try_new(vertices, tets, Vec::new())
}

/// Adds the six tetrahedra around the diagonal of one box, or twelve around its centre node.
///
/// `first` is the box's lowest corner, `strides` lead to the next node along each axis.
fn add_box(tets: &mut Vec<[u32; 4]>, first: usize, strides: [usize; 3], centre: Option<usize>) {
    let node = |n: usize| u32::try_from(n).expect("node counts are limited far below u32");
    for [u, v, w] in AXIS_ORDERS {
        let path = [
            first,
            first + strides[u],
            first + strides[u] + strides[v],
            first + strides[0] + strides[1] + strides[2],
        ]
        .map(node);
        // An even order of axes makes (a, b, c, d) positive when d comes first.
        let is_even = (u + 1) % 3 == v && (v + 1) % 3 == w;
        let mut add = |[a, b, c, d]: [u32; 4]| {
            tets.push(if is_even { [b, a, c, d] } else { [a, b, c, d] });
        };
        match centre.map(node) {
            None => add(path),
            // The centre halves the diagonal, hence every tetrahedron around it.
            Some(m) => {
                add([path[0], path[1], path[2], m]);
                add([m, path[1], path[2], path[3]]);
            }
        }
    }
}

/// Nodes along each axis: most cubical first, then as few centre nodes as possible.
fn lattice_counts(nodes: usize) -> [usize; 3] {
    let near = (nodes as f64).cbrt() as usize;
    let mut best = ([2, 2, 2], f64::INFINITY, usize::MAX);
    for nx in near.saturating_sub(2).max(2)..=near + 1 {
        for ny in nx..=near + 2 {
            for nz in ny..=near + 3 {
                let lattice = nx * ny * nz;
                let boxes = (nx - 1) * (ny - 1) * (nz - 1);
                let aspect = (nz - 1) as f64 / (nx - 1) as f64;
                if lattice > nodes || lattice + boxes < nodes {
                    continue;
                }
                if (aspect, nodes - lattice) < (best.1, best.2) {
                    best = ([nx, ny, nz], aspect, nodes - lattice);
                }
            }
        }
    }
    best.0
}

/// Edge of the cube.
pub(super) const EDGE: f64 = 0.06;

/// The six ways from a box's lowest corner to its highest, one axis after the other.
const AXIS_ORDERS: [[usize; 3]; 6] =
    [[0, 1, 2], [1, 2, 0], [2, 0, 1], [0, 2, 1], [2, 1, 0], [1, 0, 2]];

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::{BuiltIn, Quality, generate as generate_built_in};

    #[test]
    fn third_powers_give_the_plain_lattice_of_six_tetrahedra_a_box() {
        for n in [3usize, 6, 7, 10] {
            let mesh = generate(n.pow(3)).unwrap();
            assert_eq!(mesh.node_count(), n.pow(3));
            assert_eq!(mesh.tets().len(), 6 * (n - 1).pow(3));
            assert_eq!(mesh.vertices()[1].x - mesh.vertices()[0].x, mesh.vertices()[n].y + 0.03);
        }
    }

    #[test]
    fn every_node_count_is_met_exactly_by_nearly_cubical_boxes() {
        for nodes in 27..3000 {
            let [nx, ny, nz] = lattice_counts(nodes);
            let (least, most) = (nx * ny * nz, nx * ny * nz + (nx - 1) * (ny - 1) * (nz - 1));
            assert!((least..=most).contains(&nodes), "{nodes}");
            assert!((nz - 1) as f64 / (nx - 1) as f64 <= 1.5, "{nodes}: {nx} × {ny} × {nz}");
        }
    }

    #[test]
    fn thesis_size_267_keeps_the_cube_exact() {
        let mesh = generate_built_in(BuiltIn::Cube, 267).unwrap();
        let quality = Quality::from_mesh(&mesh, 0);
        assert_eq!(mesh.node_count(), 267);
        assert!((quality.volume - EDGE.powi(3)).abs() < 1e-17);
        assert!(quality.dihedral_min.to_degrees() > 30.0);
    }
}
