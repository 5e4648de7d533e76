//! Finds sensors that are dead: stuck at an end of their range.

use super::sensor::{RawSensors, Sensor, SensorSet};

/// Watches a stream of readings for sensors that have only ever shown one end of the range.
///
/// A broken bend sensor reads a constant 1 or 254 (255). A joint held at its stop looks the same
/// for a while, so a sensor counts as dead only after [`SensorHealth::RECORDS`] readings without a
/// single other value, and is alive again with the first other value.
#[derive(Clone, Debug, Default)]
pub struct SensorHealth {
    records: u32,
    /// First value seen per sensor.
    first: [Option<u8>; 22],
    /// Sensors that have shown another value since.
    varied: SensorSet,
}

impl SensorHealth {
    /// Readings before a verdict: about two seconds of a 100 Hz stream.
    pub const RECORDS: u32 = 200;

    /// Takes one more reading into account.
    pub fn observe(&mut self, raw: &RawSensors) {
        self.records = self.records.saturating_add(1);
        for sensor in Sensor::ALL {
            let Some(value) = raw.get(sensor) else { continue };
            match self.first[sensor.index()] {
                None => self.first[sensor.index()] = Some(value),
                Some(first) if first != value => self.varied.insert(sensor),
                Some(_) => {}
            }
        }
    }

    /// The sensors that are dead by the readings so far.
    pub fn dead(&self) -> SensorSet {
        match self.records < Self::RECORDS {
            true => SensorSet::EMPTY,
            false => self.only_at_one_end(),
        }
    }

    /// The sensors that have shown one end of the range only, from the first reading on: those that
    /// will be dead, if they go on.
    pub fn only_at_one_end(&self) -> SensorSet {
        let stuck = |sensor: &Sensor| {
            let constant = !self.varied.contains(*sensor);
            constant && self.first[sensor.index()].is_some_and(is_rail)
        };
        Sensor::ALL.into_iter().filter(stuck).collect()
    }
}

/// Whether a value is an end of the range, where a broken sensor stays.
pub(crate) fn is_rail(value: u8) -> bool {
    matches!(value, 0 | 1 | 254 | 255)
}

#[cfg(test)]
mod tests {
    use super::super::sensor::SensorCount;
    use super::*;

    fn reading(palm_arch: u8, thumb: u8, others: u8) -> RawSensors {
        RawSensors::from_fn(SensorCount::TwentyTwo, |sensor| match sensor {
            Sensor::PalmArch => palm_arch,
            Sensor::ThumbRotation => thumb,
            _ => others,
        })
    }

    #[test]
    fn sensors_stuck_at_an_end_are_dead_and_a_still_hand_is_not() {
        let mut health = SensorHealth::default();
        for _ in 1..SensorHealth::RECORDS {
            health.observe(&reading(254, 1, 100));
            assert!(health.dead().is_empty(), "too early to tell");
            assert_eq!(health.only_at_one_end().iter().count(), 2);
        }
        health.observe(&reading(254, 1, 100));
        let dead: Vec<_> = health.dead().iter().collect();
        assert_eq!(dead, [Sensor::ThumbRotation, Sensor::PalmArch]);
    }

    #[test]
    fn a_sensor_that_moves_once_is_alive_for_good() {
        let mut health = SensorHealth::default();
        health.observe(&reading(254, 2, 100));
        for _ in 0..2 * SensorHealth::RECORDS {
            health.observe(&reading(254, 1, 100));
        }
        assert_eq!(health.dead().iter().collect::<Vec<_>>(), [Sensor::PalmArch]);
        health.observe(&reading(250, 1, 100));
        assert!(health.dead().is_empty());
    }

    #[test]
    fn sensors_the_glove_lacks_are_not_dead() {
        let mut health = SensorHealth::default();
        for _ in 0..SensorHealth::RECORDS {
            health.observe(&RawSensors::from_fn(SensorCount::Eighteen, |_| 1));
        }
        assert_eq!(health.dead().iter().count(), 18);
    }
}
