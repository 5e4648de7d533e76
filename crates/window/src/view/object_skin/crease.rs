//! Where a surface is smooth and where it has edges: corners, and the edges between triangles.

use nalgebra::{Point3, Vector3};

/// A surface cut at its creases.
///
/// A *corner* is a node as seen from one smooth side: triangles around a node that hang together
/// over smooth edges share one corner there, hence one normal.
pub(super) struct CreasedSurface {
    /// Corners of each triangle.
    pub(super) corners: Vec<[u32; 3]>,
    /// Node of each corner.
    pub(super) corner_nodes: Vec<u32>,
    /// Every edge of the surface once.
    pub(super) edges: Vec<Edge>,
    /// Edges of each triangle: from its first corner to its second, and so on.
    pub(super) edges_of: Vec<[EdgeUse; 3]>,
}

/// An edge between two nodes.
pub(super) struct Edge {
    /// Lower and higher node.
    pub(super) nodes: [u32; 2],
    /// Corners at these nodes, seen from the one side and from the other.
    pub(super) sides: [[u32; 2]; 2],
    /// Whether both sides are one smooth surface.
    pub(super) is_smooth: bool,
    /// Whether more than two triangles meet; such an edge stays straight.
    pub(super) is_overused: bool,
}

/// An edge as a triangle runs along it.
#[derive(Clone, Copy, Default)]
pub(super) struct EdgeUse {
    pub(super) edge: u32,
    /// Whether the triangle runs from the higher node to the lower.
    pub(super) is_reversed: bool,
}

/// One triangle's side of an edge.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct HalfEdge {
    nodes: [u32; 2],
    triangle: usize,
    side: usize,
}

impl HalfEdge {
    /// Places of the lower and of the higher node in the triangle.
    fn places(self, triangles: &[[u32; 3]]) -> [usize; 2] {
        let (from, to) = (self.side, (self.side + 1) % 3);
        if triangles[self.triangle][from] == self.nodes[0] { [from, to] } else { [to, from] }
    }
}

impl CreasedSurface {
    /// Cuts a surface where neighbouring faces of the rest shape meet at more than an angle.
    ///
    /// Units: `crease_angle` rad.
    pub(super) fn new(vertices: &[Point3<f64>], triangles: &[[u32; 3]], crease_angle: f64) -> Self {
        let half_edges = sorted_half_edges(triangles);
        let normals: Vec<Vector3<f64>> =
            triangles.iter().map(|t| unit_normal(vertices, t)).collect();
        let is_smooth = |uses: &[HalfEdge]| match uses {
            [a, b] => normals[a.triangle].dot(&normals[b.triangle]) >= crease_angle.cos(),
            _ => false,
        };
        // Corners of triangles that share a smooth edge are one.
        let mut groups = Groups::new(3 * triangles.len());
        for uses in half_edges.chunk_by(|a, b| a.nodes == b.nodes).filter(|u| is_smooth(u)) {
            let [a, b] = [uses[0], uses[1]].map(|u| (u.triangle, u.places(triangles)));
            for end in 0..2 {
                groups.unite(3 * a.0 + a.1[end], 3 * b.0 + b.1[end]);
            }
        }
        let (corners, corner_nodes) = groups.corners(triangles);
        let mut edges = Vec::new();
        let mut edges_of = vec![[EdgeUse::default(); 3]; triangles.len()];
        for uses in half_edges.chunk_by(|a, b| a.nodes == b.nodes) {
            let edge = edges.len() as u32;
            for half in uses {
                let is_reversed = half.places(triangles)[0] != half.side;
                edges_of[half.triangle][half.side] = EdgeUse { edge, is_reversed };
            }
            let side = |half: &HalfEdge| half.places(triangles).map(|p| corners[half.triangle][p]);
            edges.push(Edge {
                nodes: uses[0].nodes,
                sides: [side(&uses[0]), side(uses.last().unwrap_or(&uses[0]))],
                is_smooth: is_smooth(uses),
                is_overused: uses.len() > 2,
            });
        }
        Self { corners, corner_nodes, edges, edges_of }
    }

