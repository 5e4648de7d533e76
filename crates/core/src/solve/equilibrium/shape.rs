//! The shape that a held body has, and what is out of balance there.

use std::sync::Arc;

use super::goal::Goal;
use super::hold::Hold;
use super::inverse::Renewal;
use crate::fem::hyperelastic::{Elements, Evaluated};
use crate::fem::{Stiffness, StiffnessPattern};
use crate::solve::vectors::{dot, largest, node_max, norm};

/// A body, what holds it, and its displacement field.
///
/// Shapes: 3N displacements of the system from rest. Units: m, N.
pub(super) struct Shape {
    pub elements: Arc<Elements>,
    pub pattern: Arc<StiffnessPattern>,
    pub hold: Arc<Hold>,
    pub q: Vec<f64>,
    /// Whether factors are made in single precision.
    pub is_single: bool,
    /// Largest entry of the stiffness' diagonal at rest, N/m: what rounding of forces is measured by.
    pub stiffest: f64,
    /// Length below which displacements of this motion are not told apart from nothing, m.
    reference: f64,
}

/// What is out of balance at a shape.
pub(super) struct Balance {
    /// Forces on the unknown degrees of freedom that nothing holds, N.
    pub residual: Vec<f64>,
    /// Forces of the masks, three each, N.
    pub mask_forces: Vec<f64>,
    /// Norm of the residual over that of the forces that hold the body.
    pub residual_rel: f64,
}

/// A shape that a line search went to.
pub(super) struct Moved {
    pub q: Vec<f64>,
    /// Share of the step that was gone.
    pub share: f64,
    pub evaluated: Evaluated,
    pub balance: Balance,
}

/// Residual, relative to the forces that hold the body, that counts as rounding.
pub(super) const RESIDUAL_ROUNDING: f64 = 1e-13;
/// Rounding of forces over stiffness times displacements.
const ROUNDING: f64 = 4e-16;
/// Share of the largest displacement of a path that errors are measured by at least.
const REACH_SHARE: f64 = 1e-3;
/// Change of an element's deformation gradient below which a step needs no limit.
pub(super) const GRADIENT_CHANGE_SMALL: f64 = 0.05;
/// Operations of a solve by conjugate gradients with multigrid for each block of the stiffness: thirty steps,
/// each about six products with it.
const OPERATIONS_OF_CYCLES: f64 = 30.0 * 6.0 * 18.0;
/// How often a line search may cut a step.
const CUTS_MAX: u32 = 25;

impl Shape {
    /// The shape `q` of a body; `stiffness` is that at rest.
    pub fn new(
        elements: Arc<Elements>,
        stiffness: &Stiffness,
        hold: Arc<Hold>,
        q: Vec<f64>,
        is_single: bool,
    ) -> Self {
        let pattern = Arc::clone(stiffness.pattern());
        let stiffest = largest(&stiffness.diagonal());
        Self { elements, pattern, hold, q, is_single, stiffest, reference: 0.0 }
    }

    /// Begins a motion on a path whose largest displacement so far is `reach`, m.
    pub fn begin_motion(&mut self, reach: f64) {
        self.reference = node_max(&self.q).max(REACH_SHARE * reach);
    }

    /// What errors are measured by: the largest displacement of the shape or of the one before, and
    /// a thousandth of the path's largest at least, so that a hand may go back to where it began.
    pub fn size(&self) -> f64 {
        node_max(&self.q).max(self.reference)
    }

    /// Operations of a factor of the tangent, or of a solve by conjugate gradients with multigrid.
    pub fn operations_of_inverse(&self) -> f64 {
        match self.hold.analysis() {
            Some(analysis) => analysis.flops(),
            None => OPERATIONS_OF_CYCLES * self.pattern.block_count() as f64,
        }
    }

    /// Energy and forces of the shape.
    pub fn evaluate(&self) -> Evaluated {
        self.elements.evaluate(&self.q)
    }

    /// A factor of the tangent at this shape, to be made.
    pub fn renewal(&self) -> Renewal {
        Renewal {
            elements: Arc::clone(&self.elements),
            pattern: Arc::clone(&self.pattern),
            hold: Arc::clone(&self.hold),
            q: self.q.clone(),
            is_single: self.is_single,
        }
    }

    /// A field of 3N from numbers of the unknown degrees of freedom; the known ones do not move.
    pub fn scattered(&self, unknown: &[f64]) -> Vec<f64> {
        let mut full = vec![0.0; self.q.len()];
        self.hold.partition.scatter_unknown(unknown, &mut full);
        full
    }

