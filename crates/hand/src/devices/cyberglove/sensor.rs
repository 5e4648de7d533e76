//! The sensors of the glove, their order on the wire, and one set of raw values.

use serde::{Deserialize, Serialize};

/// One bend or abduction sensor, in wire order of the 22-sensor glove.
///
/// Source: thesis section 2.2.2.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Sensor {
    /// Thumb rotation across the palm (TMJ).
    ThumbRotation,
    /// Thumb MPJ flexion.
    ThumbMcp,
    /// Thumb IJ flexion.
    ThumbIp,
    /// Thumb–index abduction.
    ThumbAbduction,
    /// Index MPJ flexion.
    IndexMcp,
    /// Index PIJ flexion.
    IndexPip,
    /// Index DIJ flexion; not in the 18-sensor glove.
    IndexDip,
    /// Middle MPJ flexion.
    MiddleMcp,
    /// Middle PIJ flexion.
    MiddlePip,
    /// Middle DIJ flexion; not in the 18-sensor glove.
    MiddleDip,
    /// Spread between middle and index finger.
    MiddleIndexAbduction,
    /// Ring MPJ flexion.
    RingMcp,
    /// Ring PIJ flexion.
    RingPip,
    /// Ring DIJ flexion; not in the 18-sensor glove.
    RingDip,
    /// Spread between ring and middle finger.
    RingMiddleAbduction,
    /// Little finger MPJ flexion.
    LittleMcp,
    /// Little finger PIJ flexion.
    LittlePip,
    /// Little finger DIJ flexion; not in the 18-sensor glove.
    LittleDip,
    /// Spread between little and ring finger.
    LittleRingAbduction,
    /// Palm arch.
    PalmArch,
    /// Wrist flexion.
    WristPitch,
    /// Wrist deviation.
    WristYaw,
}

impl Sensor {
    /// All 22 sensors, in wire order.
    pub const ALL: [Self; 22] = [
        Self::ThumbRotation,
        Self::ThumbMcp,
        Self::ThumbIp,
        Self::ThumbAbduction,
        Self::IndexMcp,
        Self::IndexPip,
        Self::IndexDip,
        Self::MiddleMcp,
        Self::MiddlePip,
        Self::MiddleDip,
        Self::MiddleIndexAbduction,
        Self::RingMcp,
        Self::RingPip,
        Self::RingDip,
        Self::RingMiddleAbduction,
        Self::LittleMcp,
        Self::LittlePip,
        Self::LittleDip,
        Self::LittleRingAbduction,
        Self::PalmArch,
        Self::WristPitch,
        Self::WristYaw,
    ];

    /// Position in [`Sensor::ALL`].
    pub const fn index(self) -> usize {
        self as usize
    }

    /// Whether the sensor measures a distal joint, which the 18-sensor glove leaves out.
    pub const fn is_dip(self) -> bool {
        matches!(self, Self::IndexDip | Self::MiddleDip | Self::RingDip | Self::LittleDip)
    }

    /// Position among the sensor bytes of a record, `None` if that glove lacks the sensor.
    pub fn wire_index(self, count: SensorCount) -> Option<usize> {
        match count {
            SensorCount::TwentyTwo => Some(self.index()),
            SensorCount::Eighteen if self.is_dip() => None,
            SensorCount::Eighteen => {
                let dips_before = Self::ALL.iter().filter(|s| s.is_dip() && **s < self).count();
                Some(self.index() - dips_before)
            }
        }
    }
}

/// Model of glove, by its number of sensors.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SensorCount {
    /// Glove without sensors at the four distal joints.
    Eighteen,
    /// Glove with all of [`Sensor::ALL`].
    TwentyTwo,
}

impl SensorCount {
    /// Number of sensor bytes per record.
    pub const fn number(self) -> usize {
        match self {
            Self::Eighteen => 18,
            Self::TwentyTwo => 22,
        }
    }

    /// The sensors of this glove in the order of its record.
    pub fn wire_order(self) -> impl Iterator<Item = Sensor> {
        Sensor::ALL.into_iter().filter(move |s| self == Self::TwentyTwo || !s.is_dip())
    }
}

/// One reading of every sensor.
///
/// Shapes: 18 or 22 values in wire order. Units: counts, each 1 to 255.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RawSensors {
    count: SensorCount,
    values: [u8; 22],
}

/// Why bytes are not a sensor reading.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum RawSensorsError {
    /// Another number of values than the glove has sensors.
    #[error("{got} sensor values, the glove sends {expected}")]
    WrongCount {
        /// Number of values given.
        got: usize,
        /// Number of sensors of the glove.
        expected: usize,
    },
    /// Zero ends a record, so it is never a sensor value.
    #[error("sensor value {wire_index} is zero")]
    Zero {
        /// Position among the values, from 0.
        wire_index: usize,
    },
}

