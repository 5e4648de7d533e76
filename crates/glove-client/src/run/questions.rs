//! What a run asks the server: the questions of ticks, and which of their answers a tick takes.

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

/// What a report says when the server has prepared the model of a rest shape.
pub const MODEL_READY: &str = "model ready";
/// Stands for the tick of a question about the shape that an object springs back to. Recordings
/// hold it; every reader of JSON can represent it.
pub const SPRINGBACK: u64 = (1 << 53) - 1;
/// Stands for the tick of a question that no tick asked; no report counts it.
pub(crate) const UNCOUNTED: u64 = u64::MAX;
/// Longest wait of a lockstep tick; a server that takes longer is overtaken.
const LOCKSTEP_WAIT_MAX: Duration = Duration::from_secs(30);
/// Share of the time from tick to tick in which a live frame at large deformation is to be answered;
/// the rest is for what a solve takes longer, for the wire and for the shape.
const SHARE_FOR_ANSWERS: f64 = 0.6;

/// What the server is asked about the object, and how.
pub(crate) struct Questions {
    link: Link,
    settings: SolveSettings,
    wishes: AnswerWishes,
    pace: Pace,
    /// Time that a live frame at large deformation may take, ms.
    answer_within_ms: Option<f64>,
    /// Tick in which the grip began, to tell answers of an earlier grip from those of this one.
    grip: Option<u64>,
    held: HeldNodes,
    /// What the fingers held the object by in the last tick that asked.
    last_known: Option<[KnownNode; 5]>,
    prefetched: Prefetched,
    /// Whether digests of requests are wanted.
    digests: bool,
    /// What the tick did with answers when it was recorded, while it is played again.
    recorded: Option<RecordedAnswers>,
    /// Requests that have ended and whose time to be taken has not come, while ticks are played
    /// again.
    held_back: Vec<RequestEnd>,
}

impl Questions {
    /// Questions about an object, whose model is sent to the server at once.
    pub(crate) fn new(
        link: Link,
        settings: SolveSettings,
        pace: Pace,
        object: &SoftObject,
    ) -> Self {
        let SolveSettings { material, element, max_error, .. } = settings;
        link.set_model(ModelUpload::new(object.rest(), object.rest_shapes(), material, element));
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

    /// Settings from the next question on; the material is that of the model that is there.
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

    /// A live frame asks for its answer within a share of the time from tick to tick.
    pub(crate) fn tick_every(&mut self, period: Duration) {
        self.answer_within_ms = Some(SHARE_FOR_ANSWERS * 1e3 * period.as_secs_f64());
    }

    /// Tells what the next tick did with answers when it was recorded; `None` for a tick that is new.
    pub(crate) fn begin_tick(&mut self, recorded: Option<&RecordedAnswers>) {
        self.recorded = recorded.cloned();
    }

    pub(crate) fn recorded(&self) -> Option<&RecordedAnswers> {
        self.recorded.as_ref()
    }

    /// Tick in which the grip began that is going on.
    pub(crate) fn grip(&self) -> Option<u64> {
        self.grip
    }

    /// Tick in which the grip began; it begins in this one if none is going on.
    pub(crate) fn begin_grip(&mut self, tick: u64) -> u64 {
        *self.grip.get_or_insert(tick)
    }

    pub(crate) fn end_grip(&mut self) {
        self.grip = None;
    }

    /// The method from the next question on.
    pub(crate) fn set_method(&mut self, method: softgrasp_protocol::MethodName) {
        self.settings.method = method;
        // Columns that were not asked for under another method may be needed now.
        self.prefetched.clear();
    }

    /// The object has another rest shape, or is another one: its model is sent to the server.
    pub(crate) fn meet_model(&mut self, model: ModelUpload) {
        self.last_known = None;
        self.held.clear();
        self.prefetched.clear();
        self.link.set_model(model);
    }

    /// The question of a tick in which the fingers prescribe displacements.
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

    /// Asks the server; whether it was asked. A tick that is played again asks what was answered, by
    /// the method that answered it, and nothing else.
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

    /// Asks the last question of the grip once more, for all nodes and outside the ticks; whether
    /// there is one.
    pub(crate) fn ask_whole(&mut self, object: &SoftObject, tip_radii: [f64; 5]) -> bool {
        let (Some(grip), Some(known)) = (self.grip, self.last_known) else { return false };
        let question = self.question(object, tip_radii, true, &known);
        self.link.ask(UNCOUNTED, grip, question, self.large_ask());
        true
    }

    /// Asks for the shape that the object takes when it is held by nothing but a support
    /// (prescribed displacements that carry no force).
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

    /// What is asked of large deformation. Where bits are to repeat, nothing may depend on the
    /// clock: in lockstep, and while a run is recorded or played again.
    fn large_ask(&self) -> Option<LargeAsk> {
        let repeats = self.pace == Pace::Lockstep || self.digests || self.recorded.is_some();
        let pace = if repeats { FramePace::Repeatable } else { FramePace::Timely };
        self.settings.elasticity.ask(PathChoice::Continue, pace)
    }

    /// In lockstep the tick waits for the answers; whether it did.
    pub(crate) fn wait_in_lockstep(&self) -> bool {
        let waits = self.pace == Pace::Lockstep;
        if waits {
            self.link.wait_idle(LOCKSTEP_WAIT_MAX);
        }
        waits
    }

    /// Requests that have ended and that the tick takes: all, or when it is played again those that
    /// it took before, in the same order. What the server has done besides becomes events.
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

    /// Whether the tick takes rest shapes that were made beside the ticks: one that is played again
    /// only if it did so before.
    pub(crate) fn takes_shapes(&self) -> bool {
        self.recorded.as_ref().is_none_or(|recorded| recorded.took_work)
    }

    /// Whether the tick, when it was recorded, got no shape that the object springs back to.
    pub(crate) fn springback_was_refused(&self) -> bool {
        self.recorded.as_ref().is_some_and(|recorded| recorded.springback_refused)
    }

    /// Forces of the fingertips in an answer to the question of this grip (N, the object's frame).
    pub(crate) fn fingertip_forces(
        &self,
        reactions: &[DofValue],
        mask_forces: &[[f64; 3]],
    ) -> Option<[nalgebra::Vector3<f64>; 5]> {
        self.held.fingertip_forces(reactions, mask_forces)
    }

    /// The work that lets the server prepare the columns of what a fingertip is about to touch, if
    /// anything is near that has not been prepared.
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
