//! A run: ticks from the hand to the deformed object, and the report of them.

mod answer_tally;
mod answering;
pub mod contact_grasp;
pub mod contact_ledger;
pub mod friction;
pub mod grasp_loop;
mod keep;
mod keeping;
pub mod latency;
mod object_control;
pub mod observer;
pub mod placing;
pub mod played_ticks;
mod recorded_tick;
pub mod run_report;
pub mod run_words;
pub mod session;
mod springback;
pub mod status_line;
pub mod tick_loop;
pub mod tick_outcome;
pub mod tick_thread;
mod times;
