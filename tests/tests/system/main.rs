//! Client and server together, over real sockets.

#![allow(
    clippy::unwrap_used,
    clippy::print_stdout,
    reason = "helpers of tests fail and speak like tests"
)]

mod access;
mod awaited_model;
mod bad_requests;
mod bad_streams;
mod contact_deadline;
mod contact_frames;
mod control;
mod controlled;
mod crowd;
mod curved;
mod dent;
mod directed;
mod disturbed_links;
mod engine;
mod fields;
mod forces;
mod gradients;
mod keep_shape;
mod lift;
mod lift_again;
mod live_grip;
mod loads;
mod many_clients;
mod masks;
mod memory;
mod mouse;
mod not_finite;
mod own_strain;
mod real_time;
mod same_bits;
mod settings;
mod start;
mod stopping;
mod table;
mod tracked_hands;
mod two_hands;
mod wire_rules;
mod wishes;
mod without_factor;
