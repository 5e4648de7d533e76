//! Plays a script step by step, and sends what glove and tracker would send meanwhile.

use std::sync::Arc;

use nalgebra::{Isometry3, Point3, UnitQuaternion, Vector3};
use softgrasp_grasp::grasp::{Command, StateName};
use softgrasp_grasp::hand::{Finger, JointAngles};
use softgrasp_grasp::object::{ContactModel, SoftObject};

use super::approach::{BACK_OFF, PalmPath, above_ground};
use super::grasp_plan::GraspPlan;
use super::lay::Lay;
use super::planner::{NoGrasp, PlanRequest, Planner};
use super::posture::{Posture, angles};
use super::script::{ScriptName, Step};
use super::seen::Seen;
use crate::hand_setup::HandSetup;
use crate::sent::Sent;

/// Fingers, posture and palm of the hand at one moment.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Moment {
    /// How far each finger is closed, 0 to 1, thumb first.
    pub(super) closure: [f64; 5],
    /// Posture of the hand.
    pub(super) posture: Posture,
    /// Pose of the palm in the world.
    pub(super) world_from_palm: Isometry3<f64>,
}

impl Moment {
    /// Joint angles of the hand at this moment.
    pub(super) fn angles(&self) -> JointAngles {
        angles(&self.closure, self.posture)
    }
}

/// Outcome of the ticks of a script that were played.
pub(super) struct Played {
    /// Fingers, posture and palm after the last tick that was played.
    pub(super) moment: Moment,
    /// Menu command that the script gives.
    pub(super) command: Option<Command>,
    /// Whether the script is over.
    pub(super) over: bool,
}

/// The scripted hand.
pub struct ScriptedHand {
    setup: HandSetup,
    contact: ContactModel,
    planner: Planner,
    /// A plan has been asked for and is not there yet.
    planning: bool,
    /// The script begins with a plan for the object as it is then.
    plans_first: bool,
    name: ScriptName,
    steps: Vec<Step>,
    at: usize,
    step_tick: u32,
    /// Share of the step that is over, from 0 to 1, gently at both ends.
    progress: f64,
    /// Ticks of holding still because the shape is being kept or the object is late.
    rested: u32,
    /// How many times as long the hand squeezes and holds.
    squeeze_times: u32,
    plan: GraspPlan,
    /// Where the palm came from when the hand turns to the other side.
    turned_from: PalmPath,
    closure: [f64; 5],
    closure_before: [f64; 5],
    lift: f64,
    /// How far the hand was lifted when the step began.
    lift_before: f64,
    /// How far it had come up when it held the object that it then raised.
    lift_of_grip: f64,
    /// How the object lay that the hand came for.
    lay: Lay,
    /// How the object lay that the plan was made for, where it had rolled.
    planned_for: Option<UnitQuaternion<f64>>,
    /// Whether the object has slipped out of the hand once.
    has_slipped: bool,
}

