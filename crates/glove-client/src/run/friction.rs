//! The ticks of a grasp by contact with friction: a step of the free object is asked for, and the hand is
//! shown where the object lets it be.

use std::sync::Arc;

use nalgebra::Point3;
use softgrasp_grasp::grasp::{Command, GraspEvent, StateName};
use softgrasp_grasp::hand::{HandColliders, HandPose, hand_bodies};
use softgrasp_grasp::object::ObjectError;
use softgrasp_protocol::NodeChoice;
use softgrasp_protocol::solve_report::SolveSummary;

use crate::ask::digest::step_digest;
use crate::ask::link::{Reached, ReachedStep};
use crate::ask::solve_settings::Subscription;
use crate::ask::unanswered::Unanswered;
use crate::run::contact_grasp::{ContactGrasp, ContactScene, TakenStep, given_way};
use crate::run::grasp_loop::GraspLoop;
use crate::run::keep::Keep;
use crate::run::tick_outcome::{LoopEvent, TickOutcome};

impl GraspLoop {
    /// From now on the object is free and has weight, and the hand grasps it by contact with friction
    /// instead of by the thesis's rules.
    pub fn grasp_with_friction(&mut self, scene: ContactScene) {
        let contact = ContactGrasp::new(scene, *self.grasp.home());
        self.world_from_object = contact.world_from_object();
        self.contact = Some(Box::new(contact));
    }

    /// The grasp by friction, if there is one.
    pub fn contact_grasp(&self) -> Option<&ContactGrasp> {
        self.contact.as_deref()
    }

    /// What a tick does once there is a hand.
    pub(crate) fn tick_with_friction(
        &mut self,
        tick: u64,
        now_s: f64,
        hand: &HandPose,
        command: Option<Command>,
        outcome: &mut TickOutcome,
    ) -> Result<(), ObjectError> {
        self.obey_with_friction(command, outcome)?;
        let dimensions = self.reader.setup().dimensions;
        let world_from_object = self.world_from_object;
        let tips = HandColliders::new(&dimensions, hand).fingers.map(|f| f.contact_point);
        self.prefetch(&tips.map(|tip| world_from_object.inverse_transform_point(&tip)), outcome);
        let is_asked = match self.keep.freezes() {
            true => Err(Unanswered::KeepingShape),
            false => self.ask_step(tick, now_s, hand, outcome)?,
        };
        let state = self.state();
        if state == StateName::Deforming {
            self.deforming_since.get_or_insert(tick);
            outcome.unanswered.extend(is_asked.err().map(|why| (tick, why)));
        } else {
            self.deforming_since = None;
            self.stop_keeping(outcome);
        }
        if self.contact.as_mut().is_some_and(|contact| contact.enters(state)) {
            outcome.events.push(LoopEvent::Grasp(GraspEvent::Entered(state)));
        }
        self.see_with_friction(tick, hand, state, outcome);
        Ok(())
    }

    /// Asks for the step to this tick; `Err` says why it is not asked for.
    fn ask_step(
        &mut self,
        tick: u64,
        now_s: f64,
        hand: &HandPose,
        outcome: &mut TickOutcome,
    ) -> Result<Result<(), Unanswered>, ObjectError> {
        let nodes = match self.settings.subscription {
            Subscription::Surface
                if matches!(self.keep, Keep::NotWanted) && self.changes.save_to.is_none() =>
            {
                NodeChoice::Nodes(self.object.surface().nodes.clone())
            }
            _ => NodeChoice::All,
        };
        let bodies = hand_bodies(&self.reader.setup().dimensions, hand);
        let is_given_up = match &self.recorded {
            Some(recorded) => recorded.gives_up_step,
            None => !self.link.is_connected(),
        };
        let Some(contact) = &mut self.contact else { return Ok(Err(Unanswered::AnswerLate)) };
        // A server that is gone answers nothing any more: of what it was asked the newest waits for the next.
        if is_given_up {
            outcome.gave_up_step |= contact.give_up_any();
        }
        let frame = contact.step(tick, now_s, &bodies, &self.object, nodes);
        let Some(frame) = frame else {
            let is_lost = self.recorded.is_none() && is_given_up;
            let why = if is_lost { Unanswered::ServerLost } else { Unanswered::AnswerLate };
            return Ok(Err(why));
        };
        if self.digests {
            outcome.request_digest = Some(step_digest(&frame));
        }
        // A tick that is played again asks what was answered, and nothing else.
        if self.recorded.as_ref().is_some_and(|recorded| recorded.answered_by.is_none()) {
            return Ok(Err(Unanswered::AnswerLate));
        }
        let grip = self.deforming_since.unwrap_or(tick);
        self.link.ask_step(tick, grip, frame);
        self.wait_in_lockstep(outcome)?;
        Ok(Ok(()))
    }

