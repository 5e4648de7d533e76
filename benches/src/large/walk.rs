//! Random walks of a hand: it squeezes, turns, slides, lets go and takes hold again.

use std::sync::Arc;

use nalgebra::Vector3;
use softgrasp_core::contact::Mask;
use softgrasp_core::mesh::BuiltIn;
use softgrasp_core::solve::equilibrium::{Goal, Hold, Path, Wish};

use super::squeeze::Squeeze;
use crate::random::Random;
use crate::report::ReportError;

/// Deepest press of a walk over that of a squeeze: 30 % of the size of a compact object.
const DEPTH_OVER_SQUEEZE: f64 = 0.3 / 0.08;
/// Estimated error that an answer of a walk may have.
const BUDGET: f64 = 2e-3;

/// A hand that walks at random round one object.
pub struct Walk {
    squeeze: Squeeze,
    path: Path,
    random: Random,
    /// Where each tip is, as a share of the size, and where it goes.
    depths: [f64; 5],
    turn: f64,
    slid: [Vector3<f64>; 5],
    /// The hold before, while the hand has taken hold elsewhere and no equilibrium was found yet.
    let_go_of: Option<Arc<Hold>>,
    /// What came of the steps so far.
    pub count: WalkCount,
}

/// What came of the steps of a walk.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct WalkCount {
    /// Steps.
    pub steps: u64,
    /// Steps for which no equilibrium was found; the shape stayed.
    pub refused: u64,
    /// Equilibria that jumped.
    pub jumps: u64,
    /// Times the hand took hold elsewhere.
    pub regrasps: u64,
    /// Smallest volume ratio of an answer.
    pub jacobian_min: f64,
    /// Most solves of a step.
    pub solves_max: u32,
    /// The bits of all shapes, folded into one number.
    pub digest: u64,
}

/// What must never be.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum WalkFault {
    /// An answer with an element inside out.
    #[error("step {step}: an element has the volume ratio {jacobian}")]
    InsideOut {
        /// Step of the walk.
        step: u64,
        /// Smallest volume ratio.
        jacobian: f64,
    },
    /// An answer that is no number.
    #[error("step {step}: a displacement is not a finite number")]
    NotFinite {
        /// Step of the walk.
        step: u64,
    },
    /// An answer whose estimated error is above its budget.
    #[error("step {step}: the estimated error is {estimate}")]
    OverBudget {
        /// Step of the walk.
        step: u64,
        /// Estimated error.
        estimate: f64,
    },
    /// Energy rose while the hand rested.
    #[error("step {step}: at rest the energy rose from {before} J to {after} J")]
    EnergyRose {
        /// Step of the walk.
        step: u64,
        /// Before.
        before: f64,
        /// After.
        after: f64,
    },
    /// The shape changed though its step was refused.
    #[error("step {step}: it was refused and the shape changed")]
    Changed {
        /// Step of the walk.
        step: u64,
    },
}

impl Walk {
    /// A walk round a built-in object.
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

    /// One step, and what it must hold.
    ///
    /// # Errors
    /// [`WalkFault`].
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

    /// Presses or eases every tip, turns, slides; now and then lets go and takes hold again.
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

    /// The hand takes hold with smaller masks in the same places.
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

    /// Means of the masks where the tips are now, m.
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
