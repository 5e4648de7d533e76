//! Finds the equilibrium of one request: follows its motion, and where that is lost goes downhill in
//! energy, along other courses too.

use super::cause;
use super::descent::{Descended, Lost, Purse};
use super::goal::{Goal, Wish};
use super::outcome::{Equilibrium, NoEquilibrium};
use super::path::{Path, Patience};
use super::rigid_part::RigidPart;
use crate::solve::vectors::largest;

/// Pieces of the motion that may fail before energy is minimised instead.
const FAILED_PIECES_MAX: u32 = 6;
/// Operations that may be spent on factors of descents: a few seconds.
const OPERATIONS_MAX: f64 = 6e10;
/// Operations of a tangent for each node, about.
const OPERATIONS_OF_A_NODE: f64 = 5e4;
/// Factors of descents at least and at most.
const FACTORS: [f64; 2] = [30.0, 1000.0];
/// Largest diagonal entries of a stiffness at rest, N/m, with which energies stay numbers.
const STIFFNESS_RANGE: std::ops::RangeInclusive<f64> = 1e-100..=1e100;

impl Path {
    /// Goes from rest to what one request asks for: follows the motion of all that is known, and where
    /// that is lost minimises the energy. A large turn is made first, as a rigid motion.
    ///
    /// # Errors
    /// [`NoEquilibrium`] with the cause; the shape is the one before, then.
    ///
    /// # Panics
    /// If the goal does not fit the hold.
    pub fn find(&mut self, goal: &Goal<'_>, wish: &Wish<'_>) -> Result<Equilibrium, NoEquilibrium> {
        let all = [goal.q_known, goal.mask_q, goal.forces].into_iter().flatten();
        if !all.copied().all(f64::is_finite) {
            return Err(NoEquilibrium::NotFinite);
        }
        if !STIFFNESS_RANGE.contains(&self.stiffest) {
            return Err(NoEquilibrium::OutOfRange { stiffness: self.stiffest });
        }
        self.attempt(goal, |path| path.search(goal, wish))
    }

    fn search(&mut self, goal: &Goal<'_>, wish: &Wish<'_>) -> Result<Equilibrium, NoEquilibrium> {
        let before = self.snapshot();
        let nodes = self.pattern.node_count() as f64;
        let operations = self.hold.analysis.flops() + OPERATIONS_OF_A_NODE * nodes;
        let factors = (OPERATIONS_MAX / operations).clamp(FACTORS[0], FACTORS[1]) as u32;
        let mut purse = Purse { factors };
        if let Some(rigid) = RigidPart::of(self, goal) {
            self.q = rigid.displacements(self.pattern.places());
            self.q_before.clone_from(&self.q);
        }
        let followed = match self.follow(
            goal,
            wish,
            Patience { failed_pieces: FAILED_PIECES_MAX, solves: u32::MAX },
        ) {
            Ok(found) => return self.checked(found, goal, wish, &mut purse),
            Err(error) => error,
        };
        // What flowed on the way is not undone by a lower energy; and time that is up stays so.
        let is_hopeless =
            matches!(followed, NoEquilibrium::Factor(super::FactorError::OutOfMemory { .. }));
        if self.elements.is_plastic() || (wish.is_late)() || is_hopeless {
            return Err(followed);
        }
        let lost = match self.descend(goal, wish, &mut purse) {
            Ok(descended) => return Ok(self.descended(descended, goal)),
            Err(lost) => lost,
        };
        let lost_at = self.q.clone();
        // Forces and known displacements may also come one after the other.
        if goal.forces.iter().any(|f| *f != 0.0) {
            let counts = self.counts;
            for forces_first in [false, true] {
                let begun = self.snapshot();
                self.restore(before.clone());
                self.counts = counts;
                if let Ok(descended) =
                    self.one_after_the_other(goal, wish, forces_first, &mut purse)
                {
                    return Ok(self.descended(descended, goal));
                }
                self.restore(begun);
            }
        }
        let begun = self.snapshot();
        let solves = self.counts.linear_solves;
        // Where volume hardly changes, many small pieces sometimes lead further than energy does.
        if self.elements.poisson_max() >= POISSON_OF_SMALL_PIECES {
            let counts = self.counts;
            self.restore(before);
            self.counts = counts;
            let more = (OPERATIONS_OF_SMALL_PIECES / (OPERATIONS_OF_A_CORRECTION * nodes)) as u32;
            let solves = solves + more.min(SOLVES_OF_SMALL_PIECES);
            let patience = Patience { failed_pieces: 40, solves };
            if let Ok(found) = self.follow(goal, wish, patience)
                && self.is_stable(&mut purse).is_ok_and(|is_stable| is_stable)
            {
                return Ok(found);
            }
            self.restore(begun);
        }
        self.q = lost_at;
        Err(cause::of(self, goal, lost))
    }

    /// Known displacements first and then forces, or the other way round.
    fn one_after_the_other(
        &mut self,
        goal: &Goal<'_>,
        wish: &Wish<'_>,
        forces_first: bool,
        purse: &mut Purse,
    ) -> Result<Descended, Lost> {
        let known: Vec<f64> = self.hold.dofs().iter().map(|&dof| self.q[dof as usize]).collect();
        let means = self.hold.means(&self.q);
        let forces = vec![0.0; goal.forces.len()];
        let half = match forces_first {
            true => Goal { q_known: &known, mask_q: &means, forces: goal.forces },
            false => Goal { forces: &forces, ..*goal },
        };
        self.descend(&half, &Wish { error_rel: Some(PART_ERROR_REL), ..*wish }, purse)?;
        let descended = self.descend(goal, wish, purse)?;
        // Not the branch that a motion in proportion leads along, as far as anybody knows.
        Ok(Descended { jumped: true, ..descended })
    }

    fn descended(&self, descended: Descended, goal: &Goal<'_>) -> Equilibrium {
        let Descended { settled, jumped, left } = descended;
        let missing = if left > 0.0 { largest(&self.missing(goal)) } else { 0.0 };
        self.equilibrium(settled, jumped, missing)
    }

    /// An equilibrium that was followed in many pieces, if it is stable; else the one downhill of it.
    fn checked(
        &mut self,
        found: Equilibrium,
        goal: &Goal<'_>,
        wish: &Wish<'_>,
        purse: &mut Purse,
    ) -> Result<Equilibrium, NoEquilibrium> {
        let was_easy = found.substeps <= PIECES_EASY && !found.jumped;
        if was_easy || (wish.is_late)() || self.elements.is_plastic() {
            return Ok(found);
        }
        let reached = self.snapshot();
        if self.is_stable(purse).is_ok_and(|is_stable| is_stable) {
            self.restore(reached);
            return Ok(found);
        }
        match self.descend(goal, wish, purse) {
            Ok(descended) => Ok(self.descended(Descended { jumped: true, ..descended }, goal)),
            Err(lost) => Err(cause::of(self, goal, lost)),
        }
    }
}

/// Poisson's ratio from which on small pieces are tried at last.
const POISSON_OF_SMALL_PIECES: f64 = 0.48;
/// Solves and operations that may go into them.
const SOLVES_OF_SMALL_PIECES: u32 = 1500;
const OPERATIONS_OF_SMALL_PIECES: f64 = 1e10;
/// Operations of a correction for each node, about.
const OPERATIONS_OF_A_CORRECTION: f64 = 2e4;
/// Estimated error of the first of two parts.
const PART_ERROR_REL: f64 = 1e-3;
/// Pieces up to which a motion that was followed has not left the stable branch.
const PIECES_EASY: u32 = 2;