/// Most ticks for which the hand holds still while it waits.
const REST_MAX: u32 = 200;
/// How far the hand lifts the object while it squeezes, m.
const LIFT: f64 = 0.03;
/// An object that has rolled by more than this, rad, is grasped by another plan.
const ROLLED: f64 = 0.03;
/// How far the hand lifts an object from its table, m.
const RAISE: f64 = 0.06;
/// A squeeze presses so many times as deep as the grip that lifts.
const SQUEEZE: f64 = 1.5;
/// Closure per tick far from and near the expected touch.
const CLOSE_FAST: f64 = 0.03;
const CLOSE_SLOW: f64 = 0.008;
/// Closure per tick while a grip is tightened.
const CLOSE_TIGHT: f64 = 0.003;
/// Way of the hand in a tick, and at most, while it presses the object onto the table, m; and how many times
/// its weight the table must carry for that.
const COME_UP: f64 = 2e-4;
const COME_UP_MAX: f64 = 0.01;
const PRESSED_DOWN: f64 = 1.05;
/// A grip presses so many times as hard as friction needs to hold the weight.
pub const GRIP_MARGIN: f64 = 2.5;
/// … and so many times as hard once the object has slipped.
const GRIP_MARGIN_AGAIN: f64 = 4.0;
/// How much further than expected a finger closes while it looks for the touch.
const CLOSE_BEYOND: f64 = 0.15;
impl ScriptedHand {
    /// A hand that has looked at the object and knows how to grasp it. It plans its later
    /// approaches while the tick waits, unless it is given another planner.
    ///
    /// # Errors
    /// [`NoGrasp`] if it cannot be grasped by this hand.
    pub fn try_new(
        name: ScriptName,
        setup: HandSetup,
        object: &SoftObject,
    ) -> Result<Self, NoGrasp> {
        let object = Arc::clone(object.rest_shape());
        let contact = ContactModel::default();
        let request = PlanRequest::new(object, setup, contact);
        let plan = request.grip()?;
        Ok(Self::following(name, request.setup, plan))
    }

    /// A hand that follows a plan which was made elsewhere.
    pub fn following(name: ScriptName, setup: HandSetup, plan: GraspPlan) -> Self {
        Self {
            setup,
            contact: ContactModel::default(),
            planner: Planner::waited(),
            planning: false,
            plans_first: false,
            name,
            steps: name.steps(),
            at: 0,
            step_tick: 0,
            progress: 0.0,
            rested: 0,
            squeeze_times: 1,
            plan,
            turned_from: plan.path,
            closure: [0.0; 5],
            closure_before: [0.0; 5],
            lift: 0.0,
            lift_before: 0.0,
            lift_of_grip: 0.0,
            lay: Lay::default(),
            planned_for: None,
            has_slipped: false,
        }
    }

    /// Plays the script again from its beginning, by this plan; `None` lets the hand plan for the
    /// object as it is then.
    pub fn restart(&mut self, plan: Option<GraspPlan>) {
        self.planner.abandon();
        self.planning = false;
        self.plans_first = plan.is_none();
        self.plan = plan.unwrap_or(self.plan);
        (self.at, self.step_tick, self.progress, self.rested) = (0, 0, 0.0, 0);
        (self.closure, self.closure_before, self.lift) = ([0.0; 5], [0.0; 5], 0.0);
        (self.lay.centre, self.planned_for) = (None, None);
        (self.steps, self.has_slipped) = (self.name.steps(), false);
    }

    /// The script that the hand plays.
    pub fn script(&self) -> ScriptName {
        self.name
    }

    /// Sets the planner of the later approaches.
    #[must_use]
    pub fn with_planner(self, planner: Planner) -> Self {
        Self { planner, ..self }
    }

    /// Sets what a fingertip holds, for the plans of the later approaches.
    #[must_use]
    pub fn holding(self, contact: ContactModel) -> Self {
        Self { contact, ..self }
    }

    /// Lets the hand squeeze and hold so many times as long.
    #[must_use]
    pub fn squeezing_longer(self, squeeze_times: u32) -> Self {
        Self { squeeze_times: squeeze_times.max(1), ..self }
    }

    /// Whether the script is over.
    pub fn is_over(&self) -> bool {
        self.at >= self.steps.len()
    }

    /// The plan being followed.
    pub fn plan(&self) -> &GraspPlan {
        &self.plan
    }

    /// Whether the hand rests because its next approach is being planned.
    pub fn is_planning(&self) -> bool {
        self.planning
    }

    /// Moves on by one tick and returns what the devices send.
    pub fn next(&mut self, seen: &Seen, object: &SoftObject) -> Sent {
        self.next_after(1, seen, object)
    }

    /// Moves on by the time of so many ticks, of which only the last is played, and returns what the
    /// devices send then.
    pub fn next_after(&mut self, ticks: u64, seen: &Seen, object: &SoftObject) -> Sent {
        let Played { moment, command, over } = self.play(ticks, seen, object);
        let arrivals = self.setup.arrivals_of(&moment.angles(), &moment.world_from_palm);
        Sent { arrivals, command, over, recorded: None }
    }

