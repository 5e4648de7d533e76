//! Meshes of cylinders: rings of triangles, extruded in layers.

use nalgebra::{Point3, Vector2};
use softgrasp_core::mesh::{MeshError, TetMesh};

use crate::accuracy::block::turned;

/// A cylinder of radius 1 and height 1 around z, of `rings` rings and as many layers, with nodes
/// exactly on it.
///
/// Shapes: ring k has 6 k nodes.
///
/// # Errors
/// [`MeshError`] if `rings` is zero.
pub fn cylinder(rings: usize) -> Result<TetMesh, MeshError> {
    let (points, triangles) = disc(rings);
    let count = points.len();
    let layers = (0..=rings).flat_map(|layer| points.iter().map(move |p| (layer, p)));
    let place =
        |(layer, p): (usize, &Vector2<f64>)| Point3::new(p.x, p.y, layer as f64 / rings as f64);
    let vertices = layers.map(place).collect();
    let mut tets = Vec::with_capacity(3 * triangles.len() * rings);
    for layer in 0..rings {
        for triangle in &triangles {
            // Ascending numbers: the diagonals of neighbours agree.
            let low = triangle.map(|n| (n + layer * count) as u32);
            let high = low.map(|n| n + count as u32);
            tets.push([low[0], low[1], low[2], high[2]]);
            tets.push([low[0], low[1], high[1], high[2]]);
            tets.push([low[0], high[0], high[1], high[2]]);
        }
    }
    turned(vertices, tets)
}

/// Nodes of a disc of radius 1, and triangles with ascending numbers.
fn disc(rings: usize) -> (Vec<Vector2<f64>>, Vec<[usize; 3]>) {
    let start = |ring: usize| if ring == 0 { 0 } else { 1 + 3 * ring * (ring - 1) };
    let at = |ring: usize, i: usize| start(ring) + if ring == 0 { 0 } else { i % (6 * ring) };
    let mut points = vec![Vector2::zeros()];
    let mut triangles = Vec::new();
    for ring in 1..=rings {
        for i in 0..6 * ring {
            let angle = std::f64::consts::TAU * i as f64 / (6 * ring) as f64;
            points.push(Vector2::new(angle.cos(), angle.sin()) * (ring as f64 / rings as f64));
        }
        for sector in 0..6 {
            let (outer, inner) = (sector * ring, sector * (ring - 1));
            for i in 0..ring {
                let beside = at(ring, outer + i + 1);
                triangles.push([at(ring, outer + i), beside, at(ring - 1, inner + i)]);
                if i + 1 < ring {
                    triangles.push([at(ring - 1, inner + i), at(ring - 1, inner + i + 1), beside]);
                }
            }
        }
    }
    triangles.iter_mut().for_each(|t| t.sort_unstable());
    (points, triangles)
}

#[cfg(test)]
mod tests {
    use softgrasp_core::mesh::Surface;

    use super::*;

    #[test]
    fn cylinder_is_closed_and_has_the_volume_of_its_polygon() {
        for rings in [1, 2, 5] {
            let mesh = cylinder(rings).unwrap();
            let volume: f64 = (0..mesh.tets().len()).map(|t| mesh.signed_volume(t)).sum();
            let sides = 6.0 * rings as f64;
            let exact = 0.5 * sides * (std::f64::consts::TAU / sides).sin();
            assert!((volume - exact).abs() < 1e-13, "{rings}: {volume} {exact}");
            let surface = Surface::from_mesh(&mesh);
            assert_eq!((surface.non_manifold_edges(), surface.euler_characteristic()), (0, 2));
        }
    }
}
