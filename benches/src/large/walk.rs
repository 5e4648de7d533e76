//! Random walks of a hand: it squeezes, rotates, slides, lets go and takes hold again.

use std::sync::Arc;

use nalgebra::Vector3;
use softgrasp_core::contact::Mask;
use softgrasp_core::mesh::BuiltIn;
use softgrasp_core::solve::equilibrium::{Goal, Hold, Path, Wish};

use super::squeeze::Squeeze;
use crate::random::Random;
use crate::report::ReportError;

/// Largest depth of a walk, relative to that of a squeeze: 30 % of the size of a compact object.
const DEPTH_OVER_SQUEEZE: f64 = 0.3 / 0.08;
/// Largest estimated error of an answer of a walk, relative.
const BUDGET: f64 = 2e-3;

/// Hand that walks at random around one object.
pub struct Walk {
    squeeze: Squeeze,
    path: Path,
    random: Random,
    /// Depth of each fingertip, relative to the size; then rotation of the hand, rad, and slide of each tip.
    depths: [f64; 5],
    turn: f64,
    slid: [Vector3<f64>; 5],
    /// Earlier hold, while no equilibrium has been found for the present one.
    let_go_of: Option<Arc<Hold>>,
    /// Totals of the steps so far.
    pub count: WalkCount,
}

/// Totals of the steps of a walk.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct WalkCount {
    /// Number of steps.
    pub steps: u64,
    /// Number of steps without an equilibrium; the shape stayed.
    pub refused: u64,
    /// Number of equilibria that jumped to another shape.
    pub jumps: u64,
    /// Number of times that the hand took hold elsewhere.
    pub regrasps: u64,
    /// Smallest ratio of an element's volume to that at rest.
    pub jacobian_min: f64,
    /// Largest number of solves of a step.
    pub solves_max: u32,
    /// Hash of the bits of all shapes.
    pub digest: u64,
}

/// Faults that must never occur in a walk.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum WalkFault {
    /// An answer has an element that is inside out.
    #[error("step {step}: an element has the volume ratio {jacobian}")]
    InsideOut {
        /// Number of the step.
        step: u64,
        /// Smallest ratio of an element's volume to that at rest.
        jacobian: f64,
    },
    /// An answer is not a finite number.
    #[error("step {step}: a displacement is not a finite number")]
    NotFinite {
        /// Number of the step.
        step: u64,
    },
    /// The estimated error of an answer is above its budget.
    #[error("step {step}: the estimated error is {estimate}")]
    OverBudget {
        /// Number of the step.
        step: u64,
        /// Estimated relative error.
        estimate: f64,
    },
    /// The energy rose while the hand did not move.
    #[error("step {step}: at rest the energy rose from {before} J to {after} J")]
    EnergyRose {
        /// Number of the step.
        step: u64,
        /// Energy before the step, J.
        before: f64,
        /// Energy after the step, J.
        after: f64,
    },
    /// The shape changed although its step was refused.
    #[error("step {step}: it was refused and the shape changed")]
    Changed {
        /// Number of the step.
        step: u64,
    },
}

impl Walk {
    /// Walk around a built-in object.
    ///
    /// # Errors
    /// [`ReportError`].
    pub fn new(shape: BuiltIn, nodes: usize, poisson: f64, seed: u64) -> Result<Self, ReportError> {
        let squeeze = Squeeze::new(shape, nodes, poisson)?;
        let path = squeeze.path(true)?;
        let count = WalkCount { jacobian_min: f64::INFINITY, ..WalkCount::default() };
        Ok(Self {
            squeeze,
            path,
            random: Random(seed),
            depths: [0.0; 5],
            turn: 0.0,
            slid: [Vector3::zeros(); 5],
            let_go_of: None,
            count,
        })
    }

