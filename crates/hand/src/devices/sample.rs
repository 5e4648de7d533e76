//! Holds the newest record of each device with the time at which it arrived.

use nalgebra::Isometry3;

use super::cyberglove::{GloveRecord, RawSensors};
use super::fastrak::{FastrakRecord, Station};

/// One reading of the glove.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GloveReading {
    /// Raw sensor values.
    pub sensors: RawSensors,
    /// Arrival of the record's first byte on the client's clock, s.
    pub time_s: f64,
}

/// One reading of the tracker.
///
/// Units: m. Frame: world, Y up (`docs/frames.md`).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TrackerReading {
    /// Station number of the receiver.
    pub station: Station,
    /// Receiver frame in the world.
    pub world_from_receiver: Isometry3<f64>,
    /// Arrival of the record's first byte on the client's clock, s.
    pub time_s: f64,
}

/// Whether a reading is young enough to be used.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Freshness {
    /// The reading is at most as old as is allowed.
    Fresh,
    /// The reading is older than is allowed.
    Stale {
        /// Age of the reading, s.
        age_s: f64,
    },
    /// There has been no reading.
    Missing,
}

/// The newest reading of each device, as one tick of the client sees them.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct HandSample {
    /// Newest glove reading.
    pub glove: Option<GloveReading>,
    /// Newest tracker reading.
    pub tracker: Option<TrackerReading>,
    /// Time of the tick on the client's clock, s.
    pub time_s: f64,
}

impl HandSample {
    /// Whether the glove reading is at most `max_age_s` old.
    pub fn glove_freshness(&self, max_age_s: f64) -> Freshness {
        freshness(self.time_s, self.glove.map(|reading| reading.time_s), max_age_s)
    }

    /// Whether the tracker reading is at most `max_age_s` old.
    pub fn tracker_freshness(&self, max_age_s: f64) -> Freshness {
        freshness(self.time_s, self.tracker.map(|reading| reading.time_s), max_age_s)
    }
}

fn freshness(now_s: f64, reading_s: Option<f64>, max_age_s: f64) -> Freshness {
    match reading_s.map(|time_s| now_s - time_s) {
        None => Freshness::Missing,
        // Written so that an age that is not a number is stale.
        Some(age_s) if age_s <= max_age_s => Freshness::Fresh,
        Some(age_s) => Freshness::Stale { age_s },
    }
}

/// Keeps the newest usable reading of each device between ticks.
///
/// Readings that carry a complaint are not kept: the older one stays and grows stale, which is
/// what a tick looks at.
#[derive(Clone, Copy, Debug, Default)]
pub struct SampleHold {
    glove: Option<GloveReading>,
    tracker: Option<TrackerReading>,
}

impl SampleHold {
    /// Takes a glove record that arrived at `time_s`, unless its status says no glove is plugged in.
    pub fn on_glove(&mut self, record: &GloveRecord, time_s: f64) {
        if record.status.is_none_or(|status| status.plugged_in) {
            self.glove = Some(GloveReading { sensors: record.sensors, time_s });
        }
    }

    /// Takes a tracker record that arrived at `time_s`, unless its self-test failed.
    pub fn on_tracker(&mut self, record: &FastrakRecord, time_s: f64) {
        if record.error.is_none() {
            self.tracker = Some(TrackerReading {
                station: record.station,
                world_from_receiver: record.world_from_receiver(),
                time_s,
            });
        }
    }

    /// The newest readings as of `now_s`.
    pub fn sample(&self, now_s: f64) -> HandSample {
        HandSample { glove: self.glove, tracker: self.tracker, time_s: now_s }
    }
}

#[cfg(test)]
mod tests {
    use super::super::cyberglove::{GloveStatus, RecordKind, SensorCount};
    use super::super::fastrak::{LengthUnit, OutputList};
    use super::*;

    fn glove(value: u8, plugged_in: bool) -> GloveRecord {
        let status = GloveStatus { plugged_in, switch_on: false, light_on: false };
        GloveRecord {
            kind: RecordKind::Polled,
            sensors: RawSensors::from_fn(SensorCount::Eighteen, |_| value),
            timestamp: None,
            status: Some(status),
        }
    }

    #[test]
    fn the_newest_good_reading_is_held_and_grows_stale() {
        let mut hold = SampleHold::default();
        assert_eq!(hold.sample(1.0).glove_freshness(0.1), Freshness::Missing);
        hold.on_glove(&glove(10, true), 1.0);
        hold.on_glove(&glove(20, false), 1.2);
        let sample = hold.sample(1.25);
        assert_eq!(sample.glove.unwrap().sensors.as_slice()[0], 10);
        assert_eq!(sample.glove_freshness(0.25), Freshness::Fresh);
        assert_eq!(sample.glove_freshness(0.2), Freshness::Stale { age_s: 0.25 });
        assert!(matches!(hold.sample(f64::NAN).glove_freshness(1.0), Freshness::Stale { .. }));
    }

    #[test]
    fn tracker_records_with_a_failed_self_test_are_not_taken() {
        let station = Station::try_new(1).unwrap();
        let pose = Isometry3::translation(0.1, 0.2, 0.3);
        let output = OutputList::PositionQuaternion;
        let good = FastrakRecord::from_world(station, &pose, output, LengthUnit::Inches);
        let mut hold = SampleHold::default();
        hold.on_tracker(&FastrakRecord { error: Some(b'x'), ..good }, 0.0);
        assert_eq!(hold.sample(0.0).tracker_freshness(1.0), Freshness::Missing);
        hold.on_tracker(&good, 0.5);
        let reading = hold.sample(0.6).tracker.unwrap();
        let off = reading.world_from_receiver.translation.vector - pose.translation.vector;
        assert!(off.norm() < 1e-12);
        assert_eq!(hold.sample(0.6).tracker_freshness(0.2), Freshness::Fresh);
    }
}
