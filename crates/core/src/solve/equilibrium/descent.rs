//! Goes to an equilibrium by minimising the energy at place after place of a motion, with factors of
//! the very shape: slower than following, and not lost where a branch bends or ends.

use std::sync::Arc;

use super::goal::{Goal, Wish};
use super::inverse::{Factor, FactorError, Inverse};
use super::motion::Motion;
use super::path::Path;
use super::settle::Settled;
use crate::fem::Stiffness;
use crate::fem::hyperelastic::{Curvature, Evaluated};
use crate::solve::vectors::{dot, largest, node_max};

/// Why a descent did not get to where it should.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Lost {
    /// Elements at what is moved would turn inside out, however small the step.
    Flattened { share: f64 },
    /// The energy found no lowest point.
    NoMinimum { share: f64, residual_rel: f64 },
    /// Neither the tangent nor its positive part has a factor.
    Singular,
    /// What was allowed to be spent is.
    Spent { share: f64, residual_rel: f64 },
    /// No memory for a factor.
    OutOfMemory { bytes: usize },
}

/// Factors that may still be made, and what a descent has met.
#[derive(Clone, Copy, Debug)]
pub(super) struct Purse {
    pub factors: u32,
}

/// An equilibrium that a descent reached.
pub(super) struct Descended {
    pub settled: Settled,
    /// Whether it lies on another branch than the one it set out on.
    pub jumped: bool,
    /// Share of the motion that was left when time was up.
    pub left: f64,
}

/// The tangent at a shape, with its factor in the path.
struct Tangent {
    stiffness: Stiffness,
    /// Whether it is that of the energy, and not its positive part.
    is_exact: bool,
}

/// Largest change of an element's deformation gradient in one piece.
const GRADIENT_STEP: f64 = 0.35;
/// Largest change of a deformation gradient in one piece, times the root of a material's first Lamé
/// constant over its second.
const GRADIENT_STEP_OF_STIFF_VOLUME: f64 = 5.0;
/// Smallest piece of a motion.
const PIECE_MIN: f64 = 1.0 / 4096.0;
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
/// Corrections over the step of the tangent from which on the shape has jumped.
const JUMP_OVER_STEP: f64 = 5.0;
/// Share of the largest displacement below which that is not told from rounding.
const STRAYED_MIN: f64 = 1e-2;
/// Change of an element's deformation gradient by which a shape is pushed off a saddle.
const PUSH: f64 = 0.03;
/// Pushes off saddles.
const PUSHES_MAX: u32 = 3;

impl Path {
    /// Goes from the shape that was reached to a goal, minimising the energy on the way.
    pub(super) fn descend(
        &mut self,
        goal: &Goal<'_>,
        wish: &Wish<'_>,
        purse: &mut Purse,
    ) -> Result<Descended, Lost> {
        let motion = Motion::begin(self, goal);
        let (mut done, mut cap, mut failed) = (0.0f64, 1.0f64, 0);
        let mut jumped = false;
        // The shape may be in balance at constraints that nothing moved yet, or nearly so.
        self.lower(&motion.at(0.0).goal(), (None, CORRECTIONS_MAX), purse)
            .map_err(|lost| lost.after(done))?;
        while done < 1.0 {
            if (wish.is_late)() {
                break;
            }
            let tangent = self.tangent_here(purse).map_err(|lost| lost.after(done))?;
            let start = self.q.clone();
            let led = self.led(&tangent.stiffness, goal);
            let left: f64 = 1.0 - done;
            let share = self.share_within_reach(&led, left, cap);
            if share.is_nan() || share < PIECE_MIN.min(left) {
                return Err(Lost::Flattened { share: done });
            }
            let to = if done + share > 1.0 - 1e-9 { 1.0 } else { done + share };
            let here = motion.at(to);
            self.q_before.clone_from(&start);
            self.move_along(&led, (to - done) / left, &here.goal());
            let stepped = self.q.clone();
            let is_last_try = failed == FAILED_MAX;
            let most = if is_last_try { CORRECTIONS_MAX } else { CORRECTIONS_OF_A_PIECE };
            let lowered = match self.elements.evaluate(&self.q).energy.is_finite() {
                true => self.lower(&here.goal(), (Some(tangent.is_exact), most), purse),
                false => Err(Lost::Flattened { share: done }),
            };
            match lowered {
                Ok(is_exact) => {
                    let off = apart(&self.q, &stepped);
                    let slack = STRAYED_MIN * self.size();
                    jumped |= off > JUMP_OVER_STEP * apart(&stepped, &start) + slack;
                    jumped |= !is_exact && !tangent.is_exact;
                    (done, cap, failed) = (to, (2.0 * share).min(1.0), 0);
                    self.forces = here.forces;
                    self.counts.substeps += 1;
                }
                Err(lost @ (Lost::Spent { .. } | Lost::OutOfMemory { .. })) => {
                    self.q = start;
                    return Err(lost.after(done));
                }
                Err(lost) => {
                    self.q = start;
                    (cap, failed) = (0.25 * share, failed + 1);
                    if failed > FAILED_MAX || cap < PIECE_MIN {
                        return Err(lost.after(done));
                    }
                }
            }
        }
        let here = motion.at(done);
        let pushed = self.rest_in_a_minimum(&here.goal(), purse).map_err(|l| l.after(done))?;
        let settled = self.settled_here(&here.goal(), wish, done)?;
        Ok(Descended { settled, jumped: jumped || pushed, left: 1.0 - done })
    }

