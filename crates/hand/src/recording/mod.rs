//! Recordings of runs: what came in, what was done with it, and replaying them bit by bit.

mod channels;
#[cfg(test)]
mod damage_tests;
mod file;
mod foxglove;
mod read;
mod recorder;
mod replay;
mod replay_check;
mod stages;
mod tick;

pub use read::{
    ReadError, Recording, VERSION, VERSION_OF_ONE_HAND, VERSION_OF_TWO_HANDS, read_recording,
};
pub use recorder::{RecordError, Recorder, TickNews};
pub use replay::{ReplayHand, Replayed};
pub use replay_check::{Difference, ReplayCheck};
pub use stages::{Stage, StageDigests};
pub use tick::{
    AnswerSeen, EventSeen, HandSeen, Intervention, PoseSeen, RecordedFriction, RecordedHand,
    RecordedRegion, RecordedSetup, RecordedTick, SPRINGBACK_REFUSED, SceneSeen, SurfaceSeen,
    TickSeen,
};
