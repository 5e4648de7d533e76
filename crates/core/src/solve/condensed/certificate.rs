//! The residual of a condensed answer and the proven bound of its error (`docs/bound.md`).

use nalgebra::DVector;

use super::base::Base;
use super::correction::Correction;
use super::overlap::{LoadSize, Overlap};
use super::rounding::{SAFE, SLACK, gamma};
use super::small_system::{ContactAnswer, SmallSystem};
use super::verified::{Amplification, Verified};
use crate::solve::vectors::norm;

/// How wrong an answer can be.
#[derive(Clone, Debug, PartialEq)]
pub struct Certificate {
    /// `‖r‖ / ‖b‖` by the triangle inequality over the columns' residuals as computed; b is that of
    /// (3.42a), or, where masks are held, `K` times the smallest field that has the means asked for.
    pub residual_rel: f64,
    /// Proven bound on `‖e‖ / ‖u‖` over all nodes, or why there is none.
    pub error_bound_rel: Result<f64, &'static str>,
    /// Estimate of `‖e‖ / ‖u‖`, where columns come from conjugate gradients.
    pub error_estimate_rel: Option<f64>,
}

/// How displacements are rounded before they are handed over.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Delivery {
    /// Not at all.
    #[default]
    Double,
    /// Each component, as a share of the largest one, to single precision.
    Single,
}

/// Half the distance of numbers in single precision, relative, with what the two roundings to
/// double precision around it and the smallest single numbers can add.
const SINGLE: f64 = 5.960_464_477_539_063e-8 * (1.0 + 1e-6);

const NOTHING_MOVES: &str = "nothing moves";
const NOT_PROVEN: &str = "no lower bound of the smallest eigenvalue has been proven for this shape";
const NO_FACTOR: &str = "the columns come from conjugate gradients, since memory is too short for a \
                         factor: the error is estimated, and no bound is proven";
const OUT_OF_RANGE: &str = "the numbers are too large or too small for a bound in double precision";
const WEAKLY_HELD: &str =
    "the contacts hold the body so weakly that double precision proves no bound";
const NO_USE: &str = "the proven error is as large as the displacements";

/// What loads add to an answer and to its errors.
///
/// Units: m, N.
pub(super) struct LoadTerms<'a> {
    /// Number of loads.
    pub count: usize,
    /// Bound of the displacements of the held shape under the loads, as a norm.
    pub size: f64,
    /// Residual of these displacements as computed, as a norm, and a bound of it.
    pub residual: f64,
    pub residual_bound: f64,
    /// Estimated error of these displacements, as a norm.
    pub error: f64,
    /// Right side of the small system, m, and a bound on the norm of what it is off.
    pub right: &'a DVector<f64>,
    pub right_off: f64,
    /// Norm of the right side of (3.42a).
    pub load_size: f64,
}

/// What answers of one contact set are judged by.
#[derive(Clone, Copy)]
pub(super) struct Judge<'a> {
    pub base: &'a Base,
    pub small: &'a SmallSystem,
    pub overlap: &'a Overlap,
    pub verified: &'a Verified,
    pub load: &'a LoadSize,
    /// What a second solve found, once there was one.
    pub correction: Option<&'a Correction>,
}

