//! A list of points and triangles over them, with no promise that it is closed.

use nalgebra::Point3;

/// Triangles in space: perhaps open, doubled, turned, or in several shells that overlap.
///
/// Shapes: N points, M triangles of indices below N. Units: the file's. Frame: the file's.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TriangleSurface {
    points: Vec<Point3<f64>>,
    triangles: Vec<[u32; 3]>,
}

/// Why points and triangles are no surface.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum SurfaceError {
    /// The surface has no triangle.
    #[error("there is no triangle")]
    Empty,
    /// A triangle names a point that is not there.
    #[error("triangle {triangle} (from 0) names point {point}, but there are {points} (from 0)")]
    NoSuchPoint {
        /// Index of the triangle, from 0.
        triangle: usize,
        /// The point it names.
        point: u32,
        /// Number of points.
        points: usize,
    },
    /// A coordinate that is not finite.
    #[error("point {point} (from 0) is not finite")]
    NotFinite {
        /// Index of the point, from 0.
        point: usize,
    },
}

impl TriangleSurface {
    /// Checks that the corners are there and finite.
    ///
    /// # Errors
    /// [`SurfaceError`].
    pub fn try_new(
        points: Vec<Point3<f64>>,
        triangles: Vec<[u32; 3]>,
    ) -> Result<Self, SurfaceError> {
        if triangles.is_empty() {
            return Err(SurfaceError::Empty);
        }
        let is_finite = |p: &Point3<f64>| p.iter().all(|c| c.abs() <= LARGEST);
        if let Some(point) = points.iter().position(|p| !is_finite(p)) {
            return Err(SurfaceError::NotFinite { point });
        }
        for (triangle, corners) in triangles.iter().enumerate() {
            if let Some(&point) = corners.iter().find(|&&n| n as usize >= points.len()) {
                return Err(SurfaceError::NoSuchPoint { triangle, point, points: points.len() });
            }
        }
        Ok(Self { points, triangles })
    }

    /// All points, those of no triangle too.
    pub fn points(&self) -> &[Point3<f64>] {
        &self.points
    }

    /// Corner indices of every triangle, counter-clockwise seen from outside where the surface is
    /// sound.
    pub fn triangles(&self) -> &[[u32; 3]] {
        &self.triangles
    }

    /// Corners of one triangle.
    pub fn corners(&self, triangle: usize) -> [Point3<f64>; 3] {
        self.triangles[triangle].map(|n| self.points[n as usize])
    }

    /// Lowest and highest corner of the box around all triangles.
    pub fn bounds(&self) -> (Point3<f64>, Point3<f64>) {
        let mut low = Point3::from([f64::INFINITY; 3]);
        let mut high = Point3::from([f64::NEG_INFINITY; 3]);
        for p in self.triangles.iter().flatten().map(|n| &self.points[*n as usize]) {
            (low, high) = (low.inf(p), high.sup(p));
        }
        (low, high)
    }

    /// Longest edge of the box around all triangles.
    pub fn size(&self) -> f64 {
        let (low, high) = self.bounds();
        (high - low).max()
    }

    /// Volume by the divergence theorem: true where the surface is closed and its shells do not
    /// overlap, negative where it is turned inside out.
    pub fn signed_volume(&self) -> f64 {
        let (low, high) = self.bounds();
        let middle = nalgebra::center(&low, &high);
        (0..self.triangles.len())
            .map(|t| {
                let [a, b, c] = self.corners(t).map(|p| p - middle);
                a.dot(&b.cross(&c)) / 6.0
            })
            .sum()
    }

    /// This surface with every coordinate times `factor`.
    ///
    /// # Errors
    /// [`SurfaceError::NotFinite`].
    pub fn scaled(&self, factor: f64) -> Result<Self, SurfaceError> {
        let points = self.points.iter().map(|p| p * factor).collect();
        Self::try_new(points, self.triangles.clone())
    }
}

/// Largest coordinate that is taken: products of three of them and sums of many stay finite.
const LARGEST: f64 = 1e50;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::surface::samples::ball;

    #[test]
    fn corners_that_are_not_there_are_refused() {
        let points = vec![Point3::origin(); 3];
        let error = TriangleSurface::try_new(points.clone(), vec![[0, 1, 3]]).unwrap_err();
        assert_eq!(error, SurfaceError::NoSuchPoint { triangle: 0, point: 3, points: 3 });
        assert_eq!(TriangleSurface::try_new(points, vec![]), Err(SurfaceError::Empty));
        let far = vec![Point3::new(f64::NAN, 0.0, 0.0); 3];
        let error = TriangleSurface::try_new(far, vec![[0, 1, 2]]).unwrap_err();
        assert_eq!(error, SurfaceError::NotFinite { point: 0 });
    }

    #[test]
    fn ball_has_its_volume_wherever_it_lies() {
        let ball = ball(4, Point3::new(7.0, -3.0, 2.0), 0.5);
        let sphere = 4.0 / 3.0 * std::f64::consts::PI * 0.125;
        assert!((ball.signed_volume() / sphere - 1.0).abs() < 0.01);
        assert!(
            (ball.scaled(2.0).unwrap().signed_volume() / ball.signed_volume() - 8.0).abs() < 1e-9
        );
        assert!((ball.size() - 1.0).abs() < 1e-12);
    }
}
