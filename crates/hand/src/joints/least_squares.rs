//! Least squares on the places of joints: residuals, equations, and the way down to the minimum.

use nalgebra::{Isometry3, Matrix3, Point3, SMatrix, UnitQuaternion, Vector3};
use softgrasp_grasp::hand::{Finger, HandDimensions, JointAngles, pose};

use super::limits::AngleLimits;
use super::normal::{Held, NormalEquations, Step};
use super::places::{digit_places, wrist_in_palm};
use super::record::{JointsRecord, WRIST, digit_joints};
use super::slope::{PER_DIGIT, SHARED, digit_slopes};

/// Slot of the palm arch in [`JointAngles::to_array`].
const ARCH_SLOT: usize = 20;
/// Weight of the wrist: less than one, because trackers do not agree on where it is.
const WRIST_WEIGHT: f64 = 0.25;
/// Weight of the thumb's first joint, the least certain place of the kinematic hand.
const TMJ_WEIGHT: f64 = 0.5;
/// Weight of the fingertips: more than one, because they are what grasps.
const TIP_WEIGHT: f64 = 2.0;
/// Damping at the start, and the least and the most that is tried.
const DAMPING_START: f64 = 1e-3;
const DAMPING_MIN: f64 = 1e-9;
const DAMPING_MAX: f64 = 1e6;
/// The way ends when a step makes the sum of squares smaller by less than this share …
const DECREASE_MIN: f64 = 1e-7;
/// … or when no unknown moves by more than this, m or rad.
const STEP_MIN: f64 = 1e-9;

/// How much the squared distance of a joint counts; zero for those that the kinematic hand lacks.
pub(super) fn weight_of(joint: usize) -> f64 {
    if joint == WRIST {
        return WRIST_WEIGHT;
    }
    let digit = Finger::ALL.into_iter().find(|&finger| digit_joints(finger).contains(&joint));
    match digit.map(|finger| (finger, joint - digit_joints(finger)[0])) {
        None => 0.0,
        Some((Finger::Thumb, 0)) => TMJ_WEIGHT,
        Some((_, 3)) => TIP_WEIGHT,
        Some(_) => 1.0,
    }
}

/// Where a hand is and how its joints are bent.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct HandState {
    pub(super) world_from_palm: Isometry3<f64>,
    pub(super) angles: JointAngles,
}

impl HandState {
    /// The state after a step, angles within their limits.
    fn moved(&self, step: &Step, limits: &AngleLimits) -> Self {
        let shift = Vector3::new(step.shared[0], step.shared[1], step.shared[2]);
        let turn = Vector3::new(step.shared[3], step.shared[4], step.shared[5]);
        let mut world_from_palm = self.world_from_palm;
        world_from_palm.translation.vector += shift;
        let rotation = UnitQuaternion::from_scaled_axis(turn) * world_from_palm.rotation;
        world_from_palm.rotation = UnitQuaternion::new_normalize(rotation.into_inner());
        let mut array = self.angles.to_array();
        for (slot, angle) in array.iter_mut().take(ARCH_SLOT).enumerate() {
            *angle += step.digits[slot / PER_DIGIT][slot % PER_DIGIT];
        }
        array[ARCH_SLOT] += step.shared[SHARED - 1];
        Self { world_from_palm, angles: limits.clamp(&JointAngles::from_array(&array)) }
    }
}

/// Distances that a fit leaves, in m.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Misfit {
    /// Root of the mean squared distance of all joints used, each counted alike.
    pub(super) rms_m: f64,
    /// Largest distance of a joint.
    pub(super) max_m: f64,
    /// Number of joints used.
    pub(super) joints: usize,
}

/// Result of a way down to the minimum: state, cost and number of steps.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Found {
    pub(super) state: HandState,
    /// Weighted sum of squared distances, m².
    pub(super) cost: f64,
    /// Number of times that the equations were set up.
    pub(super) turns: usize,
}

/// The places that a record gives for the joints of the kinematic hand.
#[derive(Clone, Copy, Debug)]
pub(super) struct LeastSquares<'a> {
    dimensions: &'a HandDimensions,
    limits: &'a AngleLimits,
    wrist: Option<Point3<f64>>,
    digits: [[Option<Point3<f64>>; 4]; 5],
    weights: [[f64; 4]; 5],
}

impl<'a> LeastSquares<'a> {
    pub(super) fn new(
        record: &JointsRecord,
        dimensions: &'a HandDimensions,
        limits: &'a AngleLimits,
    ) -> Self {
        let joints = Finger::ALL.map(digit_joints);
        Self {
            dimensions,
            limits,
            wrist: record.position(WRIST),
            digits: joints.map(|digit| digit.map(|joint| record.position(joint))),
            weights: joints.map(|digit| digit.map(weight_of)),
        }
    }

    /// Every joint that is used: its weight, where the hand has it less where the record has it.
    fn residuals(&self, state: &HandState) -> impl Iterator<Item = (f64, Vector3<f64>)> {
        let posed = pose(self.dimensions, &state.angles, state.world_from_palm);
        let wrist = state.world_from_palm * wrist_in_palm(self.dimensions);
        let of_wrist = self.wrist.map(|seen| (WRIST_WEIGHT, wrist - seen));
        let places = digit_places(&posed).into_iter().flatten();
        let seen = self.digits.into_iter().flatten().zip(self.weights.into_iter().flatten());
        let of_digits =
            places.zip(seen).filter_map(|(place, (seen, weight))| Some((weight, place - seen?)));
        of_wrist.into_iter().chain(of_digits)
    }

