//! What the programs ask of the operating system: signals that are waited for, threads that are woken
//! in time, stand back or work beside others, memory that is given back, the time a thread computed,
//! errors as one line, the file of a token, and who can read a file.
//!
//! ```
//! use softgrasp_os::Beside;
//!
//! // Long work on a thread of its own, while its owner goes on.
//! let mut squares = Beside::start("squares", |n: u32| n * n)?;
//! squares.begin(3);
//! assert_eq!(squares.wait(), Some(9));
//! # Ok::<(), std::io::Error>(())
//! ```

mod beside;
mod cpu_time;
mod end;
mod end_signals;
mod error_line;
mod freed_memory;
mod niceness;
mod private_file;
mod token_file;
mod urgency;

pub use beside::Beside;
pub use cpu_time::thread_cpu_time;
pub use end::end_within;
pub use end_signals::{EndSignal, on_end_signal};
pub use error_line::one_line;
pub use freed_memory::{give_back_freed_memory, give_back_large_pieces_at_once};
pub use niceness::stand_back;
pub use private_file::others_can_read;
pub use token_file::{TokenFileError, read_token};
pub use urgency::{NotUrgent, be_ordinary, be_urgent};
