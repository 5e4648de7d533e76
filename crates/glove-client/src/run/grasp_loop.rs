//! One tick of the client in fixed order: bytes, pose, contacts, grasp, request, answer.

use std::sync::Arc;
use std::time::Duration;

use nalgebra::{Isometry3, Point3, Vector3};
use softgrasp_grasp::grasp::{
    Command, Contact, Grasp, GraspEvent, HandSegments, KnownNode, StateName, StepInput, StepOutput,
    sense,
};
use softgrasp_grasp::hand::{HandColliders, HandPose};
use softgrasp_grasp::object::{ObjectError, SoftObject};
use softgrasp_hand::arrival::Device;
use softgrasp_hand::hand_reader::HandReader;
use softgrasp_hand::notice::Notice;
use softgrasp_hand::sent::{RecordedAnswers, Sent};
use softgrasp_protocol::{NodeChoice, Question, Want};

use crate::ask::digest::request_digest;
use crate::ask::held_nodes::{HeldNodes, PrescribedDisplacements};
use crate::ask::link::{Link, RequestEnd};
use crate::ask::model_upload::ModelUpload;
use crate::ask::prefetch::Prefetched;
use crate::ask::solve_settings::{AnswerWishes, SolveSettings, Subscription};
use crate::ask::unanswered::Unanswered;
use crate::object::object_changes::ObjectChanges;
use crate::object::object_place::ObjectPlace;
use crate::object::object_work::{ObjectJob, ObjectWork};
use crate::pace::Pace;
use crate::run::contact_grasp::ContactGrasp;
use crate::run::keep::Keep;
use crate::run::tick_outcome::{LoopEvent, TickOutcome};

/// The client between devices and server.
pub struct GraspLoop {
    pub(crate) reader: HandReader,
    pub(crate) object: SoftObject,
    pub(crate) grasp: Grasp,
    /// The grasp by contact with friction, which then takes the place of the thesis's rules.
    pub(crate) contact: Option<Box<ContactGrasp>>,
    /// Where the object is put when the first hand comes.
    pub(crate) place: ObjectPlace,
    pub(crate) link: Link,
    pub(crate) settings: SolveSettings,
    pub(crate) wishes: AnswerWishes,
    pub(crate) pace: Pace,
    /// Time that a live frame at large deformation may take, ms.
    pub(crate) answer_within_ms: Option<f64>,
    /// Tick in which the grip began, to tell answers of an earlier grip from those of this one.
    pub(crate) deforming_since: Option<u64>,
    /// Tick whose answer the object shows.
    pub(crate) shown_tick: Option<u64>,
    /// Forces of the fingertips in the answer that the object shows.
    pub(crate) shown_forces: Option<[Vector3<f64>; 5]>,
    pub(crate) held: HeldNodes,
    pub(crate) keep: Keep,
    /// Whether the shape that the object shows has flowed, so that it will not go back to rest.
    pub(crate) has_flowed: bool,
    /// What the fingers held the object by in the last tick that asked.
    pub(crate) last_known: Option<[KnownNode; 5]>,
    pub(crate) changes: ObjectChanges,
    pub(crate) work: ObjectWork,
    pub(crate) prefetched: Prefetched,
    pub(crate) world_from_object: Isometry3<f64>,
    hand: Option<HandPose>,
    pub(crate) shown_segments: HandSegments,
    /// Devices that were silent in the last tick.
    silent: Vec<Device>,
    /// Whether digests of requests are wanted.
    pub(crate) digests: bool,
    /// What the tick did with answers when it was recorded, while it is played again.
    pub(crate) recorded: Option<RecordedAnswers>,
    /// Requests that have ended and whose time to be taken has not come, while ticks are played
    /// again.
    pub(crate) held_back: Vec<RequestEnd>,
}

/// What a report says when the server has prepared the model of a rest shape.
pub const MODEL_READY: &str = "model ready";
/// Longest wait of a lockstep tick; a server that takes longer is overtaken.
pub(crate) const LOCKSTEP_WAIT_MAX: Duration = Duration::from_secs(30);
/// Share of the time from tick to tick in which a live frame at large deformation is to be answered;
/// the rest is for what a solve takes longer, for the wire and for the shape.
const SHARE_FOR_ANSWERS: f64 = 0.6;

