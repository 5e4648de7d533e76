//! Answers requests on the solving pool: a mesh or a kept model comes in, an answer goes out.

mod condensed;
mod contact_frame;
mod contact_large;
mod contact_solution;
mod direct;
mod elsewhere;
mod factor;
mod fields;
mod finite;
mod frame;
mod gradient;
mod large;
mod large_frame;
mod large_once;
mod once;
mod several;
mod upload;
mod warnings;

pub(crate) use contact_frame::{CarriedSeat, PosedContact};
pub(crate) use contact_large::PressedSeat;
pub(crate) use elsewhere::{
    KeptQuestion, Placed, kept_elsewhere, place_kept, place_once, place_upload,
};
pub(crate) use fields::reserve_fields;
pub(crate) use finite::is_finite;
pub(crate) use frame::{PosedFrame, Readiness, answer_cases, readiness};
pub(crate) use large_frame::answer_large_frame;
pub(crate) use large_once::solve_large;
pub(crate) use upload::{prefetch, prove};
