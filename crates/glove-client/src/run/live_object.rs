//! Object of a run between hand and server: answers become its shape, and results of background work
//! replace it.

use std::sync::Arc;

use nalgebra::Point3;
use softgrasp_core::fem::Material as ElasticMaterial;
use softgrasp_grasp::grasp::Command;
use softgrasp_grasp::object::{ObjectError, RestShape};
use softgrasp_hand::notice::Notice;
use softgrasp_hand::sent::WhichHand;
use softgrasp_protocol::solve_report::SolveSummary;
use softgrasp_protocol::{Material, NodeChoice};

use crate::ask::link::{Reached, ReachedStep, RequestEnd};
use crate::ask::solve_settings::element_for_frames;
use crate::object::object_work::{KeptShape, ObjectDone};
use crate::run::changing::{Changing, Keep, Replacement};
use crate::run::contact_grasp::{ContactGrasp, TakenStep};
use crate::run::holding::Holding;
use crate::run::questions::{Questions, SPRINGBACK, UNCOUNTED};
use crate::run::shown::Shown;
use crate::run::springback::support;
use crate::run::tick_outcome::{LoopEvent, TickOutcome};

/// Object of a run: how it is shown, the questions about it, and its changes.
pub(crate) struct LiveObject {
    pub(crate) shown: Shown,
    pub(crate) questions: Questions,
    pub(crate) changing: Changing,
}

impl LiveObject {
    /// Waits, in lockstep, for the answers to the tick's questions, and takes them.
    ///
    /// # Errors
    /// [`ObjectError`] if the answer does not fit the object.
    pub(crate) fn wait_in_lockstep(
        &mut self,
        holding: &mut Holding,
        outcome: &mut TickOutcome,
    ) -> Result<(), ObjectError> {
        match self.questions.wait_in_lockstep() {
            true => self.pick_up(holding, outcome),
            false => Ok(()),
        }
    }

    /// Takes the news and answers that have come from the server.
    ///
    /// # Errors
    /// [`ObjectError`] if the answer does not fit the object.
    pub(crate) fn pick_up(
        &mut self,
        holding: &mut Holding,
        outcome: &mut TickOutcome,
    ) -> Result<(), ObjectError> {
        for RequestEnd { tick, reached } in self.questions.take_ended(outcome) {
            match reached {
                Ok(_) if tick == SPRINGBACK && self.questions.springback_was_refused() => {
                    self.refuse_springback(outcome)?;
                }
                Ok(reached) if tick == SPRINGBACK => {
                    self.take_springback(*reached, holding, outcome)?;
                }
                Err(_) if tick == SPRINGBACK => self.refuse_springback(outcome)?,
                Ok(mut reached) => match (reached.step.take(), holding.friction_mut()) {
                    (Some(step), Some(contact)) => {
                        self.show_step(contact, tick, *reached, step, outcome)?;
                    }
                    (Some(_), None) => {}
                    (None, _) => self.show(tick, *reached, outcome)?,
                },
                Err(_) if tick == UNCOUNTED => {
                    let why = "the server did not say where the inside of the object is";
                    self.changing.refuse_to_save(why, outcome);
                }
                Err(why) => {
                    if let Some(contact) = holding.friction_mut() {
                        outcome.gave_up_step |= contact.give_up(tick);
                    }
                    outcome.unanswered.push((tick, why));
                }
            }
        }
        Ok(())
    }

    /// Shows an answer if it belongs to the present grasp, and if the shape may change.
    fn show(
        &mut self,
        tick: u64,
        reached: Reached,
        outcome: &mut TickOutcome,
    ) -> Result<(), ObjectError> {
        let large = reached.large;
        if tick != UNCOUNTED {
            let ms = reached.round_trip.as_secs_f64() * 1e3;
            let summary = SolveSummary::new((*reached.report).clone(), large, ms);
            outcome.answers.push((tick, summary.with_bytes(reached.bytes)));
            outcome.from_rest.extend(reached.from_rest.then_some(tick));
        }
        let is_current = reached.rest_shape == self.shown.object().rest_shapes()
            && self.questions.grip().is_some_and(|since| tick >= since)
            && !self.changing.keep().freezes();
        if !is_current {
            return Ok(());
        }
        if tick != UNCOUNTED {
            // The touched nodes stay the same as long as the grip that the answer belongs to.
            let forces = self.questions.fingertip_forces(&reached.reactions, &reached.mask_forces);
            let has_flowed = large.is_some_and(|large| large.plastic_strain > 0.0);
            self.shown.name_answer(tick, forces, has_flowed);
        }
        self.shown.deform(&reached.nodes, reached.displacement)
    }

