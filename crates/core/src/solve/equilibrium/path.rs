//! A path of equilibria: the shape that was reached, and how the next one is gone to.

use std::sync::Arc;

use super::adjoint::{Adjoint, AdjointLoad, NoAdjoint};
use super::find::find;
use super::follow::{Patience, follow};
use super::followed::Followed;
use super::goal::{Goal, Wish};
use super::hold::Hold;
use super::inverse::{FactorError, Renewal, Renewed};
use super::outcome::{Equilibrium, NoEquilibrium};
use super::shape::Shape;
use crate::fem::Stiffness;
use crate::fem::hyperelastic::Elements;
use crate::solve::vectors::node_max;

/// A path of equilibria of one body, followed from shape to shape.
///
/// Shapes: 3N displacements of the system from rest. Units: m, N.
pub struct Path {
    followed: Followed,
    /// Largest displacement of the path so far, m.
    reach: f64,
    renewal_under_way: bool,
}

/// Largest diagonal entries of a stiffness at rest, N/m, with which energies stay numbers.
const STIFFNESS_RANGE: std::ops::RangeInclusive<f64> = 1e-100..=1e100;

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
        let shape = Shape::new(elements, stiffness, hold, q, is_single);
        Self { followed: Followed::new(shape), reach: 0.0, renewal_under_way: false }
    }

    /// Displacements of the shape that was reached, 3N, m.
    pub fn displacement(&self) -> &[f64] {
        &self.followed.shape.q
    }

    /// Elements of the body, in their plastic state.
    pub fn elements(&self) -> &Arc<Elements> {
        &self.followed.shape.elements
    }

    /// What holds the body now.
    pub fn hold(&self) -> &Arc<Hold> {
        &self.followed.shape.hold
    }

    /// Bytes that it holds in memory.
    pub fn bytes(&self) -> usize {
        // The softest motion and its force are as long as the unknown.
        self.followed.corrections.bytes() + 4 * size_of_val(self.displacement())
    }

    /// Holds the body in another way from the same shape on. A factor stays if only masks change.
    pub fn hold_by(&mut self, hold: Arc<Hold>) {
        if !Arc::ptr_eq(self.hold(), &hold) {
            self.followed.hold_by(hold);
            self.renewal_under_way = false;
        }
    }

    /// Goes back to rest, where the body is in balance by itself: for an elastic body that was let go
    /// of.
    pub fn spring_back(&mut self) {
        self.followed.spring_back();
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
        self.attempt(goal, |at| follow(at, goal, wish, Patience::OF_FRAMES))
    }

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
        if !STIFFNESS_RANGE.contains(&self.followed.shape.stiffest) {
            return Err(NoEquilibrium::OutOfRange { stiffness: self.followed.shape.stiffest });
        }
        self.attempt(goal, |at| find(at, goal, wish))
    }

    /// Tries to reach a goal; where that fails the shape is the one before.
    fn attempt(
        &mut self,
        goal: &Goal<'_>,
        reach: impl FnOnce(&mut Followed) -> Result<Equilibrium, NoEquilibrium>,
    ) -> Result<Equilibrium, NoEquilibrium> {
        let at = &mut self.followed;
        assert_eq!(goal.q_known.len(), at.shape.hold.dofs().len(), "known displacements");
        assert_eq!(goal.mask_q.len(), at.shape.hold.constraint_count(), "displacements of masks");
        let before = at.snapshot();
        at.shape.begin_motion(self.reach);
        at.corrections.begin_frame();
        match reach(at) {
            Ok(found) => {
                at.reached_from(before);
                self.reach = self.reach.max(node_max(&at.shape.q));
                Ok(found)
            }
            Err(error) => {
                at.restore(before);
                Err(error)
            }
        }
    }

    /// The adjoint of the equilibrium that was found last, by the tangent there.
    ///
    /// # Errors
    /// [`NoAdjoint`] with the reason.
    ///
    /// # Panics
    /// If the load does not fit the body and its hold.
    pub fn adjoint(
        &self,
        equilibrium: &Equilibrium,
        load: &AdjointLoad<'_>,
    ) -> Result<Adjoint, NoAdjoint> {
        load.solve(&self.followed.shape, equilibrium)
    }

    /// A factor to be made beside the frames, if the one there is has become old.
    pub fn renewal(&mut self) -> Option<Renewal> {
        if self.renewal_under_way || !self.followed.corrections.take_wish_for_a_factor() {
            return None;
        }
        self.renewal_under_way = true;
        Some(self.followed.shape.renewal())
    }

    /// Takes a factor that was made beside the frames, `age` frames ago; one for another hold is
    /// dropped.
    pub fn install(&mut self, renewed: Result<Renewed, FactorError>, age: u32) {
        self.renewal_under_way = false;
        let Ok(Renewed { hold, mut inverse }) = renewed else { return };
        let now = &self.followed.shape.hold;
        if hold.has_order_of(now) {
            if !Arc::ptr_eq(&hold, now) {
                inverse.fit(now);
            }
            self.followed.corrections.install(inverse, age);
        }
    }
}
