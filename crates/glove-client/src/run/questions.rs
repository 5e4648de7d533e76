//! Questions of the ticks to the server, and the choice of the answers that a tick takes.

use std::sync::Arc;
use std::time::Duration;

use nalgebra::Point3;
use softgrasp_grasp::grasp::KnownNode;
use softgrasp_grasp::object::SoftObject;
use softgrasp_hand::sent::RecordedAnswers;
use softgrasp_protocol::{
    Deformation, DofValue, LargeAsk, NodeChoice, Pace as FramePace, PathChoice, Question, Want,
};

use crate::ask::digest::request_digest;
use crate::ask::held_nodes::{HeldNodes, PrescribedDisplacements};
use crate::ask::link::{Link, LinkEvent, RequestEnd};
use crate::ask::model_upload::ModelUpload;
use crate::ask::prefetch::Prefetched;
use crate::ask::solve_settings::{AnswerWishes, SolveSettings, Subscription};
use crate::ask::unanswered::Unanswered;
use crate::object::object_work::ObjectJob;
use crate::pace::Pace;
use crate::run::tick_outcome::{LoopEvent, TickOutcome};

/// Text of the report's event when the server has prepared the model of a rest shape.
pub const MODEL_READY: &str = "model ready";
/// Number used as the tick of a question about the shape that an object springs back to. Recordings
/// contain it; every reader of JSON can represent it.
pub const SPRINGBACK: u64 = (1 << 53) - 1;
/// Number used as the tick of a question outside the ticks, which no report counts.
pub(crate) const UNCOUNTED: u64 = u64::MAX;
/// Longest wait of a lockstep tick for its answer.
const LOCKSTEP_WAIT_MAX: Duration = Duration::from_secs(30);
/// Share of the time from tick to tick within which a live question at large deformation is to be
/// answered; the rest is for solves that take longer, for the wire and for the shape.
const SHARE_FOR_ANSWERS: f64 = 0.6;

/// Questions about the object, and their settings.
pub(crate) struct Questions {
    link: Link,
    settings: SolveSettings,
    wishes: AnswerWishes,
    pace: Pace,
    /// Time that a live question at large deformation may take, ms.
    answer_within_ms: Option<f64>,
    /// Tick in which the grip began, to tell answers of an earlier grip from those of this one.
    grip: Option<u64>,
    held: HeldNodes,
    /// Contacts of the fingers in the last tick that asked.
    last_known: Option<[KnownNode; 5]>,
    prefetched: Prefetched,
    /// Whether digests of questions are wanted.
    digests: bool,
    /// Answers that the tick took when it was recorded, during a replay.
    recorded: Option<RecordedAnswers>,
    /// Requests that have ended and are taken by a later tick, during a replay.
    held_back: Vec<RequestEnd>,
}

impl Questions {
    /// Questions about an object; sends its model to the server at once.
    pub(crate) fn new(
        link: Link,
        settings: SolveSettings,
        pace: Pace,
        object: &SoftObject,
    ) -> Self {
        let SolveSettings { material, element, max_error, .. } = settings;
        link.set_model(ModelUpload::new(
            object.rest_shape(),
            object.rest_shapes(),
            material,
            element,
        ));
        Self {
            link,
            settings,
            wishes: AnswerWishes { max_error, ..AnswerWishes::default() },
            pace,
            answer_within_ms: None,
            grip: None,
            held: HeldNodes::default(),
            last_known: None,
            prefetched: Prefetched::default(),
            digests: false,
            recorded: None,
            held_back: Vec::new(),
        }
    }

    pub(crate) fn link(&self) -> &Link {
        &self.link
    }

    pub(crate) fn settings(&self) -> &SolveSettings {
        &self.settings
    }

    /// Settings of the next questions; the material is that of the present model.
    pub(crate) fn settings_mut(&mut self) -> &mut SolveSettings {
        &mut self.settings
    }

    pub(crate) fn wishes_mut(&mut self) -> &mut AnswerWishes {
        &mut self.wishes
    }

    pub(crate) fn pace(&self) -> Pace {
        self.pace
    }

