//! The one way in which a factorisation without pivoting fails.

/// Row of `K11` where a pivot was not positive.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct NotPositive {
    pub row: usize,
}
