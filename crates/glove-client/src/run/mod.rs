//! A run: ticks from the hand to the deformed object, and the report of them.

mod answer_tally;
mod changing;
pub mod contact_grasp;
pub mod contact_ledger;
mod felt;
mod friction;
pub mod given_way;
pub mod grasp_loop;
mod holding;
pub mod latency;
mod live_object;
pub mod observer;
mod placing;
pub mod played_ticks;
pub mod questions;
mod recorded_tick;
pub mod run_report;
pub mod run_words;
pub mod session;
mod shown;
mod springback;
pub mod status_line;
pub mod tick_loop;
pub mod tick_outcome;
pub mod tick_thread;
