//! A path of equilibria: the shape that was reached, and how the next one is gone to.

use std::sync::Arc;

use super::goal::{Goal, Wish};
use super::hold::Hold;
use super::inverse::{FactorError, Inverse};
use super::outcome::{Equilibrium, NoEquilibrium};
use super::renewal::{Renewal, Renewed};
use super::secants::Secants;
use super::soft::Soft;
use crate::fem::hyperelastic::Elements;
use crate::fem::{Stiffness, StiffnessPattern};
use crate::solve::vectors::{largest, node_max};

/// A path of equilibria of one body, followed from shape to shape.
///
/// Shapes: 3N displacements of the system from rest. Units: m, N.
pub struct Path {
    pub(super) elements: Arc<Elements>,
    pub(super) pattern: Arc<StiffnessPattern>,
    pub(super) hold: Arc<Hold>,
    /// The shape that was reached.
    pub(super) q: Vec<f64>,
    /// The one before.
    pub(super) q_before: Vec<f64>,
    /// Forces that act at the shape that was reached, 3N or empty, N.
    pub(super) forces: Vec<f64>,
    pub(super) inverse: Option<Arc<Inverse>>,
    pub(super) is_single: bool,
    /// Largest entry of the stiffness' diagonal at rest, N/m: what rounding of forces is measured by.
    pub(super) stiffest: f64,
    /// Largest displacement of the path so far, m.
    reach: f64,
    /// Length below which displacements of this motion are not told apart from nothing, m.
    reference: f64,
    pub(super) secants: Secants,
    /// How corrections shrank last.
    pub(super) theta: f64,
    /// Estimated error of the shape that was reached, m, and in the energy norm.
    pub(super) errors: (f64, f64),
    pub(super) counts: Counts,
    pub(super) factor_age: u32,
    /// The softest motion that was met.
    pub(super) soft: Option<Soft>,
    /// Whether it was watched in this frame.
    pub(super) is_soft_watched: bool,
    /// Length of a motion that may be followed in one piece, m; shorter after one that was not.
    pub(super) piece_length: f64,
    /// Whether a frame had no time to wait for a factor that it needed.
    wants_factor: bool,
    renewal_under_way: bool,
    /// Whether no equilibrium was found since the body was held in another way.
    pub(super) was_held_otherwise: bool,
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
    /// Of frames.
    pub const OF_FRAMES: Self = Self { failed_pieces: 40, solves: u32::MAX };
}

/// Share of the path's largest displacement that counts as one.
const REACH_SHARE: f64 = 1e-3;
/// Ratio of corrections above which it counts as old, so that a hand that rests gets a new one too.
const THETA_OLD: f64 = 0.87;
/// Expected ratio of corrections with a new factor.
const THETA_NEW: f64 = 0.2;

impl Path {
    /// A path that begins at a shape (at rest: zeros).
    ///
    /// Shapes: `q` 3N of the system. `is_single`: factors in single precision.
    pub fn new(
        elements: Arc<Elements>,
        stiffness: &Stiffness,
        hold: Arc<Hold>,
        q: Vec<f64>,
        is_single: bool,
    ) -> Self {
        Self {
            elements,
            pattern: Arc::clone(stiffness.pattern()),
            hold,
            q_before: q.clone(),
            q,
            forces: Vec::new(),
            inverse: None,
            is_single,
            stiffest: largest(&stiffness.diagonal()),
            reach: 0.0,
            reference: 0.0,
            secants: Secants::default(),
            theta: THETA_NEW,
            errors: (0.0, 0.0),
            counts: Counts::default(),
            factor_age: 0,
            soft: None,
            is_soft_watched: false,
            piece_length: f64::INFINITY,
            wants_factor: false,
            renewal_under_way: false,
            was_held_otherwise: false,
        }
    }

    /// Displacements of the shape that was reached, 3N, m.
    pub fn displacement(&self) -> &[f64] {
        &self.q
    }

    /// The elements.
    pub fn elements(&self) -> &Arc<Elements> {
        &self.elements
    }

    /// What holds the body now.
    pub fn hold(&self) -> &Arc<Hold> {
        &self.hold
    }

    /// What errors are measured by: the largest displacement of the shape or of the one before, and
    /// a thousandth of the path's largest at least, so that a hand may go back to where it began.
    pub(super) fn size(&self) -> f64 {
        node_max(&self.q).max(self.reference)
    }

    /// Bytes held.
    pub fn bytes(&self) -> usize {
        let inverse = self.inverse.as_ref().map_or(0, |inverse| inverse.bytes());
        // The softest motion and its force are as long as the unknown.
        inverse + self.secants.bytes() + 4 * size_of_val(self.q.as_slice())
    }

    /// Holds the body in another way from the same shape on. A factor stays if only masks change.
    pub fn hold_by(&mut self, hold: Arc<Hold>) {
        if Arc::ptr_eq(&self.hold, &hold) {
            return;
        }
        self.secants.clear();
        self.soft = None;
        self.q_before.clone_from(&self.q);
        let is_same_order = Arc::ptr_eq(&self.hold.analysis, &hold.analysis);
        let kept = self.inverse.take().filter(|_| is_same_order);
        // A renewal under way does not hold the inverse, so it is nearly always the path's alone.
        self.inverse = kept.and_then(Arc::into_inner).map(|mut inverse| {
            inverse.fit(&hold);
            Arc::new(inverse)
        });
        self.hold = hold;
        self.renewal_under_way = false;
        self.wants_factor = false;
        self.was_held_otherwise = true;
        // Where the new hold leads is not known yet.
        self.errors = (f64::INFINITY, 0.0);
    }

