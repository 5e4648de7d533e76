//! Finds the equilibrium of one request: follows its motion, and where that is lost goes downhill in
//! energy, along other courses too.

use super::cause::{self, Lost};
use super::descent::{Descended, Descent};
use super::follow::{Patience, follow};
use super::followed::{Followed, Snapshot};
use super::goal::{Goal, Wish};
use super::outcome::{Equilibrium, NoEquilibrium};
use super::rigid_part::RigidPart;

/// Pieces of the motion that may fail before energy is minimised instead.
const FAILED_PIECES_MAX: u32 = 6;
/// Operations that may be spent on factors of descents: a few seconds.
const OPERATIONS_MAX: f64 = 6e10;
/// Operations of a tangent for each node, about.
const OPERATIONS_OF_A_NODE: f64 = 5e4;
/// Factors of descents at least and at most.
const FACTORS: [f64; 2] = [30.0, 1000.0];
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

/// Goes from rest to a goal: follows the motion of all that is known, and where that is lost minimises
/// the energy. A large turn is made first, as a rigid motion.
pub(super) fn find(
    at: &mut Followed,
    goal: &Goal<'_>,
    wish: &Wish<'_>,
) -> Result<Equilibrium, NoEquilibrium> {
    let before = at.snapshot();
    let nodes = at.shape.pattern.node_count() as f64;
    let operations = at.shape.hold.analysis.flops() + OPERATIONS_OF_A_NODE * nodes;
    let factors = (OPERATIONS_MAX / operations).clamp(FACTORS[0], FACTORS[1]) as u32;
    Search { at, goal, wish, factors }.run(&before)
}

/// A search for the equilibrium of one request.
struct Search<'a> {
    at: &'a mut Followed,
    goal: &'a Goal<'a>,
    wish: &'a Wish<'a>,
    /// Factors that descents may still make.
    factors: u32,
}

impl Search<'_> {
    fn run(mut self, before: &Snapshot) -> Result<Equilibrium, NoEquilibrium> {
        let (goal, wish) = (self.goal, self.wish);
        if let Some(rigid) = RigidPart::of(&self.at.shape, goal) {
            self.at.shape.q = rigid.displacements(self.at.shape.pattern.places());
            self.at.q_before.clone_from(&self.at.shape.q);
        }
        let patience = Patience { failed_pieces: FAILED_PIECES_MAX, solves: u32::MAX };
        let error = match follow(self.at, goal, wish, patience) {
            Ok(found) => return self.checked(found),
            Err(error) => error,
        };
        // What flowed on the way is not undone by a lower energy; and time that is up stays so.
        let is_hopeless =
            matches!(error, NoEquilibrium::Factor(super::FactorError::OutOfMemory { .. }));
        if self.at.shape.elements.is_plastic() || (wish.is_late)() || is_hopeless {
            return Err(error);
        }
        let lost = match self.descent().descend(goal, wish) {
            Ok(descended) => return Ok(descended.equilibrium(self.at, goal)),
            Err(lost) => lost,
        };
        if let Some(found) = self.by_other_courses(before) {
            return Ok(found);
        }
        Err(cause::of(&self.at.shape, goal, lost))
    }

    fn descent(&mut self) -> Descent<'_> {
        Descent { at: self.at, factors: &mut self.factors }
    }

    /// Tries forces and known displacements one after the other, and small pieces; the shape is the
    /// one that the search was lost at if they lead nowhere.
    fn by_other_courses(&mut self, before: &Snapshot) -> Option<Equilibrium> {
        let goal = self.goal;
        let (lost_at, counts) = (self.at.snapshot(), self.at.corrections.counts);
        if goal.forces.iter().any(|f| *f != 0.0) {
            for forces_first in [false, true] {
                self.at.restore(before.clone());
                self.at.corrections.counts = counts;
                if let Ok(descended) = self.one_after_the_other(forces_first) {
                    return Some(descended.equilibrium(self.at, goal));
                }
            }
        }
        // Where volume hardly changes, many small pieces sometimes lead further than energy does.
        if self.at.shape.elements.poisson_max() >= POISSON_OF_SMALL_PIECES {
            self.at.restore(before.clone());
            self.at.corrections.counts = counts;
            let nodes = self.at.shape.pattern.node_count() as f64;
            let more = (OPERATIONS_OF_SMALL_PIECES / (OPERATIONS_OF_A_CORRECTION * nodes)) as u32;
            let solves = counts.linear_solves + more.min(SOLVES_OF_SMALL_PIECES);
            let patience = Patience { failed_pieces: 40, solves };
            if let Ok(found) = follow(self.at, goal, self.wish, patience)
                && self.is_stable()
            {
                return Some(found);
            }
        }
        self.at.restore(lost_at);
        None
    }

    fn is_stable(&mut self) -> bool {
        self.descent().is_stable().is_ok_and(|is_stable| is_stable)
    }

    /// Known displacements first and then forces, or the other way round.
    fn one_after_the_other(&mut self, forces_first: bool) -> Result<Descended, Lost> {
        let (goal, wish, shape) = (self.goal, self.wish, &self.at.shape);
        let known: Vec<f64> = shape.hold.dofs().iter().map(|&dof| shape.q[dof as usize]).collect();
        let means = shape.hold.means(&shape.q);
        let forces = vec![0.0; goal.forces.len()];
        let half = match forces_first {
            true => Goal { q_known: &known, mask_q: &means, forces: goal.forces },
            false => Goal { forces: &forces, ..*goal },
        };
        let mut descent = self.descent();
        descent.descend(&half, &Wish { error_rel: Some(PART_ERROR_REL), ..*wish })?;
        let descended = descent.descend(goal, wish)?;
        // Not the branch that a motion in proportion leads along, as far as anybody knows.
        Ok(descended.jumped())
    }

    /// An equilibrium that was followed in many pieces, if it is stable; else the one downhill of it.
    fn checked(mut self, found: Equilibrium) -> Result<Equilibrium, NoEquilibrium> {
        let was_easy = found.substeps <= PIECES_EASY && !found.jumped;
        if was_easy || (self.wish.is_late)() || self.at.shape.elements.is_plastic() {
            return Ok(found);
        }
        let reached = self.at.snapshot();
        if self.is_stable() {
            self.at.restore(reached);
            return Ok(found);
        }
        let (goal, wish) = (self.goal, self.wish);
        match self.descent().descend(goal, wish) {
            Ok(descended) => Ok(descended.jumped().equilibrium(self.at, goal)),
            Err(lost) => Err(cause::of(&self.at.shape, goal, lost)),
        }
    }
}
