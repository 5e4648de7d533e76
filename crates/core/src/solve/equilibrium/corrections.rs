//! What corrects a shape: an older factor, what steps have taught since, and what both have cost.

use std::sync::Arc;

use super::goal::{Goal, Wish};
use super::hold::Hold;
use super::inverse::{FactorError, Inverse, Renewed};
use super::secants::{Secants, Soft};
use super::shape::{Moved, Shape};
use crate::fem::hyperelastic::Evaluated;
use crate::solve::vectors::dot;

/// The newest factor of a path, and all that makes corrections of it.
#[derive(Clone)]
pub(super) struct Corrections {
    inverse: Option<Arc<Inverse>>,
    secants: Secants,
    /// The softest motion that was met.
    soft: Option<Soft>,
    /// Whether it was followed in this frame.
    is_soft_watched: bool,
    /// Ratio by which corrections shrank last.
    pub theta: f64,
    pub counts: Counts,
    /// Frames since the shape that the factor belongs to.
    pub factor_age: u32,
    /// Whether a frame had no time to wait for a factor that it needed.
    wants_factor: bool,
}

/// What one equilibrium has cost so far.
#[derive(Clone, Copy, Default)]
pub(super) struct Counts {
    pub newton_steps: u32,
    pub linear_solves: u32,
    pub factors: u32,
    pub substeps: u32,
}

/// Solves in a frame above which its factor counts as old.
const SOLVES_OF_AN_OLD_FACTOR: u32 = 5;
/// Ratio of corrections above which it counts as old, so that a hand that rests gets a new one too.
const THETA_OLD: f64 = 0.87;
/// Expected ratio of corrections with a new factor.
const THETA_NEW: f64 = 0.2;

impl Corrections {
    /// Without a factor.
    pub fn new() -> Self {
        Self {
            inverse: None,
            secants: Secants::default(),
            soft: None,
            is_soft_watched: false,
            theta: THETA_NEW,
            counts: Counts::default(),
            factor_age: 0,
            wants_factor: false,
        }
    }
    pub fn bytes(&self) -> usize {
        let inverse = self.inverse.as_ref().map_or(0, |inverse| inverse.bytes());
        inverse + self.secants.bytes()
    }

    /// Begins a frame.
    pub fn begin_frame(&mut self) {
        self.counts = Counts::default();
        self.is_soft_watched = false;
        self.factor_age += 1;
    }

    /// Goes back to what they were before an attempt. What the frame has watched and waited for stays.
    pub fn restore(&mut self, before: Self) {
        let (is_soft_watched, wants_factor) = (self.is_soft_watched, self.wants_factor);
        *self = Self { is_soft_watched, wants_factor, ..before };
    }

    /// Forgets what steps have taught.
    pub fn forget_steps(&mut self) {
        self.secants.clear();
    }

    /// Forgets what steps and the softest motion have taught.
    pub fn forget(&mut self) {
        self.secants.clear();
        self.soft = None;
    }

    /// Fits the factor to another hold, or drops it if that has another order of elimination.
    pub fn hold_by(&mut self, hold: &Hold, is_same_order: bool) {
        self.forget();
        let kept = self.inverse.take().filter(|_| is_same_order);
        // A renewal under way does not hold the inverse, so it is nearly always the path's alone.
        self.inverse = kept.and_then(Arc::into_inner).map(|mut inverse| {
            inverse.fit(hold);
            Arc::new(inverse)
        });
        self.wants_factor = false;
    }

    /// Whether the factor is so old that one should be made beside the frames; asked for once.
    pub fn take_wish_for_a_factor(&mut self) -> bool {
        let Counts { linear_solves, factors, .. } = self.counts;
        let took_long = linear_solves + 10 * factors > SOLVES_OF_AN_OLD_FACTOR;
        let is_old = took_long || (self.theta > THETA_OLD && linear_solves > 0);
        let is_wanted = (is_old && self.factor_age > 0) || self.wants_factor;
        self.wants_factor = false;
        is_wanted
    }

    /// Whether there is time for a factor now; where not, one is wanted beside the frames.
    pub fn may_factor(&mut self, wish: &Wish<'_>) -> bool {
        let may = (wish.may_factor)();
        self.wants_factor |= !may;
        may
    }

    /// Takes a factor that was made beside the frames, `age` frames ago.
    pub fn install(&mut self, inverse: Inverse, age: u32) {
        self.inverse = Some(Arc::new(inverse));
        self.secants.clear();
        self.theta = THETA_NEW;
        self.factor_age = age;
    }

    /// Drops the factor, so that its memory serves the next one.
    pub fn drop_factor(&mut self) {
        self.inverse = None;
    }

