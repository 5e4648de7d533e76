//! The glove's driver: sets the interface unit up, asks for records, stops it at the end.

use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use softgrasp_grasp::hand::Handedness;

use super::driver::{DriverContext, Ended};
use super::facts::GloveFacts;
use super::listening::{Poll, ask, serve, wait_until_quiet};
use super::port::{Lost, Port};
use super::record_assembler::Cut;
use super::settings::{GloveMode, GloveSettings};
use crate::devices::cyberglove::{GloveEncoding, GloveTicks, SensorCount};

/// Ctrl-C: ends a stream.
const STOP: &[u8] = b"\x03";
/// Ctrl-R: starts the firmware again.
const RESTART: &[u8] = b"\x12";
/// How long a restart may take; it takes about 1.75 s.
const RESTART_MAX: Duration = Duration::from_millis(2500);
/// How long a reply may take; the vendor's library waits 0.1 s for each byte.
const REPLY_MAX: Duration = Duration::from_millis(300);

/// Serves an open port until it is lost or the thread is to end.
pub(super) fn serve_glove(
    context: &DriverContext,
    port: &mut Port,
    settings: &GloveSettings,
    facts: &Arc<Mutex<GloveFacts>>,
) -> Result<Ended, Lost> {
    let text = settings.encoding == GloveEncoding::Ascii;
    let poll = match settings.mode {
        GloveMode::Polled { hz } => {
            let request = if text { &b"g\r"[..] } else { b"G" };
            Some(Poll { request, period: Duration::from_secs_f64(1.0 / hz) })
        }
        GloveMode::Streamed { .. } => None,
    };
    // A restart that was cut short by silence is not repeated: the next setting up is quick.
    let restart = settings.restart && !context.is_silent();
    let ended = serve(context, port, Cut::AtNul, poll, |port, just_opened| {
        let mut setting_up = SettingUp { context, port, settings };
        let told = setting_up.all(restart && just_opened)?;
        let mut slot = facts.lock().unwrap_or_else(PoisonError::into_inner);
        // A glove that falls silent is still the glove that it was.
        if just_opened || told != GloveFacts::default() {
            *slot = told;
        }
        Ok(())
    });
    if poll.is_none() {
        // Where the port is lost, so is this.
        let _ = port.write(STOP);
    }
    ended
}

struct SettingUp<'a> {
    context: &'a DriverContext,
    port: &'a mut Port,
    settings: &'a GloveSettings,
}

impl SettingUp<'_> {
    /// The vendor's sequence, then the settings; a device that does not answer is set all the same.
    fn all(&mut self, restart: bool) -> Result<GloveFacts, Lost> {
        self.port.write(STOP)?;
        self.quiet()?;
        if restart {
            let done = |heard: &[u8]| heard.windows(4).any(|w| w == b"\x12\r\n\0").then_some(());
            ask(self.context, self.port, RESTART, RESTART_MAX, done)?;
        }
        let told = self.questions()?;
        self.set(&told)?;
        self.quiet()?;
        self.port.discard_input();
        if let GloveMode::Streamed { hz } = self.settings.mode {
            let [first, second] = period_words(hz);
            self.port.write(format!("t {first} {second}\r").as_bytes())?;
            self.quiet()?;
            let text = self.settings.encoding == GloveEncoding::Ascii;
            self.port.write(if text { b"s\r" } else { b"S" })?;
        }
        Ok(told)
    }

    fn questions(&mut self) -> Result<GloveFacts, Lost> {
        let mut told = GloveFacts::default();
        let bytes = Payload::Bytes;
        told.ready = self.query(b'G', bytes(1))?.and_then(|b| b.first().map(|b| b & 3 == 3));
        let sensors = self.query(b'S', bytes(1))?.and_then(|b| b.first().copied());
        if told.ready.is_none() && sensors.is_none() {
            // Nobody answers; the other questions would only take time.
            return Ok(told);
        }
        match sensors {
            Some(18) => told.sensors = Some(SensorCount::Eighteen),
            Some(22) => told.sensors = Some(SensorCount::TwentyTwo),
            other => told.other_sensors = other,
        }
        told.flags = self.query(b'P', bytes(3))?.and_then(|b| b.try_into().ok());
        let mask: Option<[u8; 3]> = self.query(b'K', bytes(3))?.and_then(|b| b.try_into().ok());
        told.hardware_mask = mask.map(|[a, b, c]| u32::from_le_bytes([a, b, c, 0]));
        let right = self.query(b'R', bytes(1))?.and_then(|b| b.first().copied());
        told.hand = right.map(|right| match right {
            0 => Handedness::Left,
            _ => Handedness::Right,
        });
        let text = |payload: Vec<u8>| String::from_utf8_lossy(&payload).trim().to_owned();
        told.identity = self.query(b'i', Payload::Text)?.map(text);
        told.firmware = self.query(b'v', Payload::Text)?.map(text);
        if told.ready == Some(false) {
            tracing::warn!("the glove's unit says that no glove is plugged in");
        }
        if let (Some(expected), Some(found)) = (self.settings.sensors, sensors)
            && expected.number() != usize::from(found)
        {
            let expected = expected.number();
            tracing::warn!(expected, found, "the glove has another number of sensors");
        }
        Ok(told)
    }

    fn set(&mut self, told: &GloveFacts) -> Result<(), Lost> {
        if let Some(mask) = told.hardware_mask {
            let [a, b, c, _] = mask.to_le_bytes();
            self.command(&[b'M', a, b, c])?;
        }
        let sensors = self.settings.sensors.or(told.sensors);
        if let Some(sensors) = sensors {
            self.command(&[b'N', sensors.number() as u8])?;
        }
        let options = self.settings.options;
        self.command(&[b'D', u8::from(options.timestamp)])?;
        self.command(&[b'U', u8::from(options.status)])?;
        self.command(&[b'F', u8::from(self.settings.filter)])
    }

    /// Sends a command and waits for its echo, but not long.
    fn command(&mut self, bytes: &[u8]) -> Result<(), Lost> {
        let echo = [bytes[0], 0];
        let done = |heard: &[u8]| {
            let refused = heard.windows(3).any(|window| window == b"e?\0");
            (refused || heard.windows(2).any(|window| window == echo)).then_some(refused)
        };
        let refused = ask(self.context, self.port, bytes, REPLY_MAX / 3, done)?;
        if refused == Some(true) {
            tracing::warn!(?bytes, "the glove does not know a command");
        }
        Ok(())
    }

    fn query(&mut self, letter: u8, payload: Payload) -> Result<Option<Vec<u8>>, Lost> {
        let find = |heard: &[u8]| find_reply(heard, letter, payload);
        let reply = ask(self.context, self.port, &[b'?', letter], REPLY_MAX, find)?;
        Ok(match reply {
            Some(Reply::Payload(payload)) => Some(payload),
            Some(Reply::Refused) | None => None,
        })
    }

    fn quiet(&mut self) -> Result<(), Lost> {
        let (quiet, longest) = (Duration::from_millis(30), Duration::from_millis(300));
        wait_until_quiet(self.context, self.port, quiet, longest).map(drop)
    }
}

