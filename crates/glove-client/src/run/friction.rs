//! Ticks of a grasp by contact with friction: each asks for a step of the free object, and shows the hands
//! where the object lets them be.

use nalgebra::Point3;
use softgrasp_grasp::grasp::{Command, GraspEvent, HandSegments, StateName};
use softgrasp_grasp::hand::{HandColliders, HandDimensions, HandPose, hand_bodies};
use softgrasp_grasp::object::ObjectError;
use softgrasp_hand::scripted::Seen;
use softgrasp_hand::sent::WhichHand;
use softgrasp_protocol::PathChoice;

use crate::ask::digest::step_digest;
use crate::ask::unanswered::Unanswered;
use crate::run::contact_grasp::{ContactGrasp, StepWish};
use crate::run::given_way::given_way;
use crate::run::live_object::LiveObject;
use crate::run::shown::Shown;
use crate::run::table_object::TableObject;
use crate::run::tick_outcome::{LoopEvent, TickOutcome};

/// Hand of a tick, and its dimensions.
#[derive(Clone, Copy)]
pub(crate) struct TickHand {
    pub(crate) pose: HandPose,
    pub(crate) dimensions: HandDimensions,
}

/// Tick of a grasp by friction: number, time on the client's clock (s), and the hands that are there.
pub(crate) struct FrictionTick {
    pub(crate) tick: u64,
    pub(crate) now_s: f64,
    pub(crate) hands: [Option<TickHand>; 2],
}

impl FrictionTick {
    /// Begins the tick for an object: carries out a command and asks for its step. The result says
    /// whether it was asked.
    ///
    /// # Errors
    /// [`ObjectError`] when the object cannot be shown any more.
    pub(crate) fn begin(
        &self,
        command: Option<Command>,
        object: &mut TableObject,
        outcome: &mut TickOutcome,
    ) -> Result<Result<(), Unanswered>, ObjectError> {
        obey(command, object, outcome)?;
        for TickHand { pose, dimensions } in self.hands.iter().flatten() {
            let object_from_world = object.world_from_object().inverse();
            let tips = HandColliders::new(dimensions, pose).fingers.map(|f| f.contact_point);
            let tips = tips.map(|tip| object_from_world * tip);
            object.prefetch(&tips, dimensions.tip_radii(), outcome);
        }
        Ok(self.ask(object, outcome))
    }

    /// Ends the tick for an object: takes the answer, if it is awaited, and writes what is seen.
    ///
    /// # Errors
    /// [`ObjectError`] when the object cannot be shown any more.
    pub(crate) fn end(
        &self,
        is_asked: Result<(), Unanswered>,
        object: &mut TableObject,
        outcome: &mut TickOutcome,
    ) -> Result<(), ObjectError> {
        if is_asked.is_ok() {
            object.wait_in_lockstep(outcome)?;
        }
        let TableObject { live, holding, .. } = object;
        let state = holding.state_name();
        if state == StateName::Deforming {
            live.questions.begin_grip(self.tick);
            outcome.unanswered.extend(is_asked.err().map(|why| (self.tick, why)));
        } else {
            live.questions.end_grip();
            live.stop_keeping(outcome);
        }
        let Some(contact) = holding.friction_mut() else { return Ok(()) };
        if contact.enters(state) {
            outcome.events.push(LoopEvent::Grasp(GraspEvent::Entered(state)));
        }
        live.shown.place(contact.world_from_object());
        self.see(contact, &live.shown, state, outcome);
        outcome.seen.is_late |= !live.questions.link().is_connected();
        Ok(())
    }

    /// Segments of each hand as they are shown: outside of the objects, each of which pushes it back.
    pub(crate) fn shown_hands(&self, objects: &[&ContactGrasp]) -> [Option<HandSegments>; 2] {
        let segments = self.segments();
        WhichHand::ALL.map(|which| {
            let hand = self.hands[which.index()]?;
            let ends: [Point3<f64>; 5] = hand.pose.fingers.map(|finger| finger.tip());
            let pushes = objects.iter().map(|object| object.pushed_back(which));
            let pushed = pushes.reduce(|all, more| {
                std::array::from_fn(|digit| std::array::from_fn(|i| all[digit][i] + more[digit][i]))
            });
            Some(given_way(&segments[which.index()]?, &ends, &pushed.unwrap_or_default()))
        })
    }

    /// Segments of each hand as they were measured.
    fn segments(&self) -> [Option<HandSegments>; 2] {
        let of =
            |hand: TickHand| hand.pose.fingers.map(|f| f.segments.map(|s| s.world_from_segment));
        self.hands.map(|hand| hand.map(of))
    }

