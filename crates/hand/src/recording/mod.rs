//! Recordings of runs: what came in, what was done with it, and replaying them bit by bit.

mod channels;
mod file;
mod read;
mod recorder;
mod replay;
mod replay_check;
mod stages;
mod tick;

pub use read::{ReadError, Recording, VERSION, read_recording};
pub use recorder::{RecordError, Recorder, TickNews};
pub use replay::{ReplayHand, Replayed};
pub use replay_check::{Difference, ReplayCheck};
pub use stages::{Stage, StageDigests};
pub use tick::{
    AnswerSeen, EventSeen, Intervention, PoseSeen, RecordedSetup, RecordedTick, TickSeen,
};