impl Judge<'_> {
    /// How wrong an answer can be that was delivered with this norm, m.
    pub fn certificate(
        self,
        q: &[f64],
        answer: &ContactAnswer,
        delivered: f64,
        delivery: Delivery,
    ) -> Certificate {
        Certificate {
            residual_rel: self.residual_rel(q, answer),
            error_bound_rel: self.bound(q, answer, delivered, delivery),
            error_estimate_rel: self.estimate(norm(q), answer, 0.0, delivered),
        }
    }

    /// The same for an answer on which loads act, by the residuals of the columns alone
    /// (`docs/bound.md`, section 8).
    pub fn loaded(
        self,
        q: &[f64],
        answer: &ContactAnswer,
        loads: LoadTerms<'_>,
        delivered: f64,
        delivery: Delivery,
    ) -> Certificate {
        let residual = self.residual(answer) + loads.residual;
        let b = loads.load_size;
        Certificate {
            residual_rel: if b > 0.0 { residual / b } else { residual },
            error_estimate_rel: self.estimate(norm(q), answer, loads.error, delivered),
            error_bound_rel: self.loaded_bound(norm(q), answer, &loads, (delivered, delivery)),
        }
    }

    fn loaded_bound(
        self,
        asked: f64,
        answer: &ContactAnswer,
        loads: &LoadTerms<'_>,
        (delivered, delivery): (f64, Delivery),
    ) -> Result<f64, &'static str> {
        let Self { base, verified, .. } = self;
        let eigenvalue = proven_eigenvalue(base)?;
        if asked == 0.0 && loads.size == 0.0 {
            return Err(NOTHING_MOVES);
        }
        let sizes = [asked, loads.size, delivered].into_iter().filter(|size| *size != 0.0);
        let sizes = sizes.chain([eigenvalue, base.stiffest, verified.scale]);
        if !sizes.into_iter().all(|x| SAFE.contains(&x)) {
            return Err(OUT_OF_RANGE);
        }
        let factors = verified.amplification(base, eigenvalue).ok_or(WEAKLY_HELD)?;
        let x = self.scaled(answer);
        let missed = verified.missed(loads.right, &x) + loads.right_off;
        let error = self.plain(&x, missed, factors, Some(loads)).ok_or(WEAKLY_HELD)?;
        let size = (asked / self.overlap.stretch).max(delivered / SLACK - error) / SLACK;
        relative(error, size, delivered, delivery)
    }

    /// Estimate of the relative error that conjugate gradients leave; `None` where a factor was used.
    ///
    /// The errors of the columns add up in proportion to the forces. Where the contacts are held, the small
    /// system takes out again what moves them, which is a part of the same size. Rounding in the stiffness
    /// turns a body that the contacts hold weakly.
    ///
    /// Units: `asked` and `delivered` norms, m; `of_loads` norm of the error of what loads move, m.
    fn estimate(
        self,
        asked: f64,
        answer: &ContactAnswer,
        of_loads: f64,
        delivered: f64,
    ) -> Option<f64> {
        if self.base.inverse.factor().is_some() {
            return None;
        }
        let columns = &self.small.columns;
        let places = self.small.places.iter().map(|&(at, axis)| columns[at].errors[axis]);
        let of_columns: f64 = places.zip(&answer.lambda).map(|(e, force)| e * force.abs()).sum();
        let size = delivered.max(asked / self.overlap.stretch);
        let turned = self.verified.turned_by_rounding(self.base) * size;
        let error = ESTIMATE_SAFETY * (of_columns + of_loads) + turned;
        Some(if size > 0.0 { error / size } else { error })
    }

    /// Bound of the residual's norm by the residuals of columns and motions as computed.
    fn residual(self, answer: &ContactAnswer) -> f64 {
        let Self { base, small, .. } = self;
        let places = small.places.iter().map(|&(at, axis)| small.columns[at].residuals[axis]);
        let residuals = places.chain(base.modes.iter().map(|m| m.residual));
        let amounts = answer.lambda.iter().chain(&answer.amounts);
        let mut residual: f64 = residuals.zip(amounts).map(|(r, amount)| amount.abs() * r).sum();
        // What the contacts are off moves their neighbours by at most so much force.
        let stiffest = (base.stiffest * self.overlap.lift).max(small.scale);
        residual += stiffest * answer.mismatch;
        residual
    }

    fn residual_rel(self, q: &[f64], answer: &ContactAnswer) -> f64 {
        let (residual, b) = (self.residual(answer), self.load.size(q));
        if b > 0.0 { residual / b } else { residual }
    }

    /// Unknowns of the small system, k.
    fn scaled(self, answer: &ContactAnswer) -> DVector<f64> {
        let of_lambda = answer.lambda.iter().map(|x| x / self.verified.scale);
        let x: Vec<f64> = of_lambda.chain(answer.amounts.iter().copied()).collect();
        DVector::from_vec(x)
    }

    fn bound(
        self,
        q: &[f64],
        answer: &ContactAnswer,
        delivered: f64,
        delivery: Delivery,
    ) -> Result<f64, &'static str> {
        let Self { base, verified, .. } = self;
        let eigenvalue = proven_eigenvalue(base)?;
        let asked = norm(q);
        if asked == 0.0 {
            return Err(NOTHING_MOVES);
        }
        if ![asked, eigenvalue, base.stiffest, verified.scale].iter().all(|x| SAFE.contains(x)) {
            return Err(OUT_OF_RANGE);
        }
        let factors = verified.amplification(base, eigenvalue).ok_or(WEAKLY_HELD)?;
        let x = self.scaled(answer);
        let missed = verified.mismatch(q, &x);
        let plain = self.plain(&x, missed, factors, None);
        let refined = self.refined(&x, missed, factors);
        let error = match (plain, refined) {
            (Some(plain), Some(refined)) => plain.min(refined),
            (plain, refined) => plain.or(refined).ok_or(WEAKLY_HELD)?,
        };
        // The size of the exact answer, from below.
        let by_contacts = asked / self.overlap.stretch;
        let by_all = self.correction.map_or(0.0, |c| c.size.at_least(&x));
        let size = by_contacts.max((delivered / SLACK).max(by_all) - error) / SLACK;
        relative(error, size, delivered, delivery)
    }

    /// The bound from the columns' residuals.
    fn plain(
        self,
        x: &DVector<f64>,
        missed: f64,
        factors: Amplification,
        loads: Option<&LoadTerms<'_>>,
    ) -> Option<f64> {
        let (count, size, residual) =
            loads.map_or((0, 0.0, 0.0), |l| (l.count, l.size, l.residual_bound));
        let v = self.verified;
        // Written so that a NaN is refused too.
        let is_verified = v.eta < 0.5;
        let step = missed / (1.0 - v.eta);
        let residual = Verified::sum(&v.residuals, x) + residual + v.left * step;
        let size = Verified::sum(&v.norms, x) + size;
        let moments = self.base.rigid.as_ref().map_or(0.0, |rigid| rigid.stiffness);
        let error = factors.of_residual * residual
            + factors.of_moment * moments * (size + v.moved * step)
            + v.moved * step
            + gamma(x.len() + count + 6) * size;
        is_verified.then_some(error * SLACK)
    }

    /// The bound from what a second solve found, once there was one ([`super::ContactSet::refine`]).
    ///
    /// What was found is all rounding, so it would be another number in other units; what is said is
    /// the smallest of some fixed multiples of what was expected that is no smaller.
    fn refined(self, x: &DVector<f64>, missed: f64, factors: Amplification) -> Option<f64> {
        let (c, v) = (self.correction?, self.verified);
        // Written so that a NaN is refused too.
        let is_verified = c.eta < 0.5;
        if !is_verified {
            return None;
        }
        let step = (missed + Verified::sum(&c.changes, x)) / (1.0 - c.eta);
        let residual = Verified::sum(&c.residuals, x) + c.left * step;
        let size =
            c.size.at_most(x) + Verified::sum(&c.lengths, x) + (c.moved + c.corrected) * step;
        let found = c.error.at_most(x)
            + Verified::sum(&c.off, x)
            + (c.corrected + c.moved * c.eta) * step
            + factors.of_residual * residual
            + factors.of_moment * c.moments * size;
        let found = found * SLACK;
        let expected = EXPECTED_AT_LEAST * c.expected.about(x);
        let steps = (0..EXPECTED_STEPS).map(|m| expected * EXPECTED_STEP.powi(m));
        let said = steps.into_iter().find(|said| *said >= found).unwrap_or(found);
        let known = c.moved * missed + gamma(v.norms.len() + 8) * c.sizes.at_most(&x.abs());
        Some((said + known) * SLACK)
    }
}

