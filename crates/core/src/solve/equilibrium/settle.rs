//! Brings forces into balance at constraints that are met: corrections downhill in energy.

use super::corrections::Corrections;
use super::goal::{Goal, Wish};
use super::inverse::FactorError;
use super::shape::{Balance, RESIDUAL_ROUNDING, Shape};
use crate::fem::hyperelastic::Evaluated;
use crate::solve::vectors::node_max;

/// How a settling ended.
pub(super) struct Settled {
    pub evaluated: Evaluated,
    pub balance: Balance,
    /// Estimated error of a displacement, m, and in the energy norm.
    pub errors: (f64, f64),
    pub is_balanced: bool,
    /// Balanced without regard to time.
    pub is_converged: bool,
}

/// How corrections shrink.
struct Contraction {
    /// Energy norm and largest displacement of the last correction.
    last: Option<[f64; 2]>,
    /// Whether two corrections of this frame were seen.
    is_seen: bool,
    /// Largest ratio of two corrections of late.
    theta: f64,
}

/// A ratio of corrections that is taken to be at least so much: slow motions hide behind quick ones.
const THETA_MIN: f64 = 0.8;
/// Ratio of corrections that is assumed before two of a frame were seen.
const THETA_UNSEEN: f64 = 0.8;
/// A ratio above which nothing is promised.
const THETA_MAX: f64 = 0.93;

impl Contraction {
    /// With what is expected before two corrections were seen.
    fn expecting(theta: f64) -> Self {
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

/// Residual at which nothing is gained by asking again.
pub(super) const RESIDUAL_SETTLED: f64 = 1e-8;
/// Corrections without a better residual after which it counts as rounding.
const STALLED_MAX: u32 = 4;
/// Solves after which a factor is made anew while it is waited for.
const SOLVES_WITH_OLD_FACTOR: u32 = 14;

/// Corrects a shape, whose energy and forces are given, until it is good enough, balanced, or no
/// better. `errors`: what is known of its errors before, m and in the energy norm.
///
/// # Errors
/// [`FactorError`] where a factor is needed that cannot be made.
pub(super) fn settle(
    (shape, corrections): (&mut Shape, &mut Corrections),
    goal: &Goal<'_>,
    wish: &Wish<'_>,
    evaluated: Evaluated,
    (errors, solves_max): ((f64, f64), u32),
) -> Result<Settled, FactorError> {
    let balance = shape.balance(&evaluated, goal);
    // What does not move and is settled is left alone.
    let was_settled = errors.0.is_finite() && balance.residual_rel <= RESIDUAL_SETTLED;
    let is_left_alone = was_settled && wish.error_rel.is_some();
    if !is_left_alone {
        corrections.watch_soft(shape, &balance.residual);
    }
    let mut settling = Settling {
        goal,
        wish,
        solves_end: corrections.counts.linear_solves + solves_max,
        contraction: Contraction::expecting(corrections.theta),
        shape,
        corrections,
        evaluated,
        balance,
        errors,
        best: Best::default(),
        with_this_factor: 0,
        has_stalled: false,
    };
    while !is_left_alone && settling.correct()? {}
    Ok(settling.ended(was_settled))
}

/// Corrections of a shape, while they are made.
struct Settling<'a> {
    shape: &'a mut Shape,
    corrections: &'a mut Corrections,
    goal: &'a Goal<'a>,
    wish: &'a Wish<'a>,
    evaluated: Evaluated,
    balance: Balance,
    errors: (f64, f64),
    contraction: Contraction,
    best: Best,
    /// Corrections with the present factor.
    with_this_factor: u32,
    /// Whether an older factor has stalled already.
    has_stalled: bool,
    /// Count of solves at which corrections end.
    solves_end: u32,
}

impl Settling<'_> {
    /// Makes one correction, or a new factor; says whether another correction may follow.
    fn correct(&mut self) -> Result<bool, FactorError> {
        let is_rounding = self.best.see(self.balance.residual_rel);
        let is_late = (self.wish.is_late)() && self.errors.0.is_finite();
        let is_exact = self.wish.error_rel.is_none();
        if is_rounding && is_exact && !self.has_stalled && self.best.is_stalled() {
            // An old factor stalls too; only what a new one does not better is rounding.
            self.begin_anew()?;
            (self.best, self.has_stalled) = (Best::default(), true);
            return Ok(true);
        }
        let is_spent = self.corrections.counts.linear_solves >= self.solves_end;
        if is_rounding || is_late || is_spent {
            return Ok(false);
        }
        if self.with_this_factor >= SOLVES_WITH_OLD_FACTOR {
            match self.corrections.may_factor(self.wish) {
                true => self.begin_anew()?,
                false => self.with_this_factor = 0,
            }
        }
        let off = self.shape.means_off(self.goal);
        let (step, slope) = self.corrections.downhill(self.shape, &self.balance.residual, &off);
        self.with_this_factor += 1;
        let (size, largest) = ((-slope).max(0.0).sqrt(), node_max(&step));
        self.contraction.see([size, largest]);
        let here = (&self.evaluated, &self.balance);
        let Some(moved) = self.shape.searched(self.goal, here, (&step, slope)) else {
            if self.with_this_factor > 1 && self.corrections.may_factor(self.wish) {
                self.begin_anew()?;
                return Ok(true);
            }
            // What the correction would have been is what the shape is off by.
            self.errors = (largest, size);
            return Ok(false);
        };
        self.corrections.learn(&step, &self.balance.residual, &moved);
        let is_whole = moved.share == 1.0;
        self.shape.q = moved.q;
        (self.evaluated, self.balance) = (moved.evaluated, moved.balance);
        let expected = if is_whole { self.contraction.left_after(largest) } else { largest };
        self.errors = (self.told_error(expected), self.contraction.left_after(size));
        Ok(!self.wish.error_rel.is_some_and(|tolerance| self.is_within(tolerance)))
    }

    /// Makes a factor of the shape as it is now, and expects of corrections what it lets expect.
    fn begin_anew(&mut self) -> Result<(), FactorError> {
        self.corrections.factor(self.shape)?;
        self.contraction = Contraction::expecting(self.corrections.theta);
        self.with_this_factor = 0;
        Ok(())
    }

    /// The error that is told, m, after a correction that lets so much be expected.
    fn told_error(&self, expected: f64) -> f64 {
        let Balance { residual, residual_rel, .. } = &self.balance;
        let of_corrections = SAFETY * (expected + self.corrections.left_along_soft(residual));
        of_corrections.max(ERROR_OF_RESIDUAL * residual_rel * self.shape.size())
    }

    fn is_within(&self, tolerance: f64) -> bool {
        self.errors.0 <= tolerance * self.shape.size()
    }

    fn ended(mut self, was_settled: bool) -> Settled {
        self.corrections.theta = self.contraction.theta;
        let residual_rel = self.balance.residual_rel;
        let is_rounding = self.best.is_rounding() || residual_rel <= RESIDUAL_ROUNDING;
        if is_rounding && !self.errors.0.is_finite() {
            self.errors.0 = 0.0;
        }
        let is_converged = is_rounding
            || match self.wish.error_rel {
                Some(tolerance) => was_settled || self.is_within(tolerance),
                None => residual_rel <= RESIDUAL_SETTLED,
            };
        let is_balanced = is_converged || (self.wish.is_late)();
        let Self { evaluated, balance, errors, .. } = self;
        Settled { evaluated, balance, errors, is_balanced, is_converged }
    }
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
