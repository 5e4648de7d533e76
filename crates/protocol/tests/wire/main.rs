//! The wire as a stranger sees it: random and recorded messages, damage, cuts, hostile bytes.

#![allow(clippy::unwrap_used, reason = "helpers of tests fail like tests")]

mod adapters;
mod allocation;
mod chunking;
mod document;
mod golden;
mod growth;
mod hostile;
mod random_contact;
mod random_messages;
mod raw;
mod round_trip;
mod samples;
mod traced;