    /// Nodes of a triangle.
    pub(super) fn nodes_of(&self, triangle: usize) -> [u32; 3] {
        self.corners[triangle].map(|c| self.corner_nodes[c as usize])
    }
}

/// All sides of all triangles; those of one edge stand together.
fn sorted_half_edges(triangles: &[[u32; 3]]) -> Vec<HalfEdge> {
    let mut half_edges: Vec<HalfEdge> = (0..3 * triangles.len())
        .map(|i| {
            let (triangle, side) = (i / 3, i % 3);
            let (from, to) = (triangles[triangle][side], triangles[triangle][(side + 1) % 3]);
            HalfEdge { nodes: [from.min(to), from.max(to)], triangle, side }
        })
        .collect();
    half_edges.sort_unstable();
    half_edges
}

fn unit_normal(vertices: &[Point3<f64>], triangle: &[u32; 3]) -> Vector3<f64> {
    let [a, b, c] = triangle.map(|n| vertices[n as usize]);
    (b - a).cross(&(c - a)).try_normalize(f64::MIN_POSITIVE).unwrap_or_else(Vector3::zeros)
}

/// Things that are joined two by two, each pointing towards the first of its group.
struct Groups(Vec<usize>);

impl Groups {
    fn new(count: usize) -> Self {
        Self((0..count).collect())
    }

    fn first(&mut self, mut at: usize) -> usize {
        while self.0[at] != at {
            self.0[at] = self.0[self.0[at]];
            at = self.0[at];
        }
        at
    }

    fn unite(&mut self, a: usize, b: usize) {
        let (a, b) = (self.first(a), self.first(b));
        let (low, high) = (a.min(b), a.max(b));
        self.0[high] = low;
    }

    /// Numbers the groups in the order of their first triangle corner.
    fn corners(&mut self, triangles: &[[u32; 3]]) -> (Vec<[u32; 3]>, Vec<u32>) {
        let mut number = vec![u32::MAX; self.0.len()];
        let mut nodes = Vec::new();
        let mut corners = vec![[0; 3]; triangles.len()];
        for at in 0..self.0.len() {
            let first = self.first(at);
            if number[first] == u32::MAX {
                number[first] = nodes.len() as u32;
                nodes.push(triangles[at / 3][at % 3]);
            }
            corners[at / 3][at % 3] = number[first];
        }
        (corners, nodes)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use softgrasp_core::mesh::{BuiltIn, Surface, generate};

    fn creased(shape: BuiltIn, angle_deg: f64) -> (CreasedSurface, Surface) {
        let mesh = generate(shape, 343).unwrap();
        let surface = Surface::from_mesh(&mesh);
        let angle = angle_deg.to_radians();
        (CreasedSurface::new(mesh.vertices(), &surface.triangles, angle), surface)
    }

    #[test]
    fn cube_of_seven_nodes_an_edge_has_six_smooth_faces() {
        let (creased, surface) = creased(BuiltIn::Cube, 40.0);
        // Six faces of 7 × 7 corners; twelve sharp edges of six pieces.
        assert_eq!(creased.corner_nodes.len(), 6 * 49);
        assert_eq!(creased.edges.iter().filter(|e| !e.is_smooth).count(), 12 * 6);
        assert!(creased.edges.iter().all(|e| !e.is_overused));
        for (t, triangle) in surface.triangles.iter().enumerate() {
            assert_eq!(creased.nodes_of(t), *triangle);
        }
    }

    #[test]
    fn surface_without_creases_has_one_corner_a_node() {
        let (creased, surface) = creased(BuiltIn::Sphere, 180.0);
        assert_eq!(creased.corner_nodes.len(), surface.nodes.len());
        assert!(creased.edges.iter().all(|e| e.is_smooth && e.sides[0] == e.sides[1]));
    }
}
