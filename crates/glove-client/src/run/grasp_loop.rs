//! One tick of the client in fixed order (bytes, pose, contacts, grasp, request, answer), and a person's
//! changes of the object between two ticks.

use std::path::PathBuf;
use std::sync::Arc;
use std::time::Duration;

use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};
use softgrasp_force::{ForceReport, Renderer};
use softgrasp_grasp::grasp::{
    Command, Contact, Grasp, GraspError, GraspEvent, HandSegments, StateName, StepInput,
    StepOutput, sense,
};
use softgrasp_grasp::hand::{HandColliders, HandPose};
use softgrasp_grasp::object::{ObjectError, RestShape, SoftObject};
use softgrasp_hand::hand_reader::HandReader;
use softgrasp_hand::hand_readers::HandReaders;
use softgrasp_hand::notice::Notice;
use softgrasp_hand::sent::{Sent, WhichHand};
use softgrasp_protocol::{Material, MethodName};

use crate::ask::link::Link;
use crate::ask::solve_settings::{AnswerWishes, SolveSettings, Subscription};
use crate::ask::unanswered::Unanswered;
use crate::object::object_place::ObjectPlace;
use crate::pace::Pace;
use crate::run::changing::{Changing, Replacement};
use crate::run::contact_grasp::{ContactGrasp, ContactScene};
use crate::run::felt::FeltHand;
use crate::run::friction::{FrictionTick, TickHand};
use crate::run::holding::Holding;
use crate::run::live_object::LiveObject;
use crate::run::placing::where_it_closes;
use crate::run::questions::Questions;
use crate::run::shown::Shown;
use crate::run::tick_outcome::{LoopEvent, TickOutcome};
use crate::run::tracked_hands::TrackedHands;

/// The client's loop between devices and server.
pub struct GraspLoop {
    hands: TrackedHands,
    holding: Holding,
    object: LiveObject,
    /// Place where the object is put when the first hand comes.
    place: ObjectPlace,
    /// Whether the table stops the hand: one that was put below an object in the hand is not there for the
    /// hand.
    stops_hand: bool,
}

impl GraspLoop {
    /// Loop of one hand or two around an object at the origin; sends its model to the server at once. To be
    /// made before the calling thread asks for real-time priority. Two hands need a grasp by friction.
    ///
    /// # Errors
    /// Error of the operating system if it starts no thread.
    pub fn try_new(
        readers: impl Into<HandReaders>,
        object: SoftObject,
        grasp: Grasp,
        link: Link,
        settings: SolveSettings,
        pace: Pace,
    ) -> std::io::Result<Self> {
        let questions = Questions::new(link, settings, pace, &object);
        let changing = Changing::start(pace)?;
        Ok(Self {
            hands: TrackedHands::new(readers.into()),
            holding: Holding::new(grasp),
            object: LiveObject { shown: Shown::new(object), questions, changing },
            place: ObjectPlace::Home,
            stops_hand: true,
        })
    }

    /// Makes the object free and heavy, so that the hand grasps it by contact with friction instead of by
    /// the thesis's rules.
    pub fn grasp_with_friction(&mut self, scene: ContactScene) {
        self.holding.by_friction(scene, &mut self.object.shown);
    }

    /// Lets the hand feel what a grasp by friction presses it with.
    pub fn feel(&mut self, renderer: Renderer) {
        if let Some(contact) = self.holding.friction_mut() {
            contact.feel(FeltHand::new(renderer));
        }
    }

    /// Ends the force and tells of it; `None` without any.
    pub fn end_force(&mut self) -> Option<ForceReport> {
        self.holding.friction_mut()?.end_force()
    }

    /// State of the grasp by friction, if there is one.
    pub fn contact_grasp(&self) -> Option<&ContactGrasp> {
        self.holding.friction()
    }

    /// Sets the time from tick to tick: live questions ask for their answer within it.
    pub fn tick_every(&mut self, period: Duration) {
        self.object.questions.tick_every(period);
    }

    /// Whether ticks wait for answers.
    pub fn pace(&self) -> Pace {
        self.object.questions.pace()
    }

    /// Adds the digest of the question to every later outcome.
    pub fn want_digests(&mut self) {
        self.object.questions.want_digests();
    }

    /// Object with its present shape.
    pub fn object(&self) -> &SoftObject {
        self.object.shown.object()
    }

    /// Pose of the object in the world after the last tick.
    pub fn world_from_object(&self) -> &Isometry3<f64> {
        self.object.shown.world_from_object()
    }

    /// State of the grasp after the last tick.
    pub fn state(&self) -> StateName {
        self.holding.state_name()
    }

