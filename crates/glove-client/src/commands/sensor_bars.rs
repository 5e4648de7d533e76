//! Live bars of the glove's sensors on a terminal, and one line a second anywhere else.

use std::io::{IsTerminal as _, Write};
use std::time::{Duration, Instant};

use softgrasp_hand::devices::calibration::sensor_name;
use softgrasp_hand::devices::cyberglove::{RawSensors, Sensor};

/// Length of a full bar, characters.
const BAR: usize = 32;
/// Shortest time between two drawings, as fast as a person reads.
const DRAW_EVERY: Duration = Duration::from_millis(60);
/// Shortest time between two lines of a log.
const LOG_EVERY: Duration = Duration::from_secs(1);

/// Draws every sensor's reading, and the range that it has shown so far.
pub(super) struct SensorBars<W> {
    out: W,
    is_terminal: bool,
    /// Least and largest reading of each sensor.
    range: [Option<(u8, u8)>; 22],
    drawn: Option<Instant>,
    /// Number of lines that the next drawing overwrites.
    over: usize,
}

impl SensorBars<std::io::Stderr> {
    /// Bars on standard error.
    pub(super) fn on_standard_error() -> Self {
        let out = std::io::stderr();
        let is_terminal = out.is_terminal();
        Self::new(out, is_terminal)
    }
}

impl<W: Write> SensorBars<W> {
    /// Bars on a writer, with cursor movements only if it is a terminal.
    pub(super) fn new(out: W, is_terminal: bool) -> Self {
        Self { out, is_terminal, range: [None; 22], drawn: None, over: 0 }
    }

    /// Prints a sentence below the bars.
    pub(super) fn say(&mut self, text: &str) {
        self.over = 0;
        self.drawn = None;
        // Nobody can be told that standard error is closed.
        let _ = writeln!(self.out, "{text}").and_then(|()| self.out.flush());
    }

    /// Takes a reading, and draws it if it is time.
    pub(super) fn show(&mut self, title: &str, raw: &RawSensors) {
        for sensor in Sensor::ALL {
            let Some(value) = raw.get(sensor) else { continue };
            let range = &mut self.range[sensor.index()];
            let (least, most) = range.unwrap_or((value, value));
            *range = Some((least.min(value), most.max(value)));
        }
        let every = if self.is_terminal { DRAW_EVERY } else { LOG_EVERY };
        if self.drawn.is_some_and(|drawn| drawn.elapsed() < every) {
            return;
        }
        self.drawn = Some(Instant::now());
        let text = if self.is_terminal { self.screen(title, raw) } else { log_line(title, raw) };
        let _ = self.out.write_all(text.as_bytes()).and_then(|()| self.out.flush());
    }

    /// Text of all bars, which overwrites the ones before.
    fn screen(&mut self, title: &str, raw: &RawSensors) -> String {
        let mut text = match self.over {
            0 => String::new(),
            lines => format!("\x1b[{lines}A"),
        };
        let bars = Sensor::ALL.into_iter().filter_map(|sensor| {
            Some(bar_line(sensor, raw.get(sensor)?, self.range[sensor.index()]?))
        });
        let lines: Vec<String> = std::iter::once(title.to_owned()).chain(bars).collect();
        for line in &lines {
            text.push_str(line);
            // Clears what a longer line left behind.
            text.push_str("\x1b[K\n");
        }
        self.over = lines.len();
        text
    }
}

/// Line of a sensor: name, reading, bar from 0 to 255, least and largest reading.
fn bar_line(sensor: Sensor, value: u8, (least, most): (u8, u8)) -> String {
    let column = |value: u8| usize::from(value) * BAR / 256;
    let bar: String = (0..BAR)
        .map(|place| match () {
            () if place <= column(value) => '#',
            () if (column(least)..=column(most)).contains(&place) => '-',
            () => ' ',
        })
        .collect();
    format!("  {:<19} {value:>3} |{bar}| {least:>3} to {most:>3}", sensor_name(sensor))
}

/// Line with all readings in the order of the wire.
fn log_line(title: &str, raw: &RawSensors) -> String {
    let values: Vec<String> = raw.as_slice().iter().map(ToString::to_string).collect();
    format!("{title}: {}\n", values.join(" "))
}

#[cfg(test)]
mod tests {
    use super::*;
    use softgrasp_hand::devices::cyberglove::SensorCount;

    fn reading(value: u8) -> RawSensors {
        RawSensors::from_fn(SensorCount::Eighteen, |_| value)
    }

    #[test]
    fn bars_span_the_range_and_mark_what_was_seen() {
        let line = bar_line(Sensor::IndexMcp, 128, (64, 192));
        assert_eq!(line, "  index MPJ           128 |#################--------       |  64 to 192");
        assert_eq!(bar_line(Sensor::PalmArch, 255, (255, 255)).matches('#').count(), BAR);
    }

    #[test]
    fn a_terminal_is_drawn_over_and_a_log_gets_plain_lines() {
        let mut screen = Vec::new();
        let mut bars = SensorBars::new(&mut screen, true);
        bars.show("flat hand", &reading(10));
        bars.drawn = None;
        bars.show("flat hand", &reading(20));
        bars.say("good");
        let text = String::from_utf8(screen).unwrap();
        assert_eq!(text.matches("\x1b[19A").count(), 1, "18 bars and a title");
        assert!(text.contains(" 10 to  20") && text.ends_with("good\n"));
        assert!(!text.contains("index DIJ"), "this glove has none");
        let mut log = Vec::new();
        let mut bars = SensorBars::new(&mut log, false);
        for value in 1..=50 {
            bars.show("flat hand", &reading(value));
        }
        let text = String::from_utf8(log).unwrap();
        assert!(!text.contains('\x1b'));
        assert!(text.starts_with("flat hand: 1 1 1 "), "{text}");
    }
}