    /// Plays ticks of the script without sending their device records.
    pub(super) fn play(&mut self, ticks: u64, seen: &Seen, object: &SoftObject) -> Played {
        let mut command = None;
        let mut step = None;
        for _ in 0..ticks {
            step = self.steps.get(self.at).copied();
            let Some(step) = step else { break };
            if self.step_tick == 0 {
                self.progress = 0.0;
            }
            // Who waits to see something goes on after it, however long it took.
            let awaits = seen.object_awaited && step == Step::Reach && self.step_tick == 0;
            if awaits || self.rests(seen) || !self.is_ready_for(step, seen, object) {
                break;
            }
            if self.advance(step, seen) {
                command = Some(Command::KeepShape);
                break;
            }
        }
        let mut centre = object.rest_shape().centre();
        if self.name == ScriptName::Lift {
            if matches!(step, Some(Step::Look | Step::Reach)) {
                self.lay.look(seen, &centre);
            }
            centre = self.lay.centre.unwrap_or(centre);
        }
        let moment = Moment {
            closure: self.closure,
            posture: self.posture(step),
            world_from_palm: self.world_from_palm(step, centre),
        };
        Played { moment, command, over: step.is_none() }
    }

    /// Whether the hand holds still because the shape is being kept, or the object that it lifts is late:
    /// not for ever, the server may be gone.
    fn rests(&mut self, seen: &Seen) -> bool {
        let waits = seen.keeping || (seen.is_late && self.name == ScriptName::Lift);
        self.rested = if waits { self.rested + 1 } else { 0 };
        (1..=REST_MAX).contains(&self.rested)
    }

    /// Plays one tick of a step; returns whether the shape is to be kept.
    fn advance(&mut self, step: Step, seen: &Seen) -> bool {
        if self.step_tick == 0 {
            (self.closure_before, self.lift_before) = (self.closure, self.lift);
        }
        self.step_tick += 1;
        let ticks_max = match step {
            Step::Press | Step::Hold => self.squeeze_times * step.ticks_max(),
            _ => step.ticks_max(),
        };
        let t = (f64::from(self.step_tick) / f64::from(ticks_max)).min(1.0);
        self.progress = t * t * (3.0 - 2.0 * t);
        self.close(step, seen);
        if self.step_tick >= ticks_max || self.is_done(step, seen) {
            self.at += 1;
            self.step_tick = 0;
            let lifts = matches!(step, Step::Raise | Step::Hold | Step::Squeeze);
            if lifts && !self.has_slipped && self.has_lost(seen) {
                self.try_again();
            }
        }
        step == Step::Keep
    }

    /// Whether the object, as far as it can move, has not come up with the hand that lifts it: all of it, or
    /// one end of what is held beside its centre of mass.
    fn has_lost(&self, seen: &Seen) -> bool {
        let has_lifted = seen.friction > 0.0 && self.lift > 0.0;
        has_lifted && (self.lay.drags(seen) || self.lay.risen(seen) < 0.5 * self.lift)
    }

    /// Lets the hand open, go back and lift in another way, as a person does from whose hand a thing slips.
    fn try_again(&mut self) {
        self.has_slipped = true;
        self.steps = vec![Step::Open, Step::Retreat, Step::TurnToOtherSide];
        self.steps.extend(self.name.steps());
        (self.at, self.step_tick) = (0, 0);
    }

