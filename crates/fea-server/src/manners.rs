//! Slows down clients that send many bad requests, or many requests without waiting for the replies.
//!
//! All sessions share one thread for their sockets. A client that waits for its replies, and whose
//! requests are valid, is never slowed down.

use std::time::Duration;

use softgrasp_protocol::RejectCode;

/// Counts of a client's bad requests and of those sent ahead of replies.
#[derive(Debug, Default)]
pub(crate) struct Manners {
    /// Number of bad requests so far.
    nonsense: u32,
    /// Number of requests in a row that had come before the reply to the previous one was written.
    ahead: u32,
    /// Whether the newest request was a bad one.
    is_nonsense: bool,
}

/// Number of bad requests without consequence: a person tries things out.
const NONSENSE_FREE: u32 = 50;
/// Pause after every further bad request.
const NONSENSE_REST: Duration = Duration::from_millis(20);
/// Number of requests in a row that a client may send ahead of its replies, if many sessions are open.
const AHEAD_FREE: u32 = 32;
/// Pause before every further such request: five hundred a second are left.
const AHEAD_REST: Duration = Duration::from_millis(2);

impl Manners {
    /// Counts the refusal of a request.
    pub fn refused(&mut self, code: RejectCode) {
        if code == RejectCode::BadRequest {
            self.nonsense += 1;
            self.is_nonsense = true;
        }
    }

    /// Pause before the next request, if one is due. `is_ahead`: that request has come already;
    /// `is_quiet`: few sessions are open.
    pub fn rest(&mut self, is_ahead: bool, is_quiet: bool) -> Option<Duration> {
        self.ahead = if is_ahead { self.ahead.saturating_add(1) } else { 0 };
        if std::mem::take(&mut self.is_nonsense) && self.nonsense > NONSENSE_FREE {
            return Some(NONSENSE_REST);
        }
        (self.ahead > AHEAD_FREE && !is_quiet).then_some(AHEAD_REST)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn client_that_waits_for_its_replies_never_rests_whatever_is_refused() {
        let mut manners = Manners::default();
        for _ in 0..10_000 {
            manners.refused(RejectCode::Uncertain);
            manners.refused(RejectCode::UnknownModel);
            assert_eq!(manners.rest(false, false), None);
        }
    }

    #[test]
    fn nonsense_without_end_rests_and_sense_between_does_not() {
        let mut manners = Manners::default();
        for _ in 0..NONSENSE_FREE {
            manners.refused(RejectCode::BadRequest);
            assert_eq!(manners.rest(false, true), None);
        }
        manners.refused(RejectCode::BadRequest);
        assert_eq!(manners.rest(false, true), Some(NONSENSE_REST));
        assert_eq!(manners.rest(false, true), None);
    }

    #[test]
    fn flood_rests_only_where_others_are_there_and_while_it_lasts() {
        let mut manners = Manners::default();
        for _ in 0..AHEAD_FREE {
            assert_eq!(manners.rest(true, false), None);
        }
        assert_eq!(manners.rest(true, false), Some(AHEAD_REST));
        assert_eq!(manners.rest(true, true), None, "nobody else is there");
        assert_eq!(manners.rest(false, false), None, "it waits again");
        assert_eq!(manners.rest(true, false), None);
    }
}
