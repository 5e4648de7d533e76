//! Fits the kinematic hand to a record of joints, each record from the fit before it.

use nalgebra::Isometry3;
use softgrasp_grasp::hand::{HandDimensions, Handedness, JointAngles};

use super::least_squares::{Found, HandState, LeastSquares, Misfit, weight_of};
use super::limits::AngleLimits;
use super::record::JointsRecord;
use super::start::{PALM_JOINTS_NEEDED, PALM_SPREAD_NEEDED_M, PalmJoints, angles_of_bones};

/// Most steps of a fit that begins at the last fit.
const WARM_TURNS_MAX: usize = 20;
/// Most steps of a fit that begins at the record alone.
const COLD_TURNS_MAX: usize = 60;
/// The last fit, moved to where the palm is now, is no start if it is farther from the joints than
/// this, m: the hand was lost and found again.
const JUMP_M: f64 = 0.03;
/// A warm fit is checked against a cold one if its rms is larger than the last one's by this, m.
const DOUBT_M: f64 = 0.002;

/// Wrist, and four joints of each digit.
const FITTED_JOINTS: usize = 21;
/// How far joints that are not tracked are closed at the start, in the order of the tries.
const CLOSED_SHARES: [f64; 3] = [0.5, 0.0, 1.0];

/// The kinematic hand that fits a record best.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FittedHand {
    /// Palm frame in the world (`docs/frames.md`).
    pub world_from_palm: Isometry3<f64>,
    /// Joint angles, rad; wrist angles are zero.
    pub angles: JointAngles,
    /// Root of the mean squared distance between joints of the hand and of the record, m.
    pub fit_error_rms_m: f64,
    /// Largest distance between a joint of the hand and of the record, m.
    pub fit_error_max_m: f64,
    /// Number of joints that were fitted, at most 21: wrist, and four of each digit.
    pub joints_used: usize,
    /// Number of steps that were taken.
    pub iterations: usize,
    /// Whether the fit began at the last fit.
    pub is_warm: bool,
}

/// Why a record has no fit.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum FitError {
    /// The palm is not determined by what is tracked of it.
    #[error(
        "{tracked} joints of the palm are tracked, {spread_m:.3} m beside a line; needed are \
         {PALM_JOINTS_NEEDED}, {PALM_SPREAD_NEEDED_M} m beside a line, and wrist or thumb metacarpal \
         among them"
    )]
    NotEnoughJoints {
        /// Number of tracked joints that are fixed to the palm.
        tracked: usize,
        /// How far these joints lie beside a straight line, m.
        spread_m: f64,
    },
    /// The record is of the other hand.
    #[error("the record is of a {got:?} hand, the hand to be fitted is a {expected:?} one")]
    OtherHand {
        /// Side of the hand to be fitted: right or left.
        expected: Handedness,
        /// Side of the record's hand: right or left.
        got: Handedness,
    },
}

/// Fits one hand to one record after the other.
///
/// The result depends on the record and on the last fit only, and the same records give the same
/// bits. Joints that are not tracked do not count; angles of which the tracked joints say nothing
/// stay as they were in the last fit.
#[derive(Clone, Debug)]
pub struct HandFit {
    dimensions: HandDimensions,
    limits: AngleLimits,
    last: Option<FittedHand>,
}

impl HandFit {
    /// A fit of a hand of these dimensions, left or right as they say.
    pub fn new(dimensions: HandDimensions) -> Self {
        Self { dimensions, limits: AngleLimits::default(), last: None }
    }

    /// A fit with other limits of the joint angles.
    #[must_use]
    pub fn with_limits(self, limits: AngleLimits) -> Self {
        Self { limits, ..self }
    }

    /// Dimensions of the hand that is fitted.
    pub const fn dimensions(&self) -> &HandDimensions {
        &self.dimensions
    }

    /// The last fit, if there is one.
    pub const fn last(&self) -> Option<&FittedHand> {
        self.last.as_ref()
    }

