//! LucidGloves on a serial port: a line of servo levels for each line of the glove.

use std::path::Path;
use std::time::{Duration, Instant};

use serial2::SerialPort;

use super::error::DeviceError;
use super::link::{Link, Said, is_later};
use crate::rendering::PORTS;

/// The glove's line, on a thread of its own.
#[derive(Debug)]
pub(crate) struct LucidLink(Link<Told>);

/// What the line and the ticks tell each other.
#[derive(Debug)]
struct Told {
    /// Newest level of each finger, and when it was rendered.
    levels: ([f64; PORTS], Instant),
    heard: Option<Instant>,
}

/// Speed of the glove, bits per second.
const BAUD: u32 = 115_200;
/// A glove that sends no line for longer is lost.
const SILENCE_MAX: Duration = Duration::from_millis(300);
/// Levels that are older are not sent.
const LEVEL_AGE_MAX: Duration = Duration::from_millis(50);
/// Longest wait for bytes.
const READ_MAX: Duration = Duration::from_millis(50);
const WRITE_MAX: Duration = Duration::from_millis(100);
/// Largest number of a servo.
const FULL: f64 = 1000.0;

/// The line that sets the servos: thumb first, 0 free, 1000 held.
///
/// Source: the serial protocol of LucidGloves, letters `A` to `E`.
pub fn line_of(levels: &[f64; PORTS]) -> String {
    let mut line = String::with_capacity(32);
    for (letter, level) in ('A'..='E').zip(levels) {
        // A NaN must not brake a finger.
        let level = if level.is_finite() { level.clamp(0.0, 1.0) } else { 0.0 };
        let number = (FULL * level).round();
        line.push(letter);
        line.push_str(&format!("{number:.0}"));
    }
    line.push('\n');
    line
}

impl LucidLink {
    pub(super) fn open(path: &Path) -> Result<Self, DeviceError> {
        let opened = SerialPort::open(path, BAUD).and_then(|mut port| {
            port.set_read_timeout(READ_MAX)?;
            port.set_write_timeout(WRITE_MAX)?;
            Ok(port)
        });
        let port = opened.map_err(|source| DeviceError::Port { path: path.to_owned(), source })?;
        let told = Told { levels: ([0.0; PORTS], Instant::now()), heard: None };
        Link::start("LucidGloves", told, move |said| Line { port, said }.keep()).map(Self)
    }

    pub(super) fn is_lost(&self, now: Instant) -> bool {
        let heard = self.0.said().heard;
        heard.is_none_or(|at| now.saturating_duration_since(at) > SILENCE_MAX)
    }

    pub(super) fn render(&self, levels: [f64; PORTS]) {
        self.0.said().levels = (levels, Instant::now());
    }

    pub(super) fn close(self) -> Option<String> {
        self.0.close()
    }
}

/// The side of the thread.
struct Line {
    port: SerialPort,
    said: Said<Told>,
}

impl Line {
    fn keep(mut self) {
        if let Err(error) = self.speak() {
            tracing::warn!(%error, "the line of the LucidGloves is lost");
            self.said.lock().why_lost = Some(error.to_string());
        }
        // A servo keeps its last angle: the fingers are freed in any case.
        let _ = self.port.write_all(line_of(&[0.0; PORTS]).as_bytes());
    }

    fn speak(&mut self) -> std::io::Result<()> {
        let mut bytes = [0u8; 256];
        while !self.said.lock().ends {
            let count = match self.port.read(&mut bytes) {
                Ok(0) => return Err(std::io::Error::other("the line was hung up")),
                Ok(count) => count,
                Err(error) if is_later(error.kind()) => continue,
                Err(error) => return Err(error),
            };
            // In lock step: whatever came, one line of ours answers the newest of the glove's.
            if !bytes[..count].contains(&b'\n') {
                continue;
            }
            let levels = {
                let mut said = self.said.lock();
                said.heard = Some(Instant::now());
                let (levels, at) = said.levels;
                if at.elapsed() < LEVEL_AGE_MAX { levels } else { [0.0; PORTS] }
            };
            match self.port.write_all(line_of(&levels).as_bytes()) {
                Ok(()) => {}
                // A glove that does not listen now gets the next line.
                Err(error) if is_later(error.kind()) => {}
                Err(error) => return Err(error),
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn levels_are_servo_numbers_from_the_thumb_on() {
        assert_eq!(line_of(&[0.0, 0.25, 0.5, 1.0, 7.0]), "A0B250C500D1000E1000\n");
        assert_eq!(line_of(&[f64::NAN, -1.0, 0.0, 0.0, 0.0]), "A0B0C0D0E0\n");
    }
}
