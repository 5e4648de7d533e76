//! The computed surface as curved triangles that pass through every computed vertex.

use nalgebra::{Point3, Vector3};

use super::crease::{CreasedSurface, Edge};

/// Curved triangles over a surface: cubic in position, quadratic in normal.
///
/// Neighbours share the curve of their common edge, across creases too, so nothing gapes.
/// Units: m. Frame: the object's.
///
/// Source: Vlachos, Peters, Boyd, Mitchell, "Curved PN triangles", I3D 2001. Edges between two
/// smooth sides run along both tangent planes, which makes rims round.
pub(super) struct CurvedSurface {
    surface: CreasedSurface,
    corner_normals: Vec<Vector3<f64>>,
    curves: Vec<[Vector3<f64>; 2]>,
    nets: Vec<Net>,
}

/// Control net of one curved triangle.
#[derive(Clone, Copy)]
struct Net {
    /// Control points: corners, then two along each side, then the middle. The order of
    /// [`cubic_weights`].
    points: [Vector3<f64>; 10],
    /// Control normals: corners, then the middles of the sides. The order of [`quadratic_weights`].
    normals: [Vector3<f64>; 6],
}

/// Weights of a place in a triangle: worked out once, used for every shape.
#[derive(Clone, Copy)]
pub(super) struct PlaceWeights {
    /// Barycentric coordinates of the place.
    pub(super) linear: [f64; 3],
    cubic: [f64; 10],
    quadratic: [f64; 6],
}

impl PlaceWeights {
    /// Weights at barycentric coordinates.
    pub(super) fn new(linear: [f64; 3]) -> Self {
        Self { linear, cubic: cubic_weights(linear), quadratic: quadratic_weights(linear) }
    }
}

impl CurvedSurface {
    /// Curved triangles over `shape`, which holds all vertices of the mesh.
    pub(super) fn new(surface: CreasedSurface, shape: &[Point3<f64>]) -> Self {
        let corner_normals = vec![Vector3::zeros(); surface.corner_nodes.len()];
        let curves = vec![[Vector3::zeros(); 2]; surface.edges.len()];
        let empty = Net { points: [Vector3::zeros(); 10], normals: [Vector3::zeros(); 6] };
        let nets = vec![empty; surface.corners.len()];
        let mut curved = Self { surface, corner_normals, curves, nets };
        curved.follow(shape);
        curved
    }

    /// The surface that is curved.
    pub(super) fn creased(&self) -> &CreasedSurface {
        &self.surface
    }

    /// Works out all control nets again for a new shape.
    pub(super) fn follow(&mut self, shape: &[Point3<f64>]) {
        self.average_normals(shape);
        for (edge, curve) in self.surface.edges.iter().zip(&mut self.curves) {
            *curve = edge_curve(edge, shape, &self.corner_normals);
        }
        for t in 0..self.nets.len() {
            self.nets[t] = self.net(t, shape);
        }
    }

    /// Position on a triangle.
    pub(super) fn point(&self, triangle: u32, weights: &PlaceWeights) -> Vector3<f64> {
        let points = &self.nets[triangle as usize].points;
        let mut sum = Vector3::zeros();
        for (point, weight) in points.iter().zip(&weights.cubic) {
            sum += point * *weight;
        }
        sum
    }

    /// Unit normal on a triangle.
    pub(super) fn normal(&self, triangle: u32, weights: &PlaceWeights) -> Vector3<f64> {
        let normals = &self.nets[triangle as usize].normals;
        let mut sum = Vector3::zeros();
        for (normal, weight) in normals.iter().zip(&weights.quadratic) {
            sum += normal * *weight;
        }
        sum.try_normalize(1e-12).unwrap_or(normals[0])
    }

    /// Normal of each corner: mean of its faces, weighted so that it is exact on a sphere.
    ///
    /// Source: Max, "Weights for computing vertex normals from facet normals", 1999.
    fn average_normals(&mut self, shape: &[Point3<f64>]) {
        self.corner_normals.fill(Vector3::zeros());
        for (t, corners) in self.surface.corners.iter().enumerate() {
            let p = self.surface.nodes_of(t).map(|n| shape[n as usize]);
            let sides = [p[1] - p[0], p[2] - p[1], p[0] - p[2]];
            let face = sides[0].cross(&sides[1]);
            let squares = sides.map(|s| s.norm_squared().max(f64::MIN_POSITIVE));
            for i in 0..3 {
                let weight = 1.0 / (squares[i] * squares[(i + 2) % 3]);
                self.corner_normals[corners[i] as usize] += face * weight;
            }
        }
        for normal in &mut self.corner_normals {
            *normal = normal.try_normalize(1e-12).unwrap_or_else(Vector3::y);
        }
    }

    fn net(&self, triangle: usize, shape: &[Point3<f64>]) -> Net {
        let p = self.surface.nodes_of(triangle).map(|n| shape[n as usize].coords);
        let n = self.surface.corners[triangle].map(|c| self.corner_normals[c as usize]);
        let mut points = [Vector3::zeros(); 10];
        let mut normals = [Vector3::zeros(); 6];
        let mut side_sum = Vector3::zeros();
        for i in 0..3 {
            let along = self.surface.edges_of[triangle][i];
            let [low, high] = self.curves[along.edge as usize];
            let [first, second] = if along.is_reversed { [high, low] } else { [low, high] };
            points[i] = p[i];
            points[3 + 2 * i] = first;
            points[4 + 2 * i] = second;
            side_sum += first + second;
            normals[i] = n[i];
            normals[3 + i] = middle_normal(&(p[(i + 1) % 3] - p[i]), &n[i], &n[(i + 1) % 3]);
        }
        let side_mean = side_sum / 6.0;
        points[9] = side_mean + (side_mean - (p[0] + p[1] + p[2]) / 3.0) / 2.0;
        Net { points, normals }
    }
}

