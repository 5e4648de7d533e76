//! The transition table as text, made by running the machine on one example of each case.

use nalgebra::{Isometry3, Point3, Vector3};

use super::event::{Command, StepInput};
use super::sense::FingerInput;
use super::state::StateName;
use super::step::Grasp;
use crate::hand::Finger;
use crate::sphere_tree::{ContactHit, TIP_HITS_MAX};

/// Transition table in Markdown: state, what the tick brings, next state, events.
///
/// Every row is what [`Grasp::step`] answers, so the text cannot differ from the code. A case that
/// is not listed for a state changes nothing there and reports nothing.
pub fn transition_table() -> String {
    let mut table =
        String::from("| state | in this tick | next state | events |\n|---|---|---|---|\n");
    for start in START_STATES {
        for (text, case) in CASES {
            let output = grasp_in(start).step(&case.input());
            let events: Vec<String> = output.events.iter().map(|e| e.to_string()).collect();
            if !events.is_empty() {
                let (next, events) = (output.state, events.join(", "));
                table += &format!("| {start} | {text} | {next} | {events} |\n");
            }
        }
    }
    table
}

/// One kind of tick, in sets of fingers (bit 0 the thumb).
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Case {
    /// Fingers whose tip is inside the object.
    pub(super) inside: u8,
    /// Fingers whose tip has moved out by a centimetre since its contact.
    pub(super) out: u8,
    /// Fingers whose middle segment penetrates.
    pub(super) collide: u8,
    /// Fingers within the margin of the object without touching it.
    pub(super) near: u8,
    pub(super) command: Option<Command>,
}

impl Case {
    pub(super) const NONE: Self = Self { inside: 0, out: 0, collide: 0, near: 0, command: None };

    const fn inside(inside: u8) -> Self {
        Self { inside, ..Self::NONE }
    }

    const fn out(out: u8) -> Self {
        Self { out, near: ALL, ..Self::NONE }
    }

    const fn command(command: Command) -> Self {
        Self { command: Some(command), near: ALL, ..Self::NONE }
    }

    /// The tick's input: contacts at the origin on a plane with normal +z, finger f on node f.
    pub(super) fn input(&self) -> StepInput {
        let fingers = Finger::ALL.map(|finger| {
            let has = |set: u8| set >> finger.index() & 1 == 1;
            let hit = |node| ContactHit { node, distance: 0.0, normal: Vector3::z() };
            let mut tip_hits = [None; TIP_HITS_MAX];
            tip_hits[0] = has(self.inside).then(|| hit(finger.index() as u32));
            FingerInput {
                segments_collide: [false, has(self.collide), false],
                clear: !has(self.inside | self.collide | self.near),
                tip_hits,
                tip_in_object: Point3::new(0.0, 0.0, if has(self.out) { 0.01 } else { 0.0 }),
            }
        });
        StepInput {
            world_from_palm: Isometry3::identity(),
            world_from_segment: [[Isometry3::identity(); 3]; 5],
            fingers,
            command: self.command,
        }
    }
}

/// A grasp brought into a state by ticks alone.
pub(super) fn grasp_in(state: StateName) -> Grasp {
    let mut grasp = Grasp::try_new(Isometry3::identity(), Grasp::RELEASE_MARGIN_M)
        .expect("the default margin is a distance");
    let way: &[Case] = match state {
        StateName::Detached => &[],
        StateName::Free => &[Case::NONE],
        StateName::Avoiding => &[Case::NONE, Case { collide: 0b10, ..Case::NONE }],
        StateName::Attached => &[Case::NONE, Case::inside(THREE)],
        StateName::Deforming => &[Case::NONE, Case::inside(THREE), Case::inside(ALL)],
    };
    for case in way {
        grasp.step(&case.input());
    }
    grasp
}

const START_STATES: [StateName; 5] = [
    StateName::Free,
    StateName::Avoiding,
    StateName::Attached,
    StateName::Deforming,
    StateName::Detached,
];

/// The set of index, middle and ring finger.
const THREE: u8 = 0b01110;
const ALL: u8 = 0b11111;

const CASES: &[(&str, Case)] = &[
    ("every finger is clear of the object", Case::NONE),
    ("a finger is near, none penetrates", Case { near: 0b10, ..Case::NONE }),
    ("a finger segment penetrates", Case { collide: 0b100, ..Case::NONE }),
    ("index and middle tips are inside", Case::inside(0b00110)),
    ("index, middle and ring tips are inside", Case::inside(THREE)),
    ("thumb and little tips are inside", Case::inside(0b10001)),
    ("the thumb tip is inside", Case::inside(0b00001)),
    ("all five tips are inside", Case::inside(ALL)),
    ("the thumb moves out", Case::out(0b00001)),
    ("the little finger moves out", Case::out(0b10000)),
    ("the index moves out", Case::out(0b00010)),
    ("index, middle and ring move out", Case::out(THREE)),
    ("keep shape", Case::command(Command::KeepShape)),
    ("release", Case::command(Command::Release)),
    ("return home", Case::command(Command::ReturnHome)),
];
