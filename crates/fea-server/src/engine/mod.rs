//! Engines that answer questions in a server's place, and what they need for it.
//!
//! A server with an [`Engine`] hands questions over to it: all of them ([`Engine::takes_all`]), or those
//! that are too large for its own memory and those that name a [`ClusterMethod`]. What is asked is a
//! [`Task`]; [`Equations`] are what follows from it, checked as a server checks its own, and an
//! [`Outcome`] becomes the answer.

mod equations;
mod outcome;
mod task;

pub use equations::Equations;
pub use outcome::{Case, Outcome};
pub use task::{Answered, ClusterMethod, Engine, Task};
