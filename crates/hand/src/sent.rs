//! What the devices send in one tick, and what the person asks for.

use softgrasp_grasp::grasp::Command;

use crate::arrival::Arrival;

/// What comes into one tick.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Sent {
    /// Bytes of the devices, in the order in which they came.
    pub arrivals: Vec<Arrival>,
    /// Menu command.
    pub command: Option<Command>,
    /// The script is over; the hand rests.
    pub over: bool,
    /// What the tick did with the server's answers when it was recorded; `None` unless it is played
    /// again.
    pub recorded: Option<RecordedAnswers>,
}

/// What a tick that is played again has to wait for, and what it must not take yet.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RecordedAnswers {
    /// Method that answered what it asked; `None` if no tick took an answer to it.
    pub answered_by: Option<String>,
    /// Whether that answer's path at large deformation began at rest.
    pub from_rest: bool,
    /// Whether there was no shape that the object could spring back to.
    pub springback_refused: bool,
    /// Ticks whose answers it takes, in that order.
    pub taken: Vec<u64>,
    /// Whether it takes a rest shape that was made beside the ticks.
    pub took_work: bool,
    /// Whether it waits no longer for the step of a free object that an earlier tick asked for.
    pub gives_up_step: bool,
}
