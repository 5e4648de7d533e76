//! Input, output and events of one tick of the grasp.

use nalgebra::{Isometry3, Point3, Vector3};

use super::sense::FingerInput;
use super::state::{HandSegments, StateName};
use crate::hand::Finger;

/// What the user asks for, at most once per tick.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Command {
    /// Make the deformed shape the rest shape and let the object go home (thesis 4.6, 6.1.2).
    KeepShape,
    /// Let the object go where it is.
    Release,
    /// Put the object back to its home pose, where it began.
    ReturnHome,
}

/// Measurements of one tick: palm, segments, what each finger touches, and the command.
#[derive(Clone, Debug, PartialEq)]
pub struct StepInput {
    /// Measured palm pose.
    pub world_from_palm: Isometry3<f64>,
    /// Measured poses of the finger segments.
    pub world_from_segment: HandSegments,
    /// What each finger touches, thumb first (see [`super::sense`]).
    pub fingers: [FingerInput; 5],
    /// The user's command, if there is one.
    pub command: Option<Command>,
}

/// What happened in a tick; the variants are in the order in which one tick reports them.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum GraspEvent {
    /// A measurement was not a finite number; the tick changed nothing.
    InputIgnored,
    /// The command has no meaning in this state and is not carried out.
    Ignored(Command),
    /// The client now makes the deformed shape the rest shape and rebuilds the tree.
    ShapeKept,
    /// The object was let go where it is.
    Released,
    /// The object is back at its home pose.
    ReturnedHome,
    /// A tip moved away from its contact.
    TipLeft(Finger),
    /// A tip came into contact with a node of its own.
    TipTouched(Finger, u32),
    /// The grasp changed its state.
    Entered(StateName),
}

/// Known displacement of one node (`Q_k` of thesis (3.43a)).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct KnownNode {
    /// Number of the mesh node.
    pub node: u32,
    /// Displacement of the tip since its contact, which the node takes over, m, object frame.
    pub displacement_in_object: Vector3<f64>,
}

/// Outcome of one tick: events, state, known displacements, and poses to display.
#[derive(Clone, Debug, PartialEq)]
pub struct StepOutput {
    /// Events of the tick, ascending in the order of [`GraspEvent`].
    pub events: Vec<GraspEvent>,
    /// The state after the tick.
    pub state: StateName,
    /// Known displacements by finger, thumb first, five different nodes; present exactly when the
    /// state is `Deforming` and the input was not ignored.
    pub known: Option<[KnownNode; 5]>,
    /// Object pose after the tick.
    pub world_from_object: Isometry3<f64>,
    /// Segment poses to display; those measured where the input was ignored.
    pub world_from_segment: HandSegments,
    /// How many segments of each finger, counted from the palm, are shown at their last free pose.
    pub recalled: [u8; 5],
}

impl StepInput {
    /// Whether every number that the rules use is finite.
    pub(super) fn is_finite(&self) -> bool {
        let tip = |f: &FingerInput| is_finite_point(&f.tip_in_object);
        let hit = |f: &FingerInput| {
            f.tip_hits.iter().flatten().all(|h| h.normal.iter().all(|c| c.is_finite()))
        };
        is_finite_pose(&self.world_from_palm)
            && self.world_from_segment.iter().flatten().all(is_finite_pose)
            && self.fingers.iter().all(|f| tip(f) && hit(f))
    }
}

fn is_finite_pose(pose: &Isometry3<f64>) -> bool {
    let rotation = pose.rotation.coords.iter();
    rotation.chain(pose.translation.vector.iter()).all(|c| c.is_finite())
}

fn is_finite_point(point: &Point3<f64>) -> bool {
    point.coords.iter().all(|c| c.is_finite())
}

impl std::fmt::Display for Command {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::KeepShape => "keep shape",
            Self::Release => "release",
            Self::ReturnHome => "return home",
        })
    }
}

impl std::fmt::Display for GraspEvent {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::InputIgnored => f.write_str("input ignored"),
            Self::Ignored(command) => write!(f, "{command} ignored"),
            Self::ShapeKept => f.write_str("shape kept"),
            Self::Released => f.write_str("released"),
            Self::ReturnedHome => f.write_str("returned home"),
            Self::TipLeft(finger) => write!(f, "{finger} left"),
            Self::TipTouched(finger, _) => write!(f, "{finger} touched"),
            Self::Entered(state) => write!(f, "entered {state}"),
        }
    }
}
