//! Brings forces into balance at constraints that are met: corrections downhill in energy.

use super::goal::{Goal, Wish};
use super::path::Path;
use crate::fem::hyperelastic::Evaluated;
use crate::solve::vectors::{dot, node_max, norm};

/// What is out of balance at a shape.
pub(super) struct Balance {
    /// Forces on the unknown that nothing holds, N.
    pub residual: Vec<f64>,
    /// Of the masks, three each, N.
    pub mask_forces: Vec<f64>,
    /// Norm of the residual over that of the forces that hold the body.
    pub residual_rel: f64,
}

/// How corrections shrink.
pub(super) struct Contraction {
    /// Energy norm and largest displacement of the last correction.
    last: Option<[f64; 2]>,
    /// Whether two corrections of this frame were seen.
    is_seen: bool,
    /// Largest ratio of two corrections of late.
    pub theta: f64,
}

/// A ratio of corrections that is taken to be at least so much: slow motions hide behind quick ones.
const THETA_MIN: f64 = 0.8;
/// Ratio of corrections that is assumed before two of a frame were seen.
const THETA_UNSEEN: f64 = 0.8;
/// A ratio above which nothing is promised.
const THETA_MAX: f64 = 0.93;

impl Contraction {
    /// With what is expected before two corrections were seen.
    pub fn expecting(theta: f64) -> Self {
        Self { last: None, is_seen: false, theta: theta.clamp(THETA_UNSEEN, THETA_MAX) }
    }

    /// The larger of both ratios counts: slender bodies have motions of little energy that shrink
    /// slowly, and stiff ones motions that are small.
    fn see(&mut self, sizes: [f64; 2]) {
        if let Some(last) = self.last.filter(|last| last.iter().all(|size| *size > 0.0)) {
            let ratio = (sizes[0] / last[0]).max(sizes[1] / last[1]).clamp(THETA_MIN, THETA_MAX);
            // One lucky step does not make the next one lucky.
            self.theta = match self.is_seen {
                true => ratio.max(0.7 * self.theta),
                false => ratio,
            };
            self.is_seen = true;
        }
        self.last = Some(sizes);
    }

    /// What is left after a correction of this size.
    fn left_after(&self, size: f64) -> f64 {
        size * self.theta / (1.0 - self.theta)
    }
}

/// What is expected of the error is told so many times over. Of random squeezes of fourteen objects one
/// frame in 200 was wrong by more than twice what is expected, and is one in 1500 by more than twice what
/// is told.
const SAFETY: f64 = 2.5;
/// A residual, relative to the forces that hold the body, leaves a displacement off by so much of the
/// largest one at least. A short correction among long ones says little: where a branch nears its end
/// one in ten steps is short by chance, and only the residual knows.
const ERROR_OF_RESIDUAL: f64 = 10.0;

/// How a settling ended.
pub(super) struct Settled {
    pub evaluated: Evaluated,
    pub balance: Balance,
    /// Estimated error of a displacement, m.
    pub error: f64,
    /// Estimated error in the energy norm.
    pub energy_error: f64,
    pub is_balanced: bool,
    /// Balanced without regard to time.
    pub is_converged: bool,
}

/// Residual, relative to the forces that hold the body, that counts as rounding.
const RESIDUAL_ROUNDING: f64 = 1e-13;
/// Rounding of forces over stiffness times displacements.
const ROUNDING: f64 = 4e-16;
/// Residual at which nothing is gained by asking again.
pub(super) const RESIDUAL_SETTLED: f64 = 1e-8;
/// Corrections without a better residual after which it counts as rounding.
const STALLED_MAX: u32 = 4;
/// Solves after which a factor is made anew while it is waited for.
const SOLVES_WITH_OLD_FACTOR: u32 = 14;
/// Change of an element's deformation gradient below which a step needs no limit.
pub(super) const GRADIENT_CHANGE_SMALL: f64 = 0.05;
/// Times a step is cut.
const CUTS_MAX: u32 = 25;

impl Path {
    /// What is out of balance, from forces `∂W/∂u`.
    pub(super) fn balance(&self, evaluated: &Evaluated, goal: &Goal<'_>) -> Balance {
        let hold = &self.hold;
        let unknown = hold.partition.unknown();
        let external = |dof: usize| goal.forces.get(dof).copied().unwrap_or(0.0);
        let out_of_balance = |&dof: &u32| {
            let dof = dof as usize;
            evaluated.forces[dof] - external(dof)
        };
        let mut residual: Vec<f64> = unknown.iter().map(out_of_balance).collect();
        let mask_forces = hold.mask_forces(&residual);
        let before = norm(&residual);
        hold.subtract_mask_forces(&mask_forces, &mut residual);
        let left = norm(&residual);
        let of_masks = (before * before - left * left).max(0.0).sqrt();
        let reactions: Vec<f64> =
            hold.partition.known().iter().map(|&dof| evaluated.forces[dof as usize]).collect();
        let loads = norm(goal.forces);
        let held_by = norm(&[of_masks, norm(&reactions), loads]);
        // Forces of a body that nothing presses are rounding, and so is what they are off by.
        let rounding = ROUNDING * self.stiffest * norm(&self.q).max(self.size());
        let residual_rel = match left <= rounding {
            true => RESIDUAL_ROUNDING.min(if held_by > 0.0 { left / held_by } else { 0.0 }),
            false => left / held_by,
        };
        Balance { residual, mask_forces, residual_rel }
    }

