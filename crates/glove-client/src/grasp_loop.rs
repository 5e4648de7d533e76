//! One tick of the client in fixed order: bytes, pose, contacts, grasp, request, answer.

use std::sync::Arc;
use std::time::Duration;

use nalgebra::{Isometry3, Point3};
use softgrasp_core::grasp::{
    Command, Grasp, GraspEvent, KnownNode, StateName, StepInput, StepOutput, sense,
};
use softgrasp_core::hand::{HandColliders, HandPose};
use softgrasp_protocol::{
    ElementName, Material, MethodName, ModelHash, NodeChoice, Precision, Question, UploadModel,
    Want,
};

use crate::commands::mesh_data;
use crate::contact_model::{ContactModel, HeldNodes, Prescribed};
use crate::hand_reader::HandReader;
use crate::link::{Link, LinkEvent, ModelOrder};
use crate::prefetch::Prefetched;
use crate::scripted::{Seen, Sent};
use crate::soft_object::{ObjectError, SoftObject};
use crate::solve_report::SolveSummary;

/// How the tick and the server keep step.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Pace {
    /// The tick never waits; an answer is shown when it comes.
    Free,
    /// Each tick waits for its answer (bounded): every run gives the same frames.
    Lockstep,
}

/// What the object is made of and how it is to be solved.
#[derive(Clone, Debug, PartialEq)]
pub struct SolveSettings {
    /// Its material.
    pub material: Material,
    /// Element of the model.
    pub element: ElementName,
    /// Method asked for.
    pub method: MethodName,
    /// What a fingertip holds.
    pub contact: ContactModel,
    /// Nodes that frames are asked for.
    pub subscription: Subscription,
}

/// Nodes that frames are asked for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Subscription {
    /// What is seen and touched; the inside is asked for when a shape is to be kept.
    Surface,
    /// Every node: the whole object is written down.
    Whole,
}

/// What happened, for the report; in the order it happened.
#[derive(Clone, Debug, PartialEq)]
pub enum LoopEvent {
    /// The grasp changed.
    Grasp(GraspEvent),
    /// A shape was to be kept, but cannot be.
    KeepRefused(String),
    /// Something about the server.
    Server(String),
}

/// One tick, for the status line and the report.
#[derive(Clone, Debug)]
pub struct TickOutcome {
    /// Events of this tick.
    pub events: Vec<LoopEvent>,
    /// State after it.
    pub state: Option<StateName>,
    /// Which tips hold or touch, thumb first.
    pub tips: [bool; 5],
    /// Segments shown at their last free pose, by finger.
    pub recalled: [u8; 5],
    /// Answers that came, with the tick they were asked for in.
    pub answers: Vec<(u64, SolveSummary)>,
    /// What the person sees next.
    pub seen: Seen,
}

/// The client between devices and server.
pub struct GraspLoop {
    reader: HandReader,
    object: SoftObject,
    grasp: Grasp,
    link: Link,
    settings: SolveSettings,
    pace: Pace,
    /// Tick of the last order, to tell answers of an earlier grasp from those of this one.
    deforming_since: Option<u64>,
    held: HeldNodes,
    /// A shape is to be kept as soon as its inside is known.
    keep_wanted: bool,
    prefetched: Prefetched,
    world_from_object: Isometry3<f64>,
    hand: Option<HandPose>,
}

/// Longest wait of a lockstep tick; a server that takes longer is overtaken.
const LOCKSTEP_WAIT_MAX: Duration = Duration::from_secs(30);

impl GraspLoop {
    /// A loop around an object at the origin; its model is sent to the server at once.
    pub fn new(
        reader: HandReader,
        object: SoftObject,
        grasp: Grasp,
        link: Link,
        settings: SolveSettings,
        pace: Pace,
    ) -> Self {
        let this = Self {
            reader,
            object,
            grasp,
            link,
            settings,
            pace,
            deforming_since: None,
            held: HeldNodes::default(),
            keep_wanted: false,
            prefetched: Prefetched::default(),
            world_from_object: Isometry3::identity(),
            hand: None,
        };
        this.send_model();
        this
    }

    /// The object as it is now.
    pub fn object(&self) -> &SoftObject {
        &self.object
    }

    /// Object pose after the last tick.
    pub fn world_from_object(&self) -> &Isometry3<f64> {
        &self.world_from_object
    }

    /// The hand as measured in the last tick.
    pub fn hand(&self) -> Option<&HandPose> {
        self.hand.as_ref()
    }

    /// The reader, for its faults.
    pub fn reader(&self) -> &HandReader {
        &self.reader
    }

    /// Waits until the server has answered all, at most so long.
    pub fn wait_idle(&self, at_most: Duration) -> bool {
        self.link.wait_idle(at_most)
    }