    pub(crate) fn want_digests(&mut self) {
        self.digests = true;
    }

    pub(crate) fn wants_digests(&self) -> bool {
        self.digests
    }

    /// Sets the time from tick to tick, of which live questions ask for their answer within a share.
    pub(crate) fn tick_every(&mut self, period: Duration) {
        self.answer_within_ms = Some(SHARE_FOR_ANSWERS * 1e3 * period.as_secs_f64());
    }

    /// Sets the answers that the next tick took when it was recorded; `None` for a tick that is new.
    pub(crate) fn begin_tick(&mut self, recorded: Option<&RecordedAnswers>) {
        self.recorded = recorded.cloned();
    }

    pub(crate) fn recorded(&self) -> Option<&RecordedAnswers> {
        self.recorded.as_ref()
    }

    /// Tick in which the present grip began.
    pub(crate) fn grip(&self) -> Option<u64> {
        self.grip
    }

    /// Tick in which the grip began; it begins in `tick` if there is none.
    pub(crate) fn begin_grip(&mut self, tick: u64) -> u64 {
        *self.grip.get_or_insert(tick)
    }

    pub(crate) fn end_grip(&mut self) {
        self.grip = None;
    }

    /// Sets the method, from the next question on.
    pub(crate) fn set_method(&mut self, method: softgrasp_protocol::MethodName) {
        self.settings.method = method;
        // Columns that were not asked for under another method may be needed now.
        self.prefetched.clear();
    }

    /// Sends the model of another rest shape or object to the server.
    pub(crate) fn meet_model(&mut self, model: ModelUpload) {
        self.last_known = None;
        self.held.clear();
        self.prefetched.clear();
        self.link.set_model(model);
    }

    /// Question of a tick in which the fingers prescribe displacements.
    pub(crate) fn question_of_tick(
        &mut self,
        object: &SoftObject,
        tip_radii: [f64; 5],
        wants_whole: bool,
        known: &[KnownNode; 5],
        outcome: &mut TickOutcome,
    ) -> Question {
        self.last_known = Some(*known);
        let question = self.question(object, tip_radii, wants_whole, known);
        if self.digests {
            outcome.request_digest = Some(request_digest(&question));
        }
        question
    }

    /// Nodes whose displacements a tick asks for.
    pub(crate) fn nodes(&self, object: &SoftObject, wants_whole: bool) -> NodeChoice {
        match self.settings.subscription {
            Subscription::Surface if !wants_whole => {
                NodeChoice::Nodes(object.surface().nodes.clone())
            }
            _ => NodeChoice::All,
        }
    }

