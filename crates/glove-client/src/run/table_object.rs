//! An object of a run: how it is shown and asked about, what holds it, and what a person does to it
//! between two ticks.

use std::path::PathBuf;
use std::sync::Arc;

use nalgebra::{Isometry3, Point3, Translation3, UnitQuaternion};
use softgrasp_core::fem::Material as ElasticMaterial;
use softgrasp_grasp::grasp::{Command, Grasp, GraspError};
use softgrasp_grasp::object::{ObjectError, RestShape, SoftObject};
use softgrasp_hand::notice::Notice;
use softgrasp_protocol::Material;
use softgrasp_window::view::frame::OwnLook;
use softgrasp_window::view::object_skin::Look;

use crate::ask::link::Link;
use crate::ask::solve_settings::SolveSettings;
use crate::pace::Pace;
use crate::run::changing::{Changing, Replacement};
use crate::run::contact_scene::ContactScene;
use crate::run::holding::Holding;
use crate::run::live_object::LiveObject;
use crate::run::questions::Questions;
use crate::run::shown::Shown;
use crate::run::tick_outcome::TickOutcome;

/// An object of a run, and what holds it.
pub(crate) struct TableObject {
    /// Name of a built-in object, or its file.
    pub(crate) name: String,
    /// What it is painted as, where it is one of several.
    pub(crate) look: Look,
    pub(crate) live: LiveObject,
    pub(crate) holding: Holding,
}

/// A further object for the table, and the link to the server that is its own.
pub struct FurtherObject {
    /// Name of a built-in object, or its file.
    pub name: String,
    /// What it is painted as.
    pub look: Look,
    /// The object, in its rest shape.
    pub object: SoftObject,
    /// Its home in the world.
    pub grasp: Grasp,
    /// Link to the server that answers for it.
    pub link: Link,
    /// Material, and settings of the solves.
    pub settings: SolveSettings,
    /// Constants of its grasp, with the height of the table that it shares.
    pub scene: ContactScene,
}

impl TableObject {
    /// An object without name and look; sends its model to the server at once.
    ///
    /// # Errors
    /// Error of the operating system if it starts no thread.
    pub(crate) fn start(
        object: SoftObject,
        grasp: Grasp,
        link: Link,
        settings: SolveSettings,
        pace: Pace,
    ) -> std::io::Result<Self> {
        let questions = Questions::new(link, settings, pace, &object);
        let changing = Changing::start(pace)?;
        let live = LiveObject { shown: Shown::new(object), questions, changing };
        let look = Look::Imported;
        Ok(Self { name: String::new(), look, live, holding: Holding::new(grasp) })
    }

    /// An object that is free and lies at its home; sends its model to the server at once.
    ///
    /// # Errors
    /// Error of the operating system if it starts no thread.
    pub(crate) fn further(further: FurtherObject, pace: Pace) -> std::io::Result<Self> {
        let FurtherObject { name, look, object, grasp, link, settings, scene } = further;
        let mut begun = Self::start(object, grasp, link, settings, pace)?;
        begun.holding.by_friction(scene, &mut begun.live.shown);
        Ok(Self { name, look, ..begun })
    }

    /// The object with its present shape.
    pub(crate) fn object(&self) -> &SoftObject {
        self.live.shown.object()
    }

    /// Pose of the object in the world.
    pub(crate) fn world_from_object(&self) -> &Isometry3<f64> {
        self.live.shown.world_from_object()
    }

    /// Centre of the object, m, in the world frame.
    pub(crate) fn centre(&self) -> Point3<f64> {
        self.world_from_object() * self.object().rest_shape().centre()
    }

    /// Look and material of the object, where several are shown. `None` for a material that is none.
    pub(crate) fn own_look(&self) -> Option<OwnLook> {
        let Material { young, poisson } = self.live.questions.settings().material;
        let material = ElasticMaterial::try_new(young, poisson).ok()?;
        Some(OwnLook { name: self.name.as_str().into(), look: self.look, material })
    }

    /// Number of kept shapes that can be undone.
    pub(crate) fn undo_count(&self) -> usize {
        self.live.changing.history().len()
    }

    /// Whether the object is the one asked for, and the server keeps its model.
    pub(crate) fn is_ready(&self) -> bool {
        self.live.questions.link().has_model() && !self.live.changing.replaces()
    }

    /// Whether the hand waits until a shape is kept. In lockstep this is done in the next tick, and the
    /// hand goes on.
    pub(crate) fn is_keeping(&self) -> bool {
        self.live.questions.pace() == Pace::Free && self.live.changing.keep().is_wanted()
    }