    /// First hand of the last tick, as measured, but never below the table of a grasp by friction.
    pub fn hand(&self) -> Option<&HandPose> {
        self.hands.pose(WhichHand::First)
    }

    /// Whether there was a hand in the last tick.
    pub fn has_hand(&self) -> bool {
        WhichHand::ALL.into_iter().any(|which| self.hands.pose(which).is_some())
    }

    /// Hand of the last tick, as [`GraspLoop::hand`], with its segments as the tick shows them, in the
    /// world: those that may not enter the object stay at their last free pose.
    pub fn shown_hand(&self, which: WhichHand) -> Option<(&HandPose, &HandSegments)> {
        Some((self.hands.pose(which)?, self.hands.shown(which)))
    }

    /// Segments of the first hand as the last tick shows them.
    pub fn shown_segments(&self) -> &HandSegments {
        self.hands.shown(WhichHand::First)
    }

    /// Contact of each fingertip after the last tick, thumb first.
    pub fn contacts(&self) -> [Option<Contact>; 5] {
        self.holding.contacts()
    }

    /// Force of each fingertip on the object in its shown shape, thumb first. `None` if the fingers do
    /// not deform it, until the first answer, and unless [`AnswerWishes::forces`] asks for them.
    ///
    /// Units: N. Frame: the object's.
    pub fn fingertip_forces(&self) -> Option<[Vector3<f64>; 5]> {
        self.object.shown.forces()
    }

    /// Whether the server is preparing the object's model.
    pub fn is_model_prepared(&self) -> bool {
        !self.object.questions.link().is_giving_model()
    }

    /// Whether the server is connected.
    pub fn is_connected(&self) -> bool {
        self.object.questions.link().is_connected()
    }

    /// Whether the object is the one asked for, and the server keeps its model.
    pub fn is_object_ready(&self) -> bool {
        self.object.questions.link().has_model() && !self.object.changing.replaces()
    }

    /// Reader of the first hand.
    pub fn reader(&self) -> &HandReader {
        self.hands.readers.first()
    }

    /// Readers of all hands, for their faults.
    pub fn readers(&self) -> &HandReaders {
        &self.hands.readers
    }

    /// Waits until all requests have ended, for at most `at_most`; returns whether they have.
    pub fn wait_idle(&self, at_most: Duration) -> bool {
        self.object.questions.link().wait_idle(at_most)
    }

    /// Waits until all requests have ended, for at most `at_most`, and until background work is done:
    /// then what the next tick finds does not depend on time.
    pub fn settle(&mut self, at_most: Duration) {
        self.object.changing.settle();
        self.object.questions.link().wait_idle(at_most);
    }

    /// Takes what has come from the server since the last tick, if no tick follows.
    ///
    /// # Errors
    /// [`ObjectError`] if the answer does not fit the object.
    pub fn take_last(&mut self) -> Result<TickOutcome, ObjectError> {
        let mut outcome = TickOutcome::default();
        self.object.pick_up(&mut self.holding, &mut outcome)?;
        Ok(outcome)
    }

    /// Plays one tick, at a time on the client's clock.
    ///
    /// # Errors
    /// [`ObjectError`] if the answer does not fit the object.
    pub fn tick(&mut self, tick: u64, now_s: f64, sent: &Sent) -> Result<TickOutcome, ObjectError> {
        let mut outcome = TickOutcome::default();
        self.hands.readers.feed(&sent.arrivals, now_s);
        self.object.questions.begin_tick(sent.recorded.as_ref());
        self.object.pick_up(&mut self.holding, &mut outcome)?;
        self.object.save_when_whole(&mut self.holding, &mut outcome);
        self.hands.look_at_devices(now_s, &mut outcome);
        // Until the devices of a hand have spoken there is none to act with.
        if self.readers().heard(now_s) == 0 {
            return Ok(outcome);
        }
        self.meet_first_hand(now_s);
        let hands = self.hands.measured(now_s, self.table_for_hands());
        self.object.take_work(&mut self.holding, &mut outcome);
        let command = self.object.allowed(sent.command, &mut self.holding, &mut outcome);
        let keeping = self.is_keeping();
        let shown = if self.holding.friction().is_some() {
            let friction = FrictionTick { tick, now_s, hands };
            let shown =
                friction.play(command, &mut self.holding, &mut self.object, &mut outcome)?;
            outcome.seen.keeping = keeping;
            outcome.seen_by_second.keeping = keeping;
            shown
        } else {
            // The thesis's rules know one hand.
            let [Some(TickHand { pose, .. }), _] = hands else { return Ok(outcome) };
            let shown = self.tick_of_the_thesis(tick, &pose, command, &mut outcome)?;
            outcome.seen.keeping = self.is_keeping();
            [Some(shown), None]
        };
        self.hands.show(&hands, shown);
        Ok(outcome)
    }

