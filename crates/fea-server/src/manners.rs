//! How a client behaves: whoever sends nonsense, or a flood that it does not wait for, is served slowly.
//!
//! All sessions share one thread for their sockets. A client that waits for its replies, and asks what
//! can be answered, never rests here.

use std::time::Duration;

use softgrasp_protocol::RejectCode;

/// What a session remembers of its client.
#[derive(Debug, Default)]
pub(crate) struct Manners {
    /// Requests without sense so far.
    nonsense: u32,
    /// Requests in a row that were there before the reply to the one before was written.
    ahead: u32,
    /// The newest request made no sense.
    is_nonsense: bool,
}

/// Requests without sense for which nobody rests: a person tries things out.
const NONSENSE_FREE: u32 = 50;
/// Rest after every further one.
const NONSENSE_REST: Duration = Duration::from_millis(20);
/// Requests in a row that a client may send ahead of its replies, where many sessions share the server.
const AHEAD_FREE: u32 = 32;
/// Rest before every further one: five hundred a second are left.
const AHEAD_REST: Duration = Duration::from_millis(2);

impl Manners {
    /// A request was refused.
    pub fn refused(&mut self, code: RejectCode) {
        if code == RejectCode::BadRequest {
            self.nonsense += 1;
            self.is_nonsense = true;
        }
    }

    /// How long to rest before the next request, which is there already or not; `None`: not at all.
    /// `is_quiet`: few sessions share the server.
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
