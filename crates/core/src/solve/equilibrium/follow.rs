//! How a path goes from the shape that was reached to what is asked for: in pieces, each a step of the
//! tangent and then corrections.

use super::followed::Followed;
use super::goal::{Goal, Wish};
use super::inverse::FactorError;
use super::outcome::{Equilibrium, NoEquilibrium};
use super::settle::Settled;
use super::shape::GRADIENT_CHANGE_SMALL;
use crate::fem::hyperelastic::Evaluated;
use crate::solve::vectors::{largest, node_max};

/// Largest change of an element's deformation gradient in one piece of a motion.
const GRADIENT_STEP_MAX: f64 = 0.4;
/// Change of a deformation gradient below which a piece is not cut further because its equilibrium lies
/// elsewhere.
const GRADIENT_STEP_SMALL: f64 = 0.02;
/// Share of the largest displacement that corrections may differ by from where the tangent led.
pub(super) const STRAYED_MIN: f64 = 1e-2;
/// Corrections over the step of the tangent from which on the shape has jumped: near the end of a
/// branch a body grows soft, and corrections are longer than the step without any jump.
pub(super) const JUMP_OVER_STEP: f64 = 5.0;
/// Estimated error at which a frame without motion stops.
const RESTING_ERROR_REL: f64 = 1e-10;
/// Estimated error of a shape from which a motion is tried again that could not be followed.
const SETTLED_ERROR_REL: f64 = 1e-8;
/// Solves of a frame without motion; more than those of an old factor, so that it gets a new one.
const SOLVES_AT_REST: u32 = 5;
/// Solves after which a piece of a motion has no equilibrium.
const SOLVES_OF_A_PIECE_MAX: u32 = 200;
/// Smallest piece of a motion.
pub(super) const PIECE_MIN: f64 = 1.0 / 4096.0;
/// Estimated error of a piece that is not the last one.
const PIECE_ERROR_REL: f64 = 1e-3;

/// How long a motion is followed that fails again and again: a branch that ends is crept towards in
/// ever smaller pieces, and whoever waits for the refusal must not wait long.
#[derive(Clone, Copy)]
pub(super) struct Patience {
    /// Pieces that may fail.
    pub failed_pieces: u32,
    /// Solves of the whole attempt after which no piece may fail.
    pub solves: u32,
}

impl Patience {
    /// Patience with the motion of a frame.
    pub const OF_FRAMES: Self = Self { failed_pieces: 40, solves: u32::MAX };
}

/// Follows the motion from the shape that was reached to the goal.
pub(super) fn follow(
    at: &mut Followed,
    goal: &Goal<'_>,
    wish: &Wish<'_>,
    patience: Patience,
) -> Result<Equilibrium, NoEquilibrium> {
    let way = Wish { error_rel: Some(PIECE_ERROR_REL), ..*wish };
    Following { at, goal, wish, way, tried: Tried::default() }.follow(patience)
}

/// A motion that is followed.
struct Following<'a> {
    at: &'a mut Followed,
    goal: &'a Goal<'a>,
    wish: &'a Wish<'a>,
    /// What is wished for of a shape on the way.
    way: Wish<'a>,
    tried: Tried,
}