    /// Height of the table where it stops hands, m.
    fn table_for_hands(&self) -> Option<f64> {
        let contact = self.holding.friction().filter(|_| self.stops_hand);
        contact.and_then(|contact| contact.scene().table_y)
    }

    /// Whether the hand waits until a shape is kept. In lockstep this is done in the next tick, and the
    /// hand goes on.
    fn is_keeping(&self) -> bool {
        self.pace() == Pace::Free && self.object.changing.keep().is_wanted()
    }

    /// Puts the object where the first hand closes that is heard of, if that is wanted.
    fn meet_first_hand(&mut self, now_s: f64) {
        let readers = self.readers();
        let mut heard = WhichHand::ALL.into_iter().filter_map(|which| readers.of(which));
        let heard = heard.find_map(|reader| {
            let (angles, _) = reader.measured(now_s)?;
            Some((angles, reader.hand(now_s)?, reader.setup().dimensions))
        });
        let Some((angles, hand, dimensions)) = heard else { return };
        if std::mem::take(&mut self.place) != ObjectPlace::Hand {
            return;
        }
        self.stops_hand = false;
        let home = where_it_closes(&dimensions, &angles, &hand, self.object());
        if self.holding.set_home(home).is_ok() {
            self.object.shown.place(home);
        }
    }

    /// Plays the part of a tick by the thesis's rules that needs a hand.
    fn tick_of_the_thesis(
        &mut self,
        tick: u64,
        hand: &HandPose,
        command: Option<Command>,
        outcome: &mut TickOutcome,
    ) -> Result<HandSegments, ObjectError> {
        let step = self.step(hand, command, outcome);
        self.follow(tick, &step, outcome)?;
        self.object.shown.place(step.world_from_object);
        outcome.events.extend(step.events.iter().map(|&event| LoopEvent::Grasp(event)));
        outcome.state = Some(step.state);
        outcome.seen.state = Some(step.state);
        outcome.seen.world_from_object = step.world_from_object;
        outcome.recalled = step.recalled;
        outcome.shown_tick = self.object.shown.tick();
        Ok(step.world_from_segment)
    }

    fn step(
        &mut self,
        hand: &HandPose,
        command: Option<Command>,
        outcome: &mut TickOutcome,
    ) -> StepOutput {
        let colliders = HandColliders::new(&self.reader().setup().dimensions, hand);
        let thesis = self.holding.thesis();
        let world_from_object = thesis.world_from_object(&hand.world_from_palm);
        let margin = thesis.release_margin();
        let (tree, normals) = (self.object().tree(), self.object().normals());
        let fingers = sense(tree, normals, &colliders, &world_from_object, margin);
        let tips = fingers.map(|finger| finger.tip_in_object);
        outcome.seen.inside = std::array::from_fn(|i| fingers[i].tip_hits[0].is_some());
        outcome.tips = outcome.seen.inside;
        let tip_radii = self.reader().setup().dimensions.tip_radii();
        self.object.prefetch(&tips, tip_radii, &mut self.holding, outcome);
        self.holding.step(&StepInput {
            world_from_palm: hand.world_from_palm,
            world_from_segment: hand.fingers.map(|f| f.segments.map(|s| s.world_from_segment)),
            fingers,
            command,
        })
    }

    /// Applies the decisions of the thesis's rules to object and server.
    fn follow(
        &mut self,
        tick: u64,
        step: &StepOutput,
        outcome: &mut TickOutcome,
    ) -> Result<(), ObjectError> {
        let tip_radii = self.reader().setup().dimensions.tip_radii();
        let (holding, object) = (&mut self.holding, &mut self.object);
        if step.events.contains(&GraspEvent::ShapeKept) {
            object.keep_made();
        }
        match &step.known {
            Some(known) => {
                outcome.tips = [true; 5];
                let grip = object.questions.begin_grip(tick);
                if object.changing.keep().freezes() {
                    outcome.unanswered.push((tick, Unanswered::KeepingShape));
                    return Ok(());
                }
                let wants_whole = object.changing.wants_whole();
                let shown = object.shown.object();
                let questions = &mut object.questions;
                let question =
                    questions.question_of_tick(shown, tip_radii, wants_whole, known, outcome);
                if questions.ask(tick, grip, question, outcome) {
                    object.wait_in_lockstep(holding, outcome)?;
                }
            }
            // A tick whose input was ignored keeps the shape as it is.
            None if step.state == StateName::Deforming => {
                outcome.unanswered.push((tick, Unanswered::InputIgnored));
            }
            None => object.let_go(holding, outcome)?,
        }
        Ok(())
    }

