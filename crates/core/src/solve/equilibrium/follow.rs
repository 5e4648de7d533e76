//! How a path goes from the shape that was reached to what is asked for: in pieces, each a step of the
//! tangent and then corrections.

use std::sync::Arc;

use super::goal::{Goal, Wish};
use super::inverse::FactorError;
use super::motion::Motion;
use super::outcome::{Equilibrium, NoEquilibrium};
use super::path::{Path, Patience};
use super::settle::{GRADIENT_CHANGE_SMALL, RESIDUAL_SETTLED, Settled};
use crate::fem::hyperelastic::Evaluated;
use crate::solve::vectors::{largest, node_max};

/// Largest change of an element's deformation gradient in one piece of a motion.
const GRADIENT_STEP_MAX: f64 = 0.4;
/// Change of a deformation gradient below which a piece is not cut further because its equilibrium lies
/// elsewhere.
const GRADIENT_STEP_SMALL: f64 = 0.02;
/// Share of the largest displacement that corrections may differ by from where the tangent led.
const STRAYED_MIN: f64 = 1e-2;
/// Corrections over the step of the tangent from which on the shape has jumped: near the end of a
/// branch a body grows soft, and corrections are longer than the step without any jump.
const JUMP_OVER_STEP: f64 = 5.0;
/// Estimated error at which a frame without motion stops.
const RESTING_ERROR_REL: f64 = 1e-10;
/// Estimated error of a shape from which a motion is tried again that could not be followed.
const SETTLED_ERROR_REL: f64 = 1e-8;
/// Solves of a frame without motion; more than those of an old factor, so that it gets a new one.
const SOLVES_AT_REST: u32 = 5;
/// Solves after which a piece of a motion has no equilibrium.
const SOLVES_OF_A_PIECE_MAX: u32 = 200;
/// Smallest piece of a motion.
const PIECE_MIN: f64 = 1.0 / 4096.0;
/// Estimated error of a piece that is not the last one.
const PIECE_ERROR_REL: f64 = 1e-3;

impl Path {
    /// Follows the motion from the shape that was reached to the goal.
    pub(super) fn follow(
        &mut self,
        goal: &Goal<'_>,
        wish: &Wish<'_>,
        patience: Patience,
    ) -> Result<Equilibrium, NoEquilibrium> {
        let motion = Motion::begin(self, goal);
        let length = largest(&self.missing(goal));
        let (mut done, mut piece) = (0.0, self.first_piece(length, wish));
        // Whether the factor is that of the shape that was reached.
        let (mut jumped, mut try_again) = (false, Retries::default());
        // Of the last balanced shape.
        let mut errors = self.errors;
        loop {
            let to = if done + piece > 1.0 - 1e-12 { 1.0 } else { done + piece };
            let is_last = to == 1.0;
            let part = motion.at(to);
            let way = Wish { error_rel: Some(PIECE_ERROR_REL), ..*wish };
            let before = (self.q.clone(), self.q_before.clone());
            match self.piece(&part.goal(), if is_last { wish } else { &way }) {
                Ok((mut settled, jump)) => {
                    self.commit(&mut settled);
                    self.counts.substeps += 1;
                    self.forces = part.forces;
                    jumped |= jump;
                    self.piece_length = 1.5 * piece * length;
                    if is_last || (wish.is_late)() {
                        let missing = largest(&self.missing(goal));
                        return Ok(self.equilibrium(settled, jumped, missing));
                    }
                    errors = self.errors;
                    self.q_before = before.0;
                    done = to;
                    try_again.is_fresh = false;
                    piece *= 1.5;
                }
                Err(failed) => {
                    (self.q, self.q_before) = before;
                    self.secants.clear();
                    if let Failed::Factor(error) = failed {
                        return Err(error.into());
                    }
                    self.piece_length = 0.5 * piece * length;
                    if (wish.is_late)()
                        && let Some(part) = self.part_of_the_way(goal, errors, wish)
                    {
                        return Ok(part);
                    }
                    let here = motion.at(if self.was_held_otherwise { 0.0 } else { done });
                    if self.mend(&mut try_again, &here.goal(), (wish, &way))? {
                        errors = self.errors;
                        continue;
                    }
                    piece *= 0.5;
                    try_again.failed_pieces += 1;
                    let is_over = self.counts.linear_solves > patience.solves
                        || try_again.failed_pieces > patience.failed_pieces;
                    if piece < PIECE_MIN || is_over {
                        if let Some(part) = self.part_of_the_way(goal, errors, wish) {
                            return Ok(part);
                        }
                        let solves = self.counts.linear_solves;
                        return Err(failed.after(done, solves));
                    }
                }
            }
        }
    }