    /// One tick at a time on the client's clock.
    ///
    /// # Errors
    /// [`ObjectError`] when the object cannot be shown any more.
    pub fn tick(&mut self, tick: u64, now_s: f64, sent: &Sent) -> Result<TickOutcome, ObjectError> {
        let mut outcome = TickOutcome {
            events: Vec::new(),
            state: None,
            tips: [false; 5],
            recalled: [0; 5],
            answers: Vec::new(),
            seen: Seen::default(),
        };
        self.reader.feed(&sent.glove, &sent.tracker, now_s);
        self.pick_up(&mut outcome)?;
        // Until both devices have spoken there is no hand to act with.
        let Some(hand) = self.reader.hand(now_s) else { return Ok(outcome) };
        let command = self.allowed(sent.command, &mut outcome);
        let step = self.step(&hand, command, &mut outcome);
        self.follow(tick, &step, &mut outcome)?;
        self.world_from_object = step.world_from_object;
        self.hand = Some(hand);
        outcome.events.extend(step.events.iter().map(|&event| LoopEvent::Grasp(event)));
        outcome.state = Some(step.state);
        outcome.seen.state = Some(step.state);
        outcome.recalled = step.recalled;
        Ok(outcome)
    }

    /// A command, unless the shape that is to be kept cannot be, or not yet.
    fn allowed(&mut self, command: Option<Command>, outcome: &mut TickOutcome) -> Option<Command> {
        let other = command.filter(|c| *c != Command::KeepShape);
        if other.is_some() || (command.is_none() && !self.keep_wanted) {
            return other;
        }
        // Frames bring the surface; the next one is asked for whole.
        self.keep_wanted = !self.object.is_whole();
        if self.keep_wanted {
            return None;
        }
        match self.object.check_shape() {
            Ok(()) => Some(Command::KeepShape),
            Err(error) => {
                outcome.events.push(LoopEvent::KeepRefused(error.to_string()));
                None
            }
        }
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
        self.prefetch(&tips);
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
        if step.events.contains(&GraspEvent::ShapeKept) {
            self.object.keep_shape()?;
            self.held.clear();
            self.prefetched.clear();
            self.send_model();
        }
        match &step.known {
            Some(known) => {
                outcome.tips = [true; 5];
                self.deforming_since.get_or_insert(tick);
                let question = self.question(known);
                self.link.ask(tick, question);
                if self.pace == Pace::Lockstep {
                    self.link.wait_idle(LOCKSTEP_WAIT_MAX);
                    self.pick_up(outcome)?;
                }
            }
            // A tick whose input was ignored keeps the shape as it is.
            None if step.state == StateName::Deforming => {}
            None => {
                self.deforming_since = None;
                self.keep_wanted = false;
                self.link.cancel();
                self.object.relax()?;
            }
        }
        Ok(())
    }

    fn question(&mut self, known: &[KnownNode; 5]) -> Question {
        let tip_radii = self.reader.setup().dimensions.tip_radii();
        let contact = self.settings.contact;
        let Prescribed { known, masks, mask_displacements } =
            self.held.prescribed(contact, &self.object, tip_radii, known);
        let nodes = match self.settings.subscription {
            Subscription::Surface if !self.keep_wanted => {
                NodeChoice::Nodes(self.object.surface().nodes.clone())
            }
            _ => NodeChoice::All,
        };
        Question {
            known,
            masks,
            mask_displacements,
            method: self.settings.method.clone(),
            want: Want { nodes, reactions: false, precision: Precision::F64 },
            ..Question::default()
        }
    }

    /// Takes what has come from the server; only answers of the grasp that is going on are shown.
    fn pick_up(&mut self, outcome: &mut TickOutcome) -> Result<(), ObjectError> {
        for event in self.link.take_events() {
            match event {
                LinkEvent::Answer { tick, rest_shape, nodes, displacement, report, round_trip } => {
                    let ms = round_trip.as_secs_f64() * 1e3;
                    outcome.answers.push((tick, SolveSummary::new(&report, ms)));
                    let current = rest_shape == self.object.rest_shapes()
                        && self.deforming_since.is_some_and(|since| tick >= since);
                    match nodes {
                        _ if !current => {}
                        NodeChoice::All => self.object.apply(displacement)?,
                        NodeChoice::Nodes(_) => self.object.apply_to_surface(&displacement)?,
                    }
                }
                LinkEvent::Connected { server } => {
                    outcome.events.push(LoopEvent::Server(format!("connected to {server}")));
                }
                LinkEvent::ModelReady(ready) => tracing::info!(model = %ready.model, "model ready"),
                LinkEvent::Refused { text, .. } => {
                    outcome.events.push(LoopEvent::Server(format!("refused: {text}")));
                }
                LinkEvent::Lost { text } => {
                    outcome.events.push(LoopEvent::Server(format!("lost: {text}")));
                }
            }
        }
        Ok(())
    }

    /// Lets the server prepare the columns of what a fingertip is about to touch.
    fn prefetch(&mut self, tips_in_object: &[Point3<f64>; 5]) {
        // Only condensed frames are made of columns.
        if !matches!(self.settings.method.as_str(), "auto" | "condensed") {
            return;
        }
        let tip_radii = self.reader.setup().dimensions.tip_radii();
        let contact = self.settings.contact;
        let hint = self.prefetched.next(contact, &self.object, tip_radii, tips_in_object);
        if !hint.is_empty() {
            self.link.prefetch(hint);
        }
    }

    /// Gives the link the rest shape as the model of the frames to come.
    fn send_model(&self) {
        let upload = UploadModel {
            mesh: mesh_data(self.object.rest()),
            materials: vec![self.settings.material],
            element: self.settings.element,
            fixed: Vec::new(),
        };
        self.link.set_model(ModelOrder {
            rest_shape: self.object.rest_shapes(),
            hash: ModelHash::of(&upload),
            upload: Arc::new(upload),
        });
    }
}
