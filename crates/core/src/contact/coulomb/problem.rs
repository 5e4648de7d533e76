//! The linear contact problem: gaps and slips of points as a function of their forces.

use nalgebra::DMatrix;

use super::cone::{FrictionCone, at};
use super::delassus::{Delassus, PointPlace, ProblemError};
use super::law::PointLaw;

/// Points in contact, or nearly so: `u = W λ + b`, and a law for each.
///
/// Shapes: n points; the Delassus operator W 3n × 3n, symmetric, positive semidefinite; `b` 3n; each
/// point has three rows: normal, and two tangents.
/// Units: `w` m/N, `b` m (gap and slip without contact forces), λ N.
///
/// Source: Moreau's implicit contact at position level; Alart and Curnier (1991).
#[derive(Clone, Debug)]
pub struct ContactProblem {
    pub(super) w: Delassus,
    pub(super) b: Vec<f64>,
    pub(super) laws: Vec<PointLaw>,
    /// A stiffness for each point, N/m: it turns metres into newtons in the residual.
    pub(super) rho: Vec<f64>,
}

impl ContactProblem {
    /// Points that are each a corner of their own: W is the compliance between them.
    ///
    /// Shapes and units as in [`ContactProblem`].
    ///
    /// # Errors
    /// [`ProblemError`].
    pub fn try_new(
        w: DMatrix<f64>,
        b: Vec<f64>,
        cones: Vec<FrictionCone>,
    ) -> Result<Self, ProblemError> {
        let points = (0..cones.len() as u32).map(PointPlace::corner).collect();
        let laws = cones.into_iter().map(PointLaw::from).collect();
        Self::between_corners(Delassus::try_new(w, points)?, b, laws)
    }

    /// Points that lie between the corners of a surface.
    ///
    /// Shapes and units as in [`ContactProblem`].
    ///
    /// # Errors
    /// [`ProblemError`].
    pub fn between_corners(
        w: Delassus,
        b: Vec<f64>,
        laws: Vec<PointLaw>,
    ) -> Result<Self, ProblemError> {
        let points = laws.len();
        let expected = 3 * points;
        let rows = 3 * w.point_count();
        if rows != expected || b.len() != expected {
            return Err(ProblemError::Sizes { points, expected, rows, motion: b.len() });
        }
        if !b.iter().all(|x| x.is_finite()) {
            return Err(ProblemError::NotFinite);
        }
        let mut rho = Vec::with_capacity(points);
        for point in 0..points {
            let compliance = w.own(point)[(0, 0)];
            // Written so that a NaN is refused too.
            let is_soft = compliance > 0.0;
            if !is_soft {
                return Err(ProblemError::Rigid { point, compliance });
            }
            rho.push(1.0 / compliance);
        }
        Ok(Self { w, b, laws, rho })
    }

    /// Number of points.
    pub fn point_count(&self) -> usize {
        self.laws.len()
    }

    /// Gap and slip `W λ + b` of every point, m.
    ///
    /// Shapes: `lambda` and result 3n; no forces at all may be given as none.
    pub fn motion(&self, lambda: &[f64]) -> Vec<f64> {
        let moved = self.w.apply(lambda);
        moved.iter().zip(&self.b).map(|(w, b)| w + b).collect()
    }

    /// Largest residual of the natural map over all points, N; infinite where a force or a motion is no number.
    ///
    /// Shapes: `lambda` and `motion` 3n.
    pub fn residual_of(&self, lambda: &[f64], motion: &[f64]) -> f64 {
        let points = 0..self.point_count();
        let residuals = points.map(|i| {
            let (force, motion) = (at(lambda, i), at(motion, i));
            self.laws[i].residual(force, motion, self.rho[i])
        });
        residuals.fold(0.0, |most: f64, r| if r.is_nan() { f64::INFINITY } else { most.max(r) })
    }

    /// Every force moved to the nearest one that its law allows.
    pub(super) fn projected(&self, lambda: &[f64]) -> Vec<f64> {
        let points = self.laws.iter().enumerate();
        points.flat_map(|(point, law)| <[f64; 3]>::from(law.project(at(lambda, point)))).collect()
    }

    /// The problem with a share of every point's friction.
    pub(super) fn with_friction(&self, share: f64) -> Self {
        let laws = self.laws.iter().map(|law| match *law {
            PointLaw::Contact(FrictionCone { friction }) => {
                PointLaw::Contact(FrictionCone { friction: share * friction })
            }
            spring => spring,
        });
        Self { laws: laws.collect(), ..self.clone() }
    }

    /// Contact problem of some points alone.
    pub(super) fn of_points(&self, points: &[usize]) -> Self {
        let row = |k: usize| 3 * points[k / 3] + k % 3;
        let rows = 3 * points.len();
        Self {
            w: self.w.of_points(points),
            b: (0..rows).map(|k| self.b[row(k)]).collect(),
            laws: points.iter().map(|&i| self.laws[i]).collect(),
            rho: points.iter().map(|&i| self.rho[i]).collect(),
        }
    }
}
