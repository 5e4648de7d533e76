//! The mask of a round fingertip: the surface around a node under a pressure that ends at a rim.

use std::collections::{BTreeMap, BTreeSet, VecDeque};

use nalgebra::{Point3, Vector3};

use super::mask::Mask;
use crate::mesh::Surface;

/// The triangles around every surface node, so that a patch is found without looking at all.
///
/// Shapes: `starts` N + 1 offsets into `around`; `around` positions in the surface's triangles.
#[derive(Clone, Debug, Default)]
pub struct SurfaceStars {
    starts: Vec<u32>,
    around: Vec<u32>,
}

/// Pieces of a triangle are at most this share of the radius long …
const PIECE_OF_RADIUS: f64 = 0.25;
/// … but an edge is cut into no more and no fewer pieces than these.
const CUTS: (usize, usize) = (2, 16);

impl SurfaceStars {
    /// Stars of a surface of a mesh with so many nodes.
    pub fn new(surface: &Surface, node_count: usize) -> Self {
        let mut starts = vec![0u32; node_count + 1];
        for &node in surface.triangles.iter().flatten() {
            starts[node as usize + 1] += 1;
        }
        for node in 0..node_count {
            starts[node + 1] += starts[node];
        }
        let mut next = starts.clone();
        let mut around = vec![0u32; 3 * surface.triangles.len()];
        for (position, triangle) in (0u32..).zip(&surface.triangles) {
            for &node in triangle {
                let place = &mut next[node as usize];
                around[*place as usize] = position;
                *place += 1;
            }
        }
        Self { starts, around }
    }

    /// Positions of the surface triangles around a node, ascending; empty for a node inside.
    pub fn of_node(&self, node: u32) -> &[u32] {
        let ends = (self.starts.get(node as usize), self.starts.get(node as usize + 1));
        let (Some(&start), Some(&end)) = ends else { return &[] };
        self.around.get(start as usize..end as usize).unwrap_or_default()
    }

    /// Mask of a tip of some radius that presses on the surface at a node.
    ///
    /// The weight of node i is `∫ φ_i p dA` over the patch: p falls from one at the centre to zero
    /// at the radius as `1 − (d/r)²`, φ is linear on every triangle, so the weights are the
    /// consistent load of one and the same pressure on whatever mesh. The patch is what hangs
    /// together with the centre and faces the same way, so the far side of a thin body is not in it.
    /// Where the triangles are much larger than the tip the centre alone is left.
    ///
    /// Units: m. Frame: that of `vertices`.
    pub fn tip_mask(
        &self,
        vertices: &[Point3<f64>],
        surface: &Surface,
        centre: u32,
        radius: f64,
    ) -> Mask {
        let corners = |position: u32| surface.triangles[position as usize];
        let points = |nodes: [u32; 3]| nodes.map(|n| vertices[n as usize]);
        let star = self.of_node(centre);
        let facing: Vector3<f64> = star.iter().map(|&t| area_vector(&points(corners(t)))).sum();
        let mut seen: BTreeSet<u32> = star.iter().copied().collect();
        let mut waiting: VecDeque<u32> = seen.iter().copied().collect();
        let mut weights: BTreeMap<u32, f64> = BTreeMap::new();
        while let Some(position) = waiting.pop_front() {
            let nodes = corners(position);
            let triangle = points(nodes);
            if area_vector(&triangle).dot(&facing) <= 0.0 {
                continue;
            }
            let loads = consistent_load(&triangle, &vertices[centre as usize], radius);
            // What the tip does not reach ends the patch.
            if loads.iter().sum::<f64>() <= 0.0 {
                continue;
            }
            for (node, load) in nodes.into_iter().zip(loads) {
                *weights.entry(node).or_default() += load;
                waiting.extend(self.of_node(node).iter().filter(|t| seen.insert(**t)));
            }
        }
        Mask::try_new(weights.into_iter().collect()).unwrap_or_else(|_| Mask::of_node(centre))
    }
}

/// Twice the area along the outward normal.
fn area_vector([a, b, c]: &[Point3<f64>; 3]) -> Vector3<f64> {
    (b - a).cross(&(c - a))
}

