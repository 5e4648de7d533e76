//! Tracked hands from an OpenXR runtime, without a page and without a picture.
//!
//! [`RuntimeHands`] opens a session without graphics (`XR_MND_headless`) on a thread of its own
//! (`follower`), asks the runtime for the joints of both hands (`session`, `XR_EXT_hand_tracking`), makes
//! records of them ([`record_of`]) and hands these on (`runtime_feed`) as every other sender of joints
//! does. The runtime's loader is opened at run time. What asks a runtime is built with the feature `openxr`
//! only; without it [`RuntimeHands::open`] says so.

mod error;
#[cfg(feature = "openxr")]
mod follower;
mod hands;
mod located;
mod runtime_feed;
#[cfg(feature = "openxr")]
mod session;
mod wanted;

pub use error::{RuntimeError, XrResult};
pub use hands::RuntimeHands;
pub use located::{LocatedJoint, ORIENTATION_VALID, POSITION_TRACKED, POSITION_VALID, record_of};
pub use wanted::WantedHands;
