//! Opposed places of an object's surface: where thumb and fingers can hold it between them by friction.

use nalgebra::{Point3, Vector3};
use softgrasp_core::surface::{SurfaceError, SurfaceTree, TriangleSurface};
use softgrasp_grasp::object::{RestShape, centre_of_mass};

/// Most places of the surface from which a line is drawn through the object.
const STARTS_MAX: usize = 600;
/// The line meets the surface at least so straight on both sides (cosine).
pub(super) const STRAIGHT_MIN: f64 = 0.85;
/// The line rises no more than this (sine): fingers that press along a slope push the object up or down.
const SLOPE_MAX: f64 = 0.5;
/// Narrowest and widest part that a hand holds between thumb and fingers, m.
const WIDTH: (f64, f64) = (0.004, 0.1);
/// Pairs that are looked at, and how much they must differ: over the object's extent, and as a cosine.
const PAIRS_MAX: usize = 10;
const APART: f64 = 0.12;
const TURNED: f64 = 0.9;

/// An object as what a pinch must know of it: its surface, and where its weight acts.
pub(super) struct PinchedSurface {
    /// Tree over the triangles of the surface.
    pub tree: SurfaceTree,
    /// Outer unit normal of every triangle.
    pub normals: Vec<Vector3<f64>>,
    /// Centre of mass, m.
    pub centre_of_mass: Point3<f64>,
    /// Longest extent, m.
    pub size: f64,
}

/// Two places of a surface, each seen straight from the other.
///
/// Units: m. Frame: that of the object's mesh.
#[derive(Clone, Copy, Debug)]
pub(super) struct OpposedPair {
    /// Place of the thumb.
    pub thumb: Point3<f64>,
    /// Unit direction from the thumb to the fingers.
    pub across: Vector3<f64>,
    /// Distance of the places.
    pub width: f64,
    /// How well friction can hold there, with the object's weight.
    pub score: f64,
}

impl OpposedPair {
    /// The point in the middle.
    pub fn middle(&self) -> Point3<f64> {
        self.thumb + 0.5 * self.width * self.across
    }

    /// The pair with thumb and fingers exchanged.
    pub fn exchanged(&self) -> Self {
        Self { thumb: self.thumb + self.width * self.across, across: -self.across, ..*self }
    }

    fn is_like(&self, other: &Self, size: f64) -> bool {
        let is_near = (self.middle() - other.middle()).norm() < APART * size;
        is_near && self.across.dot(&other.across).abs() > TURNED
    }
}

impl PinchedSurface {
    /// # Errors
    /// [`SurfaceError`] for an object without a surface.
    pub fn try_new(object: &RestShape) -> Result<Self, SurfaceError> {
        let mesh = object.mesh();
        let triangles = object.surface().triangles.clone();
        let surface = TriangleSurface::try_new(mesh.vertices().to_vec(), triangles)?;
        let normal = |t: usize| {
            let [a, b, c] = surface.corners(t);
            (b - a).cross(&(c - a)).try_normalize(0.0).unwrap_or_else(Vector3::y)
        };
        Ok(Self {
            tree: SurfaceTree::new(&surface),
            normals: (0..surface.triangles().len()).map(normal).collect(),
            centre_of_mass: centre_of_mass(mesh),
            size: mesh.size(),
        })
    }

    /// How well friction holds along a line, with the object's weight: best where the line is level, goes
    /// through the centre of mass or below, and meets the surface straight on both sides.
    ///
    /// Units: m; `straight` cosine of the worse side.
    ///
    /// Source: Nguyen (1988), force closure of two contacts with friction.
    pub fn hold(&self, middle: &Point3<f64>, across: &Vector3<f64>, straight: f64) -> f64 {
        let to_centre = self.centre_of_mass - middle;
        let aside = (to_centre - across * across.dot(&to_centre)).norm() / self.size;
        // Tips above the centre press the object onto the table instead of lifting it.
        let above = ((middle.y - self.centre_of_mass.y) / self.size).max(-0.05);
        6.0 * straight - 2.0 * across.y.abs() - 8.0 * aside - 4.0 * above
    }

    /// The best pairs, best first; they differ in place or direction.
    pub fn pairs(&self, object: &RestShape) -> Vec<OpposedPair> {
        let vertices = object.mesh().vertices();
        let triangles = &object.surface().triangles;
        let every = triangles.len().div_ceil(STARTS_MAX).max(1);
        let mut found: Vec<OpposedPair> = Vec::new();
        for (triangle, corners) in triangles.iter().enumerate().step_by(every) {
            let [a, b, c] = corners.map(|node| vertices[node as usize].coords);
            let start = Point3::from((a + b + c) / 3.0);
            let inward = -self.normals[triangle];
            let level = Vector3::new(inward.x, 0.0, inward.z).try_normalize(1e-6);
            let through = [Some(inward), level].into_iter().flatten();
            found.extend(through.filter_map(|across| self.pair(start, inward, across)));
        }
        found.sort_by(|a, b| b.score.total_cmp(&a.score));
        let mut chosen: Vec<OpposedPair> = Vec::new();
        for pair in found {
            if chosen.iter().all(|known| !pair.is_like(known, self.size)) {
                chosen.push(pair);
            }
            if chosen.len() == PAIRS_MAX {
                break;
            }
        }
        chosen
    }

    /// The pair on a line that goes into the object, if friction can hold there.
    fn pair(
        &self,
        thumb: Point3<f64>,
        inward: Vector3<f64>,
        across: Vector3<f64>,
    ) -> Option<OpposedPair> {
        let hits = self.tree.hits(&thumb, &across);
        let out = hits.iter().find(|hit| hit.leaves && hit.at > 1e-6)?;
        let normal = self.normals[out.triangle as usize];
        let straight = inward.dot(&across).min(normal.dot(&across));
        let fits = (WIDTH.0..WIDTH.1).contains(&out.at);
        let holds = straight > STRAIGHT_MIN && across.y.abs() < SLOPE_MAX && fits;
        let middle = thumb + 0.5 * out.at * across;
        let score = self.hold(&middle, &across, straight);
        holds.then_some(OpposedPair { thumb, across, width: out.at, score })
    }
}
