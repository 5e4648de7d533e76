//! Records of a receiver for the tests: poses with the noise of a tracker, the same for one seed.

use nalgebra::{Isometry3, Point3, UnitQuaternion, Vector3};

/// Noise of a tracker: 0.8 mm and 0.15° root mean square over three axes.
pub(super) struct Noise {
    state: u64,
    place_m: f64,
    turn_rad: f64,
}

impl Noise {
    /// The noise of a FASTRAK near its transmitter.
    pub(super) fn new(seed: u64) -> Self {
        let per_axis = 1.0 / 3.0f64.sqrt();
        let turn_rad = 0.15f64.to_radians() * per_axis;
        Self { state: seed, place_m: 8e-4 * per_axis, turn_rad }
    }

    /// A generator without noise: only the turns of the receiver are random.
    pub(super) fn none(seed: u64) -> Self {
        Self { state: seed, place_m: 0.0, turn_rad: 0.0 }
    }

    /// Between 0 and 1 (SplitMix64).
    pub(super) fn uniform(&mut self) -> f64 {
        self.state = self.state.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.state;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 53) as f64
    }

    /// About normal, standard deviation 1: the sum of twelve uniform numbers.
    fn normal(&mut self) -> f64 {
        (0..12).map(|_| self.uniform()).sum::<f64>() - 6.0
    }

    fn vector(&mut self) -> Vector3<f64> {
        Vector3::from_fn(|_, _| self.normal())
    }

    /// A record of this pose, with noise.
    pub(super) fn around(&mut self, pose: &Isometry3<f64>) -> Isometry3<f64> {
        let shift = self.vector() * self.place_m;
        let turn = UnitQuaternion::from_scaled_axis(self.vector() * self.turn_rad);
        let place = pose.translation.vector + shift;
        Isometry3::from_parts(place.into(), turn * pose.rotation)
    }
}

/// A receiver that turns to and fro about a point of its frame that rests at a place.
pub(super) fn turning_about(
    crease_in_receiver: Point3<f64>,
    place: Point3<f64>,
    count: usize,
    most_rad: f64,
    noise: &mut Noise,
) -> Vec<Isometry3<f64>> {
    (0..count)
        .map(|_| {
            let turn = Vector3::from_fn(|_, _| (2.0 * noise.uniform() - 1.0) * most_rad);
            let rotation = UnitQuaternion::from_scaled_axis(turn);
            let shift = place - rotation * crease_in_receiver;
            noise.around(&Isometry3::from_parts(shift.into(), rotation))
        })
        .collect()
}
