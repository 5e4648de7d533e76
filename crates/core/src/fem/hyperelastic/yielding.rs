//! Elements that yield: plastic flow that stays once a shape was reached.

use nalgebra::{Matrix3, Vector3};

use super::Deformed;
use super::body::{At, Body, Evaluated, PieceSum, Shape, gradient_of, points_of};
use super::connectivity::Locals;
use super::plastic::{Hencky, PlasticPoint, Trial};
use super::principal::{Curvature, PrincipalTangent};

/// Why elements cannot yield.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum YieldError {
    /// The yield stress is not a positive finite number.
    #[error("the yield stress is {stress_pa}; it must be a finite number above 0 Pa")]
    Stress {
        /// The value given.
        stress_pa: f64,
    },
    /// t4-anp has a yield stress.
    #[error(
        "t4-anp does not take a yield stress: its change of volume is averaged between elements, \
         while plastic flow belongs to each element by itself; take t4 or t10"
    )]
    Averaged,
}

/// Yield stress and plastic state of all points of a body.
///
/// Shapes: `points` one for each point of each element, in their order.
#[derive(Clone, Debug)]
pub(super) struct Plastic {
    /// `√(2/3) σ_y`, Pa.
    radius: f64,
    points: Vec<PlasticPoint>,
}

impl Plastic {
    /// A yield stress for the elements of a body, without plastic strain at first.
    pub fn try_new(body: &Body, stress_pa: f64) -> Result<Self, YieldError> {
        if !(stress_pa.is_finite() && stress_pa > 0.0) {
            return Err(YieldError::Stress { stress_pa });
        }
        let points = match &body.shape {
            Shape::Linear(_) => points_of::<4>(),
            Shape::Quadratic(_) => points_of::<10>(),
            Shape::Averaged(..) => return Err(YieldError::Averaged),
        };
        let radius = (2.0f64 / 3.0).sqrt() * stress_pa;
        Ok(Self { radius, points: vec![PlasticPoint::default(); points * body.rest.len()] })
    }

    /// Yield stress, Pa.
    pub fn yield_stress(&self) -> f64 {
        self.radius / (2.0f64 / 3.0).sqrt()
    }

    /// Bytes of the points' states.
    pub fn bytes(&self) -> usize {
        self.points.len() * size_of::<PlasticPoint>()
    }

    /// Largest accumulated plastic strain of a point.
    pub fn strain_max(&self) -> f64 {
        self.points.iter().map(|point| point.strain).fold(0.0, f64::max)
    }

    /// Makes the plastic flow of a displacement field permanent.
    pub fn commit(&mut self, body: &Body, u: &[f64]) {
        let yielding = Yielding { body, plastic: self };
        let pieces = body.by_pieces(u, |tet, point, h, piece: &mut Vec<PlasticPoint>| {
            let state = &yielding.plastic.points[point];
            let trial = Trial::new(state, &Deformed::new(h));
            piece.push(trial.map_or(*state, |trial| trial.committed(yielding.hencky(tet))));
        });
        self.points = pieces.concat();
    }
}

/// A body whose elements yield, in its plastic state.
#[derive(Clone, Copy)]
pub(super) struct Yielding<'a> {
    pub body: &'a Body,
    pub plastic: &'a Plastic,
}

impl Yielding<'_> {
    pub fn hencky(&self, tet: usize) -> Hencky {
        let moduli = self.body.moduli.of(tet);
        Hencky { mu: moduli.mu, kappa: moduli.bulk(), radius: self.plastic.radius }
    }

    pub fn trial(&self, point: usize, deformed: &Deformed) -> Option<Trial<'_>> {
        Trial::new(&self.plastic.points[point], deformed)
    }

    /// Potential of a step and its slopes.
    pub fn evaluate(&self, u: &[f64]) -> Evaluated {
        match &self.body.shape {
            Shape::Linear(locals) | Shape::Averaged(locals, _) => self.evaluate_points(locals, u),
            Shape::Quadratic(locals) => self.evaluate_points(locals, u),
        }
    }

    fn evaluate_points<const K: usize>(&self, locals: &Locals<K>, u: &[f64]) -> Evaluated {
        let stress = |at: At, _: &[Vector3<f64>; K], deformed: &Deformed, sum: &mut PieceSum| {
            let trial = self.trial(at.point, deformed);
            let answer = trial.map(|trial| trial.potential_and_stress(self.hencky(at.tet)));
            let (potential, stress) = answer.unwrap_or((f64::INFINITY, Matrix3::zeros()));
            sum.see(at.weight * potential, deformed.j);
            stress
        };
        let (sums, forces) = self.body.forces_of(locals, u, stress);
        Evaluated::of_pieces(&sums, forces)
    }

    /// The tangent of a step times a vector.
    pub fn tangent_times(&self, u: &[f64], v: &[f64]) -> Vec<f64> {
        match &self.body.shape {
            Shape::Linear(locals) | Shape::Averaged(locals, _) => self.times(locals, u, v),
            Shape::Quadratic(locals) => self.times(locals, u, v),
        }
    }

    fn times<const K: usize>(&self, locals: &Locals<K>, u: &[f64], v: &[f64]) -> Vec<f64> {
        let stress = |at: At, gradients: &[Vector3<f64>; K], deformed: &Deformed, (): &mut ()| {
            let tangent = self.tangent((at.tet, at.point), deformed, Curvature::AsItIs);
            let df = gradient_of(&locals.tets[at.tet], gradients, v);
            tangent.map_or_else(Matrix3::zeros, |tangent| tangent.apply(&df))
        };
        self.body.forces_of(locals, u, stress).1
    }

    /// Tangent of a step at one point; none where the volume is gone.
    pub fn tangent(
        &self,
        (tet, point): (usize, usize),
        deformed: &Deformed,
        curvature: Curvature,
    ) -> Option<PrincipalTangent> {
        let trial = self.trial(point, deformed)?;
        Some(trial.tangent(self.hencky(tet), curvature))
    }
}

#[cfg(test)]
mod tests;