impl Following<'_> {
    fn follow(mut self, patience: Patience) -> Result<Equilibrium, NoEquilibrium> {
        let goal = self.goal;
        let motion = self.at.motion(goal);
        let length = largest(&self.at.shape.missing(goal));
        let (mut done, mut piece, mut jumped) = (0.0, self.first_piece(length), false);
        // Of the last balanced shape.
        let mut errors = self.at.errors;
        loop {
            let to = if done + piece > 1.0 - 1e-12 { 1.0 } else { done + piece };
            let part = motion.at(to);
            let before = (self.at.shape.q.clone(), self.at.q_before.clone());
            let wish = if to == 1.0 { *self.wish } else { self.way };
            match self.piece(&part.goal(), &wish) {
                Ok((mut settled, jump)) => {
                    self.at.commit(&mut settled);
                    self.at.corrections.counts.substeps += 1;
                    self.at.forces = part.forces;
                    jumped |= jump;
                    self.at.piece_length = 1.5 * piece * length;
                    if to == 1.0 || self.is_late() {
                        let missing = largest(&self.at.shape.missing(goal));
                        return Ok(self.at.equilibrium(settled, jumped, missing));
                    }
                    (errors, self.at.q_before, done) = (self.at.errors, before.0, to);
                    self.tried.is_fresh = false;
                    piece *= 1.5;
                }
                Err(failed) => {
                    (self.at.shape.q, self.at.q_before) = before;
                    self.at.corrections.forget_steps();
                    if let Failed::Factor(error) = failed {
                        return Err(error.into());
                    }
                    self.at.piece_length = 0.5 * piece * length;
                    if self.is_late()
                        && let Some(part) = self.part_of_the_way(errors)
                    {
                        return Ok(part);
                    }
                    let share = if self.at.was_held_otherwise { 0.0 } else { done };
                    if self.mend(&motion.at(share).goal())? {
                        errors = self.at.errors;
                        continue;
                    }
                    piece *= 0.5;
                    if piece < PIECE_MIN || self.is_over(patience) {
                        let solves = self.at.corrections.counts.linear_solves;
                        let part = self.part_of_the_way(errors);
                        return part.ok_or_else(|| failed.after(done, solves));
                    }
                }
            }
        }
    }

    fn is_late(&self) -> bool {
        (self.wish.is_late)()
    }

    /// Whether a motion is given up of which one more piece has failed.
    fn is_over(&mut self, patience: Patience) -> bool {
        self.tried.failed_pieces += 1;
        self.at.corrections.counts.linear_solves > patience.solves
            || self.tried.failed_pieces > patience.failed_pieces
    }

    /// The share of a motion that is tried first: where time is short, what was too far in the last
    /// frame is not tried again.
    fn first_piece(&self, length: f64) -> f64 {
        if self.wish.part_will_do && self.at.piece_length < length {
            return (self.at.piece_length / length).max(PIECE_MIN);
        }
        1.0
    }

    /// Does what may make the same piece succeed when it is tried again; says whether anything was
    /// left to do.
    fn mend(&mut self, here: &Goal<'_>) -> Result<bool, NoEquilibrium> {
        // What was let go of goes its way first, before the rest is moved.
        if self.at.was_held_otherwise {
            self.at.was_held_otherwise = false;
            self.let_go_in_place(here)?;
            return Ok(true);
        }
        // A step of an older tangent may have led astray: one of this shape first.
        if !self.tried.is_fresh && self.at.corrections.may_factor(self.wish) {
            self.at.corrections.factor(&self.at.shape)?;
            self.tried.is_fresh = true;
            return Ok(true);
        }
        // So may a shape that is only nearly in balance: near the end of a branch there is nothing
        // beside it to follow.
        if self.tried.is_fresh && !self.tried.is_settled {
            self.tried.is_settled = true;
            self.settle_in_place(here);
            return Ok(true);
        }
        Ok(false)
    }

    /// The shape that was reached last, if part of the way will do and it is known how good it is.
    fn part_of_the_way(&mut self, errors: (f64, f64)) -> Option<Equilibrium> {
        if !self.wish.part_will_do || !errors.0.is_finite() {
            return None;
        }
        self.at.errors = errors;
        let missing = largest(&self.at.shape.missing(self.goal));
        let evaluated = self.at.shape.evaluate();
        let forces = self.at.forces.clone();
        let balance = self.at.shape.balance(&evaluated, &Goal { forces: &forces, ..*self.goal });
        let settled =
            Settled { evaluated, balance, errors, is_balanced: true, is_converged: false };
        Some(self.at.equilibrium(settled, false, missing))
    }

    /// Finds the equilibrium of a new hold where it took hold.
    fn let_go_in_place(&mut self, here: &Goal<'_>) -> Result<(), NoEquilibrium> {
        self.at.corrections.factor_if_none(&self.at.shape)?;
        let solves = self.at.corrections.counts.linear_solves;
        let evaluated = self.at.shape.evaluate();
        let mut settled = self
            .settle_at(here, &{ self.way }, evaluated)
            .map_err(|failed| failed.after(0.0, solves))?;
        self.at.commit(&mut settled);
        self.at.corrections.counts.substeps += 1;
        Ok(())
    }

    /// Brings the shape nearer to its equilibrium where it is, if that can be done.
    fn settle_in_place(&mut self, here: &Goal<'_>) {
        let before = (self.at.shape.q.clone(), self.at.errors);
        let wish = Wish { error_rel: Some(SETTLED_ERROR_REL), ..*self.wish };
        let evaluated = self.at.shape.evaluate();
        if self.settle_at(here, &wish, evaluated).is_err() {
            (self.at.shape.q, self.at.errors) = before;
        }
    }

    /// One piece of the motion: a step of the tangent to the new constraints, then corrections.
    fn piece(&mut self, goal: &Goal<'_>, wish: &Wish<'_>) -> Result<(Settled, bool), Failed> {
        self.at.corrections.factor_if_none(&self.at.shape)?;
        let is_loaded_so = goal.forces == self.at.forces.as_slice();
        if is_loaded_so && self.at.shape.missing(goal).iter().all(|missing| *missing == 0.0) {
            let evaluated = self.at.shape.evaluate();
            // What was let go of has a way to go without any constraint that moves.
            if self.at.was_held_otherwise {
                return Ok((self.settle_at(goal, wish, evaluated)?, false));
            }
            // What rests comes nearer to its equilibrium with every frame, in a few solves each.
            let further = Wish { error_rel: wish.error_rel.map(|_| RESTING_ERROR_REL), ..*wish };
            let solves = match wish.error_rel {
                Some(_) => SOLVES_AT_REST,
                None => SOLVES_OF_A_PIECE_MAX,
            };
            // Every step goes downhill, so what comes of it is no worse than what was there.
            let mut settled =
                self.at.settle(goal, &further, evaluated, (self.at.errors, solves))?;
            self.at.errors = settled.errors;
            if wish.error_rel.is_some_and(|budget| settled.errors.0 > budget * self.at.shape.size())
            {
                settled = self.settle_at(goal, wish, settled.evaluated)?;
            }
            return Ok((settled, false));
        }
        let start = self.at.shape.q.clone();
        let moved = self.stepped(goal);
        let step: Vec<f64> = moved.iter().zip(&start).map(|(a, b)| a - b).collect();
        if !step.iter().all(|x| x.is_finite()) {
            return Err(Failed::NotFinite);
        }
        let change = self.at.shape.elements.gradient_change_max(&step);
        let may_invert = || {
            change >= GRADIENT_CHANGE_SMALL
                && self.at.shape.elements.step_limit(&start, &step) < 1.0
        };
        if change > GRADIENT_STEP_MAX || may_invert() {
            return Err(Failed::TooFar);
        }
        self.at.shape.q = moved;
        let evaluated = self.at.shape.evaluate();
        if !evaluated.energy.is_finite() {
            return Err(Failed::TooFar);
        }
        let stepped = self.at.shape.q.clone();
        self.at.errors = (f64::INFINITY, 0.0);
        let settled = self.settle_at(goal, wish, evaluated)?;
        let off: Vec<f64> = self.at.shape.q.iter().zip(&stepped).map(|(a, b)| a - b).collect();
        let (off, step) = (node_max(&off), node_max(&step));
        let slack = STRAYED_MIN * node_max(&self.at.shape.q);
        // Where a smaller piece leads elsewhere as well, the branch ends there.
        match off > step + slack && change > GRADIENT_STEP_SMALL {
            true => Err(Failed::TooFar),
            false => Ok((settled, off > JUMP_OVER_STEP * step + slack)),
        }
    }

    /// Brings the shape into balance at constraints that it meets.
    fn settle_at(
        &mut self,
        goal: &Goal<'_>,
        wish: &Wish<'_>,
        evaluated: Evaluated,
    ) -> Result<Settled, Failed> {
        let settled =
            self.at.settle(goal, wish, evaluated, (self.at.errors, SOLVES_OF_A_PIECE_MAX))?;
        if !settled.is_balanced {
            let residual_rel = settled.balance.residual_rel;
            return Err(Failed::NotBalanced { residual_rel });
        }
        self.at.errors = settled.errors;
        Ok(settled)
    }

    /// Where the tangent leads: first along the last motion as far as the known displacements went
    /// on along it, then to the constraints.
    fn stepped(&mut self, goal: &Goal<'_>) -> Vec<f64> {
        let mut q = self.predicted(goal);
        let mut evaluated = self.at.shape.elements.evaluate(&q);
        if !evaluated.energy.is_finite() {
            // The last motion leads inside out.
            q.clone_from(&self.at.shape.q);
            evaluated = self.at.shape.elements.evaluate(&q);
        }
        let elements = &self.at.shape.elements;
        let times = |v: &[f64]| elements.tangent_times(&q, v);
        let step = self.at.corrections.led(&self.at.shape, goal, (&q, &evaluated), times);
        self.at.corrections.counts.newton_steps += 1;
        q.iter_mut().zip(&step).for_each(|(q, step)| *q += step);
        // The very numbers asked for, not what sums come to.
        for (&dof, &wanted) in self.at.shape.hold.dofs().iter().zip(goal.q_known) {
            q[dof as usize] = wanted;
        }
        q
    }

    /// The shape moved on as it moved last, as far as the constraints do.
    fn predicted(&self, goal: &Goal<'_>) -> Vec<f64> {
        let hold = &self.at.shape.hold;
        let last: Vec<f64> =
            self.at.shape.q.iter().zip(&self.at.q_before).map(|(a, b)| a - b).collect();
        let known_last = hold.dofs().iter().map(|&dof| last[dof as usize]);
        let known_last = known_last.chain(hold.means(&last));
        let (mut along, mut square) = (0.0, 0.0);
        for (wanted, last) in self.at.shape.missing(goal).into_iter().zip(known_last) {
            along += wanted * last;
            square += last * last;
        }
        let share = if square > 0.0 { (along / square).clamp(0.0, 2.0) } else { 0.0 };
        if share == 0.0 {
            return self.at.shape.q.clone();
        }
        self.at.shape.q.iter().zip(&last).map(|(q, d)| q + share * d).collect()
    }
}

/// What was done already where pieces of a motion failed.
#[derive(Default)]
struct Tried {
    /// Whether the factor is that of the shape that was reached.
    is_fresh: bool,
    is_settled: bool,
    failed_pieces: u32,
}

/// Why a piece of a motion did not come to an equilibrium.
enum Failed {
    TooFar,
    NotBalanced { residual_rel: f64 },
    NotFinite,
    Factor(FactorError),
}

impl From<FactorError> for Failed {
    fn from(error: FactorError) -> Self {
        Self::Factor(error)
    }
}

impl Failed {
    fn after(self, share: f64, solves: u32) -> NoEquilibrium {
        match self {
            Self::TooFar => NoEquilibrium::InsideOut { share },
            Self::NotBalanced { residual_rel } => {
                NoEquilibrium::NotConverged { share, solves, residual_rel }
            }
            Self::NotFinite => NoEquilibrium::NotFinite,
            Self::Factor(error) => error.into(),
        }
    }
}
