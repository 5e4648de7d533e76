//! A script played in time without seeing the object: what a person does who knows it by heart.

use nalgebra::Isometry3;
use softgrasp_grasp::grasp::StateName;
use softgrasp_grasp::hand::{Finger, JointAngles};
use softgrasp_grasp::object::SoftObject;

use super::grasp_plan::GraspPlan;
use super::hand::{Moment, ScriptedHand};
use super::script::ScriptName;
use super::seen::Seen;
use crate::hand_setup::HandSetup;
use crate::sent::TICKS_PER_S;

/// The motion of a script, one moment per tick.
#[derive(Clone, Debug, PartialEq)]
pub struct Rehearsal {
    /// Moments of the motion, one per tick, at least one.
    moments: Vec<Moment>,
    ticks_per_s: f64,
}

/// How much further than the expected touch a finger closes before it counts as touching.
const BEYOND_TOUCH: f64 = 0.02;
/// Most ticks of a script.
const TICKS_MAX: usize = 5000;

impl Rehearsal {
    /// Plays a script through: the fingers close to where the plan expects the object, and all else
    /// is as in [`ScriptedHand`]. The object stays as it is.
    pub fn of(script: ScriptName, setup: HandSetup, plan: GraspPlan, object: &SoftObject) -> Self {
        let mut hand = ScriptedHand::following(script, setup, plan);
        let mut seen = Seen::default();
        let mut moments = Vec::new();
        while moments.len() < TICKS_MAX {
            let played = hand.play(1, &seen, object);
            moments.push(played.moment);
            if played.over {
                break;
            }
            let touch = hand.plan().touch;
            let reached = |finger: Finger| {
                let digit = finger.index();
                played.moment.closure[digit] >= touch[digit] + BEYOND_TOUCH
            };
            seen.inside = Finger::ALL.map(reached);
            let three = Finger::ALL.into_iter().filter(|f| f.attaches()).all(reached);
            seen.state = match (three, seen.inside == [true; 5]) {
                (_, true) => Some(StateName::Deforming),
                (true, false) => Some(StateName::Attached),
                (false, false) => Some(StateName::Free),
            };
        }
        Self { moments, ticks_per_s: TICKS_PER_S }
    }

    /// Duration of the motion, s.
    pub fn duration_s(&self) -> f64 {
        self.moments.len().saturating_sub(1) as f64 / self.ticks_per_s
    }

    /// Joint angles and palm at a time; before the beginning and after the end the hand rests.
    ///
    /// Units: s, rad, m. Frame: palm in the world.
    pub fn at(&self, time_s: f64) -> (JointAngles, Isometry3<f64>) {
        let last = self.moments.len() - 1;
        let place = (time_s * self.ticks_per_s).clamp(0.0, last as f64);
        // A time that is no number is the beginning.
        let index = (place as usize).min(last);
        let share = if place.is_nan() { 0.0 } else { place - index as f64 };
        let (before, after) = (&self.moments[index], &self.moments[(index + 1).min(last)]);
        let moment = between(before, after, share);
        (moment.angles(), moment.world_from_palm)
    }
}

fn between(before: &Moment, after: &Moment, share: f64) -> Moment {
    let mix = |digit: usize| {
        before.closure[digit] + share * (after.closure[digit] - before.closure[digit])
    };
    let palm = before.world_from_palm.try_lerp_slerp(&after.world_from_palm, share, 1e-9);
    Moment {
        closure: std::array::from_fn(mix),
        posture: before.posture.toward(&after.posture, share),
        // Half a turn within a tick has no shortest way.
        world_from_palm: palm.unwrap_or(after.world_from_palm),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scripted::PlanRequest;
    use softgrasp_core::mesh::{BuiltIn, generate};
    use softgrasp_grasp::object::ContactModel;
    use std::sync::Arc;

    /// All scripts by one plan.
    fn rehearsals() -> (Vec<(ScriptName, Rehearsal)>, GraspPlan) {
        let cube = SoftObject::try_new(generate(BuiltIn::Cube, 216).unwrap()).unwrap();
        let setup = HandSetup::default();
        let object = Arc::clone(cube.rest_shape());
        let request = PlanRequest::new(object, setup.clone(), ContactModel::default());
        let plan = request.grip().unwrap();
        let of = |script| (script, Rehearsal::of(script, setup.clone(), plan, &cube));
        (ScriptName::ALL.map(of).to_vec(), plan)
    }

    fn check_squeeze(squeeze: &Rehearsal, plan: &GraspPlan) {
        assert!((1.0..6.0).contains(&squeeze.duration_s()), "{}", squeeze.duration_s());
        let last = squeeze.moments.last().unwrap();
        for digit in 0..5 {
            // Pressed from where it touched by what the plan presses.
            let pressed = last.closure[digit] - (plan.press[digit] - plan.touch[digit]);
            assert!((pressed - plan.touch[digit] - BEYOND_TOUCH).abs() < 0.02, "{digit} {pressed}");
        }
        assert_eq!(squeeze.at(1e9), squeeze.at(squeeze.duration_s()));
        assert_eq!(squeeze.at(f64::NAN), squeeze.at(0.0));
    }

    #[test]
    fn every_script_comes_to_its_end_and_moves_without_jumps() {
        let (all, plan) = rehearsals();
        for (script, played) in all {
            if script == ScriptName::Squeeze {
                check_squeeze(&played, &plan);
            }
            assert!(played.moments.len() < TICKS_MAX, "{script}");
            for pair in played.moments.windows(2) {
                let step = pair[0].world_from_palm.translation.vector
                    - pair[1].world_from_palm.translation.vector;
                assert!(step.norm() < 0.05, "{script}: {} m in a tick", step.norm());
            }
            // Between two ticks it is between them.
            let (_, palm) = played.at(0.5 / TICKS_PER_S);
            let ends = [0, 1].map(|i| played.moments[i].world_from_palm.translation.vector);
            assert!((palm.translation.vector - (ends[0] + ends[1]) / 2.0).norm() < 1e-12);
        }
    }
}