impl GraspLoop {
    /// A loop around an object at the origin; its model is sent to the server at once. To be made
    /// before the calling thread asks for real-time priority.
    ///
    /// # Errors
    /// The system's, when it gives no thread.
    pub fn try_new(
        reader: HandReader,
        object: SoftObject,
        grasp: Grasp,
        link: Link,
        settings: SolveSettings,
        pace: Pace,
    ) -> std::io::Result<Self> {
        let SolveSettings { material, element, max_error, .. } = settings;
        link.set_model(ModelUpload::new(object.rest(), object.rest_shapes(), material, element));
        Ok(Self {
            reader,
            object,
            grasp,
            contact: None,
            place: ObjectPlace::Home,
            link,
            settings,
            wishes: AnswerWishes { max_error, ..AnswerWishes::default() },
            pace,
            deforming_since: None,
            shown_tick: None,
            shown_forces: None,
            held: HeldNodes::default(),
            keep: Keep::NotWanted,
            has_flowed: false,
            last_known: None,
            changes: ObjectChanges::default(),
            work: ObjectWork::start(pace)?,
            prefetched: Prefetched::default(),
            world_from_object: Isometry3::identity(),
            hand: None,
            shown_segments: [[Isometry3::identity(); 3]; 5],
            silent: Vec::new(),
            digests: false,
            recorded: None,
            held_back: Vec::new(),
            answer_within_ms: None,
        })
    }

    /// Tells how long it is from tick to tick: a live frame asks for its answer within that time.
    pub fn tick_every(&mut self, period: Duration) {
        self.answer_within_ms = Some(SHARE_FOR_ANSWERS * 1e3 * period.as_secs_f64());
    }

    /// Whether ticks wait for answers.
    pub fn pace(&self) -> Pace {
        self.pace
    }

    /// From now on every outcome has the digest of what was asked.
    pub fn want_digests(&mut self) {
        self.digests = true;
    }

    /// The object as it is now.
    pub fn object(&self) -> &SoftObject {
        &self.object
    }

    /// Object pose after the last tick.
    pub fn world_from_object(&self) -> &Isometry3<f64> {
        &self.world_from_object
    }

    /// State of the grasp.
    pub fn state(&self) -> StateName {
        match &self.contact {
            Some(contact) => contact.state_name(),
            None => self.grasp.state().name(),
        }
    }

    /// The hand as measured in the last tick.
    pub fn hand(&self) -> Option<&HandPose> {
        self.hand.as_ref()
    }

    /// The segments as the last tick shows them, in the world: those that may not enter the object
    /// stay at their last free pose.
    pub fn shown_segments(&self) -> &HandSegments {
        &self.shown_segments
    }

    /// What each fingertip holds after the last tick, thumb first.
    pub fn contacts(&self) -> [Option<Contact>; 5] {
        self.grasp.state().contacts()
    }

    /// Force of each fingertip on the object as it is shown, thumb first; `None` where the fingers
    /// do not deform it, until the first answer, and unless [`AnswerWishes::forces`] asks for them.
    ///
    /// Units: N. Frame: the object's.
    pub fn fingertip_forces(&self) -> Option<[Vector3<f64>; 5]> {
        self.shown_forces
    }

    /// Whether the server is preparing the object's model.
    pub fn is_model_prepared(&self) -> bool {
        !self.link.is_giving_model()
    }

    /// Whether the server is there.
    pub fn is_connected(&self) -> bool {
        self.link.is_connected()
    }

    /// The reader, for its faults.
    pub fn reader(&self) -> &HandReader {
        &self.reader
    }

    /// Waits until the server has answered all, at most so long.
    pub fn wait_idle(&self, at_most: Duration) -> bool {
        self.link.wait_idle(at_most)
    }

    /// Waits until the server has answered all, at most so long, and until the work beside the ticks
    /// is done: what the next tick finds then does not depend on time.
    pub fn settle(&mut self, at_most: Duration) {
        self.work.settle();
        self.link.wait_idle(at_most);
    }