    /// Takes a factor of the present shape that was waited for.
    pub fn take(&mut self, inverse: Inverse) {
        self.install(inverse, 0);
        self.counts.factors += 1;
    }

    /// Makes a factor of a shape.
    pub fn factor(&mut self, shape: &Shape) -> Result<(), FactorError> {
        self.drop_factor();
        let Renewed { inverse, .. } = shape.renewal().make()?;
        self.take(inverse);
        Ok(())
    }

    /// Makes a factor of a shape if there is none at all.
    pub fn factor_if_none(&mut self, shape: &Shape) -> Result<(), FactorError> {
        if self.inverse.is_none() { self.factor(shape) } else { Ok(()) }
    }

    /// The correction that the newest factor and what was learnt since make of a residual.
    pub fn correction(&mut self, shape: &Shape, residual: &[f64], means_off: &[f64]) -> Vec<f64> {
        let hold = &shape.hold;
        self.counts.linear_solves += 1;
        let downhill = residual.iter().map(|f| -f).collect();
        let Some(inverse) = &self.inverse else { return vec![0.0; residual.len()] };
        let mut step = self.secants.apply(downhill, |r| inverse.apply(hold, r, means_off));
        hold.meet(means_off, &mut step);
        step
    }

    /// A correction and the slope of the energy along it; without what was learnt where that leads
    /// uphill.
    pub fn downhill(&mut self, shape: &Shape, residual: &[f64], off: &[f64]) -> (Vec<f64>, f64) {
        let step = self.correction(shape, residual, off);
        let slope = dot(residual, &step);
        if !(slope >= 0.0 || slope.is_nan()) || self.secants.bytes() == 0 {
            return (step, slope);
        }
        // Rounding, or the shape has changed too much.
        self.secants.clear();
        let step = self.correction(shape, residual, off);
        let slope = dot(residual, &step);
        (step, slope)
    }

    /// Learns from a step of which a line search went a share, with the residual before it.
    pub fn learn(&mut self, step: &[f64], before: &[f64], moved: &Moved) {
        self.counts.newton_steps += 1;
        let change = moved.balance.residual.iter().zip(before).map(|(a, b)| a - b).collect();
        self.secants.keep(step.iter().map(|d| moved.share * d).collect(), change);
    }

    /// Where the tangent at the field `q` leads on the way to a goal, 3N, m: known displacements all
    /// the way, the others by a correction without what steps have taught, which is about steps that
    /// keep the constraints. `times` is the tangent times a field; nothing is learnt or forgotten.
    pub fn led(
        &mut self,
        shape: &Shape,
        goal: &Goal<'_>,
        (q, evaluated): (&[f64], &Evaluated),
        times: impl FnOnce(&[f64]) -> Vec<f64>,
    ) -> Vec<f64> {
        let hold = &shape.hold;
        let mut step = vec![0.0; q.len()];
        for (&dof, &wanted) in hold.dofs().iter().zip(goal.q_known) {
            step[dof as usize] = wanted - q[dof as usize];
        }
        let mut residual = shape.balance(evaluated, goal).residual;
        if step.iter().any(|step| *step != 0.0) {
            let coupled = times(&step);
            for (r, &dof) in residual.iter_mut().zip(hold.partition.unknown()) {
                *r += coupled[dof as usize];
            }
        }
        let mut off = hold.means(q);
        for ((off, wanted), known) in off.iter_mut().zip(goal.mask_q).zip(hold.means(&step)) {
            *off = wanted - *off - known;
        }
        let secants = std::mem::take(&mut self.secants);
        let of_unknown = self.correction(shape, &residual, &off);
        self.secants = secants;
        for (&dof, moved) in hold.partition.unknown().iter().zip(of_unknown) {
            step[dof as usize] = moved;
        }
        step
    }

    /// Follows the softest motion, once in a frame, and teaches corrections the true stiffness along
    /// it. It begins at what a residual drives.
    pub fn watch_soft(&mut self, shape: &Shape, residual: &[f64]) {
        if self.is_soft_watched {
            return;
        }
        self.is_soft_watched = true;
        if let Some(inverse) = &self.inverse {
            let motion = self.soft.take().map_or_else(|| residual.to_vec(), |soft| soft.motion);
            self.counts.linear_solves += 1;
            self.soft = Soft::after(motion, shape, inverse);
        }
        if let Some(soft) = &self.soft {
            self.secants.pin(soft.motion.clone(), soft.force.clone());
        }
    }

    /// By how much a residual may leave a displacement off along the softest motion, m.
    pub fn left_along_soft(&self, residual: &[f64]) -> f64 {
        self.soft.as_ref().map_or(0.0, |soft| soft.left_off(residual))
    }
}