    /// The share of a motion that is tried first: where time is short, what was too far in the last
    /// frame is not tried again.
    fn first_piece(&self, length: f64, wish: &Wish<'_>) -> f64 {
        if wish.part_will_do && self.piece_length < length {
            return (self.piece_length / length).max(PIECE_MIN);
        }
        1.0
    }

    /// Does what may make the same piece succeed when it is tried again; says whether anything was
    /// left to do.
    fn mend(
        &mut self,
        try_again: &mut Retries,
        here: &Goal<'_>,
        (wish, way): (&Wish<'_>, &Wish<'_>),
    ) -> Result<bool, NoEquilibrium> {
        // What was let go of goes its way first, before the rest is moved.
        if self.was_held_otherwise {
            self.was_held_otherwise = false;
            self.let_go_in_place(here, way)?;
            return Ok(true);
        }
        // A step of an older tangent may have led astray: one of this shape first.
        if !try_again.is_fresh && self.may_factor(wish) {
            self.factor_here()?;
            try_again.is_fresh = true;
            return Ok(true);
        }
        // So may a shape that is only nearly in balance: near the end of a branch there is nothing
        // beside it to follow.
        if try_again.is_fresh && !try_again.is_settled {
            try_again.is_settled = true;
            self.settle_in_place(here, wish);
            return Ok(true);
        }
        Ok(false)
    }

    /// The shape that was reached last, if part of the way will do and it is known how good it is.
    fn part_of_the_way(
        &mut self,
        goal: &Goal<'_>,
        errors: (f64, f64),
        wish: &Wish<'_>,
    ) -> Option<Equilibrium> {
        if !wish.part_will_do || !errors.0.is_finite() {
            return None;
        }
        self.errors = errors;
        let missing = largest(&self.missing(goal));
        let evaluated = self.elements.evaluate(&self.q);
        let forces = self.forces.clone();
        let balance = self.balance(&evaluated, &Goal { forces: &forces, ..*goal });
        let (error, energy_error) = errors;
        let settled = Settled {
            evaluated,
            balance,
            error,
            energy_error,
            is_balanced: true,
            is_converged: false,
        };
        Some(self.equilibrium(settled, false, missing))
    }

    /// Finds the equilibrium of a new hold where it took hold.
    fn let_go_in_place(&mut self, here: &Goal<'_>, wish: &Wish<'_>) -> Result<(), NoEquilibrium> {
        if self.inverse.is_none() {
            self.factor_here()?;
        }
        let solves = self.counts.linear_solves;
        let evaluated = self.elements.evaluate(&self.q);
        let mut settled =
            self.settle_at(here, wish, evaluated).map_err(|failed| failed.after(0.0, solves))?;
        self.commit(&mut settled);
        self.counts.substeps += 1;
        Ok(())
    }

    /// Brings the shape nearer to its equilibrium where it is, if that can be done.
    fn settle_in_place(&mut self, here: &Goal<'_>, wish: &Wish<'_>) {
        let before = (self.q.clone(), self.errors);
        let wish = Wish { error_rel: Some(SETTLED_ERROR_REL), ..*wish };
        let evaluated = self.elements.evaluate(&self.q);
        if self.settle_at(here, &wish, evaluated).is_err() {
            (self.q, self.errors) = before;
        }
    }

    /// Makes the plastic flow of a shape that was reached permanent; what is stored then is elastic.
    /// A shape that time cut short is no state of the material: it flows once one is reached.
    fn commit(&mut self, settled: &mut Settled) {
        if self.elements.is_plastic() && settled.is_converged {
            Arc::make_mut(&mut self.elements).commit(&self.q);
            settled.evaluated.energy = self.elements.evaluate(&self.q).energy;
        }
    }

