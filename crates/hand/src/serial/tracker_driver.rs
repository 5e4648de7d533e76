//! The tracker's driver: sets everything explicitly, asks for records, stops it at the end.

use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use super::driver::{DriverContext, Ended};
use super::facts::TrackerFacts;
use super::listening::{Poll, ask, serve, wait_until_quiet};
use super::port::{Lost, Port};
use super::record_assembler::Cut;
use super::settings::{TrackerFilter, TrackerMode, TrackerSettings};
use super::tracker_replies::{complaints as refusals, disobeyed, find_status};
use crate::devices::fastrak::{Encoding, LengthUnit, OutputList};

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