    /// The correction that the newest factor and what was learnt since make of a residual.
    pub(super) fn correction(&mut self, residual: &[f64], means_off: &[f64]) -> Vec<f64> {
        let hold = std::sync::Arc::clone(&self.hold);
        self.counts.linear_solves += 1;
        let downhill = residual.iter().map(|f| -f).collect();
        let Some(inverse) = &self.inverse else { return vec![0.0; residual.len()] };
        let mut step = self.secants.apply(downhill, |r| inverse.apply(&hold, r, means_off));
        hold.meet(means_off, &mut step);
        step
    }

    /// Corrects the shape until it is good enough, balanced, or no better.
    pub(super) fn settle(
        &mut self,
        goal: &Goal<'_>,
        wish: &Wish<'_>,
        mut evaluated: Evaluated,
        ((mut error, mut energy_error), solves_max): ((f64, f64), u32),
    ) -> Result<Settled, super::NoEquilibrium> {
        let mut balance = self.balance(&evaluated, goal);
        let mut contraction = Contraction::expecting(self.theta);
        let mut best = Best::default();
        let (mut with_this_factor, mut stalled_before) = (0, false);
        // What does not move and is settled is left alone.
        let is_done = error.is_finite() && balance.residual_rel <= RESIDUAL_SETTLED;
        if !(is_done && wish.error_rel.is_some()) {
            self.watch_soft(&balance.residual);
        }
        let solves_before = self.counts.linear_solves;
        while !(is_done && wish.error_rel.is_some()) {
            let is_rounding = best.see(balance.residual_rel);
            let is_late = (wish.is_late)() && error.is_finite();
            let solves = self.counts.linear_solves - solves_before;
            if is_rounding && wish.error_rel.is_none() && !stalled_before && best.is_stalled() {
                // An old factor stalls too; only what a new one does not better is rounding.
                contraction = self.begin_anew()?;
                (best, with_this_factor, stalled_before) = (Best::default(), 0, true);
                continue;
            }
            if is_rounding || is_late || solves >= solves_max {
                break;
            }
            if with_this_factor >= SOLVES_WITH_OLD_FACTOR {
                if self.may_factor(wish) {
                    contraction = self.begin_anew()?;
                }
                with_this_factor = 0;
            }
            let off = self.means_off(goal);
            let (step, slope) = self.downhill(&balance.residual, &off);
            with_this_factor += 1;
            let size = (-slope).max(0.0).sqrt();
            let largest = node_max(&step);
            contraction.see([size, largest]);
            let next = self.searched(goal, &evaluated, &balance, (&step, slope));
            let Some((moved, after, after_balance)) = next else {
                if with_this_factor > 1 && self.may_factor(wish) {
                    contraction = self.begin_anew()?;
                    with_this_factor = 0;
                    continue;
                }
                // What the correction would have been is what the shape is off by.
                (error, energy_error) = (largest, size);
                break;
            };
            self.counts.newton_steps += 1;
            let share = moved.share;
            let change: Vec<f64> =
                after_balance.residual.iter().zip(&balance.residual).map(|(a, b)| a - b).collect();
            self.secants.keep(step.iter().map(|d| share * d).collect(), change);
            self.q = moved.q;
            (evaluated, balance) = (after, after_balance);
            let expected = if share == 1.0 { contraction.left_after(largest) } else { largest };
            error = self.told_error(expected, &balance);
            energy_error = contraction.left_after(size);
            let is_good = |tolerance: f64| error <= tolerance * self.size();
            if wish.error_rel.is_some_and(is_good) {
                break;
            }
        }
        self.theta = contraction.theta;
        let is_rounding = best.is_rounding() || balance.residual_rel <= RESIDUAL_ROUNDING;
        if is_rounding && !error.is_finite() {
            error = 0.0;
        }
        let is_converged = is_rounding
            || match wish.error_rel {
                Some(tolerance) => is_done || error <= tolerance * self.size(),
                None => balance.residual_rel <= RESIDUAL_SETTLED,
            };
        let is_balanced = is_converged || (wish.is_late)();
        Ok(Settled { evaluated, balance, error, energy_error, is_balanced, is_converged })
    }

