//! What the programs share beside the mathematics and the wire: signals that are waited for,
//! threads that are woken in time, the time a thread computed, errors as one line.

mod cpu_time;
mod end_signals;
mod error_line;
mod urgency;

pub use cpu_time::thread_cpu_time;
pub use end_signals::{EndSignal, on_end_signal};
pub use error_line::one_line;
pub use urgency::{NotUrgent, be_ordinary, be_urgent};