    /// Takes the news and answers that have come from the server.
    ///
    /// # Errors
    /// [`ObjectError`] if the answer does not fit the object.
    pub(crate) fn pick_up(&mut self, outcome: &mut TickOutcome) -> Result<(), ObjectError> {
        self.live.pick_up(&mut self.holding, outcome)
    }

    /// Waits, in lockstep, for the answers to the tick's questions, and takes them.
    ///
    /// # Errors
    /// [`ObjectError`] if the answer does not fit the object.
    pub(crate) fn wait_in_lockstep(
        &mut self,
        outcome: &mut TickOutcome,
    ) -> Result<(), ObjectError> {
        self.live.wait_in_lockstep(&mut self.holding, outcome)
    }

    /// Writes the file that waits for all nodes, once they are known.
    pub(crate) fn save_when_whole(&mut self, outcome: &mut TickOutcome) {
        self.live.save_when_whole(&mut self.holding, outcome);
    }

    /// Takes the outcomes of background work.
    pub(crate) fn take_work(&mut self, outcome: &mut TickOutcome) {
        self.live.take_work(&mut self.holding, outcome);
    }

    /// Command for the grasp; `None` if it would keep a shape that cannot be kept, or not yet.
    pub(crate) fn allowed(
        &mut self,
        command: Option<Command>,
        outcome: &mut TickOutcome,
    ) -> Option<Command> {
        self.live.allowed(command, &mut self.holding, outcome)
    }

    /// Asks the server to prepare the columns of contacts that a fingertip is about to make.
    ///
    /// Units: m. Frame: the object's.
    pub(crate) fn prefetch(
        &mut self,
        tips_in_object: &[Point3<f64>; 5],
        tip_radii: [f64; 5],
        outcome: &mut TickOutcome,
    ) {
        self.live.prefetch(tips_in_object, tip_radii, &mut self.holding, outcome);
    }

    /// Sets another home and puts the object there.
    pub(crate) fn set_home(&mut self, home: Isometry3<f64>) {
        if self.holding.set_home(home).is_ok() {
            self.live.shown.place(home);
        }
    }

    /// Releases the object and puts it back to its home.
    pub(crate) fn put_home(&mut self) {
        self.holding.put_home(&mut self.live.shown);
    }

    /// Returns to the rest shape before the last one that was kept; the object is then free at its home.
    ///
    /// # Errors
    /// Reason for a refusal, in a sentence.
    pub(crate) fn undo_keep_shape(&mut self) -> Result<(), Notice> {
        self.live.changing.refuse_while_changing()?;
        let Some(earlier) = self.live.changing.history().last().map(Arc::clone) else {
            return Err(Notice::refused("no shape has been kept: there is nothing to undo"));
        };
        self.live.begin_to_replace(earlier, Replacement::EarlierShape);
        Ok(())
    }

    /// Puts the object back to its home, with the rest shape that it began with.
    ///
    /// # Errors
    /// Reason for a refusal, in a sentence.
    pub(crate) fn begin_anew(&mut self) -> Result<(), Notice> {
        self.live.changing.refuse_while_changing()?;
        self.put_home();
        if let Some(first) = self.live.changing.history().first().map(Arc::clone) {
            self.live.begin_to_replace(first, Replacement::FirstShape);
        }
        Ok(())
    }

    /// Replaces the object; the new one is free at its home.
    ///
    /// # Errors
    /// Reason for a refusal, in a sentence.
    pub(crate) fn replace(&mut self, rest: Arc<RestShape>, name: &str) -> Result<(), Notice> {
        self.live.changing.refuse_while_changing()?;
        self.live.begin_to_replace(rest, Replacement::Other(name.to_owned()));
        (self.name, self.look) = (name.to_owned(), Look::of(name));
        Ok(())
    }

    /// Rotates the object about its centre while nothing holds it (thesis 6.1.2).
    ///
    /// Frame: the rotation is in the world frame.
    ///
    /// # Errors
    /// [`GraspError`] while the hand holds it.
    pub(crate) fn turn(&mut self, rotation: UnitQuaternion<f64>) -> Result<(), GraspError> {
        let about = Translation3::from(self.centre().coords);
        let mut turned: Isometry3<f64> =
            about * rotation * about.inverse() * self.world_from_object();
        turned.rotation.renormalize();
        self.holding.place(turned)?;
        self.live.shown.place(turned);
        Ok(())
    }

    /// Saves the object in its present shape, with all nodes.
    ///
    /// # Errors
    /// Reason for a refusal, in a sentence.
    pub(crate) fn save(&mut self, path: PathBuf) -> Result<Option<Notice>, Notice> {
        self.live.changing.save(path, self.live.shown.object())
    }
}
