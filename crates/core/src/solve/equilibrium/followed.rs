//! A body that is followed through large deformation: its balanced shape and how it was come to.

use std::sync::Arc;

use super::corrections::Corrections;
use super::goal::{Goal, Motion, Wish};
use super::hold::Hold;
use super::inverse::FactorError;
use super::outcome::Equilibrium;
use super::settle::{RESIDUAL_SETTLED, Settled, settle};
use super::shape::Shape;
use crate::fem::hyperelastic::{Elements, Evaluated};

/// A body that is followed from one balanced shape to the next.
///
/// Shapes: 3N displacements of the system from rest. Units: m, N.
pub(super) struct Followed {
    /// The shape that was reached.
    pub shape: Shape,
    pub corrections: Corrections,
    /// Displacements of the shape before.
    pub q_before: Vec<f64>,
    /// Forces that act at the shape that was reached, 3N or empty, N.
    pub forces: Vec<f64>,
    /// Estimated error of the shape that was reached, m, and in the energy norm.
    pub errors: (f64, f64),
    /// Length of a motion that may be followed in one piece, m; shorter after one that was not.
    pub piece_length: f64,
    /// Whether no equilibrium was found since the body was held in another way.
    pub was_held_otherwise: bool,
}

/// All that an attempt that fails must leave as it was.
#[derive(Clone)]
pub(super) struct Snapshot {
    elements: Arc<Elements>,
    q: Vec<f64>,
    q_before: Vec<f64>,
    forces: Vec<f64>,
    corrections: Corrections,
    errors: (f64, f64),
}

impl Followed {
    /// From a shape on, on which no forces act.
    pub fn new(shape: Shape) -> Self {
        Self {
            q_before: shape.q.clone(),
            shape,
            corrections: Corrections::new(),
            forces: Vec::new(),
            errors: (0.0, 0.0),
            piece_length: f64::INFINITY,
            was_held_otherwise: false,
        }
    }

    /// Holds the body in another way from the same shape on.
    pub fn hold_by(&mut self, hold: Arc<Hold>) {
        let is_same_order = self.shape.hold.has_order_of(&hold);
        self.q_before.clone_from(&self.shape.q);
        self.corrections.hold_by(&hold, is_same_order);
        self.shape.hold = hold;
        self.was_held_otherwise = true;
        // Where the new hold leads is not known yet.
        self.errors = (f64::INFINITY, 0.0);
    }

    /// Goes back to rest.
    pub fn spring_back(&mut self) {
        self.shape.q.fill(0.0);
        self.q_before.fill(0.0);
        self.forces.clear();
        self.corrections.forget();
        self.errors = (0.0, 0.0);
        self.was_held_otherwise = false;
    }

    /// An attempt that began at `before` has reached the present shape.
    pub fn reached_from(&mut self, before: Snapshot) {
        self.q_before = before.q;
        self.was_held_otherwise = false;
    }

    pub fn snapshot(&self) -> Snapshot {
        Snapshot {
            elements: Arc::clone(&self.shape.elements),
            q: self.shape.q.clone(),
            q_before: self.q_before.clone(),
            forces: self.forces.clone(),
            corrections: self.corrections.clone(),
            errors: self.errors,
        }
    }

    pub fn restore(&mut self, before: Snapshot) {
        let Snapshot { elements, q, q_before, forces, corrections, errors } = before;
        (self.shape.elements, self.shape.q) = (elements, q);
        (self.q_before, self.forces, self.errors) = (q_before, forces, errors);
        self.corrections.restore(corrections);
    }

    /// The motion from the shape that was reached to a goal.
    pub fn motion<'a>(&self, goal: &'a Goal<'a>) -> Motion<'a> {
        Motion::begin(&self.shape.hold, &self.shape.q, &self.forces, goal)
    }

    /// Corrects the shape, whose energy and forces are given; see [`settle`].
    pub fn settle(
        &mut self,
        goal: &Goal<'_>,
        wish: &Wish<'_>,
        evaluated: Evaluated,
        known: ((f64, f64), u32),
    ) -> Result<Settled, FactorError> {
        settle((&mut self.shape, &mut self.corrections), goal, wish, evaluated, known)
    }

    /// Makes the plastic flow of a shape that was reached permanent; what is stored then is elastic.
    /// A shape that time cut short is no state of the material: it flows once one is reached.
    pub fn commit(&mut self, settled: &mut Settled) {
        if self.shape.elements.is_plastic() && settled.is_converged {
            Arc::make_mut(&mut self.shape.elements).commit(&self.shape.q);
            settled.evaluated.energy = self.shape.evaluate().energy;
        }
    }

    /// The answer of a settled shape; `missing` is how far the known displacements are from those asked for, m.
    pub fn equilibrium(&self, settled: Settled, jumped: bool, missing: f64) -> Equilibrium {
        let Settled { evaluated, balance, errors: (error, energy_error), .. } = settled;
        let error = error + missing;
        // A shape that has hardly set out is measured by the way that it has to go.
        let largest = self.shape.size().max(missing);
        let external = |dof: usize| self.forces.get(dof).copied().unwrap_or(0.0);
        let of_support = |&dof: &u32| evaluated.forces[dof as usize] - external(dof as usize);
        let reactions = self.shape.hold.dofs().iter().map(of_support);
        let stored = (2.0 * evaluated.energy).max(0.0).sqrt();
        Equilibrium {
            reactions: reactions.collect(),
            residual_rel: balance.residual_rel,
            error_estimate_rel: if largest > 0.0 { error / largest } else { 0.0 },
            energy_error_rel: if stored > 0.0 { energy_error / stored } else { 0.0 },
            energy: evaluated.energy,
            jacobian_min: evaluated.jacobian_min,
            newton_steps: self.corrections.counts.newton_steps,
            linear_solves: self.corrections.counts.linear_solves,
            factors: self.corrections.counts.factors,
            factor_age: self.corrections.factor_age,
            substeps: self.corrections.counts.substeps,
            jumped,
            settled: balance.residual_rel <= RESIDUAL_SETTLED,
            plastic_strain: self.shape.elements.plastic_strain_max(),
            mask_forces: balance.mask_forces,
        }
    }
}