    /// Share of the whole motion that one piece may take of the `left` one that a tangent `led` along.
    fn share_within_reach(&self, led: &[f64], left: f64, cap: f64) -> f64 {
        // What is drawn out already may be drawn out by the same ratio again.
        let step_max = GRADIENT_STEP * self.elements.summary(&self.q).stretch_max.max(1.0);
        let share = cap.min(
            step_max.min(self.step_of_volume()) * left / self.elements.gradient_change_max(led),
        );
        let part: Vec<f64> = led.iter().map(|d| d * (share / left).min(1.0)).collect();
        let limit = self.elements.step_limit(&self.q, &part);
        if limit < 1.0 { 0.8 * limit * share } else { share }
    }

    /// Largest change of an element's deformation gradient that keeps its volume well enough: a tangent
    /// keeps volume to first order only, and what is left, squared, is held against by λ/μ.
    fn step_of_volume(&self) -> f64 {
        let poisson = self.elements.poisson_max();
        let first_over_second = 2.0 * poisson / (1.0 - 2.0 * poisson);
        match first_over_second > 0.0 {
            true => GRADIENT_STEP_OF_STIFF_VOLUME / first_over_second.sqrt(),
            false => f64::INFINITY,
        }
    }

    /// Goes down from a shape that is no minimum, a saddle for one; says whether it had to.
    fn rest_in_a_minimum(&mut self, here: &Goal<'_>, purse: &mut Purse) -> Result<bool, Lost> {
        for pushes in 0..PUSHES_MAX {
            self.lower(here, (None, CORRECTIONS_MAX), purse)?;
            if self.tangent_here(purse)?.is_exact {
                return Ok(pushes > 0);
            }
            let from = self.elements.evaluate(&self.q).energy - dot(here.forces, &self.q);
            let away = self.softest_direction(pushes);
            let size = PUSH / self.elements.gradient_change_max(&away);
            let saddle = self.q.clone();
            let lowest = [size, -size].into_iter().min_by(|a, b| {
                let energy = |share: f64| {
                    let q: Vec<f64> =
                        saddle.iter().zip(&away).map(|(q, d)| q + share * d).collect();
                    self.elements.evaluate(&q).energy - dot(here.forces, &q) - from
                };
                energy(*a).total_cmp(&energy(*b))
            });
            let share = lowest.unwrap_or(size);
            self.q.iter_mut().zip(&away).for_each(|(q, d)| *q += share * d);
        }
        Err(Lost::NoMinimum { share: 1.0, residual_rel: 0.0 })
    }