/// What the contacts take out of the errors of columns has about the size of these errors.
const ESTIMATE_SAFETY: f64 = 2.0;

/// Proven smallest eigenvalue of the held stiffness, N/m, or why there is none.
fn proven_eigenvalue(base: &Base) -> Result<f64, &'static str> {
    base.eigenvalue_min().ok_or(match base.inverse.factor() {
        Some(_) => NOT_PROVEN,
        None => NO_FACTOR,
    })
}

/// Bound of the error, rounded as it is delivered, over a lower bound of the answer's size.
fn relative(
    error: f64,
    size: f64,
    delivered: f64,
    delivery: Delivery,
) -> Result<f64, &'static str> {
    let rounded = match delivery {
        Delivery::Double => 0.0,
        Delivery::Single => SINGLE * delivered,
    };
    let bound = (error + rounded * SLACK) / size * SLACK;
    // Written so that a NaN is refused too.
    if (0.0..1.0).contains(&bound) { Ok(bound) } else { Err(NO_USE) }
}

/// A bound is at least so many times the error that rounding of one unit in the stiffness makes.
const EXPECTED_AT_LEAST: f64 = 20.0;
/// Multiples of it that are tried: powers of this.
const EXPECTED_STEP: f64 = 8.0;
const EXPECTED_STEPS: i32 = 6;
