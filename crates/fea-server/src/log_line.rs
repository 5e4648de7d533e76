//! Keeps log lines about clients few, and text from clients in them short and harmless.

use std::collections::BTreeMap;
use std::net::IpAddr;
use std::time::{Duration, Instant};

use crate::lock::Lock;
use crate::origin::Origin;
use crate::pace::Pace;

/// Number of log lines that the connections of one owner may still cause.
#[derive(Default)]
pub(crate) struct LogLines(Lock<BTreeMap<Origin, Spent>>);

struct Spent {
    pace: Pace,
    left_out: u64,
}

/// Log lines that one owner's connections may cause at once, and the time between further ones: 10 lines
/// a second are a few kilobytes.
const LINES_AT_ONCE: u32 = 200;
const LINE_EVERY: Duration = Duration::from_millis(100);
/// Number of owners that are remembered.
const ORIGINS_MAX: usize = 4096;

impl LogLines {
    /// Whether another line about this address may be written. If lines were left out before it, a line
    /// with their number is written first.
    pub fn has_room(&self, address: IpAddr) -> bool {
        let origin = Origin::of(address);
        let Some(left_out) = self.spend(origin, Instant::now()) else { return false };
        if left_out > 0 {
            tracing::warn!(%origin, left_out, "too many lines: some were left out");
        }
        true
    }

    /// Takes the room for one line; returns how many were left out before it, or `None` if there is no
    /// room.
    fn spend(&self, origin: Origin, now: Instant) -> Option<u64> {
        self.0.with(|origins| {
            if origins.len() >= ORIGINS_MAX && !origins.contains_key(&origin) {
                origins.retain(|_, spent| !spent.pace.has_rested(now));
                if origins.len() >= ORIGINS_MAX {
                    origins.pop_first();
                }
            }
            let pace = Pace::new(now, LINES_AT_ONCE, LINE_EVERY);
            let spent = origins.entry(origin).or_insert(Spent { pace, left_out: 0 });
            if spent.pace.next() > now {
                spent.left_out += 1;
                return None;
            }
            spent.pace.came(now);
            Some(std::mem::take(&mut spent.left_out))
        })
    }
}

/// Largest number of characters of a name that a client chose.
const NAME_MAX: usize = 64;
/// Largest number of characters of a server's sentence that may contain a client's text.
const SENTENCE_MAX: usize = 400;

/// Name that a client chose, shortened and made harmless for the log.
pub(crate) fn foreign_name(text: &str) -> String {
    harmless(text, NAME_MAX)
}

/// Sentence that may contain a client's text, shortened and made harmless for the log.
pub(crate) fn foreign_sentence(text: impl std::fmt::Display) -> String {
    harmless(&text.to_string(), SENTENCE_MAX)
}

/// At most `max` characters of a text; invisible characters, and those that change the writing direction,
/// are replaced by their number, as `<U+202E>`.
fn harmless(text: &str, max: usize) -> String {
    let mut shown = String::new();
    for (at, character) in text.chars().enumerate() {
        if at == max {
            shown.push('…');
            break;
        }
        // Those that Rust escapes although they are part of ordinary text.
        let is_plain = matches!(character, '"' | '\'' | '\\');
        match is_plain || character.escape_debug().len() == 1 {
            true => shown.push(character),
            false => shown.push_str(&format!("<U+{:04X}>", character as u32)),
        }
    }
    shown
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn text_of_others_is_cut_and_what_cannot_be_seen_is_named() {
        assert_eq!(foreign_name("Zoë's \"hand\" 手 \\"), "Zoë's \"hand\" 手 \\");
        assert_eq!(
            foreign_name("a\u{9b}31m\u{202e}b\n\u{2028}\u{0}\u{1b}\u{feff}"),
            "a<U+009B>31m<U+202E>b<U+000A><U+2028><U+0000><U+001B><U+FEFF>"
        );
        for turning in ('\u{202a}'..='\u{202e}').chain('\u{2066}'..='\u{2069}') {
            assert!(!foreign_name(&turning.to_string()).contains(turning));
        }
        let long = foreign_name(&"x".repeat(16 * 1024));
        assert_eq!((long.chars().count(), long.ends_with('…')), (NAME_MAX + 1, true));
        assert_eq!(foreign_name(&"x".repeat(NAME_MAX)), "x".repeat(NAME_MAX));
    }

    #[test]
    fn lines_of_one_owner_are_bounded_in_rate_and_those_of_another_are_written() {
        let lines = LogLines::default();
        let start = Instant::now();
        let [loud, other] = ["10.0.0.1", "10.0.0.2"].map(|text| Origin::of(text.parse().unwrap()));
        let written = |from: Instant| (0..10_000).filter_map(|_| lines.spend(loud, from)).count();
        assert_eq!(written(start), LINES_AT_ONCE as usize + 1);
        assert_eq!(lines.spend(other, start), Some(0));
        let left_out = 10_000 - u64::from(LINES_AT_ONCE) - 1;
        assert_eq!(lines.spend(loud, start + LINE_EVERY), Some(left_out), "they are counted");
        assert_eq!(written(start + 11 * LINE_EVERY), 10);
    }

    #[test]
    fn owners_that_are_remembered_are_bounded() {
        let lines = LogLines::default();
        let start = Instant::now();
        for at in 0..2 * ORIGINS_MAX as u32 {
            let address = IpAddr::from((0x0a00_0000 + at).to_be_bytes());
            assert_eq!(lines.spend(Origin::of(address), start), Some(0));
        }
        assert_eq!(lines.0.with(|origins| origins.len()), ORIGINS_MAX);
    }
}