    /// A direction in which the positive part of the tangent is soft: two inverse iterations from
    /// numbers without pattern.
    fn softest_direction(&mut self, seed: u32) -> Vec<f64> {
        let unknown = self.hold.partition.unknown().len();
        let mut state = 0x9E37_79B9_7F4A_7C15u64 ^ u64::from(seed + 1);
        let mut next = || {
            state ^= state << 13;
            state ^= state >> 7;
            state ^= state << 17;
            (state >> 11) as f64 / (1u64 << 53) as f64 - 0.5
        };
        let mut v: Vec<f64> = (0..unknown).map(|_| next()).collect();
        let none = vec![0.0; self.hold.constraint_count()];
        self.secants.clear();
        for _ in 0..3 {
            let scale = 1.0 / largest(&v).max(f64::MIN_POSITIVE);
            v.iter_mut().for_each(|x| *x *= scale);
            v = self.correction(&v, &none);
        }
        let mut full = vec![0.0; self.q.len()];
        self.hold.partition.scatter_unknown(&v, &mut full);
        full
    }

    /// The last corrections, to what was wished for.
    fn settled_here(
        &mut self,
        here: &Goal<'_>,
        wish: &Wish<'_>,
        done: f64,
    ) -> Result<Settled, Lost> {
        let evaluated = self.elements.evaluate(&self.q);
        let estimate = (f64::INFINITY, 0.0);
        let no_minimum = |residual_rel| Lost::NoMinimum { share: done, residual_rel };
        let settled = self
            .settle(here, wish, evaluated, (estimate, 2 * CORRECTIONS_MAX))
            .map_err(|_| Lost::Singular)?;
        if !settled.is_balanced {
            return Err(no_minimum(settled.balance.residual_rel));
        }
        self.errors = (settled.error, settled.energy_error);
        Ok(settled)
    }