    /// Weighted sum of squared distances, m².
    pub(super) fn cost(&self, state: &HandState) -> f64 {
        self.residuals(state).map(|(weight, off)| weight * off.norm_squared()).sum()
    }

    /// Distances between the hand and the record.
    pub(super) fn misfit(&self, state: &HandState) -> Misfit {
        let (mut sum, mut max_m, mut joints) = (0.0, 0.0_f64, 0);
        for (_, off) in self.residuals(state) {
            sum += off.norm_squared();
            max_m = max_m.max(off.norm());
            joints += 1;
        }
        let rms_m = if joints > 0 { (sum / joints as f64).sqrt() } else { 0.0 };
        Misfit { rms_m, max_m, joints }
    }

    fn equations(&self, state: &HandState) -> NormalEquations {
        let posed = pose(self.dimensions, &state.angles, state.world_from_palm);
        let palm = state.world_from_palm * Point3::origin();
        let mut equations = NormalEquations::new();
        if let Some(seen) = self.wrist {
            let wrist = state.world_from_palm * wrist_in_palm(self.dimensions);
            let by_shared = by_shared(&(wrist - palm), &Vector3::zeros());
            equations.add_shared(WRIST_WEIGHT, &(wrist - seen), &by_shared);
        }
        for (digit, slope) in
            digit_slopes(self.dimensions, &state.angles, &posed).iter().enumerate()
        {
            for joint in 0..4 {
                let Some(seen) = self.digits[digit][joint] else { continue };
                let place = slope.places[joint];
                let by_shared = by_shared(&(place - palm), &slope.by_arch[joint]);
                let by_angle = SMatrix::from_columns(&slope.by_angle[joint]);
                let weight = self.weights[digit][joint];
                equations.add_digit(digit, weight, &(place - seen), (&by_shared, &by_angle));
            }
        }
        equations
    }

    /// Angles at a limit that the sum of squares pushes against.
    fn held(&self, state: &HandState, equations: &NormalEquations) -> Held {
        let angles = state.angles.to_array();
        let is_held = |slot: usize, gradient: f64| {
            (angles[slot] <= self.limits.low[slot] && gradient > 0.0)
                || (angles[slot] >= self.limits.high[slot] && gradient < 0.0)
        };
        let (by_arch, by_angle) = equations.gradient();
        Held {
            arch: is_held(ARCH_SLOT, by_arch),
            digits: std::array::from_fn(|digit| {
                std::array::from_fn(|i| is_held(PER_DIGIT * digit + i, by_angle[digit][i]))
            }),
        }
    }

    /// Goes down from `start` to the nearest minimum within the limits (Levenberg–Marquardt).
    pub(super) fn descend(&self, start: HandState, turns_max: usize) -> Found {
        let mut found = Found { state: start, cost: self.cost(&start), turns: 0 };
        let mut damping = DAMPING_START;
        while found.turns < turns_max {
            found.turns += 1;
            let equations = self.equations(&found.state);
            let held = self.held(&found.state, &equations);
            let Some((state, cost)) = self.better(&found, &equations, &held, &mut damping) else {
                break;
            };
            let moved = distance(&found.state, &state);
            let decrease = found.cost - cost;
            (found.state, found.cost) = (state, cost);
            if moved < STEP_MIN || decrease < DECREASE_MIN * cost {
                break;
            }
        }
        found
    }

    /// A better state by one damped step, with as little damping as that takes.
    fn better(
        &self,
        found: &Found,
        equations: &NormalEquations,
        held: &Held,
        damping: &mut f64,
    ) -> Option<(HandState, f64)> {
        while *damping <= DAMPING_MAX {
            if let Some(step) = equations.step(*damping, held) {
                let state = found.state.moved(&step, self.limits);
                let cost = self.cost(&state);
                if cost < found.cost {
                    *damping = (*damping * 0.1).max(DAMPING_MIN);
                    return Some((state, cost));
                }
                if distance(&found.state, &state) < STEP_MIN {
                    return None;
                }
            }
            *damping *= 10.0;
        }
        None
    }
}

/// Derivative of a place by palm shift, palm turn and palm arch.
fn by_shared(lever: &Vector3<f64>, by_arch: &Vector3<f64>) -> SMatrix<f64, 3, SHARED> {
    let mut columns = SMatrix::<f64, 3, SHARED>::zeros();
    columns.fixed_columns_mut::<3>(0).copy_from(&Matrix3::identity());
    // A turn w moves the place by w × lever.
    columns.fixed_columns_mut::<3>(3).copy_from(&(-lever.cross_matrix()));
    columns.set_column(SHARED - 1, by_arch);
    columns
}

/// The largest change of any unknown between two states, m or rad.
fn distance(a: &HandState, b: &HandState) -> f64 {
    let shift =
        (a.world_from_palm.translation.vector - b.world_from_palm.translation.vector).amax();
    let turn = a.world_from_palm.rotation.angle_to(&b.world_from_palm.rotation);
    let angles = a.angles.to_array().into_iter().zip(b.angles.to_array());
    angles.map(|(a, b)| (a - b).abs()).fold(shift.max(turn), f64::max)
}
