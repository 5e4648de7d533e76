//! Changes of the object besides the grasp: its next rest shape, another object, a file to be written.
//! They are made in the background.

use std::path::PathBuf;
use std::sync::Arc;

use softgrasp_grasp::object::{RestShape, SoftObject};
use softgrasp_hand::notice::Notice;

use crate::ask::solve_settings::SolveSettings;
use crate::object::object_work::{KeptShape, ObjectDone, ObjectJob, ObjectWork};
use crate::object::saving::ShapeToSave;
use crate::object::shape_history::ShapeHistory;
use crate::pace::Pace;
use crate::run::tick_outcome::{LoopEvent, TickOutcome};

/// Progress of the next rest shape: a kept shape, or the dent that a hand has left.
pub(crate) enum Keep {
    /// No shape is to be kept.
    NotWanted,
    /// A shape is to be kept once an answer brings all nodes; the answers so far brought the surface
    /// only.
    WhenWhole,
    /// The next rest shape is being made; the object keeps its present shape.
    BeingMade,
    /// The next rest shape is made, and the grasp is told in this tick.
    Made(Box<KeptShape>),
    /// The hand has released an object that has flowed: the shape that it springs back to is asked for.
    SpringsBack,
    /// The shape after springing back is being made the next rest shape.
    BecomesDent,
}

impl Keep {
    /// Whether a shape, or a dent, is to be kept.
    pub(crate) fn is_wanted(&self) -> bool {
        !matches!(self, Self::NotWanted)
    }

    /// Whether the object keeps its shape until the next rest shape is ready.
    pub(crate) fn freezes(&self) -> bool {
        matches!(self, Self::BeingMade | Self::Made(_)) || self.is_dent()
    }

    /// Whether the next rest shape is the dent that the hand has left.
    pub(crate) fn is_dent(&self) -> bool {
        matches!(self, Self::SpringsBack | Self::BecomesDent)
    }

    /// Whether background work is awaited.
    pub(crate) fn awaits_work(&self) -> bool {
        matches!(self, Self::BeingMade | Self::BecomesDent)
    }
}

/// What replaces the object.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum Replacement {
    /// The rest shape before the last one that was kept.
    EarlierShape,
    /// The rest shape before the first one that was kept.
    FirstShape,
    /// The present rest shape of another material.
    OtherMaterial,
    /// Another object, by its name.
    Other(String),
}

/// Changes of the object that are under way, and its earlier rest shapes.
pub(crate) struct Changing {
    keep: Keep,
    history: ShapeHistory,
    replacement: Option<Replacement>,
    /// File to be written as soon as every node is known.
    save_to: Option<PathBuf>,
    /// Whether the last question was asked again for all nodes, outside the ticks.
    asked_whole: bool,
    work: ObjectWork,
}

impl Changing {
    /// No change under way.
    ///
    /// # Errors
    /// Error of the operating system if it starts no thread.
    pub(crate) fn start(pace: Pace) -> std::io::Result<Self> {
        Ok(Self {
            keep: Keep::NotWanted,
            history: ShapeHistory::default(),
            replacement: None,
            save_to: None,
            asked_whole: false,
            work: ObjectWork::start(pace)?,
        })
    }

    /// Progress of the next rest shape.
    pub(crate) fn keep(&self) -> &Keep {
        &self.keep
    }

    /// Whether answers must have every node, because a shape or a file needs the inside.
    pub(crate) fn wants_whole(&self) -> bool {
        self.keep.is_wanted() || self.save_to.is_some()
    }

    pub(crate) fn set_keep(&mut self, keep: Keep) {
        self.keep = keep;
    }

    /// Takes the next rest shape, if it is ready.
    pub(crate) fn take_made(&mut self) -> Option<KeptShape> {
        match std::mem::replace(&mut self.keep, Keep::NotWanted) {
            Keep::Made(kept) => Some(*kept),
            other => {
                self.keep = other;
                None
            }
        }
    }

    /// Ends a wish to keep the shape, because nothing deforms the object any more.
    pub(crate) fn stop_keeping(&mut self, outcome: &mut TickOutcome) {
        if self.keep.is_wanted() {
            self.keep = Keep::NotWanted;
            let text = "the hand let go before the shape could be kept";
            outcome.events.push(LoopEvent::KeepRefused(text.to_owned()));
        }
    }

    /// Begins to make the present shape a rest shape, except for a share of its displacement, if there is one
    /// that may be left; the object keeps its shape meanwhile.
    pub(crate) fn begin_to_keep(
        &mut self,
        (keep, share_left): (Keep, Option<f64>),
        object: &SoftObject,
        settings: &SolveSettings,
    ) {
        self.keep = keep;
        self.work.begin(ObjectJob::Keep {
            rest: Arc::clone(object.rest_shape()),
            vertices: object.shape().to_vec(),
            share_left,
            rest_shapes: object.rest_shapes(),
            material: settings.material,
            element: settings.element,
        });
    }

