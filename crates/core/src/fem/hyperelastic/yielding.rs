//! Elements that yield: plastic flow that stays once a shape was reached.

use nalgebra::{Matrix3, Vector3};

use super::elements::{Elements, Evaluated, PieceSum, Shape, gradient_of, gradients_at, points_of};
use super::hencky::Hencky;
use super::locals::Locals;
use super::plastic::{Plastic, PlasticPoint, Trial};
use super::principal_tangent::PrincipalTangent;
use super::{Curvature, Deformed};

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

/// A point of an element, counted over all elements, and the volume that it stands for.
#[derive(Clone, Copy)]
struct At {
    tet: usize,
    point: usize,
    weight: f64,
}

impl Elements {
    /// The same elements with a yield stress, without plastic strain at first. Their elasticity is
    /// Hencky's then, with the moduli of the materials, whatever the law was:
    /// `W = μ dev e : dev e + κ/2 (tr e)²`, e the logarithmic strain of `Fe` in `F = Fe Fp`. They
    /// flow where von Mises' stress `√(3/2) ‖dev τ‖` of Kirchhoff's stress τ would exceed the yield
    /// stress (no hardening).
    ///
    /// [`Elements::evaluate`] answers with the potential of a step from the last
    /// [`Elements::commit`]: energy stored and what the step dissipates.
    ///
    /// Units: Pa.
    ///
    /// # Errors
    /// [`YieldError::Stress`] if it is not a finite number above 0, [`YieldError::Averaged`] for
    /// t4-anp.
    ///
    /// Source: Simo, CMAME 99 (1992) 61.
    pub fn with_yield(self, stress_pa: f64) -> Result<Self, YieldError> {
        if !(stress_pa.is_finite() && stress_pa > 0.0) {
            return Err(YieldError::Stress { stress_pa });
        }
        let points = match &self.shape {
            Shape::Linear(_) => points_of::<4>(),
            Shape::Quadratic(_) => points_of::<10>(),
            Shape::Averaged(..) => return Err(YieldError::Averaged),
        };
        let radius = (2.0f64 / 3.0).sqrt() * stress_pa;
        let points = vec![PlasticPoint::default(); points * self.rest.len()];
        Ok(Self { plastic: Some(Plastic { radius, points }), ..self })
    }

    /// Whether the elements have a yield stress.
    pub fn is_plastic(&self) -> bool {
        self.plastic.is_some()
    }

    /// Makes the plastic flow of a shape permanent, in parallel, the same bits for any number of
    /// threads. Without a yield stress it does nothing.
    ///
    /// Shapes: `u` 3N. Units: m.
    ///
    /// # Panics
    /// If `u` does not hold 3N numbers.
    pub fn commit(&mut self, u: &[f64]) {
        assert_eq!(u.len(), 3 * self.node_count, "displacements do not fit the body");
        let Some(plastic) = &self.plastic else { return };
        let pieces = self.by_pieces(u, |tet, point, h, piece: &mut Vec<PlasticPoint>| {
            let state = &plastic.points[point];
            let trial = Trial::new(state, &Deformed::new(h));
            piece.push(trial.map_or(*state, |trial| trial.committed(self.hencky(plastic, tet))));
        });
        let points = pieces.concat();
        self.plastic = Some(Plastic { radius: plastic.radius, points });
    }

    /// Largest accumulated plastic strain of a point, `Σ √(2/3) ‖dev e‖` of what flowed; 0 without a
    /// yield stress.
    pub fn plastic_strain_max(&self) -> f64 {
        let points = self.plastic.iter().flat_map(|plastic| &plastic.points);
        points.map(|point| point.strain).fold(0.0, f64::max)
    }

    fn hencky(&self, plastic: &Plastic, tet: usize) -> Hencky {
        self.moduli.of(tet).hencky(plastic.radius)
    }