    /// Sets the place where the object is put when the first hand comes.
    pub fn put_object(&mut self, place: ObjectPlace) {
        self.place = place;
    }

    /// Returns to the rest shape before the last one that was kept; the object is then free at its home.
    /// The result is told in a later tick.
    ///
    /// # Errors
    /// Reason for a refusal, in a sentence.
    pub fn undo_keep_shape(&mut self) -> Result<(), Notice> {
        self.object.changing.refuse_while_changing()?;
        let Some(earlier) = self.object.changing.history().last().map(Arc::clone) else {
            return Err(Notice::refused("no shape has been kept: there is nothing to undo"));
        };
        self.object.begin_to_replace(earlier, Replacement::EarlierShape);
        Ok(())
    }

    /// Puts the object back to its home, with the rest shape that it began with. The result is told in a
    /// later tick.
    ///
    /// # Errors
    /// Reason for a refusal, in a sentence.
    pub fn begin_anew(&mut self) -> Result<(), Notice> {
        self.object.changing.refuse_while_changing()?;
        self.put_object_home();
        if let Some(first) = self.object.changing.history().first().map(Arc::clone) {
            self.object.begin_to_replace(first, Replacement::FirstShape);
        }
        Ok(())
    }

    /// Replaces the object; the new one is free at its home. The result is told in a later tick.
    ///
    /// # Errors
    /// Reason for a refusal, in a sentence.
    pub fn replace_object(&mut self, rest: Arc<RestShape>, name: &str) -> Result<(), Notice> {
        self.object.changing.refuse_while_changing()?;
        self.object.begin_to_replace(rest, Replacement::Other(name.to_owned()));
        Ok(())
    }

    /// Changes the object's material; it stays held as it is. An element that was chosen as the cheapest
    /// without locking follows Poisson's ratio. The result is told in a later tick.
    ///
    /// # Errors
    /// Reason for a refusal, in a sentence.
    pub fn set_material(&mut self, material: Material) -> Result<(), Notice> {
        self.object.set_material(material)
    }

    /// Rotates the object about its centre while nothing holds it (thesis 6.1.2).
    ///
    /// Frame: the rotation is in the world frame.
    ///
    /// # Errors
    /// [`GraspError`] while the hand holds it.
    pub fn turn_object(&mut self, rotation: UnitQuaternion<f64>) -> Result<(), GraspError> {
        let centre = self.world_from_object() * self.object().rest_shape().centre();
        let about = Translation3::from(centre.coords);
        let mut turned: Isometry3<f64> =
            about * rotation * about.inverse() * self.world_from_object();
        turned.rotation.renormalize();
        self.holding.place(turned)?;
        self.object.shown.place(turned);
        Ok(())
    }

    /// Releases the object at its pose, because the hand is replaced.
    pub fn let_object_go(&mut self) {
        self.holding.let_go();
    }

    /// Releases the object and puts it back to its home.
    pub fn put_object_home(&mut self) {
        self.holding.put_home(&mut self.object.shown);
    }

    /// Saves the object in its present shape, with all nodes. If the inside is not known it is asked for
    /// first. The result is told in a later tick.
    ///
    /// # Errors
    /// Reason for a refusal, in a sentence.
    pub fn save(&mut self, path: PathBuf) -> Result<Option<Notice>, Notice> {
        self.object.changing.save(path, self.object.shown.object())
    }

    /// Sets the method, from the next question on.
    pub fn set_method(&mut self, method: MethodName) {
        self.object.questions.set_method(method);
    }

    /// Sets the nodes that are asked for, from the next question on.
    pub fn set_subscription(&mut self, subscription: Subscription) {
        self.object.questions.settings_mut().subscription = subscription;
    }

    /// Wishes for the answers, from the next question on.
    pub fn wishes_mut(&mut self) -> &mut AnswerWishes {
        self.object.questions.wishes_mut()
    }

    /// Number of kept shapes that can be undone.
    pub fn undo_count(&self) -> usize {
        self.object.changing.history().len()
    }

    /// Continues what is under way while no tick is played.
    ///
    /// # Errors
    /// [`ObjectError`] if the answer does not fit the object.
    pub fn idle(&mut self) -> Result<TickOutcome, ObjectError> {
        let mut outcome = TickOutcome::default();
        self.object.pick_up(&mut self.holding, &mut outcome)?;
        self.object.save_when_whole(&mut self.holding, &mut outcome);
        self.object.take_work(&mut self.holding, &mut outcome);
        let tip_radii = self.reader().setup().dimensions.tip_radii();
        self.object.ask_for_inside(tip_radii);
        Ok(outcome)
    }
}
