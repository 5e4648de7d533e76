//! The error of a factorisation without pivoting: a pivot that is not positive.

/// Row of `K11` where a pivot was not positive.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct NotPositive {
    pub row: usize,
}
