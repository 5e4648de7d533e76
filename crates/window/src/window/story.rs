//! What the window does by itself when a script has come to its end: it waits for the person, and
//! begins the script anew if nobody takes the hand.

use std::time::{Duration, Instant};

/// State of a script's end, and how long ago it was reached.
#[derive(Default)]
pub struct Story {
    over_since: Option<Instant>,
}

/// Time after its end, or after the person moved mouse or keys last, at which a script begins anew.
pub const PAUSE: Duration = Duration::from_secs(9);

impl Story {
    /// Takes, at each picture, whether the script is over; returns whether it has just come to its end.
    pub fn follow(&mut self, is_over: bool, now: Instant) -> bool {
        let was_over = self.over_since.is_some();
        match is_over {
            true => _ = self.over_since.get_or_insert(now),
            false => self.over_since = None,
        }
        is_over && !was_over
    }

    /// Notes that the person is there, who is not disturbed for a while.
    pub fn was_touched(&mut self, now: Instant) {
        if let Some(since) = &mut self.over_since {
            *since = now;
        }
    }

    /// Time until the script begins anew; `None` while it is not over.
    pub fn begins_in(&self, now: Instant) -> Option<Duration> {
        Some(PAUSE.saturating_sub(now.saturating_duration_since(self.over_since?)))
    }

    /// Whether the script is to begin anew now.
    pub fn begins_now(&mut self, now: Instant) -> bool {
        let begins = self.begins_in(now).is_some_and(|left| left.is_zero());
        if begins {
            self.over_since = None;
        }
        begins
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn story_that_is_over_does_not_stand_still_for_ever_but_begins_anew() {
        let (mut story, end) = (Story::default(), Instant::now());
        let at = |seconds: u64| end + Duration::from_secs(seconds);
        assert!(!story.follow(false, end) && story.begins_in(end).is_none());
        assert!(story.follow(true, end), "it has just come to its end");
        assert!(!story.follow(true, at(1)), "that is told once");
        assert!(!story.begins_now(at(8)));
        story.was_touched(at(8));
        assert!(!story.begins_now(at(16)), "the person is there");
        assert!(story.begins_now(at(17)) && !story.begins_now(at(17)));
        story.was_touched(at(18));
        assert!(!story.begins_now(at(99)), "it is played");
    }
}