    /// Potential of a step and its slopes.
    pub(super) fn evaluate_yielding(&self, plastic: &Plastic, u: &[f64]) -> Evaluated {
        match &self.shape {
            Shape::Linear(locals) | Shape::Averaged(locals, _) => {
                self.evaluate_yielding_points(plastic, locals, u)
            }
            Shape::Quadratic(locals) => self.evaluate_yielding_points(plastic, locals, u),
        }
    }

    fn evaluate_yielding_points<const K: usize>(
        &self,
        plastic: &Plastic,
        locals: &Locals<K>,
        u: &[f64],
    ) -> Evaluated {
        let (sums, forces) = self.forces_of(locals, u, |at, _, deformed, sum: &mut PieceSum| {
            let trial = Trial::new(&plastic.points[at.point], deformed);
            let answer =
                trial.map(|trial| trial.potential_and_stress(self.hencky(plastic, at.tet)));
            let (potential, stress) = answer.unwrap_or((f64::INFINITY, Matrix3::zeros()));
            sum.see(at.weight * potential, deformed.j);
            stress
        });
        Evaluated::of_pieces(&sums, forces)
    }

    /// The tangent of a step times a vector.
    pub(super) fn yielding_tangent_times(
        &self,
        plastic: &Plastic,
        u: &[f64],
        v: &[f64],
    ) -> Vec<f64> {
        match &self.shape {
            Shape::Linear(locals) | Shape::Averaged(locals, _) => {
                self.yielding_times(plastic, locals, u, v)
            }
            Shape::Quadratic(locals) => self.yielding_times(plastic, locals, u, v),
        }
    }

    fn yielding_times<const K: usize>(
        &self,
        plastic: &Plastic,
        locals: &Locals<K>,
        u: &[f64],
        v: &[f64],
    ) -> Vec<f64> {
        let of_point = |at: At, gradients: &[Vector3<f64>; K], deformed: &Deformed, (): &mut ()| {
            let place = (at.tet, at.point);
            let tangent = self.yielding_tangent(plastic, place, deformed, Curvature::AsItIs);
            let df = gradient_of(&locals.tets[at.tet], gradients, v);
            tangent.map_or_else(Matrix3::zeros, |tangent| tangent.apply(&df))
        };
        self.forces_of(locals, u, of_point).1
    }

    /// Sums the forces of stresses at all points, and what every piece of the elements adds up.
    ///
    /// `stress(point, gradients of its shape functions, its deformation, what the piece has so far)`.
    fn forces_of<const K: usize, T: Send + Default>(
        &self,
        locals: &Locals<K>,
        u: &[f64],
        stress: impl Fn(At, &[Vector3<f64>; K], &Deformed, &mut T) -> Matrix3<f64> + Sync,
    ) -> (Vec<T>, Vec<f64>) {
        let mut forces = Vec::new();
        let points = points_of::<K>();
        let sums = locals.for_each(&mut forces, |tet, forces, sum| {
            let rest = &self.rest[tet];
            let weight = rest.volume / points as f64;
            let mut so_far = [Vector3::zeros(); K];
            for point in 0..points {
                let gradients = gradients_at::<K>(rest, point);
                let deformed = Deformed::new(&gradient_of(&locals.tets[tet], &gradients, u));
                let at = At { tet, point: points * tet + point, weight };
                let stress = stress(at, &gradients, &deformed, sum) * weight;
                for (force, gradient) in so_far.iter_mut().zip(&gradients) {
                    *force += stress * gradient;
                }
            }
            *forces = so_far.map(Into::into);
        });
        (sums, locals.gather(&forces))
    }

    /// Tangent of a step at one point; none where the volume is gone.
    pub(super) fn yielding_tangent(
        &self,
        plastic: &Plastic,
        (tet, point): (usize, usize),
        deformed: &Deformed,
        curvature: Curvature,
    ) -> Option<PrincipalTangent> {
        let law = self.hencky(plastic, tet);
        let trial = Trial::new(&plastic.points[point], deformed)?;
        Some(match curvature {
            Curvature::AsItIs => trial.tangent(law),
            Curvature::PositivePart => trial.positive_tangent(law),
        })
    }
}

#[cfg(test)]
mod tests;