    /// Makes one step and checks its answer.
    ///
    /// # Errors
    /// [`WalkFault`] if the check fails.
    pub fn step(&mut self) -> Result<(), WalkFault> {
        let step = self.count.steps;
        self.count.steps += 1;
        let before = (self.depths, self.turn, self.slid);
        let rests = self.random.share() < 0.15;
        if !rests {
            self.move_on();
        }
        let mask_q = self.mask_q();
        let goal = Goal { q_known: &[], mask_q: &mask_q, forces: &[] };
        let wish = Wish { error_rel: Some(BUDGET), ..Wish::EXACT };
        let shape = self.path.displacement().to_vec();
        let energy = self.path.elements().evaluate(&shape).energy;
        let moved_before = self.path.displacement().iter().any(|u| *u != 0.0);
        match self.path.advance(&goal, &wish) {
            Ok(found) => {
                self.let_go_of = None;
                let jacobian = self.path.elements().evaluate(self.path.displacement()).jacobian_min;
                self.count.jacobian_min = self.count.jacobian_min.min(jacobian);
                self.count.solves_max = self.count.solves_max.max(found.linear_solves);
                self.count.jumps += u64::from(found.jumped);
                if jacobian <= 0.0 || jacobian.is_nan() {
                    return Err(WalkFault::InsideOut { step, jacobian });
                }
                if found.error_estimate_rel > BUDGET && !found.settled {
                    let estimate = found.error_estimate_rel;
                    return Err(WalkFault::OverBudget { step, estimate });
                }
                let after = found.energy;
                if rests && moved_before && after > energy * (1.0 + 1e-9) + 1e-15 {
                    return Err(WalkFault::EnergyRose { step, before: energy, after });
                }
            }
            Err(_) => {
                self.count.refused += 1;
                (self.depths, self.turn, self.slid) = before;
                if let Some(hold) = self.let_go_of.take() {
                    self.path.hold_by(hold);
                }
                if self.path.displacement() != shape {
                    return Err(WalkFault::Changed { step });
                }
            }
        }
        if !self.path.displacement().iter().all(|u| u.is_finite()) {
            return Err(WalkFault::NotFinite { step });
        }
        for u in self.path.displacement() {
            self.count.digest = (self.count.digest.rotate_left(5) ^ u.to_bits())
                .wrapping_mul(0x9E37_79B9_7F4A_7C15);
        }
        if let Some(renewal) = self.path.renewal() {
            self.path.install(renewal.make(), 1);
        }
        Ok(())
    }

    /// Moves the hand at random: depth of every tip, rotation, slide; now and then another hold.
    fn move_on(&mut self) {
        let regrasps = self.random.share() < 0.02;
        if regrasps {
            self.count.regrasps += 1;
            self.depths = [0.0; 5];
            (self.turn, self.slid) = (0.0, [Vector3::zeros(); 5]);
            self.let_go();
        }
        let depth_max = DEPTH_OVER_SQUEEZE * self.squeeze.depth();
        let toward = self.random.share() * depth_max;
        for depth in &mut self.depths {
            let pull = 0.15 * (toward - *depth) + 0.1 * depth_max * (self.random.share() - 0.5);
            *depth = (*depth + pull).clamp(0.0, depth_max);
        }
        self.turn = (self.turn + 0.1 * (self.random.share() - 0.5)).clamp(-1.0, 1.0);
        for slid in &mut self.slid {
            let by = Vector3::new(
                self.random.share() - 0.5,
                self.random.share() - 0.5,
                self.random.share() - 0.5,
            );
            *slid = (*slid + by * 0.02).map(|x| x.clamp(-0.08, 0.08));
        }
    }

    /// Takes hold with smaller masks at the same positions.
    fn let_go(&mut self) {
        let smaller = |mask: &Mask| {
            let keep = 3 + (self.count.regrasps as usize) % mask.entries().len().max(1);
            let entries = mask.entries().iter().take(keep).map(|&(n, _)| (n, 1.0)).collect();
            Mask::try_new(entries)
        };
        let masks: Result<Vec<Mask>, _> = self.squeeze.masks.iter().map(smaller).collect();
        let hold = masks
            .ok()
            .and_then(|masks| self.squeeze.model.hold(&[], masks, Some(self.path.hold())).ok());
        if let Some(hold) = hold {
            self.let_go_of = Some(Arc::clone(self.path.hold()));
            self.path.hold_by(Arc::new(hold));
        }
    }

    /// Mean displacements of the masks at the present positions of the fingertips, m.
    fn mask_q(&self) -> Vec<f64> {
        let mut q = Vec::with_capacity(15);
        for (tip, depth) in self.depths.iter().enumerate() {
            let posed = self.squeeze.posed(*depth, self.turn);
            for axis in 0..3 {
                q.push(posed[3 * tip + axis] + self.slid[tip][axis] * self.squeeze.size());
            }
        }
        q
    }
}
