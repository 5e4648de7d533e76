//! Cuts bytes, which arrive in pieces of any size, into lines of bounded length.

/// Most bytes of a line, its LF not counted.
pub const LINE_MAX: usize = 16 * 1024;

/// Most bytes held at once: a whole line and as much again.
const CAPACITY: usize = 2 * LINE_MAX;

/// A piece of the bytes: a whole line, or a report that one is too long.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Piece<'a> {
    /// A line without its LF.
    Line(&'a [u8]),
    /// So many bytes of a line that is too long were dropped.
    TooLong(usize),
}

/// Bounded bytes that leave as lines.
///
/// Invariants: `start + searched <= bytes.len() <= CAPACITY`; the `searched` bytes from `start` on
/// hold no LF.
#[derive(Clone, Debug, Default)]
pub(super) struct LineCutter {
    bytes: Vec<u8>,
    start: usize,
    searched: usize,
    /// Set while inside a line that is already too long: bytes of it dropped since the last report.
    overlong: Option<usize>,
}

impl LineCutter {
    /// Takes as many bytes as fit and returns how many those were.
    pub(super) fn push(&mut self, bytes: &[u8]) -> usize {
        self.bytes.drain(..self.start);
        self.start = 0;
        let taken = bytes.len().min(CAPACITY - self.bytes.len());
        self.bytes.extend_from_slice(&bytes[..taken]);
        taken
    }

    /// Whether a line has begun and not ended.
    pub(super) fn is_inside_a_line(&self) -> bool {
        self.overlong.is_some() || self.start < self.bytes.len()
    }

    /// The next line, or `None` when more bytes are needed.
    ///
    /// A line that is too long is reported at its end and each time that [`LINE_MAX`] bytes of it
    /// have been dropped, so the reports do not depend on how the bytes arrived.
    pub(super) fn next_piece(&mut self) -> Option<Piece<'_>> {
        let waiting = &self.bytes[self.start..];
        let unsearched = waiting.get(self.searched..).unwrap_or_default();
        let Some(found) = unsearched.iter().position(|&b| b == b'\n') else {
            self.searched = waiting.len();
            if self.searched > LINE_MAX || (self.overlong.is_some() && self.searched > 0) {
                return self.drop_overlong(self.searched, false);
            }
            return None;
        };
        let length = self.searched + found;
        if self.overlong.is_some() || length > LINE_MAX {
            return self.drop_overlong(length + 1, true);
        }
        let line = self.start..self.start + length;
        self.start += length + 1;
        self.searched = 0;
        Some(Piece::Line(&self.bytes[line]))
    }

    /// Drops up to `available` bytes of an overlong line; `ends` if the last of them is its LF.
    fn drop_overlong(&mut self, available: usize, ends: bool) -> Option<Piece<'_>> {
        let dropped = self.overlong.unwrap_or(0);
        let take = available.min(LINE_MAX - dropped);
        self.start += take;
        self.searched = 0;
        let dropped = dropped + take;
        let at_end = ends && take == available;
        let report = at_end || dropped == LINE_MAX;
        self.overlong = match (at_end, report) {
            (true, _) => None,
            (false, true) => Some(0),
            (false, false) => Some(dropped),
        };
        report.then_some(Piece::TooLong(dropped))
    }

    /// Bytes that were taken and have left neither as a line nor as a report.
    #[cfg(test)]
    pub(super) fn held(&self) -> usize {
        self.bytes.len() - self.start + self.overlong.unwrap_or(0)
    }
}
