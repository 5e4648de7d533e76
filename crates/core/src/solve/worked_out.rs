//! A number that is computed when first needed and then kept; no lock is held meanwhile.
//!
//! Working it out takes parallel loops, and a thread that waits inside a parallel loop takes other
//! work from the pool, which may need the same number. A cell that makes the second caller wait for
//! the first (`OnceLock::get_or_init`) then waits for itself for ever. Here nobody waits: who comes
//! second works it out as well, and the results are the same bits.

use std::sync::OnceLock;

/// A number kept once it has been worked out.
pub(super) struct WorkedOut<T>(OnceLock<T>);

impl<T> Default for WorkedOut<T> {
    fn default() -> Self {
        Self(OnceLock::new())
    }
}

impl<T> WorkedOut<T> {
    /// What has been worked out, if somebody has.
    pub fn get_ref(&self) -> Option<&T> {
        self.0.get()
    }

    /// What was worked out, or is worked out now by `work`, without a copy.
    pub fn get_ref_or(&self, work: impl FnOnce() -> T) -> &T {
        if let Some(kept) = self.get_ref() {
            return kept;
        }
        let value = work();
        // Somebody else may have been first; their number is the same. Nobody waits for a move.
        self.0.get_or_init(|| value)
    }

    /// Keeps what has been worked out; what somebody else has kept before stays.
    pub fn keep(&self, value: T) {
        let _ = self.0.set(value);
    }
}

impl<T: Clone> WorkedOut<T> {
    /// The number, if somebody has worked it out.
    pub fn get(&self) -> Option<T> {
        self.0.get().cloned()
    }

    /// The number, worked out now by `work` if nobody has; the first result is the one that stays.
    pub fn get_or(&self, work: impl FnOnce() -> T) -> T {
        self.get_ref_or(work).clone()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn number_needed_while_it_is_worked_out_does_not_wait_for_itself() {
        let number = WorkedOut::default();
        // As a thread does that waits in a parallel loop and takes a second request from the pool.
        let value = number.get_or(|| number.get_or(|| 2) + 5);
        assert_eq!(value, 2, "the first result stays");
        assert_eq!(number.get(), Some(2));
        assert_eq!(number.get_or(|| unreachable!("it is kept")), 2);
    }
}
