//! What a person does to the object besides grasping it: undo a kept shape, put another object in
//! its place, turn it, save it. Each works between two ticks, and while no tick is played.

use std::path::PathBuf;
use std::sync::Arc;

use nalgebra::{Isometry3, Translation3, UnitQuaternion};
use softgrasp_core::fem::Material as ElasticMaterial;
use softgrasp_grasp::grasp::{GraspError, StateName};
use softgrasp_grasp::object::{ObjectError, RestShape};
use softgrasp_hand::notice::Notice;
use softgrasp_protocol::{Material, MethodName, NodeChoice};

use crate::ask::solve_settings::{AnswerWishes, Subscription, element_for_frames};
use crate::object::object_changes::{Replacement, UNCOUNTED};
use crate::object::object_work::{KeptShape, ObjectJob};
use crate::object::saving::ShapeToSave;
use crate::run::grasp_loop::GraspLoop;
use crate::run::keep::Keep;
use crate::run::tick_outcome::{LoopEvent, TickOutcome};

impl GraspLoop {
    /// Goes back to the rest shape before the last one that was kept; the object will be at home
    /// and free. The news come with a later tick.
    ///
    /// # Errors
    /// Why not, in a sentence.
    pub fn undo_keep_shape(&mut self) -> Result<(), Notice> {
        self.refuse_while_changing()?;
        let Some(earlier) = self.changes.history.last().map(Arc::clone) else {
            return Err(Notice::refused("no shape has been kept: there is nothing to undo"));
        };
        self.begin_to_replace(earlier, Replacement::EarlierShape);
        Ok(())
    }

    /// Puts the object back to where it began, with the shape at rest that it began with. The news
    /// come with a later tick.
    ///
    /// # Errors
    /// Why not, in a sentence.
    pub fn begin_anew(&mut self) -> Result<(), Notice> {
        self.refuse_while_changing()?;
        self.put_object_home();
        if let Some(first) = self.changes.history.first().map(Arc::clone) {
            self.begin_to_replace(first, Replacement::FirstShape);
        }
        Ok(())
    }

    /// Whether the object is what was asked for, and the server there and prepared for it.
    pub fn is_object_ready(&self) -> bool {
        self.link.has_model() && !self.changes.are_under_way()
    }

    /// Puts another object in the place of this one; it will be at home and free. The news come
    /// with a later tick.
    ///
    /// # Errors
    /// Why not, in a sentence.
    pub fn replace_object(&mut self, rest: Arc<RestShape>, name: &str) -> Result<(), Notice> {
        self.refuse_while_changing()?;
        self.begin_to_replace(rest, Replacement::Other(name.to_owned()));
        Ok(())
    }

    /// Makes the object of another material; what holds it goes on holding it. An element that is the
    /// cheapest that does not lock follows Poisson's ratio. The news come with a later tick.
    ///
    /// # Errors
    /// Why not, in a sentence.
    pub fn set_material(&mut self, material: Material) -> Result<(), Notice> {
        ElasticMaterial::try_new(material.young, material.poisson)
            .map_err(|error| Notice::refused(format!("the material is not taken: {error}")))?;
        self.refuse_while_changing()?;
        let before = element_for_frames(self.settings.material.poisson);
        if self.settings.element == before {
            self.settings.element = element_for_frames(material.poisson);
        }
        self.settings.material = material;
        let rest = Arc::clone(self.object.rest_shape());
        self.begin_to_replace(rest, Replacement::OtherMaterial);
        Ok(())
    }

    /// Turns the object about its centre while nothing holds it (thesis 6.1.2).
    ///
    /// Frame: the rotation is the world's.
    ///
    /// # Errors
    /// [`GraspError`] while the hand holds it.
    pub fn turn_object(&mut self, rotation: UnitQuaternion<f64>) -> Result<(), GraspError> {
        let centre = self.world_from_object * self.object.rest_shape().centre();
        let about = Translation3::from(centre.coords);
        let mut turned: Isometry3<f64> =
            about * rotation * about.inverse() * self.world_from_object;
        turned.rotation.renormalize();
        match &mut self.contact {
            Some(contact) if contact.state_name() == StateName::Deforming => {
                return Err(GraspError::Held);
            }
            Some(contact) => contact.put(turned),
            None => self.grasp.place(turned)?,
        }
        self.world_from_object = turned;
        Ok(())
    }

    /// Lets go of the object where it is, because the hand is replaced.
    pub fn let_object_go(&mut self) {
        self.grasp.let_go();
        if let Some(contact) = &mut self.contact {
            contact.let_go();
        }
    }

    /// Lets go of the object and puts it back to where it began.
    pub fn put_object_home(&mut self) {
        self.grasp.let_go();
        let home = *self.grasp.home();
        // Nothing holds it any more.
        if self.grasp.place(home).is_ok() {
            self.world_from_object = home;
        }
        self.lay_another_object();
    }

    /// Saves the object as it is now, whole. Where the inside is not known it is asked for first.
    /// The news come with a later tick.
    ///
    /// # Errors
    /// Why not, in a sentence.
    pub fn save(&mut self, path: PathBuf) -> Result<Option<Notice>, Notice> {
        if let Some(earlier) = &self.changes.save_to {
            let text = format!("{} is still to be saved; wait a moment", earlier.display());
            return Err(Notice::refused(text));
        }
        if self.object.is_whole() {
            self.begin_to_save(path);
            return Ok(None);
        }
        let text = format!("{} is saved when the inside of the object is known", path.display());
        self.changes.save_to = Some(path);
        Ok(Some(Notice::waits(text)))
    }

    /// The method from the next question on.
    pub fn set_method(&mut self, method: MethodName) {
        self.settings.method = method;
        // Columns that were not asked for under another method may be needed now.
        self.prefetched.clear();
    }