    fn question(
        &mut self,
        object: &SoftObject,
        tip_radii: [f64; 5],
        wants_whole: bool,
        known: &[KnownNode; 5],
    ) -> Question {
        let contact = self.settings.contact;
        let PrescribedDisplacements { of_dofs, masks, of_masks } =
            self.held.prescribed_displacements(contact, object, tip_radii, known);
        let nodes = self.nodes(object, wants_whole);
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

    /// Asks the server; returns whether it was asked. A tick that is replayed only asks what was answered
    /// when it was recorded, by the method that answered it.
    pub(crate) fn ask(
        &mut self,
        tick: u64,
        grip: u64,
        mut question: Question,
        outcome: &mut TickOutcome,
    ) -> bool {
        if let Some(recorded) = &self.recorded {
            let Some(method) = &recorded.answered_by else {
                outcome.unanswered.push((tick, Unanswered::AnswerLate));
                return false;
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
        true
    }

    /// Asks the last question of the grip again for all nodes, outside the ticks; returns whether there
    /// is one.
    pub(crate) fn ask_whole(&mut self, object: &SoftObject, tip_radii: [f64; 5]) -> bool {
        let (Some(grip), Some(known)) = (self.grip, self.last_known) else { return false };
        let question = self.question(object, tip_radii, true, &known);
        self.link.ask(UNCOUNTED, grip, question, self.large_ask());
        true
    }

    /// Asks for the equilibrium of the object without the hand, held by prescribed displacements that
    /// carry no force.
    pub(crate) fn ask_to_spring_back(&self, grip: u64, support: Vec<DofValue>) {
        let question = Question {
            known: support,
            want: Want { nodes: NodeChoice::All, ..Want::default() },
            // No budget: the shape stays for good.
            max_error: None,
            ..Question::default()
        };
        self.link.ask(SPRINGBACK, grip, question, self.large_ask());
    }

    /// Wish for large deformation. In lockstep, and while a run is recorded or replayed, the answer must
    /// not depend on elapsed time, so that its bits repeat.
    fn large_ask(&self) -> Option<LargeAsk> {
        let repeats = self.pace == Pace::Lockstep || self.digests || self.recorded.is_some();
        let pace = if repeats { FramePace::Repeatable } else { FramePace::Timely };
        self.settings.elasticity.ask(PathChoice::Continue, pace)
    }

    /// Waits for the answers in lockstep; returns whether it waited.
    pub(crate) fn wait_in_lockstep(&self) -> bool {
        let waits = self.pace == Pace::Lockstep;
        if waits {
            self.link.wait_idle(LOCKSTEP_WAIT_MAX);
        }
        waits
    }

    /// Requests that have ended and that the tick takes: all, or in a replay those that it took when it
    /// was recorded, in the same order. Other news of the server become events.
    pub(crate) fn take_ended(&mut self, outcome: &mut TickOutcome) -> Vec<RequestEnd> {
        let (events, ended) = self.link.take();
        outcome.events.extend(events.into_iter().map(|event| LoopEvent::Server(words_of(event))));
        let Some(recorded) = &self.recorded else { return ended };
        self.held_back.extend(ended);
        let held_back = &mut self.held_back;
        let taken = recorded.taken.iter().filter_map(|tick| {
            let at = held_back.iter().position(|end| end.tick == *tick)?;
            Some(held_back.remove(at))
        });
        taken.collect()
    }

    /// Whether the tick takes rest shapes that were made in the background; in a replay only if it did so
    /// when it was recorded.
    pub(crate) fn takes_shapes(&self) -> bool {
        self.recorded.as_ref().is_none_or(|recorded| recorded.took_work)
    }

    /// Whether the recorded tick got no shape to spring back to.
    pub(crate) fn springback_was_refused(&self) -> bool {
        self.recorded.as_ref().is_some_and(|recorded| recorded.springback_refused)
    }

    /// Forces of the fingertips in an answer to the question of this grip, N, in the object's frame.
    pub(crate) fn fingertip_forces(
        &self,
        reactions: &[DofValue],
        mask_forces: &[[f64; 3]],
    ) -> Option<[nalgebra::Vector3<f64>; 5]> {
        self.held.fingertip_forces(reactions, mask_forces)
    }

    /// Job that makes the hint for contacts that a fingertip is about to make; `None` if all of them are
    /// prepared.
    ///
    /// Units: m. Frame: the object's.
    pub(crate) fn next_prefetch(
        &mut self,
        object: &SoftObject,
        tip_radii: [f64; 5],
        tips_in_object: &[Point3<f64>; 5],
    ) -> Option<ObjectJob> {
        // Only condensed frames are made of columns.
        if !matches!(self.settings.method.as_str(), "auto" | "condensed") {
            return None;
        }
        let model = self.settings.contact;
        let contacts = self.prefetched.next(model, object.tree(), tips_in_object);
        (!contacts.is_empty()).then(|| ObjectJob::Prefetch {
            rest: Arc::clone(object.rest_shape()),
            rest_shapes: object.rest_shapes(),
            model,
            tip_radii,
            contacts,
        })
    }
}

fn words_of(event: LinkEvent) -> String {
    match event {
        LinkEvent::Connected { server } => format!("connected to {server}"),
        LinkEvent::Refused { text } => format!("refused {text}"),
        LinkEvent::Lost { text } => format!("lost: {text}"),
        LinkEvent::ModelReady(ready) => {
            tracing::info!(model = %ready.model, "model ready");
            MODEL_READY.to_owned()
        }
    }
}
