//! Keeps a deformed shape: it is made the next rest shape beside the ticks, and the object stays as
//! it is until that is there.

use std::sync::Arc;

use softgrasp_grasp::grasp::Command;

use crate::object::object_work::{ObjectDone, ObjectJob};
use crate::run::grasp_loop::GraspLoop;
use crate::run::keep::Keep;
use crate::run::tick_outcome::{LoopEvent, TickOutcome};

impl GraspLoop {
    /// A command for the grasp, unless the shape that is to be kept cannot be, or not yet.
    pub(crate) fn allowed(
        &mut self,
        command: Option<Command>,
        outcome: &mut TickOutcome,
    ) -> Option<Command> {
        if !matches!(command, None | Some(Command::KeepShape)) || self.deforming_since.is_none() {
            return command;
        }
        if command.is_some() && self.changes.are_under_way() {
            let text = "the object is being changed; keep the shape after that";
            outcome.events.push(LoopEvent::KeepRefused(text.to_owned()));
            return None;
        }
        let wanted = command.is_some() || matches!(self.keep, Keep::WhenWhole);
        if wanted && matches!(self.keep, Keep::NotWanted | Keep::WhenWhole) {
            if self.object.is_whole() {
                self.begin_to_keep(outcome);
            } else {
                self.keep = Keep::WhenWhole;
            }
        }
        matches!(self.keep, Keep::Made(_)).then_some(Command::KeepShape)
    }

    /// Begins to make the shape as it is now the next rest shape.
    fn begin_to_keep(&mut self, outcome: &mut TickOutcome) {
        self.keep = Keep::BeingMade;
        self.make_next_rest_shape();
        self.take_work(outcome);
    }

    /// Has the shape as it is now made into a rest shape, beside the ticks.
    pub(crate) fn make_next_rest_shape(&mut self) {
        self.work.begin(ObjectJob::Keep {
            rest: Arc::clone(self.object.rest_shape()),
            vertices: self.object.shape().to_vec(),
            rest_shapes: self.object.rest_shapes(),
            material: self.settings.material,
            element: self.settings.element,
        });
    }

    /// Nothing deforms the object any more: a shape that waits to be kept is not kept.
    pub(crate) fn stop_keeping(&mut self, outcome: &mut TickOutcome) {
        (self.shown_tick, self.shown_forces) = (None, None);
        if !matches!(self.keep, Keep::NotWanted) {
            self.keep = Keep::NotWanted;
            let text = "the hand let go before the shape could be kept";
            outcome.events.push(LoopEvent::KeepRefused(text.to_owned()));
        }
    }

    /// Takes what has been done beside the ticks.
    pub(crate) fn take_work(&mut self, outcome: &mut TickOutcome) {
        while let Some(done) = self.take_done() {
            outcome.took_work |= matches!(done, ObjectDone::Kept(_) | ObjectDone::Replacement(_));
            match done {
                ObjectDone::Prefetch { rest_shapes, hint } => {
                    if rest_shapes == self.object.rest_shapes() {
                        self.link.prefetch(&hint);
                    }
                }
                ObjectDone::Replacement(made) => self.put_in_place(*made, outcome),
                ObjectDone::Saved(saved) => self.tell_saved(saved, outcome),
                // The hand has let go meanwhile.
                ObjectDone::Kept(_) if !self.keep.awaits_work() => {}
                ObjectDone::Kept(made) if self.keep.is_dent() => self.show_dent(made, outcome),
                ObjectDone::Kept(Ok(kept)) => self.keep = Keep::Made(kept),
                ObjectDone::Kept(Err(error)) => {
                    self.keep = Keep::NotWanted;
                    outcome.events.push(LoopEvent::KeepRefused(error.to_string()));
                }
            }
        }
        if self.keep.awaits_work() && !self.work.is_busy() {
            self.keep = Keep::NotWanted;
            let text = "the work on the new rest shape failed; this is a fault of the program";
            outcome.events.push(LoopEvent::KeepRefused(text.to_owned()));
        }
    }

    /// The next piece of work that is done. A tick that is played again takes rest shapes only if it
    /// did so before.
    fn take_done(&mut self) -> Option<ObjectDone> {
        let takes_shapes = self.recorded.as_ref().is_none_or(|recorded| recorded.took_work);
        self.work.take_if(|done| {
            takes_shapes || !matches!(done, ObjectDone::Kept(_) | ObjectDone::Replacement(_))
        })
    }
}
