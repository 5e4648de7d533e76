//! Goes to an equilibrium by minimising the energy at place after place of a motion, with factors of
//! the very shape: slower than following, and not lost where a branch bends or ends.

use std::sync::Arc;

use super::cause::Lost;
use super::follow::{JUMP_OVER_STEP, PIECE_MIN, STRAYED_MIN};
use super::followed::Followed;
use super::goal::{Goal, Wish};
use super::inverse::{FactorError, Factored};
use super::outcome::Equilibrium;
use super::settle::Settled;
use super::shape::Shape;
use crate::fem::Stiffness;
use crate::fem::hyperelastic::Evaluated;
use crate::solve::vectors::{dot, largest, node_max};

/// An equilibrium that a descent reached.
pub(super) struct Descended {
    settled: Settled,
    /// Whether it lies on another branch than the one it set out on.
    jumped: bool,
    /// Share of the motion that was left when time was up.
    left: f64,
}

impl Descended {
    /// Lies on another branch, as far as anybody knows.
    pub fn jumped(self) -> Self {
        Self { jumped: true, ..self }
    }

    /// The answer of a body that has descended to a goal.
    pub fn equilibrium(self, at: &Followed, goal: &Goal<'_>) -> Equilibrium {
        let Self { settled, jumped, left } = self;
        let missing = if left > 0.0 { largest(&at.shape.missing(goal)) } else { 0.0 };
        at.equilibrium(settled, jumped, missing)
    }
}

/// A body that goes downhill in energy.
pub(super) struct Descent<'a> {
    pub at: &'a mut Followed,
    /// Factors that may still be made.
    pub factors: &'a mut u32,
}

/// The tangent at a shape, with its factor in the path.
struct Tangent {
    stiffness: Arc<Stiffness>,
    /// Whether it is that of the energy, and not its positive part.
    is_exact: bool,
}

/// Largest change of an element's deformation gradient in one piece.
const GRADIENT_STEP: f64 = 0.35;
/// Largest change of a deformation gradient in one piece, times the root of a material's first Lamé
/// constant over its second.
const GRADIENT_STEP_OF_STIFF_VOLUME: f64 = 5.0;
/// Pieces that may fail one after the other.
const FAILED_MAX: u32 = 5;
/// Corrections at one place, while a smaller piece may be tried instead, and else.
const CORRECTIONS_OF_A_PIECE: u32 = 30;
const CORRECTIONS_MAX: u32 = 100;
/// How much of the way from the tangent to its positive part is gone, the least that has a factor: the
/// positive part alone is stiffer than it need be.
const SHARES_OF_POSITIVE: [f64; 3] = [0.0, 0.25, 1.0];
/// Corrections with one factor.
const CORRECTIONS_WITH_ONE_FACTOR: u32 = 6;
/// Residual at which the next piece begins.
const RESIDUAL_OF_A_PIECE: f64 = 1e-6;
/// Residual with which it may begin where energy's rounding hides what is downhill.
const RESIDUAL_ON_THE_WAY: f64 = 1e-3;
/// Ratio of two corrections up to which a factor is good enough to be kept.
const RATIO_KEPT: f64 = 0.25;
/// Change of an element's deformation gradient by which a shape is pushed off a saddle.
const PUSH: f64 = 0.03;
/// Pushes off saddles.
const PUSHES_MAX: u32 = 3;