    /// Forgets the last fit, so that the next one begins at the record alone.
    pub fn forget(&mut self) {
        self.last = None;
    }

    /// The hand that fits the record best.
    ///
    /// # Errors
    /// [`FitError`] when the record is of the other hand or its palm is not determined; the last
    /// fit is kept.
    pub fn fit(&mut self, record: &JointsRecord) -> Result<FittedHand, FitError> {
        let expected = self.dimensions.handedness;
        if record.hand != expected {
            return Err(FitError::OtherHand { expected, got: record.hand });
        }
        let arch = self.last.map_or(0.0, |last| last.angles.palm_arch);
        let palm_joints = PalmJoints::new(record, &self.dimensions, arch, weight_of);
        let (tracked, spread_m) = (palm_joints.count(), palm_joints.spread());
        let not_enough = FitError::NotEnoughJoints { tracked, spread_m };
        if !palm_joints.are_enough() {
            return Err(not_enough);
        }
        let world_from_palm = palm_joints.world_from_palm().ok_or(not_enough)?;
        let problem = LeastSquares::new(record, &self.dimensions, &self.limits);
        let warm = self.warm(&problem, world_from_palm);
        let (found, is_warm) = match warm {
            Some(found) if !self.is_doubtful(&problem, &found) => (found, true),
            warm => {
                let cold = self.cold(&problem, record).ok_or(not_enough)?;
                match warm {
                    Some(warm) if warm.cost <= cold.cost => (warm, true),
                    _ => (cold, false),
                }
            }
        };
        let fitted = fitted(&problem, &found, is_warm);
        self.last = Some(fitted);
        Ok(fitted)
    }

    /// The fit from the last one, moved to where the palm is now; `None` after a jump.
    fn warm(&self, problem: &LeastSquares, world_from_palm: Isometry3<f64>) -> Option<Found> {
        let start = HandState { world_from_palm, angles: self.last?.angles };
        if problem.misfit(&start).rms_m > JUMP_M {
            return None;
        }
        Some(problem.descend(start, WARM_TURNS_MAX))
    }

    /// Whether the last fit was so much better that this one may have missed the minimum.
    fn is_doubtful(&self, problem: &LeastSquares, found: &Found) -> bool {
        let last_rms = self.last.map_or(0.0, |last| last.fit_error_rms_m);
        problem.misfit(&found.state).rms_m > last_rms + DOUBT_M
    }

    /// The fit from the record alone.
    fn cold(&self, problem: &LeastSquares, record: &JointsRecord) -> Option<Found> {
        let palm_joints = PalmJoints::new(record, &self.dimensions, 0.0, weight_of);
        let world_from_palm = palm_joints.world_from_palm()?;
        let mut best: Option<Found> = None;
        for closed in CLOSED_SHARES {
            let angles =
                angles_of_bones(record, &self.dimensions, &world_from_palm, &self.limits, closed);
            let found = problem.descend(HandState { world_from_palm, angles }, COLD_TURNS_MAX);
            best = best.filter(|best| best.cost <= found.cost).or(Some(found));
            // With all joints there the share of closing is not used.
            let misfit = best.map_or_else(Misfit::default, |best| problem.misfit(&best.state));
            if misfit.joints == FITTED_JOINTS || misfit.rms_m < DOUBT_M {
                break;
            }
        }
        best
    }
}

fn fitted(problem: &LeastSquares, found: &Found, is_warm: bool) -> FittedHand {
    let misfit = problem.misfit(&found.state);
    FittedHand {
        world_from_palm: found.state.world_from_palm,
        angles: found.state.angles,
        fit_error_rms_m: misfit.rms_m,
        fit_error_max_m: misfit.max_m,
        joints_used: misfit.joints,
        iterations: found.turns,
        is_warm,
    }
}

#[cfg(test)]
#[path = "fit_tests.rs"]
mod tests;