    /// Whether the step can go on: it may need a plan for the other side, or for an object that has
    /// changed or rolled.
    fn is_ready_for(&mut self, step: Step, seen: &Seen, object: &SoftObject) -> bool {
        let begins = self.plans_first && self.at == 0;
        let turn = seen.world_from_object.rotation;
        let lifts = self.name == ScriptName::Lift;
        let regrasps = step == Step::TurnToOtherSide && !lifts;
        let rolled =
            lifts && matches!(step, Step::Reach | Step::TurnToOtherSide) && turn.angle() > ROLLED;
        if self.step_tick > 0 || !(begins || rolled || step == Step::TurnToOtherSide) {
            return true;
        }
        let is_planned = self.planned_for.is_some_and(|lay| lay.angle_to(&turn) < ROLLED);
        if step == Step::Reach && rolled && is_planned {
            return true;
        }
        if !self.planning {
            self.planning = true;
            self.turned_from = self.plan.path;
            self.planned_for = rolled.then_some(turn);
            self.planner.ask(PlanRequest {
                object: Arc::clone(object.rest_shape()),
                setup: self.setup.clone(),
                contact: self.contact,
                avoid_gaze: regrasps.then(|| self.plan.path.gaze()),
                turn: if rolled { turn } else { UnitQuaternion::identity() },
                has_slipped: self.has_slipped,
            });
        }
        let Some(planned) = self.planner.take() else { return false };
        (self.planning, self.plans_first) = (false, false);
        self.plan = planned.unwrap_or(self.plan);
        true
    }

    fn close(&mut self, step: Step, seen: &Seen) {
        let progress = self.progress;
        let plan = self.plan;
        match step {
            Step::CloseThree => self.close_until_touch(seen, |finger| finger.attaches()),
            Step::CloseOthers => self.close_until_touch(seen, |finger| !finger.attaches()),
            Step::Press => {
                for digit in 0..5 {
                    let more = plan.press[digit] - plan.touch[digit];
                    self.closure[digit] = self.closure_before[digit] + progress * more;
                }
                self.lift = LIFT * progress;
            }
            Step::Pinch => self.close_to(&plan.touch, progress),
            Step::Grip => self.close_to(&plan.press, progress),
            Step::Tighten => self.tighten(seen),
            Step::Squeeze => {
                let deeper = |digit: usize| {
                    let held = self.closure_before[digit].max(plan.press[digit]);
                    held + (SQUEEZE - 1.0) * (plan.press[digit] - plan.touch[digit])
                };
                self.close_to(&std::array::from_fn(deeper), progress);
            }
            Step::Raise => {
                self.lift_of_grip = self.lift_before;
                self.lift = self.lift_before + RAISE * progress;
            }
            Step::Lower => {
                self.lift = self.lift_before + (self.lift_of_grip - self.lift_before) * progress;
            }
            Step::Reach | Step::Open => self.close_to(&plan.reach, progress),
            Step::TurnToOtherSide => self.lift = self.lift.min(LIFT * (1.0 - progress)),
            Step::Retreat => self.close_to(&[0.0; 5], progress),
            Step::Look | Step::Hold | Step::Keep => {}
        }
    }

    /// Part of the way from where the step began to other closures.
    fn close_to(&mut self, closure: &[f64; 5], progress: f64) {
        for digit in 0..5 {
            let before = self.closure_before[digit];
            self.closure[digit] = before + progress * (closure[digit] - before);
        }
    }

    /// Closes the thumb, and the fingers, by a little where they press less than it takes to lift. A hand that
    /// presses the object onto the table comes up meanwhile: such a force holds nothing once it is lifted.
    fn tighten(&mut self, seen: &Seen) {
        if self.presses_down(seen) {
            self.lift = (self.lift + COME_UP).min(COME_UP_MAX);
        }
        let lacks = self.lacks_grip(seen);
        for digit in 0..5 {
            let (lacks, holds) = match digit {
                0 => (lacks[0], true),
                // Fingers that only close along do not touch.
                _ => (lacks[1], self.plan.press[digit] > self.plan.touch[digit]),
            };
            if lacks && holds {
                self.closure[digit] = (self.closure[digit] + CLOSE_TIGHT).min(1.0);
            }
        }
    }