impl RawSensors {
    /// Checked constructor from the sensor bytes of one record.
    ///
    /// # Errors
    /// [`RawSensorsError`] for a wrong number of values or a zero among them.
    pub fn try_new(count: SensorCount, bytes: &[u8]) -> Result<Self, RawSensorsError> {
        if bytes.len() != count.number() {
            return Err(RawSensorsError::WrongCount { got: bytes.len(), expected: count.number() });
        }
        if let Some(wire_index) = bytes.iter().position(|&b| b == 0) {
            return Err(RawSensorsError::Zero { wire_index });
        }
        let mut values = [1; 22];
        values[..bytes.len()].copy_from_slice(bytes);
        Ok(Self { count, values })
    }

    /// A reading made sensor by sensor; a zero becomes 1, as in the interface unit itself.
    pub fn from_fn(count: SensorCount, mut value: impl FnMut(Sensor) -> u8) -> Self {
        let mut values = [1; 22];
        for (slot, sensor) in values.iter_mut().zip(count.wire_order()) {
            *slot = value(sensor).max(1);
        }
        Self { count, values }
    }

    /// Model of the glove.
    pub fn count(&self) -> SensorCount {
        self.count
    }

    /// The values in wire order.
    pub fn as_slice(&self) -> &[u8] {
        &self.values[..self.count.number()]
    }

    /// Value of one sensor, `None` if this glove lacks it.
    pub fn get(&self, sensor: Sensor) -> Option<u8> {
        self.as_slice().get(sensor.wire_index(self.count)?).copied()
    }
}

/// A set of sensors.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct SensorSet(u32);

impl SensorSet {
    /// The set without any sensor.
    pub const EMPTY: Self = Self(0);

    /// Adds one sensor.
    pub fn insert(&mut self, sensor: Sensor) {
        self.0 |= 1 << sensor.index();
    }

    /// Whether the sensor is in the set.
    pub fn contains(self, sensor: Sensor) -> bool {
        self.0 & (1 << sensor.index()) != 0
    }

    /// Whether the set has no sensor.
    pub fn is_empty(self) -> bool {
        self.0 == 0
    }

    /// Sensors of the set in wire order.
    pub fn iter(self) -> impl Iterator<Item = Sensor> {
        Sensor::ALL.into_iter().filter(move |&s| self.contains(s))
    }
}

impl FromIterator<Sensor> for SensorSet {
    fn from_iter<I: IntoIterator<Item = Sensor>>(sensors: I) -> Self {
        let mut set = Self::EMPTY;
        for sensor in sensors {
            set.insert(sensor);
        }
        set
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn all_lists_the_sensors_by_index() {
        for (i, sensor) in Sensor::ALL.into_iter().enumerate() {
            assert_eq!(sensor.index(), i);
        }
    }

    #[test]
    fn eighteen_sensor_glove_has_the_documented_positions() {
        let at = |sensor: Sensor| sensor.wire_index(SensorCount::Eighteen);
        assert_eq!(at(Sensor::IndexPip), Some(5));
        assert_eq!(at(Sensor::IndexDip), None);
        assert_eq!(at(Sensor::MiddleMcp), Some(6));
        assert_eq!(at(Sensor::MiddleIndexAbduction), Some(8));
        assert_eq!(at(Sensor::RingMiddleAbduction), Some(11));
        assert_eq!(at(Sensor::LittleRingAbduction), Some(14));
        assert_eq!(at(Sensor::WristYaw), Some(17));
        for count in [SensorCount::Eighteen, SensorCount::TwentyTwo] {
            for (i, sensor) in count.wire_order().enumerate() {
                assert_eq!(sensor.wire_index(count), Some(i));
            }
            assert_eq!(count.wire_order().count(), count.number());
        }
    }

    #[test]
    fn zero_and_wrong_counts_are_refused() {
        let mut bytes = [9; 22];
        assert_eq!(
            RawSensors::try_new(SensorCount::Eighteen, &bytes),
            Err(RawSensorsError::WrongCount { got: 22, expected: 18 })
        );
        bytes[21] = 0;
        assert_eq!(
            RawSensors::try_new(SensorCount::TwentyTwo, &bytes),
            Err(RawSensorsError::Zero { wire_index: 21 })
        );
    }

    #[test]
    fn values_are_found_by_sensor() {
        let raw = RawSensors::from_fn(SensorCount::Eighteen, |s| s.index() as u8);
        assert_eq!(raw.get(Sensor::ThumbRotation), Some(1), "zero is lifted to one");
        assert_eq!(raw.get(Sensor::WristYaw), Some(21));
        assert_eq!(raw.get(Sensor::RingDip), None);
        assert_eq!(raw.as_slice().len(), 18);
    }

    #[test]
    fn a_set_holds_what_was_inserted() {
        let set: SensorSet = [Sensor::WristYaw, Sensor::ThumbIp].into_iter().collect();
        assert_eq!(set.iter().collect::<Vec<_>>(), [Sensor::ThumbIp, Sensor::WristYaw]);
        assert!(!set.contains(Sensor::ThumbMcp) && !set.is_empty() && SensorSet::EMPTY.is_empty());
    }
}