    /// Begins a job that does not change the object.
    pub(crate) fn begin(&mut self, job: ObjectJob) {
        self.work.begin(job);
    }

    /// Takes the next outcome of background work; new rest shapes only if `takes_shapes`.
    pub(crate) fn take_done(&mut self, takes_shapes: bool) -> Option<ObjectDone> {
        self.work.take_if(|done| {
            takes_shapes || !matches!(done, ObjectDone::Kept(_) | ObjectDone::Replacement(_))
        })
    }

    /// Gives up a rest shape whose thread has ended.
    pub(crate) fn give_up_lost_work(&mut self, outcome: &mut TickOutcome) {
        if self.keep.awaits_work() && !self.work.is_busy() {
            self.keep = Keep::NotWanted;
            let text = "the work on the new rest shape failed; this is a fault of the program";
            outcome.events.push(LoopEvent::KeepRefused(text.to_owned()));
        }
    }

    /// Waits until all background work is done; its outcomes are still to be taken.
    pub(crate) fn settle(&mut self) {
        self.work.settle();
    }

    /// Adds a rest shape to the history, before another replaces it.
    pub(crate) fn remember(&mut self, rest: &Arc<RestShape>) {
        self.history.push(Arc::clone(rest));
    }

    pub(crate) fn history(&self) -> &ShapeHistory {
        &self.history
    }

    /// Whether the object is about to be replaced.
    pub(crate) fn replaces(&self) -> bool {
        self.replacement.is_some()
    }

    /// Refuses a change while another one is under way.
    ///
    /// # Errors
    /// Sentence for the person.
    pub(crate) fn refuse_while_changing(&mut self) -> Result<(), Notice> {
        // Work that is lost with its thread must not be waited for.
        if !self.work.is_busy() {
            self.replacement = None;
        }
        match self.replacement {
            Some(_) => Err(Notice::refused("the object is being changed; wait a moment")),
            None => Ok(()),
        }
    }

    /// Begins to make an object that replaces the present one.
    pub(crate) fn begin_to_replace(
        &mut self,
        rest: Arc<RestShape>,
        replacement: Replacement,
        object: &SoftObject,
        settings: &SolveSettings,
    ) {
        self.replacement = Some(replacement);
        self.work.begin(ObjectJob::Replace {
            rest,
            rest_shapes: object.rest_shapes() + 1,
            material: settings.material,
            element: settings.element,
        });
    }

    /// Kind of the replacement that has been made, if it is still wanted. Updates the history of rest
    /// shapes.
    pub(crate) fn take_replacement(&mut self) -> Option<Replacement> {
        let replacement = self.replacement.take()?;
        match &replacement {
            Replacement::EarlierShape => self.history.pop(),
            Replacement::FirstShape | Replacement::Other(_) => self.history.clear(),
            Replacement::OtherMaterial => {}
        }
        Some(replacement)
    }

    /// Writes the object in its present shape, at once or when every node is known.
    ///
    /// # Errors
    /// Sentence for the person, if another file still waits.
    pub(crate) fn save(
        &mut self,
        path: PathBuf,
        object: &SoftObject,
    ) -> Result<Option<Notice>, Notice> {
        if let Some(earlier) = &self.save_to {
            let text = format!("{} is still to be saved; wait a moment", earlier.display());
            return Err(Notice::refused(text));
        }
        if object.is_whole() {
            self.begin_to_save(path, object);
            return Ok(None);
        }
        let text = format!("{} is saved when the inside of the object is known", path.display());
        self.save_to = Some(path);
        Ok(Some(Notice::waits(text)))
    }

    /// Begins to write the file that waits for all nodes, once they are known; returns whether it began.
    pub(crate) fn save_when_whole(&mut self, object: &SoftObject) -> bool {
        if object.is_whole()
            && let Some(path) = self.save_to.take()
        {
            self.asked_whole = false;
            self.begin_to_save(path, object);
            return true;
        }
        false
    }

    /// Whether the inside of the object is still to be asked for outside the ticks.
    pub(crate) fn asks_for_inside(&self) -> bool {
        self.save_to.is_some() && !self.asked_whole
    }

    pub(crate) fn inside_is_asked_for(&mut self) {
        self.asked_whole = true;
    }

    /// Gives up the file that waits for the inside of the object.
    pub(crate) fn refuse_to_save(&mut self, why: &str, outcome: &mut TickOutcome) {
        self.asked_whole = false;
        if let Some(path) = self.save_to.take() {
            let text = format!("cannot save {}: {why}; save it again", path.display());
            outcome.tell_saved(Err(text));
        }
    }

    fn begin_to_save(&mut self, path: PathBuf, object: &SoftObject) {
        self.work.begin(ObjectJob::Save(ShapeToSave {
            path,
            rest: Arc::clone(object.rest_shape()),
            vertices: object.shape().to_vec(),
            displacement: object.displacement().to_vec(),
        }));
    }
}
