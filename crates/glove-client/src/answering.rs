//! Questions of ticks and their answers: what is asked, when an answer is taken, and which is shown.

use softgrasp_protocol::{NodeChoice, Question};

use crate::grasp_loop::{GraspLoop, LOCKSTEP_WAIT_MAX, MODEL_READY};
use crate::link::{LinkEvent, Reached, RequestEnd};
use crate::object_changes::UNCOUNTED;
use crate::pace::Pace;
use crate::rest_shape::ObjectError;
use crate::solve_report::SolveSummary;
use crate::tick_outcome::{LoopEvent, TickOutcome};
use crate::unanswered::Unanswered;

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
            if let Ok(method) = method.parse() {
                question.method = method;
            }
        }
        self.link.ask(tick, grip, question);
        if self.pace == Pace::Lockstep {
            self.link.wait_idle(LOCKSTEP_WAIT_MAX);
            self.pick_up(outcome)?;
        }
        Ok(())
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
                Ok(reached) => self.show(tick, *reached, outcome)?,
                Err(_) if tick == UNCOUNTED => self.refuse_to_save_unanswered(outcome),
                Err(why) => outcome.unanswered.push((tick, why)),
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
        let Reached { rest_shape, nodes, displacement, reactions, mask_forces, report, round_trip } =
            reached;
        let ms = round_trip.as_secs_f64() * 1e3;
        if tick != UNCOUNTED {
            outcome.answers.push((tick, SolveSummary::new(&report, ms)));
        }
        let current = rest_shape == self.object.rest_shapes()
            && self.deforming_since.is_some_and(|since| tick >= since)
            && !self.keep.freezes();
        if current && tick != UNCOUNTED {
            self.shown_tick = Some(tick);
            // The touched nodes stay the same as long as the grip that the answer belongs to.
            self.shown_forces = self.held.fingertip_forces(&reactions, &mask_forces);
        }
        match nodes {
            _ if !current => Ok(()),
            NodeChoice::All => self.object.apply(displacement),
            NodeChoice::Nodes(_) => self.object.apply_to_surface(&displacement),
        }
    }
}