    /// What is out of balance, from forces `∂W/∂u`.
    pub fn balance(&self, evaluated: &Evaluated, goal: &Goal<'_>) -> Balance {
        let hold = &self.hold;
        let unknown = hold.partition.unknown();
        let external = |dof: usize| goal.forces.get(dof).copied().unwrap_or(0.0);
        let out_of_balance = |&dof: &u32| {
            let dof = dof as usize;
            evaluated.forces[dof] - external(dof)
        };
        let mut residual: Vec<f64> = unknown.iter().map(out_of_balance).collect();
        let mask_forces = hold.mask_forces(&residual);
        let before = norm(&residual);
        hold.subtract_mask_forces(&mask_forces, &mut residual);
        let left = norm(&residual);
        let of_masks = (before * before - left * left).max(0.0).sqrt();
        let reactions: Vec<f64> = hold.partition.known().iter().map(out_of_balance).collect();
        let loads = norm(goal.forces);
        let held_by = norm(&[of_masks, norm(&reactions), loads]);
        // Forces of a body that nothing presses are rounding, and so is what they are off by.
        let rounding = ROUNDING * self.stiffest * norm(&self.q).max(self.size());
        let residual_rel = match left <= rounding {
            true => RESIDUAL_ROUNDING.min(if held_by > 0.0 { left / held_by } else { 0.0 }),
            false => left / held_by,
        };
        Balance { residual, mask_forces, residual_rel }
    }

    /// By how much the means of the masks miss what is asked for, m.
    pub fn means_off(&self, goal: &Goal<'_>) -> Vec<f64> {
        let means = self.hold.means(&self.q);
        goal.mask_q.iter().zip(means).map(|(wanted, mean)| wanted - mean).collect()
    }

    /// What the known displacements and the masks still have to go, m.
    pub fn missing(&self, goal: &Goal<'_>) -> Vec<f64> {
        let known = self.hold.dofs().iter().map(|&dof| self.q[dof as usize]);
        let known = goal.q_known.iter().zip(known).map(|(wanted, q)| wanted - q);
        // Means are sums, so they are met to rounding and not to the bit.
        let size = self.size();
        let masks = self.means_off(goal).into_iter();
        let masks = masks.map(|missing| if missing.abs() <= 1e-12 * size { 0.0 } else { missing });
        known.chain(masks).collect()
    }

    /// Goes along a step of the unknown degrees of freedom as far as the energy falls; `None` if it
    /// falls nowhere.
    pub fn searched(
        &self,
        goal: &Goal<'_>,
        (evaluated, balance): (&Evaluated, &Balance),
        (step, slope): (&[f64], f64),
    ) -> Option<Moved> {
        let full = self.scattered(step);
        // So small a step cannot turn an element inside out and back, and what it turns inside out
        // has no finite energy.
        let mut share = match self.elements.gradient_change_max(&full) < GRADIENT_CHANGE_SMALL {
            true => 1.0,
            false => self.elements.step_limit(&self.q, &full),
        };
        let work = |q: &[f64]| dot(goal.forces, q);
        let energy = evaluated.energy - work(&self.q);
        for _ in 0..CUTS_MAX {
            let q: Vec<f64> = self.q.iter().zip(&full).map(|(q, d)| q + share * d).collect();
            let after = self.elements.evaluate(&q);
            if after.energy.is_finite() {
                let after_balance = self.balance(&after, goal);
                let change = after.energy - work(&q) - energy;
                let slope_after = dot(&after_balance.residual, step);
                let falls = change <= 1e-4 * share * slope;
                // Near the bottom the energy's own rounding hides whether it falls; slopes do not.
                let noise = 1e-9 * evaluated.energy.abs();
                let is_flat = change.abs() <= noise && slope_after.abs() <= 0.9 * slope.abs();
                let is_better =
                    after_balance.residual_rel < 0.5 * balance.residual_rel && change <= noise;
                if falls || is_flat || is_better {
                    return Some(Moved { q, share, evaluated: after, balance: after_balance });
                }
                let bend = (slope_after - slope) / share;
                let lowest = if bend > 0.0 { -slope / bend } else { 0.5 * share };
                share = lowest.clamp(0.1 * share, 0.5 * share);
            } else {
                share *= 0.5;
            }
        }
        None
    }
}