/// The words of `t` whose product is the period in ticks of the unit's clock.
fn period_words(hz: f64) -> [u32; 2] {
    let ticks = (GloveTicks::PER_SECOND / hz).max(1.0);
    let second = (ticks / 65_535.0).ceil();
    [(ticks / second).round() as u32, second as u32]
}

/// What stands between the echo of a query and its NUL.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Payload {
    /// So many bytes, zeros among them.
    Bytes(usize),
    /// Text up to the NUL.
    Text,
}

/// The reply to a query.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Reply {
    /// Bytes of the answer.
    Payload(Vec<u8>),
    /// The unit does not know the query.
    Refused,
}

/// The reply to the query `?` and `letter`, if it is among what was heard.
pub(super) fn find_reply(heard: &[u8], letter: u8, payload: Payload) -> Option<Reply> {
    let echo = [b'?', letter];
    let echoed = |at: &usize| heard[*at..].starts_with(&echo);
    for start in (0..heard.len()).filter(echoed) {
        let rest = &heard[start + echo.len()..];
        let length = match payload {
            Payload::Bytes(length) => length,
            Payload::Text => rest.iter().position(|&byte| byte == 0).unwrap_or(rest.len()),
        };
        if rest.get(length) == Some(&0) {
            return Some(Reply::Payload(rest[..length].to_vec()));
        }
    }
    heard.windows(3).any(|window| window == b"e?\0").then_some(Reply::Refused)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn periods_are_those_of_the_vendors_table() {
        let table = [(100.0, [1152, 1]), (80.0, [1440, 1]), (75.0, [1536, 1]), (1.0, [57600, 2])];
        for (hz, words) in table {
            assert_eq!(period_words(hz), words);
        }
    }
}

#[cfg(test)]
mod glove_replies_tests {
    use super::*;

    #[test]
    fn replies_are_found_with_zeros_in_them_and_behind_other_bytes() {
        let bytes = Payload::Bytes;
        let payload = |bytes: &[u8]| Some(Reply::Payload(bytes.to_vec()));
        assert_eq!(find_reply(b"?S\x16\0", b'S', bytes(1)), payload(b"\x16"));
        assert_eq!(find_reply(b"\x03\0G12?R\0\0", b'R', bytes(1)), payload(b"\0"));
        assert_eq!(find_reply(b"?K\0\x01\x02\0", b'K', bytes(3)), payload(b"\0\x01\x02"));
        assert_eq!(
            find_reply(b"?i CyberGlove\r\n\0", b'i', Payload::Text),
            payload(b" CyberGlove\r\n")
        );
        assert_eq!(find_reply(b"e?\0", b'i', Payload::Text), Some(Reply::Refused));
        for part in [&b""[..], b"?", b"?S", b"?S\x16", b"?S\x16\x05", b"e?"] {
            assert_eq!(find_reply(part, b'S', bytes(1)), None, "{part:?}");
        }
        assert_eq!(find_reply(b"?i text", b'i', Payload::Text), None);
    }
}
