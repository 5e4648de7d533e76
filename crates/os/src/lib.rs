//! What the programs ask of the operating system: signals that are waited for, threads that are
//! woken in time.

mod end;
mod end_signals;
mod urgency;

pub use end::end_within;
pub use end_signals::{EndSignal, on_end_signal};
pub use urgency::{NotUrgent, be_urgent};
