//! Questions of ticks and their answers: what is asked, when an answer is taken, and which is shown.

use softgrasp_grasp::object::ObjectError;
use softgrasp_protocol::solve_report::SolveSummary;
use softgrasp_protocol::{
    Deformation, LargeAsk, NodeChoice, Pace as FramePace, PathChoice, Question,
};

use crate::ask::link::{LinkEvent, Reached, RequestEnd};
use crate::ask::unanswered::Unanswered;
use crate::object::object_changes::UNCOUNTED;
use crate::pace::Pace;
use crate::run::grasp_loop::{GraspLoop, LOCKSTEP_WAIT_MAX, MODEL_READY};
use crate::run::springback::SPRINGBACK;
use crate::run::tick_outcome::{LoopEvent, TickOutcome};

impl GraspLoop {
    /// Asks the server. In lockstep the tick waits for the answer. A tick that is played again asks
    /// what was answered, by the method that answered it, and nothing else.
    pub(crate) fn ask(
        &mut self,
        tick: u64,
        grip: u64,
        mut question: Question,
        outcome: &mut TickOutcome,
    ) -> Result<(), ObjectError> {
        if let Some(recorded) = &self.recorded {
            let Some(method) = &recorded.answered_by else {
                outcome.unanswered.push((tick, Unanswered::AnswerLate));
                return Ok(());
            };
            // At large deformation the path decides, and it is followed again.
            if self.settings.elasticity.deformation == Deformation::Linear
                && let Ok(method) = method.parse()
            {
                question.method = method;
            }
        }
        let mut large = self.large_ask();
        // A server that was started anew in the middle of a grip began at rest.
        if let (Some(large), Some(recorded)) = (&mut large, &self.recorded)
            && recorded.from_rest
        {
            large.path = PathChoice::FromRest;
        }
        if large.is_some_and(|large| large.pace == FramePace::Timely) {
            question.deadline_ms = self.answer_within_ms;
        }
        self.link.ask(tick, grip, question, large);
        self.wait_in_lockstep(outcome)
    }

    /// In lockstep the tick waits for the answer.
    pub(crate) fn wait_in_lockstep(
        &mut self,
        outcome: &mut TickOutcome,
    ) -> Result<(), ObjectError> {
        if self.pace == Pace::Lockstep {
            self.link.wait_idle(LOCKSTEP_WAIT_MAX);
            self.pick_up(outcome)?;
        }
        Ok(())
    }

    /// What is asked of large deformation. Where bits are to repeat, nothing may depend on the
    /// clock: in lockstep, and while a run is recorded or played again.
    pub(crate) fn large_ask(&self) -> Option<LargeAsk> {
        let repeats = self.pace == Pace::Lockstep || self.digests || self.recorded.is_some();
        let pace = if repeats { FramePace::Repeatable } else { FramePace::Timely };
        self.settings.elasticity.ask(PathChoice::Continue, pace)
    }

    /// Requests that have ended and that the tick takes: all, or when it is played again those that
    /// it took before, in the same order.
    fn take_ended(&mut self, ended: Vec<RequestEnd>) -> Vec<RequestEnd> {
        let Some(recorded) = &self.recorded else { return ended };
        self.held_back.extend(ended);
        let held_back = &mut self.held_back;
        let taken = recorded.taken.iter().filter_map(|tick| {
            let at = held_back.iter().position(|end| end.tick == *tick)?;
            Some(held_back.remove(at))
        });
        taken.collect()
    }

    /// Whether the tick, when it was recorded, got no shape that the object springs back to.
    fn springback_was_refused(&self) -> bool {
        self.recorded.as_ref().is_some_and(|recorded| recorded.springback_refused)
    }

    /// Takes what has come from the server.
    pub(crate) fn pick_up(&mut self, outcome: &mut TickOutcome) -> Result<(), ObjectError> {
        let (events, ended) = self.link.take();
        for event in events {
            let text = match event {
                LinkEvent::Connected { server } => format!("connected to {server}"),
                LinkEvent::Refused { text } => format!("refused {text}"),
                LinkEvent::Lost { text } => format!("lost: {text}"),
                LinkEvent::ModelReady(ready) => {
                    tracing::info!(model = %ready.model, "model ready");
                    MODEL_READY.to_owned()
                }
            };
            outcome.events.push(LoopEvent::Server(text));
        }
        for RequestEnd { tick, reached } in self.take_ended(ended) {
            match reached {
                Ok(_) if tick == SPRINGBACK && self.springback_was_refused() => {
                    self.refuse_springback(outcome)?;
                }
                Ok(reached) if tick == SPRINGBACK => self.take_springback(*reached, outcome)?,
                Err(_) if tick == SPRINGBACK => self.refuse_springback(outcome)?,
                Ok(mut reached) => match reached.step.take() {
                    Some(step) => self.take_step(tick, *reached, step, outcome)?,
                    None => self.show(tick, *reached, outcome)?,
                },
                Err(_) if tick == UNCOUNTED => self.refuse_to_save_unanswered(outcome),
                Err(why) => {
                    if let Some(contact) = &mut self.contact {
                        outcome.gave_up_step |= contact.give_up(tick);
                    }
                    outcome.unanswered.push((tick, why));
                }
            }
        }
        Ok(())
    }

    /// Shows an answer if it belongs to the grasp that is going on, and to a shape that may change.
    fn show(
        &mut self,
        tick: u64,
        reached: Reached,
        outcome: &mut TickOutcome,
    ) -> Result<(), ObjectError> {
        let Reached {
            rest_shape,
            from_rest,
            nodes,
            displacement,
            reactions,
            mask_forces,
            report,
            large,
            round_trip,
            bytes,
            step: _,
        } = reached;
        let ms = round_trip.as_secs_f64() * 1e3;
        if tick != UNCOUNTED {
            let summary = SolveSummary::new((*report).clone(), large, ms);
            outcome.answers.push((tick, summary.with_bytes(bytes)));
            outcome.from_rest.extend(from_rest.then_some(tick));
        }
        let current = rest_shape == self.object.rest_shapes()
            && self.deforming_since.is_some_and(|since| tick >= since)
            && !self.keep.freezes();
        if current && tick != UNCOUNTED {
            self.shown_tick = Some(tick);
            // The touched nodes stay the same as long as the grip that the answer belongs to.
            self.shown_forces = self.held.fingertip_forces(&reactions, &mask_forces);
            self.has_flowed = large.is_some_and(|large| large.plastic_strain > 0.0);
        }
        match nodes {
            _ if !current => Ok(()),
            NodeChoice::All => self.object.apply(displacement),
            NodeChoice::Nodes(_) => self.object.apply_to_surface(&displacement),
        }
    }
}
