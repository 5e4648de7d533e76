//! How well the gestures of a calibration could be told apart, sensor by sensor.

use super::sensor_names::sensor_name;
use crate::devices::cyberglove::Sensor;

/// A held gesture may scatter by this much, counts (standard deviation).
const MAX_NOISE_COUNTS: f64 = 4.0;
/// A joint must move by this share of what an average glove shows.
const MIN_SHARE: f64 = 0.25;

/// How far the readings of one sensor moved and scattered during the gestures.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SensorQuality {
    /// Mean reading in the fist less that of the flat hand; 0 without readings.
    pub span_counts: f64,
    /// Span of an average glove's sensor; `None` where the gestures hardly differ at this joint.
    pub expected_counts: Option<f64>,
    /// Standard deviation of the readings while a gesture was held, the larger of both.
    pub noise_counts: f64,
}

impl SensorQuality {
    pub(super) fn of(readings: &[Vec<u8>; 2], expected_counts: Option<f64>) -> Self {
        if readings.iter().any(Vec::is_empty) {
            return Self { expected_counts, ..Self::default() };
        }
        let [flat, fist] = readings;
        Self {
            span_counts: mean(fist) - mean(flat),
            expected_counts,
            noise_counts: deviation(flat).max(deviation(fist)),
        }
    }

    /// The complaint about this sensor, if its readings are not good enough.
    pub(super) fn complaint(&self, sensor: Sensor) -> Option<Complaint> {
        let Self { span_counts, noise_counts, .. } = *self;
        if noise_counts > MAX_NOISE_COUNTS {
            return Some(Complaint::Unsteady { sensor, noise_counts });
        }
        if self.is_small() {
            return Some(Complaint::Small { sensor, span_counts: span_counts.abs() });
        }
        let reversed = self.is_reversed(sensor);
        reversed.then_some(Complaint::Reversed { sensor, rises: span_counts > 0.0 })
    }

    /// Whether the sensor moved by much less than one of an average glove.
    pub(super) fn is_small(&self) -> bool {
        let expected = self.expected_counts;
        expected.is_some_and(|expected| self.span_counts.abs() < MIN_SHARE * expected.abs())
    }

    /// Whether the reading of a bending joint went the wrong way.
    pub(super) fn is_reversed(&self, sensor: Sensor) -> bool {
        let expected = self.expected_counts;
        bends(sensor) && expected.is_some_and(|expected| self.span_counts * expected < 0.0)
    }
}

/// Why a gesture is not good enough, as a sentence with advice.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Complaint {
    /// The readings of both gestures are nearly the same.
    Small {
        /// Sensor that moved too little.
        sensor: Sensor,
        /// Its mean reading in the fist less that of the flat hand, counts.
        span_counts: f64,
    },
    /// The hand moved while a gesture was held.
    Unsteady {
        /// Sensor whose readings scattered.
        sensor: Sensor,
        /// Standard deviation of its readings while a gesture was held, counts.
        noise_counts: f64,
    },
    /// The reading went the wrong way.
    Reversed {
        /// Sensor whose reading went the wrong way.
        sensor: Sensor,
        /// Whether the reading rose where it should fall; otherwise it fell where it should rise.
        rises: bool,
    },
    /// The third gesture does not tell the thumb's two sensors apart.
    ThumbTooAlike,
}

impl std::fmt::Display for Complaint {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match *self {
            Self::Small { sensor, span_counts } => {
                let (name, advice) = (sensor_name(sensor), advice(sensor));
                write!(f, "{name} moved by {span_counts:.0} counts only; {advice} and try again")
            }
            Self::Unsteady { sensor, noise_counts } => {
                let name = sensor_name(sensor);
                write!(
                    f,
                    "{name} trembled by {noise_counts:.0} counts; hold each gesture still and try \
                     again"
                )
            }
            Self::Reversed { sensor, rises } => {
                let name = sensor_name(sensor);
                let went =
                    if rises { "rose where it should fall" } else { "fell where it should rise" };
                write!(
                    f,
                    "{name} {went}; show the flat hand first and then the fist, and try again"
                )
            }
            Self::ThumbTooAlike => f.write_str(
                "the thumb stood as in the fist or as in the flat hand; swing it straight in front \
                 of the palm, away from it, and try again",
            ),
        }
    }
}

/// Whether a sensor feels flexion: its reading grows with the angle on every glove.
fn bends(sensor: Sensor) -> bool {
    !matches!(
        sensor,
        Sensor::ThumbAbduction
            | Sensor::MiddleIndexAbduction
            | Sensor::RingMiddleAbduction
            | Sensor::LittleRingAbduction
            | Sensor::WristYaw
    )
}

/// Advice to the person how to move the joint of this sensor further.
fn advice(sensor: Sensor) -> &'static str {
    match sensor {
        Sensor::ThumbRotation | Sensor::ThumbMcp | Sensor::ThumbIp | Sensor::ThumbAbduction => {
            "close the thumb over the fingers"
        }
        Sensor::PalmArch => "hold a tighter fist with a hollow palm",
        _ => "hold a tighter fist",
    }
}

/// Mean of readings, of which there is at least one.
pub(super) fn mean(values: &[u8]) -> f64 {
    values.iter().map(|&v| f64::from(v)).sum::<f64>() / values.len() as f64
}

fn deviation(values: &[u8]) -> f64 {
    let mean = mean(values);
    let squares: f64 = values.iter().map(|&v| (f64::from(v) - mean).powi(2)).sum();
    (squares / values.len() as f64).sqrt()
}