/// `∫ φ_i p dA` at the three corners, by the midpoints of equal pieces.
fn consistent_load(triangle: &[Point3<f64>; 3], centre: &Point3<f64>, radius: f64) -> [f64; 3] {
    let [a, b, c] = triangle;
    let longest = (b - a).norm().max((c - b).norm()).max((a - c).norm());
    let cuts = (longest / (PIECE_OF_RADIUS * radius)).ceil();
    let cuts = if cuts.is_finite() { cuts as usize } else { CUTS.1 }.clamp(CUTS.0, CUTS.1);
    let area = 0.5 * area_vector(triangle).norm() / (cuts * cuts) as f64;
    let mut loads = [0.0; 3];
    let mut add = |i: f64, j: f64| {
        let n = cuts as f64;
        let phi = [i / n, j / n, 1.0 - (i + j) / n];
        let point = a.coords * phi[0] + b.coords * phi[1] + c.coords * phi[2];
        let pressure = 1.0 - (point - centre.coords).norm_squared() / (radius * radius);
        if pressure > 0.0 {
            for (load, phi) in loads.iter_mut().zip(phi) {
                *load += area * pressure * phi;
            }
        }
    };
    for i in 0..cuts {
        for j in 0..cuts - i {
            let (i, j) = (i as f64, j as f64);
            add(i + 1.0 / 3.0, j + 1.0 / 3.0);
            if i + j < (cuts - 1) as f64 {
                add(i + 2.0 / 3.0, j + 2.0 / 3.0);
            }
        }
    }
    loads
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::{BuiltIn, TetMesh, generate};

    fn parts(shape: BuiltIn, nodes: usize) -> (TetMesh, Surface, SurfaceStars) {
        let mesh = generate(shape, nodes).unwrap();
        let surface = Surface::from_mesh(&mesh);
        let stars = SurfaceStars::new(&surface, mesh.node_count());
        (mesh, surface, stars)
    }

    /// Middle of the top of the cube, whose number of nodes along an edge is odd.
    fn top(mesh: &TetMesh) -> u32 {
        let (_, high) = mesh.bounds();
        let middle = Point3::new(0.0, high.y, 0.0);
        let distance = |n: &u32| (mesh.vertices()[*n as usize] - middle).norm();
        (0..mesh.node_count() as u32).min_by(|a, b| distance(a).total_cmp(&distance(b))).unwrap()
    }

    #[test]
    fn weights_are_the_moments_of_the_pressure_on_every_mesh() {
        for nodes in [729, 3375, 12_167] {
            let (mesh, surface, stars) = parts(BuiltIn::Cube, nodes);
            let centre = top(&mesh);
            let mask = stars.tip_mask(mesh.vertices(), &surface, centre, 0.01);
            let from = mesh.vertices()[centre as usize];
            let at = |n: u32| mesh.vertices()[n as usize] - from;
            // Consistent loads keep the resultant: it acts at the centre, in the plane.
            for axis in 0..3 {
                assert!(mask.mean(|n| at(n)[axis]).abs() < 1e-5, "{nodes} nodes, axis {axis}");
            }
            assert!(mask.entries().iter().all(|e| at(e.0).y.abs() < 1e-12), "the top only");
            // ∫ d² p dA / ∫ p dA = r²/3 for 1 − (d/r)², plus what linear functions add: ≤ h²/3.
            let edge = 0.06 / ((nodes as f64).cbrt().round() - 1.0);
            let spread = mask.mean(|n| at(n).norm_squared());
            let exact = 0.01f64.powi(2) / 3.0;
            assert!(spread > 0.97 * exact && spread < exact + 0.4 * edge * edge, "{spread:e}");
        }
    }

    #[test]
    fn tip_much_smaller_than_the_triangles_holds_its_node() {
        let (mesh, surface, stars) = parts(BuiltIn::Cube, 27);
        let centre = top(&mesh);
        let fine = stars.tip_mask(mesh.vertices(), &surface, centre, 1e-3);
        let own = fine.entries().iter().find(|e| e.0 == centre).unwrap();
        assert!(own.1 > 0.9, "{fine:?}");
        for radius in [1e-5, 0.0, f64::NAN] {
            let mask = stars.tip_mask(mesh.vertices(), &surface, centre, radius);
            assert_eq!(mask, Mask::of_node(centre), "radius {radius}");
        }
    }

    #[test]
    fn patch_does_not_reach_through_the_body_nor_beyond_the_tip() {
        let (mesh, surface, stars) = parts(BuiltIn::Sphere, 2000);
        let radius = 0.4 * mesh.size();
        for &centre in surface.nodes.iter().step_by(37) {
            let mask = stars.tip_mask(mesh.vertices(), &surface, centre, radius);
            let from = mesh.vertices()[centre as usize];
            for &(node, _) in mask.entries() {
                let to = mesh.vertices()[node as usize];
                // Nodes of triangles that the tip reaches lie at most an edge beyond it.
                assert!((to - from).norm() < 1.25 * radius);
                assert!(to.coords.dot(&from.coords) > -0.1 * from.coords.norm_squared());
            }
        }
    }

    #[test]
    fn node_inside_the_body_and_node_that_is_not_there_hold_themselves() {
        let (mesh, surface, stars) = parts(BuiltIn::Cube, 27);
        let inside = (0..27).find(|n| surface.nodes.binary_search(n).is_err()).unwrap();
        let mask = stars.tip_mask(mesh.vertices(), &surface, inside, 0.01);
        assert_eq!(mask, Mask::of_node(inside));
    }
}