    /// Goes back to rest, where the body is in balance by itself: for an elastic body that was let go
    /// of.
    pub fn spring_back(&mut self) {
        self.q.fill(0.0);
        self.q_before.fill(0.0);
        self.forces.clear();
        self.secants.clear();
        self.soft = None;
        self.errors = (0.0, 0.0);
        self.was_held_otherwise = false;
    }

    /// Moves known displacements and masks to what is asked for and finds the equilibrium there,
    /// following the motion in as many pieces as it takes.
    ///
    /// # Errors
    /// [`NoEquilibrium`]; the shape is the one before, then.
    ///
    /// # Panics
    /// If the goal does not fit the hold.
    pub fn advance(
        &mut self,
        goal: &Goal<'_>,
        wish: &Wish<'_>,
    ) -> Result<Equilibrium, NoEquilibrium> {
        self.attempt(goal, |path| path.follow(goal, wish, Patience::OF_FRAMES))
    }

    /// Tries to reach a goal; where that fails the shape is the one before.
    pub(super) fn attempt(
        &mut self,
        goal: &Goal<'_>,
        reach: impl FnOnce(&mut Self) -> Result<Equilibrium, NoEquilibrium>,
    ) -> Result<Equilibrium, NoEquilibrium> {
        assert_eq!(goal.q_known.len(), self.hold.dofs().len(), "known displacements");
        assert_eq!(goal.mask_q.len(), self.hold.constraint_count(), "displacements of masks");
        let before = self.snapshot();
        self.reference = node_max(&self.q).max(REACH_SHARE * self.reach);
        self.counts = Counts::default();
        self.is_soft_watched = false;
        self.factor_age += 1;
        match reach(self) {
            Ok(found) => {
                self.q_before = before.q;
                self.reach = self.reach.max(node_max(&self.q));
                self.was_held_otherwise = false;
                Ok(found)
            }
            Err(error) => {
                self.restore(before);
                Err(error)
            }
        }
    }

    /// All that an attempt that fails must leave as it was.
    pub(super) fn snapshot(&self) -> Snapshot {
        Snapshot {
            elements: Arc::clone(&self.elements),
            q: self.q.clone(),
            q_before: self.q_before.clone(),
            forces: self.forces.clone(),
            inverse: self.inverse.clone(),
            secants: self.secants.clone(),
            soft: self.soft.clone(),
            theta: self.theta,
            errors: self.errors,
            counts: self.counts,
            factor_age: self.factor_age,
        }
    }

    pub(super) fn restore(&mut self, before: Snapshot) {
        let Snapshot {
            elements,
            q,
            q_before,
            forces,
            inverse,
            secants,
            soft,
            theta,
            errors,
            counts,
            factor_age,
        } = before;
        self.elements = elements;
        (self.q, self.q_before, self.forces) = (q, q_before, forces);
        (self.inverse, self.secants, self.theta) = (inverse, secants, theta);
        self.soft = soft;
        (self.errors, self.counts, self.factor_age) = (errors, counts, factor_age);
    }

    /// A factor to be made beside the frames, if the one there is has become old.
    pub fn renewal(&mut self) -> Option<Renewal> {
        let took_long =
            self.counts.linear_solves + 10 * self.counts.factors > SOLVES_OF_AN_OLD_FACTOR;
        let is_old = took_long || (self.theta > THETA_OLD && self.counts.linear_solves > 0);
        let is_wanted = (is_old && self.factor_age > 0) || self.wants_factor;
        if !is_wanted || self.renewal_under_way {
            return None;
        }
        self.wants_factor = false;
        self.renewal_under_way = true;
        Some(self.renewal_here())
    }

    /// Whether there is time for a factor now; where not, one is wanted beside the frames.
    pub(super) fn may_factor(&mut self, wish: &Wish<'_>) -> bool {
        let may = (wish.may_factor)();
        self.wants_factor |= !may;
        may
    }

    /// A factor of the shape as it is now, to be made.
    fn renewal_here(&self) -> Renewal {
        Renewal {
            elements: Arc::clone(&self.elements),
            pattern: Arc::clone(&self.pattern),
            hold: Arc::clone(&self.hold),
            q: self.q.clone(),
            is_single: self.is_single,
        }
    }

    /// Takes a factor that was made beside the frames, `age` frames ago; one for another hold is
    /// dropped.
    pub fn install(&mut self, renewed: Result<Renewed, FactorError>, age: u32) {
        self.renewal_under_way = false;
        let Ok(Renewed { hold, mut inverse }) = renewed else { return };
        if Arc::ptr_eq(&hold.analysis, &self.hold.analysis) {
            if !Arc::ptr_eq(&hold, &self.hold) {
                inverse.fit(&self.hold);
            }
            self.inverse = Some(Arc::new(inverse));
            self.secants.clear();
            self.theta = THETA_NEW;
            self.factor_age = age;
        }
    }

    /// Makes a factor of the shape as it is now.
    pub(super) fn factor_here(&mut self) -> Result<(), FactorError> {
        self.inverse = None;
        let Renewed { inverse, .. } = self.renewal_here().make()?;
        self.inverse = Some(Arc::new(inverse));
        self.has_new_factor();
        Ok(())
    }

    /// What follows from a factor of the shape as it is now.
    pub(super) fn has_new_factor(&mut self) {
        self.secants.clear();
        self.theta = THETA_NEW;
        self.factor_age = 0;
        self.counts.factors += 1;
    }
}

/// What a path is before an attempt.
#[derive(Clone)]
pub(super) struct Snapshot {
    elements: Arc<Elements>,
    q: Vec<f64>,
    q_before: Vec<f64>,
    forces: Vec<f64>,
    inverse: Option<Arc<Inverse>>,
    secants: Secants,
    soft: Option<Soft>,
    theta: f64,
    errors: (f64, f64),
    counts: Counts,
    factor_age: u32,
}