    /// One piece of the motion: a step of the tangent to the new constraints, then corrections.
    fn piece(&mut self, goal: &Goal<'_>, wish: &Wish<'_>) -> Result<(Settled, bool), Failed> {
        if self.inverse.is_none() {
            self.factor_here()?;
        }
        let is_loaded_so = goal.forces == self.forces.as_slice();
        if is_loaded_so && self.missing(goal).iter().all(|missing| *missing == 0.0) {
            let evaluated = self.elements.evaluate(&self.q);
            // What was let go of has a way to go without any constraint that moves.
            if self.was_held_otherwise {
                return Ok((self.settle_at(goal, wish, evaluated)?, false));
            }
            // What rests comes nearer to its equilibrium with every frame, in a few solves each.
            let further = Wish { error_rel: wish.error_rel.map(|_| RESTING_ERROR_REL), ..*wish };
            let solves = match wish.error_rel {
                Some(_) => SOLVES_AT_REST,
                None => SOLVES_OF_A_PIECE_MAX,
            };
            // Every step goes downhill, so what comes of it is no worse than what was there.
            let mut settled = self.settle(goal, &further, evaluated, (self.errors, solves))?;
            self.errors = (settled.error, settled.energy_error);
            if wish.error_rel.is_some_and(|budget| settled.error > budget * self.size()) {
                settled = self.settle_at(goal, wish, settled.evaluated)?;
            }
            return Ok((settled, false));
        }
        let start = self.q.clone();
        let moved = self.stepped(goal);
        let step: Vec<f64> = moved.iter().zip(&start).map(|(a, b)| a - b).collect();
        if !step.iter().all(|x| x.is_finite()) {
            return Err(Failed::NotFinite);
        }
        let change = self.elements.gradient_change_max(&step);
        let may_invert =
            || change >= GRADIENT_CHANGE_SMALL && self.elements.step_limit(&start, &step) < 1.0;
        if change > GRADIENT_STEP_MAX || may_invert() {
            return Err(Failed::TooFar);
        }
        self.q = moved;
        let evaluated = self.elements.evaluate(&self.q);
        if !evaluated.energy.is_finite() {
            return Err(Failed::TooFar);
        }
        let stepped = self.q.clone();
        self.errors = (f64::INFINITY, 0.0);
        let settled = self.settle_at(goal, wish, evaluated)?;
        let off: Vec<f64> = self.q.iter().zip(&stepped).map(|(a, b)| a - b).collect();
        let (off, step) = (node_max(&off), node_max(&step));
        let slack = STRAYED_MIN * node_max(&self.q);
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
        let settled = self.settle(goal, wish, evaluated, (self.errors, SOLVES_OF_A_PIECE_MAX))?;
        if !settled.is_balanced {
            let residual_rel = settled.balance.residual_rel;
            return Err(Failed::NotBalanced { residual_rel });
        }
        self.errors = (settled.error, settled.energy_error);
        Ok(settled)
    }

    /// What the known displacements, the masks and the forces still have to go, m and N.
    pub(super) fn missing(&self, goal: &Goal<'_>) -> Vec<f64> {
        let known = self.hold.dofs().iter().map(|&dof| self.q[dof as usize]);
        let known = goal.q_known.iter().zip(known).map(|(wanted, q)| wanted - q);
        let means = self.hold.means(&self.q);
        // Means are sums, so they are met to rounding and not to the bit.
        let size = self.size();
        let masks = goal.mask_q.iter().zip(means).map(|(wanted, mean)| {
            let missing = wanted - mean;
            if missing.abs() <= 1e-12 * size { 0.0 } else { missing }
        });
        known.chain(masks).collect()
    }

