//! Runs work so that a panic in it ends that work only.

use std::panic::AssertUnwindSafe;

use crate::awaited::Abandoned;
use crate::lock::assert_none_is_held;

/// The work on a request panicked, or the server stopped before it began; it has been logged.
#[derive(Debug, PartialEq, Eq, thiserror::Error)]
#[error("the work on this request ended abnormally")]
pub(crate) struct EndedAbnormally;

/// The result of `work`; a panic is logged.
///
/// # Errors
/// [`EndedAbnormally`] if it panicked.
pub(super) fn caught<T>(place: &str, work: impl FnOnce() -> T) -> Result<T, EndedAbnormally> {
    let checked = || {
        assert_none_is_held();
        work()
    };
    std::panic::catch_unwind(AssertUnwindSafe(checked)).map_err(|panic| {
        if panic.is::<Abandoned>() {
            tracing::info!("work {place} is ended, because its session has gone");
            return EndedAbnormally;
        }
        let text = panic
            .downcast_ref::<String>()
            .map(String::as_str)
            .or_else(|| panic.downcast_ref::<&str>().copied())
            .unwrap_or("no text");
        tracing::error!(panic = text, "work {place} ended abnormally");
        EndedAbnormally
    })
}
