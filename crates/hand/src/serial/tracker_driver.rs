//! The tracker's driver: sets everything explicitly, asks for records, stops it at the end.

use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use super::driver::{DriverContext, Ended};
use super::facts::TrackerFacts;
use super::listening::{Poll, ask, serve, wait_until_quiet};
use super::port::{Lost, Port};
use super::record_assembler::Cut;
use super::settings::{TrackerFilter, TrackerMode, TrackerSettings};
use crate::devices::fastrak::{Encoding, FastrakFormat, LengthUnit, OutputList};

/// Ends continuous output.
const STOP: &[u8] = b"c";
/// The line is quiet when nothing has come for so long; records come every 8 ms.
const QUIET: Duration = Duration::from_millis(60);
/// How long it may take to become quiet.
const QUIET_MAX: Duration = Duration::from_secs(2);
/// How long the status record may take.
const STATUS_MAX: Duration = Duration::from_millis(500);

/// All orders are given so many times at most.
const ORDERS_MAX: usize = 3;

/// Serves an open port until it is lost or the thread is to end.
pub(super) fn serve_tracker(
    context: &DriverContext,
    port: &mut Port,
    settings: &TrackerSettings,
    facts: &Arc<Mutex<TrackerFacts>>,
) -> Result<Ended, Lost> {
    let poll = match settings.mode {
        TrackerMode::Polled { hz } => {
            Some(Poll { request: b"P", period: Duration::from_secs_f64(1.0 / hz) })
        }
        TrackerMode::Continuous => None,
    };
    let cut = Cut::TrackerRecords { length: settings.format.record_length() };
    let ended = serve(context, port, cut, poll, |port, just_opened| {
        let told = set_up(context, port, settings)?;
        let mut slot = facts.lock().unwrap_or_else(PoisonError::into_inner);
        // A tracker that falls silent is still the tracker that it was.
        if just_opened || told.status.is_some() {
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

fn set_up(
    context: &DriverContext,
    port: &mut Port,
    settings: &TrackerSettings,
) -> Result<TrackerFacts, Lost> {
    port.write(STOP)?;
    wait_until_quiet(context, port, QUIET, QUIET_MAX)?;
    port.discard_input();
    let mut status = ask(context, port, b"S", STATUS_MAX, find_status)?;
    let answers = status.is_some();
    let mut complaints = Vec::new();
    let mut disobeys = None;
    // An order that was lost is given again: a tracker left in inches is wrong by a factor of 2.54.
    for _ in 0..ORDERS_MAX {
        port.write(commands(settings).as_bytes())?;
        let heard = wait_until_quiet(context, port, QUIET, STATUS_MAX)?;
        complaints = refusals(&heard);
        disobeys = None;
        if answers {
            status = ask(context, port, b"S", STATUS_MAX, find_status)?.or(status);
            disobeys = status.as_ref().and_then(|status| disobeyed(status, settings.format));
        }
        if disobeys.is_none() {
            break;
        }
    }
    for complaint in complaints.iter().chain(&disobeys) {
        tracing::info!(complaint, "the tracker refuses a command");
    }
    port.discard_input();
    if settings.mode == TrackerMode::Continuous {
        port.write(b"C")?;
    }
    Ok(TrackerFacts { status, complaints, disobeys })
}

/// Everything that the tracker is to be set to.
fn commands(settings: &TrackerSettings) -> String {
    let station = settings.station.number();
    let items = match settings.format.output {
        OutputList::PositionEuler => "2,4,1",
        OutputList::PositionQuaternion => "2,11,1",
    };
    let encoding = match settings.format.encoding {
        Encoding::Ascii => 'F',
        Encoding::Binary => 'f',
    };
    let units = match settings.format.units {
        LengthUnit::Inches => 'U',
        LengthUnit::Centimetres => 'u',
    };
    let stations: String = (1..=4).map(|n| format!("l{n},{}\r", u8::from(n == station))).collect();
    let [x, y, z] = settings.hemisphere;
    // An alignment, boresight or increment that someone has left would bend or thin out the poses.
    let undone = format!("R{station}\rb{station}\rI{station},0\r");
    let filters = [("x", settings.position_filter), ("v", settings.attitude_filter)];
    let filters: String = filters.map(|(letter, filter)| filter_command(letter, filter)).concat();
    format!(
        "{stations}O{station},{items}\r{encoding}{units}H{station},{x:.3},{y:.3},{z:.3}\r{undone}\
         {filters}"
    )
}

fn filter_command(letter: &str, filter: TrackerFilter) -> String {
    match filter {
        TrackerFilter::Off => format!("{letter},1\r"),
        TrackerFilter::On { sensitivity, low, high, factor } => {
            format!("{letter}{sensitivity:.3},{low:.3},{high:.3},{factor:.3}\r")
        }
    }
}

/// The status record among what was heard, without CR LF.
pub(super) fn find_status(heard: &[u8]) -> Option<String> {
    lines(heard).find(|line| line.get(2) == Some(&b'S') && is_reply(line)).map(text)
}

/// What a status record says that a tracker is not as it was told to be: text or floats, and the
/// unit. `None` where all is as it was told, or the record does not say.
pub(super) fn disobeyed(status: &str, told: FastrakFormat) -> Option<String> {
    let bits = u16::from_str_radix(status.get(3..6)?, 16).ok()?;
    let is_binary = bits & 1 != 0;
    let units = if bits & 2 != 0 { LengthUnit::Centimetres } else { LengthUnit::Inches };
    if units != told.units {
        let (is, was_told) = (units.name(), told.units.name());
        return Some(format!("it stays in {is} though it was told to send {was_told}"));
    }
    (is_binary != (told.encoding == Encoding::Binary))
        .then(|| "it did not take the order for text or bytes".to_owned())
}

/// The error records among what was heard.
pub(super) fn refusals(heard: &[u8]) -> Vec<String> {
    let complains = |line: &&[u8]| is_reply(line) && line.windows(7).any(|w| w == b"*ERROR*");
    lines(heard).filter(complains).map(text).collect()
}

fn text(line: &[u8]) -> String {
    String::from_utf8_lossy(line).trim_end().to_owned()
}

/// Lines that have ended, from the last byte on that could begin a reply.
fn lines(heard: &[u8]) -> impl Iterator<Item = &[u8]> {
    let mut rest = heard;
    std::iter::from_fn(move || {
        let end = rest.windows(2).position(|pair| pair == b"\r\n")?;
        let line = &rest[..end];
        rest = &rest[end + 2..];
        // Garbage may stand before it.
        let start = (0..line.len()).find(|&at| is_reply(&line[at..])).unwrap_or(0);
        Some(&line[start..])
    })
}

fn is_reply(line: &[u8]) -> bool {
    matches!(line, [b'2', b' ' | b'1'..=b'4', letter, ..] if letter.is_ascii_alphabetic())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::serial::PortName;
    use nalgebra::Isometry3;
    use softgrasp_emulator::{EmulatedTracker, EmulatedTrackerKind};

    #[test]
    fn every_command_is_one_that_the_tracker_knows() {
        let mut settings = TrackerSettings::new(PortName { path: "x".into(), baud: 115_200 });
        let on = TrackerFilter::On { sensitivity: 0.2, low: 0.2, high: 0.8, factor: 0.8 };
        for filter in [TrackerFilter::Off, on] {
            settings.attitude_filter = filter;
            let mut tracker = EmulatedTracker::new(EmulatedTrackerKind {
                plugged: [true; 4],
                ..EmulatedTrackerKind::default()
            });
            tracker.receive(commands(&settings).as_bytes(), 0.0);
            let complaints = tracker.send(1.0, |_, _| Isometry3::identity());
            assert_eq!(complaints, b"", "{}", String::from_utf8_lossy(&complaints));
            tracker.receive(b"P", 2.0);
            assert_eq!(tracker.send(3.0, |_, _| Isometry3::identity()).len(), 33);
        }
    }
}

#[cfg(test)]
mod tracker_replies_tests {
    use super::*;
    use crate::devices::fastrak::OutputList;

    #[test]
    fn status_tells_a_tracker_that_was_left_in_inches() {
        let told = FastrakFormat {
            encoding: Encoding::Binary,
            output: OutputList::PositionQuaternion,
            units: LengthUnit::Centimetres,
        };
        assert_eq!(disobeyed("21S3F3    F31  2.10", told), None);
        let inches = disobeyed("21S3F1    F31  2.10", told).expect("said");
        assert_eq!(inches, "it stays in inches though it was told to send centimetres");
        assert!(disobeyed("21S3F2    F31  2.10", told).is_some_and(|why| why.contains("text")));
        for unclear in ["", "21S", "21SXYZ", "21Sé"] {
            assert_eq!(disobeyed(unclear, told), None, "{unclear}");
        }
    }

    #[test]
    fn status_and_complaints_are_found_among_other_bytes() {
        let heard = b".00\r\nxx21S3F0    F31  2.10  \r\n2 E*ERROR*O*ERROR* EC -3*\r\n01  ";
        assert_eq!(find_status(heard).as_deref(), Some("21S3F0    F31  2.10"));
        assert_eq!(refusals(heard), ["2 E*ERROR*O*ERROR* EC -3*"]);
        for heard in [&b""[..], b"21S3F0", b"\r\n", b"2\r\n", b"01   10.25\r\n"] {
            assert_eq!(find_status(heard), None, "{heard:?}");
            assert!(refusals(heard).is_empty());
        }
    }
}