    /// Goes downhill in energy at constraints that are met, until forces are in balance; says whether
    /// the last factor was that of the tangent as it is. `has_factor`: a factor of a shape nearby is
    /// there, and whether it is of the tangent as it is.
    fn lower(
        &mut self,
        here: &Goal<'_>,
        (has_factor, corrections_max): (Option<bool>, u32),
        purse: &mut Purse,
    ) -> Result<bool, Lost> {
        let mut evaluated: Evaluated = self.elements.evaluate(&self.q);
        let mut balance = self.balance(&evaluated, here);
        let (mut is_exact, mut size_before) = (has_factor.unwrap_or(true), f64::INFINITY);
        let mut with_this = if has_factor.is_some() { 1 } else { u32::MAX };
        for _ in 0..corrections_max {
            let residual_rel = balance.residual_rel;
            if residual_rel <= RESIDUAL_OF_A_PIECE {
                return Ok(is_exact);
            }
            if with_this >= CORRECTIONS_WITH_ONE_FACTOR {
                is_exact = self.tangent_here(purse).map_err(|l| l.with(residual_rel))?.is_exact;
                with_this = 0;
            }
            let off = self.means_off(here);
            let step = self.correction(&balance.residual, &off);
            let slope = dot(&balance.residual, &step);
            let size = (-slope).max(0.0).sqrt();
            with_this += 1;
            let Some((moved, after, after_balance)) =
                self.searched(here, &evaluated, &balance, (&step, slope))
            else {
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
            self.counts.newton_steps += 1;
            let change: Vec<f64> =
                after_balance.residual.iter().zip(&balance.residual).map(|(a, b)| a - b).collect();
            self.secants.keep(step.iter().map(|d| moved.share * d).collect(), change);
            if moved.share < 1.0 || size > RATIO_KEPT * size_before {
                with_this = u32::MAX;
            }
            size_before = size;
            self.q = moved.q;
            (evaluated, balance) = (after, after_balance);
        }
        Err(Lost::NoMinimum { share: 0.0, residual_rel: balance.residual_rel })
    }

    /// The tangent here, or its positive part where it has no factor; its factor becomes the path's.
    fn tangent_here(&mut self, purse: &mut Purse) -> Result<Tangent, Lost> {
        if purse.factors == 0 {
            return Err(Lost::Spent { share: 0.0, residual_rel: 0.0 });
        }
        let hold = Arc::clone(&self.hold);
        self.inverse = None;
        let tangent_of = |curvature| self.elements.tangent(&self.pattern, &self.q, curvature);
        let as_it_is = tangent_of(Curvature::AsItIs);
        let mut positive = None;
        for share in SHARES_OF_POSITIVE {
            let mut stiffness = match share {
                0.0 => as_it_is.clone(),
                _ => {
                    let part = positive.get_or_insert_with(|| tangent_of(Curvature::PositivePart));
                    as_it_is.towards(part, share)
                }
            };
            let springs = hold.add_springs(&mut stiffness);
            purse.factors = purse.factors.saturating_sub(1);
            match Factor::try_new(&hold, &stiffness, self.is_single) {
                Ok(factor) => {
                    self.inverse = Some(Arc::new(Inverse::new(&hold, factor, springs)));
                    self.has_new_factor();
                    return Ok(Tangent { stiffness, is_exact: share == 0.0 });
                }
                Err(FactorError::OutOfMemory { bytes }) => return Err(Lost::OutOfMemory { bytes }),
                Err(FactorError::NotPositive) => {}
            }
        }
        Err(Lost::Singular)
    }

    /// Where a tangent leads all the way to a goal, 3N, m.
    fn led(&mut self, tangent: &Stiffness, goal: &Goal<'_>) -> Vec<f64> {
        let hold = Arc::clone(&self.hold);
        let mut step = vec![0.0; self.q.len()];
        for (&dof, &wanted) in hold.dofs().iter().zip(goal.q_known) {
            step[dof as usize] = wanted - self.q[dof as usize];
        }
        let evaluated = self.elements.evaluate(&self.q);
        let mut residual = self.balance(&evaluated, goal).residual;
        let coupled = tangent.mul(&step);
        for (r, &dof) in residual.iter_mut().zip(hold.partition.unknown()) {
            *r += coupled[dof as usize];
        }
        let with_known = hold.means(&step);
        let off: Vec<f64> =
            self.means_off(goal).iter().zip(with_known).map(|(off, known)| off - known).collect();
        self.secants.clear();
        let of_unknown = self.correction(&residual, &off);
        for (&dof, moved) in hold.partition.unknown().iter().zip(of_unknown) {
            step[dof as usize] = moved;
        }
        step
    }

    /// Moves the shape along a step, known degrees of freedom to the very numbers asked for.
    fn move_along(&mut self, step: &[f64], share: f64, here: &Goal<'_>) {
        self.q.iter_mut().zip(step).for_each(|(q, d)| *q += share * d);
        let hold = Arc::clone(&self.hold);
        for (&dof, &wanted) in hold.dofs().iter().zip(here.q_known) {
            self.q[dof as usize] = wanted;
        }
    }

    /// Whether the tangent here has only positive stiffness in what can move.
    pub(super) fn is_stable(&mut self, purse: &mut Purse) -> Result<bool, Lost> {
        Ok(self.tangent_here(purse)?.is_exact)
    }
}

impl Lost {
    /// With the share of the motion that was done before.
    fn after(self, done: f64) -> Self {
        match self {
            Self::Flattened { .. } => Self::Flattened { share: done },
            Self::NoMinimum { residual_rel, .. } => Self::NoMinimum { share: done, residual_rel },
            Self::Spent { residual_rel, .. } => Self::Spent { share: done, residual_rel },
            other => other,
        }
    }

    /// With the residual that was left.
    fn with(self, residual_rel: f64) -> Self {
        match self {
            Self::Spent { share, .. } => Self::Spent { share, residual_rel },
            other => other,
        }
    }
}

/// Largest distance of two displacement fields, m.
fn apart(a: &[f64], b: &[f64]) -> f64 {
    let difference: Vec<f64> = a.iter().zip(b).map(|(a, b)| a - b).collect();
    node_max(&difference)
}