    /// What the server has done since the last tick, when no tick follows.
    ///
    /// # Errors
    /// [`ObjectError`] when the object cannot be shown any more.
    pub fn take_last(&mut self) -> Result<TickOutcome, ObjectError> {
        let mut outcome = TickOutcome::default();
        self.pick_up(&mut outcome)?;
        Ok(outcome)
    }

    /// One tick at a time on the client's clock.
    ///
    /// # Errors
    /// [`ObjectError`] when the object cannot be shown any more.
    pub fn tick(&mut self, tick: u64, now_s: f64, sent: &Sent) -> Result<TickOutcome, ObjectError> {
        let mut outcome = TickOutcome::default();
        self.reader.feed(&sent.arrivals, now_s);
        self.recorded.clone_from(&sent.recorded);
        self.pick_up(&mut outcome)?;
        self.save_when_whole(&mut outcome);
        self.look_at_devices(now_s, &mut outcome);
        // Until both devices have spoken there is no hand to act with.
        let Some(hand) = self.reader.hand(now_s) else { return Ok(outcome) };
        self.meet_first_hand(&hand, now_s);
        self.take_work(&mut outcome);
        let command = self.allowed(sent.command, &mut outcome);
        // In lockstep a shape is kept in the next tick, and the hand goes on.
        let keeping = self.pace == Pace::Free && !matches!(self.keep, Keep::NotWanted);
        if self.contact.is_some() {
            self.tick_with_friction(tick, now_s, &hand, command, &mut outcome)?;
            self.hand = Some(hand);
            outcome.seen.keeping = keeping;
            return Ok(outcome);
        }
        let step = self.step(&hand, command, &mut outcome);
        self.follow(tick, &step, &mut outcome)?;
        self.world_from_object = step.world_from_object;
        self.hand = Some(hand);
        self.shown_segments = step.world_from_segment;
        outcome.events.extend(step.events.iter().map(|&event| LoopEvent::Grasp(event)));
        outcome.state = Some(step.state);
        outcome.seen.state = Some(step.state);
        outcome.seen.world_from_object = step.world_from_object;
        // In lockstep a shape is kept in the next tick, and the hand goes on.
        outcome.seen.keeping = self.pace == Pace::Free && !matches!(self.keep, Keep::NotWanted);
        outcome.recalled = step.recalled;
        outcome.shown_tick = self.shown_tick;
        Ok(outcome)
    }

    /// Tells when a device falls silent, and when it speaks again. A hand that is not heard of stays
    /// where it was, and so does what it holds.
    fn look_at_devices(&mut self, now_s: f64, outcome: &mut TickOutcome) {
        outcome.silent = self.reader.silent(now_s);
        let silent = &outcome.silent;
        let fallen = silent.iter().filter(|device| !self.silent.contains(device));
        let what = match self.reader.measured(now_s) {
            Some(_) => "the hand is held where it was",
            None => "there is no hand yet",
        };
        let tell =
            |device: &Device| Notice::refused(format!("the {} is silent: {what}", device.name()));
        outcome.events.extend(fallen.map(tell).map(LoopEvent::Device));
        let back = self.silent.iter().filter(|device| !silent.contains(device));
        let tell = |device: &Device| Notice::done(format!("the {} speaks again", device.name()));
        outcome.events.extend(back.map(tell).map(LoopEvent::Device));
        self.silent.clone_from(&outcome.silent);
        outcome.events.extend(self.reader.take_news().into_iter().map(LoopEvent::Device));
    }

    fn step(
        &mut self,
        hand: &HandPose,
        command: Option<Command>,
        outcome: &mut TickOutcome,
    ) -> StepOutput {
        let colliders = HandColliders::new(&self.reader.setup().dimensions, hand);
        let world_from_object = self.grasp.world_from_object(&hand.world_from_palm);
        let margin = self.grasp.release_margin();
        let (tree, normals) = (self.object.tree(), self.object.normals());
        let fingers = sense(tree, normals, &colliders, &world_from_object, margin);
        let tips = fingers.map(|finger| finger.tip_in_object);
        outcome.seen.inside = std::array::from_fn(|i| fingers[i].tip_hits[0].is_some());
        outcome.tips = outcome.seen.inside;
        self.prefetch(&tips, outcome);
        self.grasp.step(&StepInput {
            world_from_palm: hand.world_from_palm,
            world_from_segment: hand.fingers.map(|f| f.segments.map(|s| s.world_from_segment)),
            fingers,
            command,
        })
    }