/// The two inner control points of an edge, from its lower node to its higher.
fn edge_curve(edge: &Edge, shape: &[Point3<f64>], normals: &[Vector3<f64>]) -> [Vector3<f64>; 2] {
    let [low, high] = edge.nodes.map(|n| shape[n as usize].coords);
    let chord = high - low;
    if edge.is_overused {
        return [low + chord / 3.0, high - chord / 3.0];
    }
    let at = |side: usize, end: usize| normals[edge.sides[side][end] as usize];
    [
        low + tangent(&chord, &at(0, 0), &at(1, 0)) / 3.0,
        high - tangent(&chord, &at(0, 1), &at(1, 1)) / 3.0,
    ]
}

/// The chord turned into the surface: into its tangent plane, or at a crease into both planes.
fn tangent(chord: &Vector3<f64>, one: &Vector3<f64>, other: &Vector3<f64>) -> Vector3<f64> {
    let Some(mean) = (one + other).try_normalize(1e-6) else { return *chord };
    let in_plane = chord - mean * chord.dot(&mean);
    let line = one.cross(other);
    let sine_squared = line.norm_squared();
    if sine_squared < CREASE_BEGINS {
        return in_plane;
    }
    let along_line = line * (line.dot(chord) / sine_squared);
    // Between a smooth surface and a crease the curve changes without a jump.
    let share = ((sine_squared - CREASE_BEGINS) / (CREASE_ENDS - CREASE_BEGINS)).min(1.0);
    in_plane + (along_line - in_plane) * share
}

/// Normal in the middle of a side, mirrored about the plane between its ends.
fn middle_normal(
    chord: &Vector3<f64>,
    first: &Vector3<f64>,
    second: &Vector3<f64>,
) -> Vector3<f64> {
    let sum = first + second;
    let length_squared = chord.norm_squared().max(f64::MIN_POSITIVE);
    let mirrored = sum - chord * (2.0 * chord.dot(&sum) / length_squared);
    mirrored.try_normalize(1e-6).unwrap_or(*first)
}

/// Bernstein polynomials of degree three: corners, pairs along the sides, middle.
fn cubic_weights([u, v, w]: [f64; 3]) -> [f64; 10] {
    [
        u * u * u,
        v * v * v,
        w * w * w,
        3.0 * u * u * v,
        3.0 * u * v * v,
        3.0 * v * v * w,
        3.0 * v * w * w,
        3.0 * w * w * u,
        3.0 * w * u * u,
        6.0 * u * v * w,
    ]
}

/// Bernstein polynomials of degree two: corners, middles of the sides.
fn quadratic_weights([u, v, w]: [f64; 3]) -> [f64; 6] {
    [u * u, v * v, w * w, 2.0 * u * v, 2.0 * v * w, 2.0 * w * u]
}

/// Square of the sine of the angle between two sides from which an edge counts as a crease …
const CREASE_BEGINS: f64 = 0.03;
/// … and from which it is nothing else.
const CREASE_ENDS: f64 = 0.25;

#[cfg(test)]
mod tests {
    use super::*;
    use softgrasp_core::mesh::{BuiltIn, Surface, generate};

    fn curved(shape: BuiltIn) -> CurvedSurface {
        let mesh = generate(shape, 343).unwrap();
        let surface = Surface::from_mesh(&mesh);
        let creased = CreasedSurface::new(mesh.vertices(), &surface.triangles, 40f64.to_radians());
        CurvedSurface::new(creased, mesh.vertices())
    }

    #[test]
    fn curved_sphere_is_rounder_than_its_triangles_by_a_factor_of_ten() {
        let sphere = curved(BuiltIn::Sphere);
        let middle = PlaceWeights::new([1.0 / 3.0; 3]);
        let (mut flat_error, mut curved_error, mut normal_error) = (0f64, 0f64, 0f64);
        for (t, net) in (0..).zip(&sphere.nets) {
            let flat = (net.points[0] + net.points[1] + net.points[2]) / 3.0;
            let point = sphere.point(t, &middle);
            flat_error = flat_error.max((flat.norm() - 0.035).abs());
            curved_error = curved_error.max((point.norm() - 0.035).abs());
            normal_error = normal_error.max(sphere.normal(t, &middle).angle(&point));
        }
        assert!(curved_error < 0.1 * flat_error, "{curved_error} of {flat_error}");
        assert!(normal_error < 0.03, "{normal_error}");
    }

    #[test]
    fn curved_cube_is_the_cube() {
        let cube = curved(BuiltIn::Cube);
        for t in 0..cube.nets.len() as u32 {
            for linear in [[0.2, 0.3, 0.5], [0.0, 0.4, 0.6], [0.7, 0.1, 0.2]] {
                let weights = PlaceWeights::new(linear);
                let (point, normal) = (cube.point(t, &weights), cube.normal(t, &weights));
                assert!((point.amax() - 0.03).abs() < 1e-12);
                assert!((point.dot(&normal) - 0.03).abs() < 1e-12);
            }
        }
    }
}