    /// Shows the answer to a step of the free object, unless the object was changed since then or may not
    /// change.
    fn show_step(
        &mut self,
        contact: &mut ContactGrasp,
        tick: u64,
        reached: Reached,
        step: ReachedStep,
        outcome: &mut TickOutcome,
    ) -> Result<(), ObjectError> {
        let shown = &mut self.shown;
        let ms = reached.round_trip.as_secs_f64() * 1e3;
        let summary =
            SolveSummary::new((*reached.report).clone(), None, ms).with_bytes(reached.bytes);
        outcome.answers.push((tick, summary));
        outcome.from_rest.extend(reached.from_rest.then_some(tick));
        let is_current = reached.rest_shape == shown.object().rest_shapes();
        if !is_current || self.changing.keep().freezes() {
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
                return shown.relax();
            }
        }
        outcome.steps.push(contact.record(tick, ms));
        shown.place(contact.world_from_object());
        let object_from_world = shown.world_from_object().rotation.inverse();
        let forces = contact.hand(WhichHand::First).finger_forces();
        let forces = forces.map(|force| object_from_world * force);
        shown.name_answer(tick, Some(forces), false);
        shown.deform(&reached.nodes, reached.displacement)
    }

    /// Command for the grasp; `None` if it would keep a shape that cannot be kept, or not yet.
    pub(crate) fn allowed(
        &mut self,
        command: Option<Command>,
        holding: &mut Holding,
        outcome: &mut TickOutcome,
    ) -> Option<Command> {
        let keeps = matches!(command, None | Some(Command::KeepShape));
        if !keeps || self.questions.grip().is_none() {
            return command;
        }
        if command.is_some() && self.changing.replaces() {
            let text = "the object is being changed; keep the shape after that";
            outcome.events.push(LoopEvent::KeepRefused(text.to_owned()));
            return None;
        }
        let wanted = command.is_some() || matches!(self.changing.keep(), Keep::WhenWhole);
        if wanted && matches!(self.changing.keep(), Keep::NotWanted | Keep::WhenWhole) {
            if self.shown.object().is_whole() {
                self.begin_to_keep(Keep::BeingMade, holding, outcome);
            } else {
                self.changing.set_keep(Keep::WhenWhole);
            }
        }
        matches!(self.changing.keep(), Keep::Made(_)).then_some(Command::KeepShape)
    }

    /// Begins to make the present shape the next rest shape, as far as a hand that holds the object by friction
    /// can do without its pressing back.
    fn begin_to_keep(&mut self, keep: Keep, holding: &mut Holding, outcome: &mut TickOutcome) {
        let (object, settings) = (self.shown.object(), self.questions.settings());
        // What has flowed does not spring back: it cannot go on pressing.
        let flows = keep.is_dent() || settings.elasticity.yield_stress.is_some();
        let contact = holding.friction().filter(|_| !flows);
        let share_left = contact.map(|contact| contact.grip(object).share_left());
        self.changing.begin_to_keep((keep, share_left), object, settings);
        self.take_work(holding, outcome);
    }

    /// Takes the kept shape as the rest shape, if it is ready; returns the share of the displacement that goes
    /// on as one of the new rest shape.
    ///
    /// # Errors
    /// [`ObjectError`] if the object cannot be shown.
    pub(crate) fn keep_made(&mut self) -> Result<Option<f64>, ObjectError> {
        let Some(kept) = self.changing.take_made() else { return Ok(None) };
        let object = self.shown.object();
        let share_left = kept.share_left;
        let left = object.displacement().iter().map(|u| u.map(|u| share_left * u)).collect();
        self.changing.remember(object.rest_shape());
        self.show_from_now_on(kept);
        if share_left > 0.0 {
            self.shown.deform(&NodeChoice::All, left)?;
        }
        Ok(Some(share_left))
    }

    /// Ends a wish to keep the shape, because nothing deforms the object any more.
    pub(crate) fn stop_keeping(&mut self, outcome: &mut TickOutcome) {
        self.shown.forget_answer();
        self.changing.stop_keeping(outcome);
    }

    /// Ends the deformation, because the fingers do not hold the object any more.
    ///
    /// # Errors
    /// [`ObjectError`] if the object cannot be shown.
    pub(crate) fn let_go(
        &mut self,
        holding: &mut Holding,
        outcome: &mut TickOutcome,
    ) -> Result<(), ObjectError> {
        let may_flow = matches!(self.changing.keep(), Keep::NotWanted | Keep::WhenWhole);
        if let Some(grip) = self.questions.grip()
            && may_flow
            && self.shown.has_flowed()
        {
            self.begin_to_spring_back(grip, outcome);
            return self.wait_in_lockstep(holding, outcome);
        }
        self.questions.end_grip();
        if self.changing.keep().is_dent() {
            return Ok(());
        }
        self.stop_keeping(outcome);
        self.refuse_to_save_half(outcome);
        self.questions.link().cancel();
        self.shown.relax()
    }

    /// Asks for the shape without the hand; until it is known the object keeps its shape.
    fn begin_to_spring_back(&mut self, grip: u64, outcome: &mut TickOutcome) {
        self.refuse_to_save_half(outcome);
        self.questions.end_grip();
        self.shown.forget_answer();
        self.shown.forget_flow();
        self.changing.set_keep(Keep::SpringsBack);
        self.questions.ask_to_spring_back(grip, support(self.shown.object()));
    }

    /// Takes the shape that the object has sprung back to.
    fn take_springback(
        &mut self,
        reached: Reached,
        holding: &mut Holding,
        outcome: &mut TickOutcome,
    ) -> Result<(), ObjectError> {
        outcome.sprung_back = true;
        let is_current = reached.rest_shape == self.shown.object().rest_shapes();
        if !matches!(self.changing.keep(), Keep::SpringsBack) || !is_current {
            return Ok(());
        }
        // A server that was started anew knows nothing of what has flowed.
        if !reached.large.is_some_and(|large| large.plastic_strain > 0.0) {
            return self.go_back_to_rest("the server has forgotten what has flowed", outcome);
        }
        self.shown.deform(&NodeChoice::All, reached.displacement)?;
        self.begin_to_keep(Keep::BecomesDent, holding, outcome);
        Ok(())
    }

    /// Gives up springing back, because there is no equilibrium without the hand.
    fn refuse_springback(&mut self, outcome: &mut TickOutcome) -> Result<(), ObjectError> {
        outcome.sprung_back = true;
        match self.changing.keep() {
            Keep::SpringsBack => self.go_back_to_rest("the server gave no such shape", outcome),
            _ => Ok(()),
        }
    }

    fn go_back_to_rest(&mut self, why: &str, outcome: &mut TickOutcome) -> Result<(), ObjectError> {
        self.changing.set_keep(Keep::NotWanted);
        outcome.springback_refused = true;
        let text = format!("the object goes back to its rest shape without a dent: {why}");
        outcome.events.push(LoopEvent::Shape(text));
        self.shown.relax()
    }

    /// Replaces the squeezed object by the one with the dent.
    fn show_dent(&mut self, made: Result<Box<KeptShape>, ObjectError>, outcome: &mut TickOutcome) {
        self.changing.set_keep(Keep::NotWanted);
        match made {
            Ok(dented) => {
                self.changing.remember(self.shown.object().rest_shape());
                self.show_from_now_on(*dented);
                self.questions.end_grip();
                let text = "the object has sprung back as far as it does, and stays dented";
                outcome.events.push(LoopEvent::Shape(text.to_owned()));
            }
            Err(error) => outcome.events.push(LoopEvent::KeepRefused(error.to_string())),
        }
    }

    /// Takes the outcomes of background work.
    pub(crate) fn take_work(&mut self, holding: &mut Holding, outcome: &mut TickOutcome) {
        while let Some(done) = self.changing.take_done(self.questions.takes_shapes()) {
            outcome.took_work |= matches!(done, ObjectDone::Kept(_) | ObjectDone::Replacement(_));
            match done {
                ObjectDone::Prefetch { rest_shapes, hint } => {
                    if rest_shapes == self.shown.object().rest_shapes() {
                        self.questions.link().prefetch(&hint);
                    }
                }
                ObjectDone::Replacement(made) => self.put_in_place(*made, holding, outcome),
                ObjectDone::Saved(saved) => outcome.tell_saved(saved),
                // The hand has let go meanwhile.
                ObjectDone::Kept(_) if !self.changing.keep().awaits_work() => {}
                ObjectDone::Kept(made) if self.changing.keep().is_dent() => {
                    self.show_dent(made, outcome);
                }
                ObjectDone::Kept(Ok(kept)) => self.changing.set_keep(Keep::Made(kept)),
                ObjectDone::Kept(Err(error)) => {
                    self.changing.set_keep(Keep::NotWanted);
                    outcome.events.push(LoopEvent::KeepRefused(error.to_string()));
                }
            }
        }
        self.changing.give_up_lost_work(outcome);
    }

    /// Asks the server to prepare the columns of contacts that a fingertip is about to make.
    ///
    /// Units: m. Frame: the object's.
    pub(crate) fn prefetch(
        &mut self,
        tips_in_object: &[Point3<f64>; 5],
        tip_radii: [f64; 5],
        holding: &mut Holding,
        outcome: &mut TickOutcome,
    ) {
        let object = self.shown.object();
        if let Some(job) = self.questions.next_prefetch(object, tip_radii, tips_in_object) {
            self.changing.begin(job);
            self.take_work(holding, outcome);
        }
    }

    /// Replaces the object by one that was made in the background.
    fn put_in_place(&mut self, made: KeptShape, holding: &mut Holding, outcome: &mut TickOutcome) {
        // Nobody waits for it.
        let Some(replacement) = self.changing.take_replacement() else { return };
        self.refuse_to_save_half(outcome);
        self.show_from_now_on(made);
        self.questions.end_grip();
        self.changing.set_keep(Keep::NotWanted);
        let text = match replacement {
            Replacement::OtherMaterial => {
                let text = words_of_material(self.questions.settings().material);
                outcome.events.push(LoopEvent::Shape(text));
                return;
            }
            Replacement::EarlierShape => "the object has the shape back that it had before".into(),
            Replacement::FirstShape => "the object has the shape back that it began with".into(),
            Replacement::Other(name) => format!("the object is now {name}"),
        };
        holding.put_home(&mut self.shown);
        outcome.events.push(LoopEvent::Shape(text.clone()));
        outcome.notices.push(Notice::done(text));
    }

    /// Shows another object, or one with another rest shape, from now on.
    fn show_from_now_on(&mut self, made: KeptShape) {
        self.shown.replace(made.object);
        self.questions.meet_model(made.model);
    }

    /// Begins to make the object of another material. An element that was chosen as the cheapest without
    /// locking follows Poisson's ratio.
    ///
    /// # Errors
    /// Reason for a refusal, in a sentence.
    pub(crate) fn set_material(&mut self, material: Material) -> Result<(), Notice> {
        ElasticMaterial::try_new(material.young, material.poisson)
            .map_err(|error| Notice::refused(format!("the material is not taken: {error}")))?;
        self.changing.refuse_while_changing()?;
        let rest = Arc::clone(self.shown.object().rest_shape());
        let element = |poisson| element_for_frames(rest.regions().largest_poisson(poisson));
        let settings = self.questions.settings_mut();
        if settings.element == element(settings.material.poisson) {
            settings.element = element(material.poisson);
        }
        settings.material = material;
        self.begin_to_replace(rest, Replacement::OtherMaterial);
        Ok(())
    }

    /// Begins to make an object that replaces this one.
    pub(crate) fn begin_to_replace(&mut self, rest: Arc<RestShape>, replacement: Replacement) {
        let settings = self.questions.settings();
        self.changing.begin_to_replace(rest, replacement, self.shown.object(), settings);
    }

    /// Writes the file that waits for all nodes, once they are known.
    pub(crate) fn save_when_whole(&mut self, holding: &mut Holding, outcome: &mut TickOutcome) {
        if self.changing.save_when_whole(self.shown.object()) {
            self.take_work(holding, outcome);
        }
    }

    /// Asks for the inside of the object while no tick is played, if a file waits for it.
    pub(crate) fn ask_for_inside(&mut self, tip_radii: [f64; 5]) {
        if self.changing.asks_for_inside()
            && self.questions.ask_whole(self.shown.object(), tip_radii)
        {
            self.changing.inside_is_asked_for();
        }
    }

    /// Gives up the file whose shape ended before all of its nodes were known.
    fn refuse_to_save_half(&mut self, outcome: &mut TickOutcome) {
        let why = "the hand let go before the inside of the object was known";
        self.changing.refuse_to_save(why, outcome);
    }
}

fn words_of_material(material: Material) -> String {
    let Material { young, poisson } = material;
    format!("the object is now of {} kPa, Poisson's ratio {poisson}", 1e-3 * young)
}
