//! The work on one request, on the solving pool: mesh or kept model in, answer out.

mod condensed;
mod direct;
mod factor;
mod frame;
mod once;
mod upload;
mod warnings;

pub(crate) use frame::{Readiness, answer_frame, readiness};
pub(crate) use once::solve_once;
pub(crate) use upload::{prefetch, prove, upload};