    /// Takes the answer to the step of a tick, unless the object has been changed since.
    pub(crate) fn take_step(
        &mut self,
        tick: u64,
        reached: Reached,
        step: ReachedStep,
        outcome: &mut TickOutcome,
    ) -> Result<(), ObjectError> {
        let ms = reached.round_trip.as_secs_f64() * 1e3;
        let summary =
            SolveSummary::new((*reached.report).clone(), None, ms).with_bytes(reached.bytes);
        outcome.answers.push((tick, summary));
        let is_current = reached.rest_shape == self.object.rest_shapes() && !self.keep.freezes();
        let Some(contact) = &mut self.contact else { return Ok(()) };
        if !is_current {
            contact.give_up(tick);
            return Ok(());
        }
        match contact.take(tick, step) {
            TakenStep::Taken => {}
            TakenStep::NotAsked => return Ok(()),
            TakenStep::Lost => {
                let text = "the contact could not be solved; the object lies undeformed where it was, and \
                            the hand has to leave it first";
                outcome.events.push(LoopEvent::Shape(text.to_owned()));
                return self.object.relax();
            }
        }
        outcome.steps.push(contact.record(tick, ms));
        self.shown_tick = Some(tick);
        self.world_from_object = contact.world_from_object();
        let object_from_world = self.world_from_object.rotation.inverse();
        self.shown_forces = Some(contact.finger_forces().map(|force| object_from_world * force));
        match reached.nodes {
            NodeChoice::All => self.object.apply(reached.displacement),
            NodeChoice::Nodes(_) => self.object.apply_to_surface(&reached.displacement),
        }
    }

    /// Carries out a command of the menu.
    fn obey_with_friction(
        &mut self,
        command: Option<Command>,
        outcome: &mut TickOutcome,
    ) -> Result<(), ObjectError> {
        let (Some(command), Some(contact)) = (command, &mut self.contact) else { return Ok(()) };
        let event = match command {
            Command::Release => {
                contact.let_go();
                GraspEvent::Released
            }
            Command::ReturnHome => {
                contact.return_home();
                self.world_from_object = contact.world_from_object();
                self.object.relax()?;
                GraspEvent::ReturnedHome
            }
            Command::KeepShape => match std::mem::replace(&mut self.keep, Keep::NotWanted) {
                Keep::Made(kept) => {
                    contact.meet_new_shape();
                    self.changes.history.push(Arc::clone(self.object.rest_shape()));
                    self.show_from_now_on(*kept);
                    GraspEvent::ShapeKept
                }
                other => {
                    self.keep = other;
                    GraspEvent::Ignored(command)
                }
            },
        };
        outcome.events.push(LoopEvent::Grasp(event));
        Ok(())
    }

    /// What the person sees of a tick: the hand stays outside of the object.
    fn see_with_friction(
        &mut self,
        tick: u64,
        hand: &HandPose,
        state: StateName,
        outcome: &mut TickOutcome,
    ) {
        let Some(contact) = &self.contact else { return };
        self.world_from_object = contact.world_from_object();
        let segments = hand.fingers.map(|f| f.segments.map(|s| s.world_from_segment));
        let ends: [Point3<f64>; 5] = hand.fingers.map(|finger| finger.tip());
        self.shown_segments = given_way(&segments, &ends, &contact.pushed_back());
        outcome.tips = contact.touching();
        outcome.seen.inside = outcome.tips;
        outcome.state = Some(state);
        outcome.seen.state = Some(state);
        outcome.seen.world_from_object = self.world_from_object;
        outcome.seen.is_still = contact.is_still();
        outcome.seen.is_late = contact.is_late(tick) || !self.link.is_connected();
        outcome.shown_tick = self.shown_tick;
    }

    /// Tells the grasp by friction that another object lies at its home.
    pub(crate) fn lay_another_object(&mut self) {
        let table_y = self.contact.as_ref().and_then(|contact| contact.scene().table_y);
        let home_y = self.grasp.home().translation.y;
        let table_y = table_y.map(|_| home_y + self.object.rest_shape().bottom());
        if let Some(contact) = &mut self.contact {
            contact.meet_new_object(table_y);
            self.world_from_object = contact.world_from_object();
        }
    }
}