    /// Whether the thumb, and the fingers together, press less than holds the weight by friction.
    fn lacks_grip(&self, seen: &Seen) -> [bool; 2] {
        if seen.friction <= 0.0 {
            return [false; 2];
        }
        // Each side holds half of the weight.
        let margin = if self.has_slipped { GRIP_MARGIN_AGAIN } else { GRIP_MARGIN };
        let needed = margin * 0.5 * self.lay.weight_n / seen.friction;
        let [thumb, fingers @ ..] = seen.finger_forces_n;
        [thumb < needed, fingers.iter().sum::<f64>() < needed]
    }

    /// Whether the table carries more than the object's weight, and the hand can still come up.
    fn presses_down(&self, seen: &Seen) -> bool {
        let is_pressed = seen.table_force_n > PRESSED_DOWN * self.lay.weight_n;
        seen.friction > 0.0 && is_pressed && self.lift < COME_UP_MAX
    }

    /// Whether the person sees and feels that the step has done what it was for.
    fn is_done(&self, step: Step, seen: &Seen) -> bool {
        match step {
            Step::CloseThree => {
                matches!(seen.state, Some(StateName::Attached | StateName::Deforming))
            }
            Step::CloseOthers => seen.state == Some(StateName::Deforming),
            Step::Look => seen.is_still,
            Step::Tighten => self.lacks_grip(seen) == [false; 2] && !self.presses_down(seen),
            _ => false,
        }
    }

    fn close_until_touch(&mut self, seen: &Seen, moves: impl Fn(Finger) -> bool) {
        for finger in Finger::ALL.into_iter().filter(|f| moves(*f)) {
            let digit = finger.index();
            let touch = self.plan.touch[digit];
            if seen.inside[digit] {
                continue;
            }
            let speed = if self.closure[digit] < touch - 0.06 { CLOSE_FAST } else { CLOSE_SLOW };
            self.closure[digit] =
                (self.closure[digit] + speed).min((touch + CLOSE_BEYOND).min(1.0));
        }
    }

    fn posture(&self, step: Option<Step>) -> Posture {
        // The hand is set for the grasp while it is still away, and opened after it.
        let set = match step {
            Some(Step::Reach) => self.progress,
            Some(Step::Retreat) => 1.0 - self.progress,
            Some(Step::TurnToOtherSide | Step::Look) => 0.0,
            None if self.steps.last() == Some(&Step::Retreat) => 0.0,
            // A script that does not end with letting go holds on.
            Some(_) | None => 1.0,
        };
        Posture::OPEN.toward(&self.plan.posture, set)
    }

    fn world_from_palm(&self, step: Option<Step>, centre: Point3<f64>) -> Isometry3<f64> {
        let path = match step {
            Some(Step::Look) => self.plan.path.backed_off(BACK_OFF),
            Some(Step::Reach) => self.plan.path.backed_off(BACK_OFF * (1.0 - self.progress)),
            Some(Step::Retreat) => self.plan.path.backed_off(BACK_OFF * self.progress),
            Some(Step::TurnToOtherSide) => {
                let share = self.progress;
                self.turned_from
                    .backed_off(BACK_OFF)
                    .toward(&self.plan.path.backed_off(BACK_OFF), share)
            }
            None if self.steps.last() == Some(&Step::Retreat) => {
                self.plan.path.backed_off(BACK_OFF)
            }
            _ => self.plan.path,
        };
        let palm = path.world_from_palm(centre + Vector3::new(0.0, self.lift, 0.0));
        let away = match step {
            Some(Step::Reach) => 1.0 - self.progress,
            Some(Step::Retreat) => self.progress,
            Some(Step::Look | Step::TurnToOtherSide) => 1.0,
            None if self.steps.last() == Some(&Step::Retreat) => 1.0,
            _ => 0.0,
        };
        above_ground(&palm, away)
    }
}

#[cfg(test)]
#[path = "hand_tests.rs"]
mod tests;