    /// The nodes that are asked for from the next question on.
    pub fn set_subscription(&mut self, subscription: Subscription) {
        self.settings.subscription = subscription;
    }

    /// What the answers are to hold from the next question on.
    pub fn wishes_mut(&mut self) -> &mut AnswerWishes {
        &mut self.wishes
    }

    /// How many kept shapes can be undone.
    pub fn undo_count(&self) -> usize {
        self.changes.history.len()
    }

    /// Goes on with what is under way while no tick is played.
    ///
    /// # Errors
    /// [`ObjectError`] when the object cannot be shown any more.
    pub fn idle(&mut self) -> Result<TickOutcome, ObjectError> {
        let mut outcome = TickOutcome::default();
        self.pick_up(&mut outcome)?;
        self.save_when_whole(&mut outcome);
        self.take_work(&mut outcome);
        let waits = self.changes.save_to.is_some() && !self.changes.asked_whole;
        if let (true, Some(grip), Some(known)) = (waits, self.deforming_since, self.last_known) {
            let mut question = self.question(&known);
            question.want.nodes = NodeChoice::All;
            self.changes.asked_whole = true;
            self.link.ask(UNCOUNTED, grip, question, self.large_ask());
        }
        Ok(outcome)
    }

    /// From now on the object is another one, or has another rest shape.
    pub(crate) fn show_from_now_on(&mut self, made: KeptShape) {
        self.object = made.object;
        (self.shown_tick, self.shown_forces) = (None, None);
        (self.last_known, self.has_flowed) = (None, false);
        self.held.clear();
        self.prefetched.clear();
        self.link.set_model(made.model);
    }

    /// Puts what was made beside the ticks in the place of the object.
    pub(crate) fn put_in_place(&mut self, made: KeptShape, outcome: &mut TickOutcome) {
        let text = match self.changes.replacement.take() {
            // Nobody waits for it.
            None => return,
            Some(Replacement::OtherMaterial) => {
                self.refuse_to_save_half(outcome);
                self.show_from_now_on(made);
                (self.deforming_since, self.keep) = (None, Keep::NotWanted);
                outcome.events.push(LoopEvent::Shape(words_of_material(self.settings.material)));
                return;
            }
            Some(Replacement::EarlierShape) => {
                self.changes.history.pop();
                "the object has the shape back that it had before".to_owned()
            }
            Some(Replacement::FirstShape) => {
                self.changes.history.clear();
                "the object has the shape back that it began with".to_owned()
            }
            Some(Replacement::Other(name)) => {
                self.changes.history.clear();
                format!("the object is now {name}")
            }
        };
        self.refuse_to_save_half(outcome);
        self.show_from_now_on(made);
        self.deforming_since = None;
        self.keep = Keep::NotWanted;
        self.put_object_home();
        outcome.events.push(LoopEvent::Shape(text.clone()));
        outcome.notices.push(Notice::done(text));
    }

    /// Writes the file that waits for the whole shape, once that is known.
    pub(crate) fn save_when_whole(&mut self, outcome: &mut TickOutcome) {
        if self.object.is_whole()
            && let Some(path) = self.changes.save_to.take()
        {
            self.changes.asked_whole = false;
            self.begin_to_save(path);
            self.take_work(outcome);
        }
    }

    /// The shape is gone before it was known whole.
    pub(crate) fn refuse_to_save_half(&mut self, outcome: &mut TickOutcome) {
        self.refuse_waiting("the hand let go before the inside of the object was known", outcome);
    }

    /// The server has not said where the inside of the object is.
    pub(crate) fn refuse_to_save_unanswered(&mut self, outcome: &mut TickOutcome) {
        self.refuse_waiting("the server did not say where the inside of the object is", outcome);
    }

    /// What has become of a file.
    pub(crate) fn tell_saved(&mut self, saved: Result<String, String>, outcome: &mut TickOutcome) {
        let (notice, text) = match saved {
            Ok(text) => (Notice::done(text.clone()), text),
            Err(text) => (Notice::refused(text.clone()), text),
        };
        outcome.events.push(LoopEvent::Shape(text));
        outcome.notices.push(notice);
    }

    fn refuse_waiting(&mut self, why: &str, outcome: &mut TickOutcome) {
        self.changes.asked_whole = false;
        if let Some(path) = self.changes.save_to.take() {
            let text = format!("cannot save {}: {why}; save it again", path.display());
            self.tell_saved(Err(text), outcome);
        }
    }

    fn refuse_while_changing(&mut self) -> Result<(), Notice> {
        // Work that is lost with its thread must not be waited for.
        if !self.work.is_busy() {
            self.changes.replacement = None;
        }
        match self.changes.replacement {
            Some(_) => Err(Notice::refused("the object is being changed; wait a moment")),
            None => Ok(()),
        }
    }

    fn begin_to_replace(&mut self, rest: Arc<RestShape>, replacement: Replacement) {
        self.changes.replacement = Some(replacement);
        self.work.begin(ObjectJob::Replace {
            rest,
            rest_shapes: self.object.rest_shapes() + 1,
            material: self.settings.material,
            element: self.settings.element,
        });
    }

    fn begin_to_save(&mut self, path: PathBuf) {
        self.work.begin(ObjectJob::Save(ShapeToSave {
            path,
            rest: Arc::clone(self.object.rest_shape()),
            vertices: self.object.shape().to_vec(),
            displacement: self.object.displacement().to_vec(),
        }));
    }
}

fn words_of_material(material: Material) -> String {
    let Material { young, poisson } = material;
    format!("the object is now of {} kPa, Poisson's ratio {poisson}", 1e-3 * young)
}
