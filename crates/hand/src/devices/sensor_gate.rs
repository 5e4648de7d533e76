//! Keeps out readings of a glove's sensor that no finger can have brought about, and tells of
//! sensors that are dead or at an end of their range.

use super::calibration::sensor_name;
use super::cyberglove::{RawSensors, Sensor, is_rail};
use crate::notice::Notice;

/// Compares each reading of a sensor with the one before. A jump waits for the next reading: two that
/// agree are a finger that moved. One to an end of the range is not taken as long as it stays there:
/// that is what a sensor does whose wire breaks.
#[derive(Clone, Debug, Default)]
pub struct SensorGate {
    sensors: [Watched; 22],
    last_s: Option<f64>,
    refused: u64,
    news: Vec<Notice>,
}

/// State of one sensor: readings taken and waiting, and what was told.
#[derive(Clone, Copy, Debug, Default)]
struct Watched {
    taken: Option<u8>,
    waiting: Option<u8>,
    /// Readings in a row at an end of the range: `broken` after a jump there, `clipped` after a gradual
    /// way there.
    broken: u32,
    clipped: u32,
    /// Whether the sensor has read a value inside its range; one that has not may be dead, which is told
    /// elsewhere.
    has_read: bool,
    is_told_broken: bool,
    is_told_clipped: bool,
}

/// Fastest change of a reading by a finger, counts/s, and a change that noise does not exceed, counts.
const RATE_MAX: f64 = 1500.0;
const STEP_COUNTS: f64 = 30.0;
/// Shortest time that is assumed between two readings, s: several may be taken at once.
const RECORD_S: f64 = 0.01;
/// Readings in a row at an end of the range after which the person is told: half a second.
const TOLD_AFTER: u32 = 50;

impl SensorGate {
    /// The reading, in which every sensor that jumped keeps its value from before.
    ///
    /// Units: `time_s` s.
    pub fn take(&mut self, raw: &RawSensors, time_s: f64) -> RawSensors {
        let elapsed_s = self.last_s.map_or(0.0, |last_s| time_s - last_s).max(RECORD_S);
        self.last_s = Some(time_s);
        let most = STEP_COUNTS + RATE_MAX * elapsed_s;
        RawSensors::from_fn(raw.count(), |sensor| {
            // A glove of 18 sensors is not asked for the others.
            let Some(value) = raw.get(sensor) else { return 0 };
            let watched = &mut self.sensors[sensor.index()];
            let (taken, refused) = watched.take(value, most);
            self.refused += u64::from(refused);
            self.news.extend(watched.news(sensor, value));
            taken
        })
    }

    /// Number of readings of single sensors that were not taken.
    pub fn refused(&self) -> u64 {
        self.refused
    }

    /// What is to be told of sensors since the last call, a sentence each.
    pub fn take_news(&mut self) -> Vec<Notice> {
        std::mem::take(&mut self.news)
    }
}

impl Watched {
    /// The value to go on with, and whether the reading was refused.
    fn take(&mut self, value: u8, most: f64) -> (u8, bool) {
        let follows = |other: Option<u8>| {
            other.is_none_or(|other| (f64::from(value) - f64::from(other)).abs() <= most)
        };
        let is_end = is_rail(value);
        let waited = self.waiting.take();
        let agrees = waited.is_some() && follows(waited) && !is_end;
        match self.taken {
            Some(before) if !follows(Some(before)) && !agrees => {
                self.broken = if is_end { self.broken.saturating_add(1) } else { 0 };
                self.waiting = Some(value);
                (before, true)
            }
            _ => {
                self.broken = 0;
                self.has_read |= !is_end;
                let is_clipped = is_end && self.has_read;
                self.clipped = if is_clipped { self.clipped.saturating_add(1) } else { 0 };
                self.taken = Some(value);
                (value, false)
            }
        }
    }

    /// The notice about this sensor that is due now, if there is one.
    fn news(&mut self, sensor: Sensor, value: u8) -> Option<Notice> {
        let name = sensor_name(sensor);
        if self.broken >= TOLD_AFTER && !self.is_told_broken {
            self.is_told_broken = true;
            return Some(Notice::refused(format!(
                "the glove's sensor {name} went to {value} at once and stays there, as a broken one \
                 does: its joint is held where it was"
            )));
        }
        if self.broken == 0 && self.is_told_broken && self.waiting.is_none() {
            self.is_told_broken = false;
            return Some(Notice::done(format!("the glove's sensor {name} reads again")));
        }
        if self.clipped >= TOLD_AFTER && !self.is_told_clipped {
            self.is_told_clipped = true;
            return Some(Notice::refused(format!(
                "the glove's sensor {name} is at an end of its range ({value}): its joint is not \
                 measured beyond; set the glove's gains anew, or the sensor is dead"
            )));
        }
        None
    }
}

#[cfg(test)]
mod tests {
    use super::super::cyberglove::SensorCount;
    use super::*;

    fn reading(index_mcp: u8) -> RawSensors {
        RawSensors::from_fn(SensorCount::TwentyTwo, |sensor| match sensor {
            Sensor::IndexMcp => index_mcp,
            _ => 100,
        })
    }

    /// Feeds readings of one sensor, 100 a second; returns the readings taken, the notices, and how many were
    /// refused.
    fn feed(readings: impl IntoIterator<Item = u8>) -> (Vec<u8>, Vec<Notice>, u64) {
        let mut gate = SensorGate::default();
        let given = readings.into_iter().enumerate().map(|(at, value)| {
            gate.take(&reading(value), 0.01 * at as f64).get(Sensor::IndexMcp).unwrap()
        });
        let given = given.collect();
        (given, gate.take_news(), gate.refused())
    }

    #[test]
    fn finger_that_closes_and_opens_quickly_is_followed() {
        let closing = (0..20).map(|i| 60 + 8 * i).chain((0..20).map(|i| 212 - 8 * i));
        let (given, told, refused) = feed(closing.clone());
        assert_eq!((given, told.len(), refused), (closing.collect(), 0, 0));
        let jump = [60, 60, 200, 200, 200];
        assert_eq!(feed(jump).0, [60, 60, 60, 200, 200], "two agree");
    }

    #[test]
    fn single_damaged_reading_is_left_out() {
        let (given, told, refused) = feed([60, 62, 190, 64, 66, 254, 68]);
        assert_eq!((given, told.len(), refused), (vec![60, 62, 62, 64, 66, 66, 68], 0, 2));
    }

    #[test]
    fn sensor_that_dies_holds_its_joint_where_it_was_and_is_told_once() {
        let dies = [90; 5].into_iter().chain([254; 300]).chain([92; 3]);
        let (given, told, _) = feed(dies);
        assert_eq!(&given[..305], &[90; 305][..], "the hand does not jump");
        assert_eq!(given[307], 92);
        assert_eq!(told.len(), 2, "{told:?}");
        assert!(told[0].text.contains("index MPJ went to 254 at once"), "{told:?}");
        assert!(told[1].text.contains("reads again"), "{told:?}");
    }

    #[test]
    fn range_that_is_clipped_is_told_once() {
        let clips = (0..40).map(|i| 100 + 4 * i).map(|v: u32| v.min(254) as u8);
        let (given, told, refused) = feed(clips.chain([254; 100]).chain([240; 9]).chain([254; 99]));
        assert_eq!((given[130], refused), (254, 0));
        assert_eq!(told.len(), 1, "{told:?}");
        assert!(told[0].text.contains("at an end of its range (254)"), "{told:?}");
    }
}