    /// Asks for the step of the free object up to this tick, unless its shape is being kept.
    fn ask(&self, object: &mut TableObject, outcome: &mut TickOutcome) -> Result<(), Unanswered> {
        let TableObject { live, holding, .. } = object;
        let LiveObject { shown, questions, changing } = live;
        if changing.keep().freezes() {
            return Err(Unanswered::KeepingShape);
        }
        let contact = holding.friction_mut().ok_or(Unanswered::AnswerLate)?;
        let recorded = questions.recorded();
        let is_given_up = match recorded {
            Some(recorded) => recorded.gives_up_step,
            None => !questions.link().is_connected(),
        };
        contact.feel_server(is_given_up);
        // A server that is gone answers nothing any more: of what it was asked the newest waits for the next.
        if is_given_up {
            outcome.gave_up_step |= contact.give_up_any();
        }
        let bodies = self.hands.map(|hand| hand.map(|h| hand_bodies(&h.dimensions, &h.pose)));
        let wish = StepWish {
            nodes: questions.nodes(shown.object(), changing.wants_whole()),
            elasticity: questions.settings().elasticity,
            path: match recorded.is_some_and(|recorded| recorded.from_rest) {
                true => PathChoice::FromRest,
                false => PathChoice::Continue,
            },
        };
        let frame = contact.step(self.tick, self.now_s, &bodies, shown.object(), wish);
        let Some(frame) = frame else {
            let is_lost = recorded.is_none() && is_given_up;
            return Err(if is_lost { Unanswered::ServerLost } else { Unanswered::AnswerLate });
        };
        if questions.wants_digests() {
            outcome.request_digest = Some(step_digest(&frame));
        }
        // A tick that is played again asks what was answered, and nothing else.
        if recorded.is_some_and(|recorded| recorded.answered_by.is_none()) {
            return Err(Unanswered::AnswerLate);
        }
        let grip = questions.grip().unwrap_or(self.tick);
        questions.link().ask_step(self.tick, grip, frame);
        Ok(())
    }

    /// Writes the visible result of the tick into its outcome.
    fn see(
        &self,
        contact: &ContactGrasp,
        shown: &Shown,
        state: StateName,
        outcome: &mut TickOutcome,
    ) {
        let [first, second] = WhichHand::ALL.map(|which| contact.hand(which));
        outcome.tips = first.touching();
        outcome.second_tips = second.touching();
        outcome.state = Some(state);
        outcome.shown_tick = shown.tick();
        outcome.seen.inside = outcome.tips;
        outcome.seen.state = Some(state);
        outcome.seen.world_from_object = *shown.world_from_object();
        outcome.seen.is_still = contact.is_still();
        outcome.seen.finger_forces_n = first.finger_forces().map(|force| force.norm());
        outcome.seen.table_force_n = contact.table_force().norm();
        outcome.seen.friction = contact.scene().friction;
        outcome.seen.is_late = contact.is_late(self.tick);
        outcome.seen_by_second = Seen {
            inside: outcome.second_tips,
            finger_forces_n: second.finger_forces().map(|force| force.norm()),
            ..outcome.seen
        };
    }
}

/// Carries out a command of the menu.
fn obey(
    command: Option<Command>,
    object: &mut TableObject,
    outcome: &mut TickOutcome,
) -> Result<(), ObjectError> {
    let TableObject { live, holding, .. } = object;
    let (Some(command), Some(contact)) = (command, holding.friction_mut()) else { return Ok(()) };
    let event = match command {
        Command::Release => {
            contact.let_go();
            GraspEvent::Released
        }
        Command::ReturnHome => {
            contact.return_home();
            live.shown.place(contact.world_from_object());
            live.shown.relax()?;
            GraspEvent::ReturnedHome
        }
        Command::KeepShape => match live.keep_made()? {
            Some(share_left) => {
                contact.meet_new_shape(share_left);
                if share_left > 0.0 {
                    let percent = 1e2 * share_left;
                    let text = format!(
                        "the shape is kept but for {percent:.0} %, which go on pressing on the hand and spring \
                         back when it opens"
                    );
                    outcome.events.push(LoopEvent::Shape(text));
                }
                GraspEvent::ShapeKept
            }
            None => GraspEvent::Ignored(command),
        },
    };
    outcome.events.push(LoopEvent::Grasp(event));
    Ok(())
}