    /// Does to object and server what the grasp decided.
    fn follow(
        &mut self,
        tick: u64,
        step: &StepOutput,
        outcome: &mut TickOutcome,
    ) -> Result<(), ObjectError> {
        if step.events.contains(&GraspEvent::ShapeKept)
            && let Keep::Made(kept) = std::mem::replace(&mut self.keep, Keep::NotWanted)
        {
            self.changes.history.push(Arc::clone(self.object.rest_shape()));
            self.show_from_now_on(*kept);
        }
        match &step.known {
            Some(known) => {
                outcome.tips = [true; 5];
                let grip = *self.deforming_since.get_or_insert(tick);
                if self.keep.freezes() {
                    outcome.unanswered.push((tick, Unanswered::KeepingShape));
                    return Ok(());
                }
                self.last_known = Some(*known);
                let question = self.question(known);
                if self.digests {
                    outcome.request_digest = Some(request_digest(&question));
                }
                self.ask(tick, grip, question, outcome)?;
            }
            // A tick whose input was ignored keeps the shape as it is.
            None if step.state == StateName::Deforming => {
                outcome.unanswered.push((tick, Unanswered::InputIgnored));
            }
            None => self.let_go(outcome)?,
        }
        Ok(())
    }

    /// The fingers do not deform the object (any more).
    fn let_go(&mut self, outcome: &mut TickOutcome) -> Result<(), ObjectError> {
        if let Some(grip) = self.deforming_since
            && self.springs_back()
        {
            return self.begin_to_spring_back(grip, outcome);
        }
        self.deforming_since = None;
        if self.keep.is_dent() {
            return Ok(());
        }
        self.stop_keeping(outcome);
        self.refuse_to_save_half(outcome);
        self.link.cancel();
        self.object.relax()
    }

    /// The question of a tick.
    pub(crate) fn question(&mut self, known: &[KnownNode; 5]) -> Question {
        let tip_radii = self.reader.setup().dimensions.tip_radii();
        let contact = self.settings.contact;
        let PrescribedDisplacements { of_dofs, masks, of_masks } =
            self.held.prescribed_displacements(contact, &self.object, tip_radii, known);
        let nodes = match self.settings.subscription {
            Subscription::Surface
                if matches!(self.keep, Keep::NotWanted) && self.changes.save_to.is_none() =>
            {
                NodeChoice::Nodes(self.object.surface().nodes.clone())
            }
            _ => NodeChoice::All,
        };
        Question {
            known: of_dofs,
            masks,
            mask_displacements: of_masks,
            method: self.settings.method.clone(),
            want: Want { nodes, reactions: self.wishes.forces, ..Want::default() },
            max_error: self.wishes.max_error.or(self.settings.error_of_frames()),
            ..Question::default()
        }
    }

    /// Lets the server prepare the columns of what a fingertip is about to touch.
    pub(crate) fn prefetch(
        &mut self,
        tips_in_object: &[Point3<f64>; 5],
        outcome: &mut TickOutcome,
    ) {
        // Only condensed frames are made of columns.
        if !matches!(self.settings.method.as_str(), "auto" | "condensed") {
            return;
        }
        let model = self.settings.contact;
        let contacts = self.prefetched.next(model, self.object.tree(), tips_in_object);
        if !contacts.is_empty() {
            self.work.begin(ObjectJob::Prefetch {
                rest: Arc::clone(self.object.rest_shape()),
                rest_shapes: self.object.rest_shapes(),
                model,
                tip_radii: self.reader.setup().dimensions.tip_radii(),
                contacts,
            });
            self.take_work(outcome);
        }
    }
}
