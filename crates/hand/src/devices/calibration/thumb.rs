//! Cross-talk of the two sensors at the root of the thumb.

use serde::{Deserialize, Serialize};

use crate::devices::cyberglove::Sensor;

/// The two sensors that may be coupled.
pub(super) const THUMB_ROOT: [Sensor; 2] = [Sensor::ThumbRotation, Sensor::ThumbAbduction];

/// What each of the two thumb sensors adds to the angle of the other.
///
/// The root of the thumb turns about two axes and both strips bend with either turn, so that
/// rotation = g₀ (raw₀ − o₀) + c (raw₃ − o₃) and abduction = g₃ (raw₃ − o₃) + d (raw₀ − o₀), with
/// the sensors' own gains g and offsets o. Zero, the default, is no coupling.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ThumbCoupling {
    /// c: rotation for one count of the abduction sensor.
    pub rotation_rad_per_abduction_count: f64,
    /// d: abduction for one count of the rotation sensor.
    pub abduction_rad_per_rotation_count: f64,
}

impl ThumbCoupling {
    /// Whether both terms are zero: the two sensors are not coupled.
    pub fn is_none(&self) -> bool {
        *self == Self::default()
    }

    /// Both terms, rad per count: `[c, d]`, on the rotation and on the abduction.
    pub(super) fn terms(&self) -> [f64; 2] {
        [self.rotation_rad_per_abduction_count, self.abduction_rad_per_rotation_count]
    }

    /// Rotation and abduction in rad, of the counts above the offsets of both sensors.
    pub(super) fn angles(&self, gains: [f64; 2], counts: [f64; 2]) -> [f64; 2] {
        let [to_rotation, to_abduction] = self.terms();
        [
            gains[0] * counts[0] + to_rotation * counts[1],
            gains[1] * counts[1] + to_abduction * counts[0],
        ]
    }

    /// The counts above the offsets at which both sensors stand: the inverse.
    pub(super) fn counts(&self, gains: [f64; 2], angles: [f64; 2]) -> [f64; 2] {
        let [to_rotation, to_abduction] = self.terms();
        if self.is_none() {
            return [angles[0] / gains[0], angles[1] / gains[1]];
        }
        let determinant = gains[0] * gains[1] - to_rotation * to_abduction;
        [
            (gains[1] * angles[0] - to_rotation * angles[1]) / determinant,
            (gains[0] * angles[1] - to_abduction * angles[0]) / determinant,
        ]
    }

    /// Both angles where one sensor (0: rotation, 1: abduction) is dead and its joint rests.
    ///
    /// The resting joint and the other sensor say together where the dead sensor would stand.
    pub(super) fn angles_beside_dead(
        &self,
        gains: [f64; 2],
        dead: usize,
        rest_rad: f64,
        live_counts: f64,
    ) -> [f64; 2] {
        let live = 1 - dead;
        let terms = self.terms();
        let dead_counts = (rest_rad - terms[dead] * live_counts) / gains[dead];
        let live_rad = gains[live] * live_counts + terms[live] * dead_counts;
        if dead == 0 { [rest_rad, live_rad] } else { [live_rad, rest_rad] }
    }

    /// Whether two readings that differ always mean two different pairs of angles, with a margin.
    pub(super) fn is_invertible(&self, gains: [f64; 2]) -> bool {
        let [to_rotation, to_abduction] = self.terms();
        let (own, cross) = (gains[0] * gains[1], to_rotation * to_abduction);
        let sound = to_rotation.abs() <= 1.0 && to_abduction.abs() <= 1.0;
        sound && (own - cross).abs() >= 0.05 * (own.abs() + cross.abs())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn counts_are_the_inverse_of_angles(
            gains in prop::array::uniform2(0.004..0.02f64),
            terms in prop::array::uniform2(-0.003..0.003f64),
            counts in prop::array::uniform2(-120.0..120.0f64),
        ) {
            let coupling = ThumbCoupling {
                rotation_rad_per_abduction_count: terms[0],
                abduction_rad_per_rotation_count: terms[1],
            };
            prop_assert!(coupling.is_invertible(gains));
            let back = coupling.counts(gains, coupling.angles(gains, counts));
            prop_assert!((back[0] - counts[0]).abs() < 1e-9);
            prop_assert!((back[1] - counts[1]).abs() < 1e-9);
        }

        #[test]
        fn a_dead_sensor_at_its_rest_changes_nothing_for_the_other(
            terms in prop::array::uniform2(-0.003..0.003f64),
            counts in prop::array::uniform2(-120.0..120.0f64),
            dead in 0..2usize,
        ) {
            let gains = [0.016, 0.005];
            let coupling = ThumbCoupling {
                rotation_rad_per_abduction_count: terms[0],
                abduction_rad_per_rotation_count: terms[1],
            };
            let angles = coupling.angles(gains, counts);
            let beside = coupling.angles_beside_dead(gains, dead, angles[dead], counts[1 - dead]);
            prop_assert!((beside[0] - angles[0]).abs() < 1e-9);
            prop_assert!((beside[1] - angles[1]).abs() < 1e-9);
        }
    }

    #[test]
    fn couplings_that_merge_both_angles_are_found() {
        let merged = ThumbCoupling {
            rotation_rad_per_abduction_count: 0.01,
            abduction_rad_per_rotation_count: 0.01,
        };
        assert!(!merged.is_invertible([0.01, 0.01]));
        let endless = ThumbCoupling {
            rotation_rad_per_abduction_count: f64::NAN,
            abduction_rad_per_rotation_count: 0.0,
        };
        assert!(!endless.is_invertible([0.01, 0.01]));
    }
}