    /// Where the tangent leads: first along the last motion as far as the known displacements went
    /// on along it, then to the constraints.
    fn stepped(&mut self, goal: &Goal<'_>) -> Vec<f64> {
        let hold = Arc::clone(&self.hold);
        let mut q = self.predicted(goal);
        let mut evaluated = self.elements.evaluate(&q);
        if !evaluated.energy.is_finite() {
            // The last motion leads inside out.
            q.clone_from(&self.q);
            evaluated = self.elements.evaluate(&q);
        }
        let mut known_step = vec![0.0; q.len()];
        for (&dof, &wanted) in hold.dofs().iter().zip(goal.q_known) {
            known_step[dof as usize] = wanted - q[dof as usize];
        }
        let mut residual = self.balance(&evaluated, goal).residual;
        if known_step.iter().any(|step| *step != 0.0) {
            let coupled = self.elements.tangent_times(&q, &known_step);
            for (r, &dof) in residual.iter_mut().zip(hold.partition.unknown()) {
                *r += coupled[dof as usize];
            }
        }
        let mut means_off: Vec<f64> = hold.means(&q);
        let with_known = hold.means(&known_step);
        for ((off, wanted), known) in means_off.iter_mut().zip(goal.mask_q).zip(with_known) {
            *off = wanted - *off - known;
        }
        // What was learnt is about steps that keep the constraints; this one does not.
        let secants = std::mem::take(&mut self.secants);
        let step = self.correction(&residual, &means_off);
        self.secants = secants;
        self.counts.newton_steps += 1;
        for (&dof, step) in hold.partition.unknown().iter().zip(step) {
            q[dof as usize] += step;
        }
        // The very numbers asked for, not what sums come to.
        for (&dof, &wanted) in hold.dofs().iter().zip(goal.q_known) {
            q[dof as usize] = wanted;
        }
        q
    }

    /// The shape moved on as it moved last, as far as the constraints do.
    fn predicted(&self, goal: &Goal<'_>) -> Vec<f64> {
        let hold = &self.hold;
        let last: Vec<f64> = self.q.iter().zip(&self.q_before).map(|(a, b)| a - b).collect();
        let known_last = hold.dofs().iter().map(|&dof| last[dof as usize]);
        let known_last = known_last.chain(hold.means(&last));
        let (mut along, mut square) = (0.0, 0.0);
        for (wanted, last) in self.missing(goal).into_iter().zip(known_last) {
            along += wanted * last;
            square += last * last;
        }
        let share = if square > 0.0 { (along / square).clamp(0.0, 2.0) } else { 0.0 };
        if share == 0.0 {
            return self.q.clone();
        }
        self.q.iter().zip(&last).map(|(q, d)| q + share * d).collect()
    }

    /// `missing` is how far the known displacements are from those asked for, m.
    pub(super) fn equilibrium(&self, settled: Settled, jumped: bool, missing: f64) -> Equilibrium {
        let Settled { evaluated, balance, error, energy_error, .. } = settled;
        let error = error + missing;
        // A shape that has hardly set out is measured by the way that it has to go.
        let largest = self.size().max(missing);
        let reactions = self.hold.dofs().iter().map(|&dof| evaluated.forces[dof as usize]);
        let stored = (2.0 * evaluated.energy).max(0.0).sqrt();
        Equilibrium {
            reactions: reactions.collect(),
            residual_rel: balance.residual_rel,
            error_estimate_rel: if largest > 0.0 { error / largest } else { 0.0 },
            energy_error_rel: if stored > 0.0 { energy_error / stored } else { 0.0 },
            energy: evaluated.energy,
            jacobian_min: evaluated.jacobian_min,
            newton_steps: self.counts.newton_steps,
            linear_solves: self.counts.linear_solves,
            factors: self.counts.factors,
            factor_age: self.factor_age,
            substeps: self.counts.substeps,
            jumped,
            settled: balance.residual_rel <= RESIDUAL_SETTLED,
            plastic_strain: self.elements.plastic_strain_max(),
            mask_forces: balance.mask_forces,
        }
    }
}

/// What was done already where pieces of a motion failed.
#[derive(Default)]
struct Retries {
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

impl From<NoEquilibrium> for Failed {
    fn from(error: NoEquilibrium) -> Self {
        match error {
            NoEquilibrium::Factor(error) => Self::Factor(error),
            _ => Self::NotFinite,
        }
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
