//! The body of an object: its computed surface, curved and cut fine.

use nalgebra::{Point3, Vector3};
use softgrasp_grasp::object::RestShape;

use super::bake::Spread;
use super::crease::CreasedSurface;
use super::curved_surface::{CurvedSurface, PlaceWeights};
use super::part::single;
use super::tessellation::{Source, Tessellation, lattice_places, level_for};
use super::unwrap::Unwrap;

/// Drawn vertices of the body, each a fixed place on a curved triangle.
///
/// Units: m. Frame: the object's.
pub(super) struct Body {
    curved: CurvedSurface,
    lattice: Vec<PlaceWeights>,
    sources: Vec<Source>,
    /// Drawn triangles.
    pub(super) triangles: Vec<[u32; 3]>,
    /// Pieces of the edges of the computed surface.
    pub(super) wireframe: Vec<[u32; 2]>,
}

/// The body spread out for painting: one place in space and one in the picture per vertex.
pub(super) struct SpreadBody {
    pub(super) positions: Vec<Point3<f64>>,
    pub(super) uvs: Vec<[f64; 2]>,
}

impl Body {
    /// Curves and cuts the surface of a rest shape.
    ///
    /// Units: `crease_angle` rad.
    pub(super) fn new(rest: &RestShape, crease_angle: f64) -> Self {
        let (vertices, triangles) = (rest.mesh().vertices(), &rest.surface().triangles);
        let creased = CreasedSurface::new(vertices, triangles, crease_angle);
        let length = |nodes: [u32; 2]| {
            let [a, b] = nodes.map(|n| vertices[n as usize]);
            (b - a).norm()
        };
        let edge_sum: f64 = creased.edges.iter().map(|e| length(e.nodes)).sum();
        let edge_mean = edge_sum / creased.edges.len().max(1) as f64;
        let level = level_for(edge_mean, PIECE, triangles.len());
        let cut = Tessellation::new(&creased, level);
        Self {
            curved: CurvedSurface::new(creased, vertices),
            lattice: lattice_places(level).into_iter().map(PlaceWeights::new).collect(),
            sources: cut.sources,
            triangles: cut.triangles,
            wireframe: cut.wireframe,
        }
    }

    /// Spreads the body out; vertices between two charts are doubled.
    pub(super) fn spread(&mut self, unwrap: &Unwrap) -> SpreadBody {
        let positions: Vec<Point3<f64>> = self.points().collect();
        let charts: Vec<u8> = self
            .triangles
            .iter()
            .map(|triangle| {
                let [a, b, c] = triangle.map(|v| positions[v as usize]);
                let middle = Point3::from((a.coords + b.coords + c.coords) / 3.0);
                unwrap.chart(&middle, &(b - a).cross(&(c - a)))
            })
            .collect();
        let mut cut = Tessellation {
            level: 0,
            sources: std::mem::take(&mut self.sources),
            triangles: std::mem::take(&mut self.triangles),
            wireframe: vec![],
        };
        let vertex_charts = cut.split_by_chart(&charts);
        (self.sources, self.triangles) = (cut.sources, cut.triangles);
        let positions: Vec<Point3<f64>> = self.points().collect();
        let place = |(p, chart): (&Point3<f64>, &u8)| unwrap.place(*chart, p);
        let uvs = positions.iter().zip(&vertex_charts).map(place).collect();
        SpreadBody { positions, uvs }
    }

    /// The curved surface, for what is fixed to it.
    pub(super) fn curved(&self) -> &CurvedSurface {
        &self.curved
    }

    /// Number of drawn vertices.
    pub(super) fn vertex_count(&self) -> usize {
        self.sources.len()
    }

    /// Takes on a new shape: all vertices of the mesh.
    pub(super) fn follow(&mut self, shape: &[Point3<f64>]) {
        self.curved.follow(shape);
    }

    /// Writes where the drawn vertices are now, and their normals.
    pub(super) fn write(&self, positions: &mut [[f32; 3]], normals: &mut [[f32; 3]]) {
        for ((source, position), normal) in self.sources.iter().zip(positions).zip(normals) {
            let weights = &self.lattice[source.place as usize];
            *position = single(&self.curved.point(source.triangle, weights));
            *normal = single(&self.curved.normal(source.triangle, weights));
        }
    }

    /// Values at the drawn vertices of a quantity known at the nodes, linear in each triangle.
    pub(super) fn values(&self, node_values: &[f64], out: &mut Vec<f32>) {
        out.clear();
        out.extend(self.sources.iter().map(|source| {
            let nodes = self.curved.creased().nodes_of(source.triangle as usize);
            let weights = &self.lattice[source.place as usize].linear;
            let mean: f64 =
                nodes.iter().zip(weights).map(|(n, w)| node_values[*n as usize] * w).sum();
            mean as f32
        }));
    }

    fn points(&self) -> impl Iterator<Item = Point3<f64>> {
        self.sources.iter().map(|source| {
            let weights = &self.lattice[source.place as usize];
            Point3::from(self.curved.point(source.triangle, weights))
        })
    }
}

impl SpreadBody {
    /// The places of the body and its triangles, as a painter takes them.
    pub(super) fn with<'a>(&'a self, triangles: &'a [[u32; 3]]) -> Spread<'a> {
        Spread { triangles, positions: &self.positions, uvs: &self.uvs }
    }

    /// Area of the drawn triangles below a height, for heights in ascending order of triangles.
    ///
    /// Shapes: pairs of the height of a triangle's middle (m) and the area up to it (m²).
    pub(super) fn area_by_height(&self, triangles: &[[u32; 3]]) -> Vec<(f64, f64)> {
        let mut pieces: Vec<(f64, f64)> = triangles
            .iter()
            .map(|triangle| {
                let [a, b, c] = triangle.map(|v| self.positions[v as usize]);
                let area: Vector3<f64> = (b - a).cross(&(c - a)) / 2.0;
                ((a.y + b.y + c.y) / 3.0, area.norm())
            })
            .collect();
        pieces.sort_by(|a, b| a.0.total_cmp(&b.0));
        let mut sum = 0.0;
        for piece in &mut pieces {
            sum += piece.1;
            piece.1 = sum;
        }
        pieces
    }
}

/// Length that the drawn pieces should have, m.
const PIECE: f64 = 0.0013;