    /// The error that is told, m, of a shape whose last correction lets so much be expected.
    fn told_error(&self, expected: f64, balance: &Balance) -> f64 {
        let of_corrections = SAFETY * (expected + self.left_along_soft(&balance.residual));
        of_corrections.max(ERROR_OF_RESIDUAL * balance.residual_rel * self.size())
    }

    /// A correction and the slope of the energy along it; without what was learnt where that leads
    /// uphill.
    fn downhill(&mut self, residual: &[f64], off: &[f64]) -> (Vec<f64>, f64) {
        let step = self.correction(residual, off);
        let slope = dot(residual, &step);
        if !(slope >= 0.0 || slope.is_nan()) || self.secants.bytes() == 0 {
            return (step, slope);
        }
        // Rounding, or the shape has changed too much.
        self.secants.clear();
        let step = self.correction(residual, off);
        let slope = dot(residual, &step);
        (step, slope)
    }

    /// A factor of the shape as it is now, and what is expected of it.
    fn begin_anew(&mut self) -> Result<Contraction, super::NoEquilibrium> {
        self.factor_here()?;
        Ok(Contraction::expecting(self.theta))
    }

    /// Goes along a step as far as the energy falls.
    pub(super) fn searched(
        &self,
        goal: &Goal<'_>,
        evaluated: &Evaluated,
        balance: &Balance,
        (step, slope): (&[f64], f64),
    ) -> Option<(Moved, Evaluated, Balance)> {
        let mut full = vec![0.0; self.q.len()];
        self.hold.partition.scatter_unknown(step, &mut full);
        // So small a step cannot turn an element inside out and back, and what it turns inside out
        // has no finite energy.
        let mut share = match self.elements.gradient_change_max(&full) < GRADIENT_CHANGE_SMALL {
            true => 1.0,
            false => self.elements.step_limit(&self.q, &full),
        };
        let work = |q: &[f64]| dot(goal.forces, q);
        let energy = evaluated.energy - work(&self.q);
        for _ in 0..CUTS_MAX {
            let q: Vec<f64> = self.q.iter().zip(&full).map(|(q, d)| q + share * d).collect();
            let after = self.elements.evaluate(&q);
            if after.energy.is_finite() {
                let after_balance = self.balance(&after, goal);
                let change = after.energy - work(&q) - energy;
                let slope_after = dot(&after_balance.residual, step);
                let falls = change <= 1e-4 * share * slope;
                // Near the bottom the energy's own rounding hides whether it falls; slopes do not.
                let noise = 1e-9 * evaluated.energy.abs();
                let is_flat = change.abs() <= noise && slope_after.abs() <= 0.9 * slope.abs();
                let is_better =
                    after_balance.residual_rel < 0.5 * balance.residual_rel && change <= noise;
                if falls || is_flat || is_better {
                    return Some((Moved { q, share }, after, after_balance));
                }
                let bend = (slope_after - slope) / share;
                let lowest = if bend > 0.0 { -slope / bend } else { 0.5 * share };
                share = lowest.clamp(0.1 * share, 0.5 * share);
            } else {
                share *= 0.5;
            }
        }
        None
    }

    /// By how much the means of the masks miss what is asked for, m.
    pub(super) fn means_off(&self, goal: &Goal<'_>) -> Vec<f64> {
        let means = self.hold.means(&self.q);
        goal.mask_q.iter().zip(means).map(|(wanted, mean)| wanted - mean).collect()
    }
}

/// A shape that was gone to.
pub(super) struct Moved {
    pub q: Vec<f64>,
    /// Of the step.
    pub share: f64,
}

/// The best residual so far, and how long ago it was.
struct Best {
    residual_rel: f64,
    steps_since: u32,
}

impl Default for Best {
    fn default() -> Self {
        Self { residual_rel: f64::INFINITY, steps_since: 0 }
    }
}

impl Best {
    /// Takes a residual into account; says whether it is rounding.
    fn see(&mut self, residual_rel: f64) -> bool {
        if residual_rel < 0.7 * self.residual_rel {
            (self.residual_rel, self.steps_since) = (residual_rel, 0);
        } else {
            self.steps_since += 1;
        }
        residual_rel <= RESIDUAL_ROUNDING || self.is_rounding()
    }

    /// Whether a residual is as small as rounding, or small and has stopped falling.
    fn is_rounding(&self) -> bool {
        self.residual_rel <= RESIDUAL_ROUNDING || self.is_stalled()
    }

    /// Whether a small residual, which is not that of rounding yet, has stopped falling.
    fn is_stalled(&self) -> bool {
        self.residual_rel > RESIDUAL_ROUNDING
            && self.residual_rel <= 1e-9
            && self.steps_since >= STALLED_MAX
    }
}
