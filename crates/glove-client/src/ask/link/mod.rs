//! The link to the server, on a thread beside the ticks.
//!
//! At most one request is in flight, and of those not yet sent the newest wins. A tick leaves its
//! request in the outbox and picks up what has come; it never waits for the network. A
//! lost server is looked for again with growing pauses, and the model is sent anew only if the
//! server does not know it. What the server refused is not asked again until something changes.

mod event;
mod handle;
mod outbox;
mod worker;

pub use event::{LinkEvent, Reached, ReachedStep, RequestEnd};
pub use handle::Link;