impl Descent<'_> {
    /// Goes from the shape that was reached to a goal, minimising the energy on the way.
    pub fn descend(&mut self, goal: &Goal<'_>, wish: &Wish<'_>) -> Result<Descended, Lost> {
        let motion = self.at.motion(goal);
        let (mut done, mut cap, mut failed) = (0.0f64, 1.0f64, 0);
        let mut jumped = false;
        // The shape may be in balance at constraints that nothing moved yet, or nearly so.
        self.lower(&motion.at(0.0).goal(), (None, CORRECTIONS_MAX))
            .map_err(|lost| lost.after(done))?;
        while done < 1.0 {
            if (wish.is_late)() {
                break;
            }
            let tangent = self.tangent_here().map_err(|lost| lost.after(done))?;
            let start = self.at.shape.q.clone();
            let led = self.led(&tangent.stiffness, goal);
            let left: f64 = 1.0 - done;
            let share = self.share_within_reach(&led, left, cap);
            if share.is_nan() || share < PIECE_MIN.min(left) {
                return Err(Lost::Flattened { share: done });
            }
            let to = if done + share > 1.0 - 1e-9 { 1.0 } else { done + share };
            let here = motion.at(to);
            self.at.q_before.clone_from(&start);
            self.move_along(&led, (to - done) / left, &here.goal());
            let stepped = self.at.shape.q.clone();
            let is_last_try = failed == FAILED_MAX;
            let most = if is_last_try { CORRECTIONS_MAX } else { CORRECTIONS_OF_A_PIECE };
            let lowered = match self.at.shape.evaluate().energy.is_finite() {
                true => self.lower(&here.goal(), (Some(tangent.is_exact), most)),
                false => Err(Lost::Flattened { share: done }),
            };
            match lowered {
                Ok(is_exact) => {
                    let off = apart(&self.at.shape.q, &stepped);
                    let slack = STRAYED_MIN * self.at.shape.size();
                    jumped |= off > JUMP_OVER_STEP * apart(&stepped, &start) + slack;
                    jumped |= !is_exact && !tangent.is_exact;
                    (done, cap, failed) = (to, (2.0 * share).min(1.0), 0);
                    self.at.forces = here.forces;
                    self.at.corrections.counts.substeps += 1;
                }
                Err(lost @ (Lost::Spent { .. } | Lost::OutOfMemory { .. })) => {
                    self.at.shape.q = start;
                    return Err(lost.after(done));
                }
                Err(lost) => {
                    self.at.shape.q = start;
                    (cap, failed) = (0.25 * share, failed + 1);
                    if failed > FAILED_MAX || cap < PIECE_MIN {
                        return Err(lost.after(done));
                    }
                }
            }
        }
        let here = motion.at(done);
        let pushed = self.rest_in_a_minimum(&here.goal()).map_err(|l| l.after(done))?;
        let settled = self.settled_here(&here.goal(), wish, done)?;
        Ok(Descended { settled, jumped: jumped || pushed, left: 1.0 - done })
    }

    /// Share of the whole motion that one piece may take of the `left` one that a tangent `led` along.
    fn share_within_reach(&self, led: &[f64], left: f64, cap: f64) -> f64 {
        // What is drawn out already may be drawn out by the same ratio again.
        let step_max =
            GRADIENT_STEP * self.at.shape.elements.summary(&self.at.shape.q).stretch_max.max(1.0);
        let share = cap.min(
            step_max.min(self.step_of_volume()) * left
                / self.at.shape.elements.gradient_change_max(led),
        );
        let part: Vec<f64> = led.iter().map(|d| d * (share / left).min(1.0)).collect();
        let limit = self.at.shape.elements.step_limit(&self.at.shape.q, &part);
        if limit < 1.0 { 0.8 * limit * share } else { share }
    }

    /// Largest change of an element's deformation gradient that keeps its volume well enough: a tangent
    /// keeps volume to first order only, and what is left, squared, is held against by λ/μ.
    fn step_of_volume(&self) -> f64 {
        let poisson = self.at.shape.elements.poisson_max();
        let first_over_second = 2.0 * poisson / (1.0 - 2.0 * poisson);
        match first_over_second > 0.0 {
            true => GRADIENT_STEP_OF_STIFF_VOLUME / first_over_second.sqrt(),
            false => f64::INFINITY,
        }
    }

    /// Goes down from a shape that is no minimum, a saddle for one; says whether it had to.
    fn rest_in_a_minimum(&mut self, here: &Goal<'_>) -> Result<bool, Lost> {
        for pushes in 0..PUSHES_MAX {
            self.lower(here, (None, CORRECTIONS_MAX))?;
            if self.tangent_here()?.is_exact {
                return Ok(pushes > 0);
            }
            let from = self.at.shape.evaluate().energy - dot(here.forces, &self.at.shape.q);
            let away = self.softest_direction(pushes);
            let size = PUSH / self.at.shape.elements.gradient_change_max(&away);
            let saddle = self.at.shape.q.clone();
            let lowest = [size, -size].into_iter().min_by(|a, b| {
                let energy = |share: f64| {
                    let q: Vec<f64> =
                        saddle.iter().zip(&away).map(|(q, d)| q + share * d).collect();
                    self.at.shape.elements.evaluate(&q).energy - dot(here.forces, &q) - from
                };
                energy(*a).total_cmp(&energy(*b))
            });
            let share = lowest.unwrap_or(size);
            self.at.shape.q.iter_mut().zip(&away).for_each(|(q, d)| *q += share * d);
        }
        Err(Lost::NoMinimum { share: 1.0, residual_rel: 0.0 })
    }

    /// A direction in which the positive part of the tangent is soft: two inverse iterations from
    /// numbers without pattern.
    fn softest_direction(&mut self, seed: u32) -> Vec<f64> {
        let unknown = self.at.shape.hold.partition.unknown().len();
        let mut state = 0x9E37_79B9_7F4A_7C15u64 ^ u64::from(seed + 1);
        let mut next = || {
            state ^= state << 13;
            state ^= state >> 7;
            state ^= state << 17;
            (state >> 11) as f64 / (1u64 << 53) as f64 - 0.5
        };
        let mut v: Vec<f64> = (0..unknown).map(|_| next()).collect();
        let none = vec![0.0; self.at.shape.hold.constraint_count()];
        self.at.corrections.forget_steps();
        for _ in 0..3 {
            let scale = 1.0 / largest(&v).max(f64::MIN_POSITIVE);
            v.iter_mut().for_each(|x| *x *= scale);
            v = self.at.corrections.correction(&self.at.shape, &v, &none);
        }
        self.at.shape.scattered(&v)
    }

    /// The last corrections, to what was wished for.
    fn settled_here(
        &mut self,
        here: &Goal<'_>,
        wish: &Wish<'_>,
        done: f64,
    ) -> Result<Settled, Lost> {
        let evaluated = self.at.shape.evaluate();
        let estimate = (f64::INFINITY, 0.0);
        let no_minimum = |residual_rel| Lost::NoMinimum { share: done, residual_rel };
        let settled = self
            .at
            .settle(here, wish, evaluated, (estimate, 2 * CORRECTIONS_MAX))
            .map_err(|_| Lost::Singular)?;
        if !settled.is_balanced {
            return Err(no_minimum(settled.balance.residual_rel));
        }
        self.at.errors = settled.errors;
        Ok(settled)
    }

    /// Goes downhill in energy at constraints that are met, until forces are in balance; says whether
    /// the last factor was that of the tangent as it is. `has_factor`: a factor of a shape nearby is
    /// there, and whether it is of the tangent as it is.
    fn lower(
        &mut self,
        here: &Goal<'_>,
        (has_factor, corrections_max): (Option<bool>, u32),
    ) -> Result<bool, Lost> {
        let mut evaluated: Evaluated = self.at.shape.evaluate();
        let mut balance = self.at.shape.balance(&evaluated, here);
        let (mut is_exact, mut size_before) = (has_factor.unwrap_or(true), f64::INFINITY);
        let mut with_this = if has_factor.is_some() { 1 } else { u32::MAX };
        for _ in 0..corrections_max {
            let residual_rel = balance.residual_rel;
            if residual_rel <= RESIDUAL_OF_A_PIECE {
                return Ok(is_exact);
            }
            if with_this >= CORRECTIONS_WITH_ONE_FACTOR {
                is_exact = self.tangent_here().map_err(|l| l.with(residual_rel))?.is_exact;
                with_this = 0;
            }
            let off = self.at.shape.means_off(here);
            let step = self.at.corrections.correction(&self.at.shape, &balance.residual, &off);
            let slope = dot(&balance.residual, &step);
            let size = (-slope).max(0.0).sqrt();
            with_this += 1;
            let here_is = (&evaluated, &balance);
            let Some(moved) = self.at.shape.searched(here, here_is, (&step, slope)) else {
                if with_this > 1 {
                    with_this = u32::MAX;
                    continue;
                }
                // A shape on the way need not be exact; the last one is settled by itself.
                let is_settled = residual_rel <= RESIDUAL_ON_THE_WAY;
                return match is_settled {
                    true => Ok(is_exact),
                    false => Err(Lost::NoMinimum { share: 0.0, residual_rel }),
                };
            };
            self.at.corrections.learn(&step, &balance.residual, &moved);
            if moved.share < 1.0 || size > RATIO_KEPT * size_before {
                with_this = u32::MAX;
            }
            size_before = size;
            self.at.shape.q = moved.q;
            (evaluated, balance) = (moved.evaluated, moved.balance);
        }
        Err(Lost::NoMinimum { share: 0.0, residual_rel: balance.residual_rel })
    }

    /// The tangent here, or its positive part where it has no factor; its factor becomes the path's.
    fn tangent_here(&mut self) -> Result<Tangent, Lost> {
        if *self.factors == 0 {
            return Err(Lost::Spent { share: 0.0, residual_rel: 0.0 });
        }
        self.at.corrections.drop_factor();
        let Shape { elements, pattern, hold, q, is_single, .. } = &self.at.shape;
        let factors = &mut *self.factors;
        let shares =
            SHARES_OF_POSITIVE.into_iter().inspect(|_| *factors = factors.saturating_sub(1));
        let tangent_of = |curvature| elements.tangent(pattern, q, curvature);
        match Factored::try_new(hold, *is_single, shares, tangent_of) {
            Ok(Factored { inverse, stiffness, share }) => {
                self.at.corrections.take(inverse);
                Ok(Tangent { stiffness, is_exact: share == 0.0 })
            }
            Err(FactorError::OutOfMemory { bytes }) => Err(Lost::OutOfMemory { bytes }),
            Err(FactorError::NotPositive) => Err(Lost::Singular),
        }
    }

    /// Where a tangent leads all the way to a goal, 3N, m.
    fn led(&mut self, tangent: &Stiffness, goal: &Goal<'_>) -> Vec<f64> {
        let Followed { shape, corrections, .. } = &mut *self.at;
        let evaluated = shape.evaluate();
        corrections.led(shape, goal, (&shape.q, &evaluated), |step| tangent.mul(step))
    }

    /// Moves the shape along a step, known degrees of freedom to the very numbers asked for.
    fn move_along(&mut self, step: &[f64], share: f64, here: &Goal<'_>) {
        self.at.shape.q.iter_mut().zip(step).for_each(|(q, d)| *q += share * d);
        for (&dof, &wanted) in self.at.shape.hold.dofs().iter().zip(here.q_known) {
            self.at.shape.q[dof as usize] = wanted;
        }
    }

    /// Whether the tangent here has only positive stiffness in what can move.
    pub fn is_stable(&mut self) -> Result<bool, Lost> {
        Ok(self.tangent_here()?.is_exact)
    }
}

/// Largest distance of two displacement fields, m.
fn apart(a: &[f64], b: &[f64]) -> f64 {
    let difference: Vec<f64> = a.iter().zip(b).map(|(a, b)| a - b).collect();
    node_max(&difference)
}
