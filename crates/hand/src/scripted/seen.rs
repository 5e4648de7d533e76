//! What the person behind the scripted hand sees and feels.

use nalgebra::Isometry3;
use softgrasp_grasp::grasp::StateName;

/// What the person behind the hand sees before moving on.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Seen {
    /// Whether each tip is inside the object, thumb first.
    pub inside: [bool; 5],
    /// Pose of the object in the world.
    pub world_from_object: Isometry3<f64>,
    /// State of the grasp, once there is one.
    pub state: Option<StateName>,
    /// Whether the shape is being kept beside the ticks; the hand holds still until it is.
    pub keeping: bool,
    /// Whether the object, which is free to move, lies still.
    pub is_still: bool,
    /// Whether the object has not answered what the hand did before: a hand that lifts waits for it.
    pub is_late: bool,
    /// Force of each finger on the object, N, thumb first; zero where none is known.
    pub finger_forces_n: [f64; 5],
    /// Force of the table on the object, N: its weight, while nothing else holds it.
    pub table_force_n: f64,
    /// Coefficient of friction between hand and object; 0 where nothing holds by friction.
    pub friction: f64,
    /// Whether the object is being prepared and the person waits for it: the hand does not reach before.
    pub object_awaited: bool,
}
