//! One hand of a grasp by contact with friction: where its bodies were, and what they press with.

use nalgebra::{Isometry3, Vector3};
use softgrasp_core::dynamics::MovingBody;
use softgrasp_grasp::hand::{HAND_BODIES, HandBody};
use softgrasp_protocol::{BodyLoad, BodyShape};

use crate::ask::contact_frame::StepBody;
use crate::run::contact_ledger::HandLoads;

/// Poses of the bodies of a hand, world from body.
pub(super) type BodyPoses = [Isometry3<f64>; HAND_BODIES];
/// Bodies of both hands; `None` for a hand that is not there.
pub type BothHands = [Option<[HandBody; HAND_BODIES]>; 2];

/// One hand of a grasp by contact.
pub struct GraspingHand {
    /// Poses at the end of the last answered step; `None` before the hand was there.
    before: Option<BodyPoses>,
    /// Whether the hand must leave the object before it can touch it.
    pub(super) is_apart: bool,
    /// Force and torque of each body on the object in the last answer; empty before the first one.
    loads: Vec<BodyLoad>,
}

/// Number of segments of a finger.
const SEGMENTS: usize = 3;
/// Number of bodies of all fingers; those of the palm come after them.
const OF_FINGERS: usize = 5 * SEGMENTS;
/// Distance, m, by which a hand was not followed if it moves farther in one step: it must leave the
/// object first.
const LEAP_M: f64 = 0.15;

impl GraspingHand {
    /// A hand that was not there yet; one that begins inside the object must leave it first.
    pub(super) fn new() -> Self {
        Self { before: None, is_apart: true, loads: Vec::new() }
    }

    /// Poses of the bodies of a hand.
    pub(super) fn poses(bodies: &[HandBody; HAND_BODIES]) -> BodyPoses {
        std::array::from_fn(|i| bodies[i].world_from_body)
    }

    /// Meets a hand in these poses; one that has come newly begins there.
    pub(super) fn meet(&mut self, now: &BodyPoses) {
        self.before.get_or_insert(*now);
    }

    /// Begins a step that ends at these poses. A hand that has leapt begins there, away from the object.
    pub(super) fn follow(&mut self, now: &BodyPoses) {
        let before = self.before.get_or_insert(*now);
        let leap = before.iter().zip(now);
        let leap = leap.map(|(a, b)| (a.translation.vector - b.translation.vector).norm());
        if leap.fold(0.0, f64::max) > LEAP_M {
            *before = *now;
            self.is_apart = true;
        }
    }

    /// Ends a step at these poses; `None` for a hand that was not there.
    pub(super) fn end(&mut self, now: Option<BodyPoses>) {
        self.before = now;
    }

    /// Bodies of a step, each with its motion since the last answer.
    ///
    /// Units: `compliance` m/N.
    pub(super) fn step_bodies(
        &self,
        bodies: &[HandBody; HAND_BODIES],
        friction: f64,
        compliance: f64,
    ) -> impl Iterator<Item = StepBody> {
        bodies.iter().enumerate().map(move |(i, body)| {
            let end = body.world_from_body;
            let start = self.before.as_ref().map_or(end, |before| before[i]);
            StepBody {
                moving: MovingBody {
                    shape: body.shape(),
                    world_from_body_start: start,
                    world_from_body_end: end,
                    friction,
                    compliance,
                },
                shape: BodyShape::Capsule { radius: body.radius, length: body.length },
            }
        })
    }

    /// Sets the loads of the last answer, those of a hand that was not there to none.
    pub(super) fn press(&mut self, loads: &[BodyLoad]) {
        self.loads.clear();
        self.loads.extend_from_slice(loads);
    }

    /// Whether the hand was part of the last answered step.
    pub(super) fn was_there(&self) -> bool {
        !self.loads.is_empty()
    }

    /// Whether the hand presses on the object.
    pub fn is_touching(&self) -> bool {
        !self.is_apart && self.loads.iter().any(|load| load.contacts > 0)
    }

    /// Whether each finger presses on the object, thumb first.
    pub fn touching(&self) -> [bool; 5] {
        std::array::from_fn(|digit| self.of_finger(digit).iter().any(|load| load.contacts > 0))
    }

    /// Force of each finger on the object, N, in the world frame, thumb first; zero without contact.
    pub fn finger_forces(&self) -> [Vector3<f64>; 5] {
        let sum = |loads: &[BodyLoad]| loads.iter().map(|load| Vector3::from(load.force)).sum();
        std::array::from_fn(|digit| sum(self.of_finger(digit)))
    }

    /// Loads of the fingers and of the palm in the last answer.
    pub(super) fn loads(&self) -> HandLoads<'_> {
        let palm = self.loads.get(OF_FINGERS..).unwrap_or_default();
        HandLoads::of(|digit| self.of_finger(digit), palm)
    }

    /// Load of every body of the hand; none before the first answer.
    pub(super) fn every_load(&self) -> impl Iterator<Item = &BodyLoad> {
        self.loads.iter()
    }

    /// Loads of the segments of a finger; empty before the first answer.
    fn of_finger(&self, digit: usize) -> &[BodyLoad] {
        let first = SEGMENTS * digit;
        self.loads.get(first..first + SEGMENTS).unwrap_or_default()
    }

    /// Displacement of the shown hand from the measured one, m, in the world frame: each segment of a
    /// finger gives way to the force on it, by this compliance, m/N.
    pub(super) fn pushed_back(&self, compliance: f64) -> [[Vector3<f64>; 3]; 5] {
        let push = |load: &BodyLoad| -compliance * Vector3::from(load.force);
        std::array::from_fn(|digit| {
            let loads = self.of_finger(digit);
            std::array::from_fn(|i| loads.get(i).map_or(Vector3::zeros(), push))
        })
    }
}
