//! Noise of a glove and a tracker, added to the bytes that they send.

use nalgebra::{Quaternion, UnitQuaternion, Vector3};
use softgrasp_hand::sent::{Arrival, Device};

use softgrasp_bench::random::Random;

/// Standard deviation of the tracker's position along each axis, cm (0.8 mm).
const POSITION_CM: f64 = 0.08;
/// Standard deviation of the tracker's attitude about each axis, rad (0.15°).
const ATTITUDE_RAD: f64 = 0.15 * std::f64::consts::PI / 180.0;

/// Source of noise that is the same in every run.
pub struct Noise(Random);

impl Noise {
    /// Source of noise with a seed.
    pub fn new(seed: u64) -> Self {
        Self(Random(seed.wrapping_mul(0x2545_F491_4F6C_DD1D)))
    }

    /// Normal random number of standard deviation 1 (Box and Muller 1958).
    fn normal(&mut self) -> f64 {
        let (radius, angle) = (self.0.share().max(1e-300), self.0.share());
        (-2.0 * radius.ln()).sqrt() * (std::f64::consts::TAU * angle).cos()
    }

    fn normals(&mut self) -> Vector3<f64> {
        Vector3::new(self.normal(), self.normal(), self.normal())
    }

    /// Adds noise to device bytes: each sensor of the glove is one count off either way in two thirds of
    /// the readings, the tracker is off in position and orientation.
    ///
    /// The bytes are those of the scripted set-up: records of 22 sensors, binary quaternions, cm.
    pub fn on(&mut self, arrivals: &[Arrival]) -> Vec<Arrival> {
        let mut noisy = arrivals.to_vec();
        for arrival in &mut noisy {
            match (arrival.device, arrival.bytes.len()) {
                (Device::Glove, 24) => self.on_glove(&mut arrival.bytes[1..23]),
                (Device::Tracker, 33) => self.on_tracker(&mut arrival.bytes[3..31]),
                _ => {}
            }
        }
        noisy
    }

    fn on_glove(&mut self, sensors: &mut [u8]) {
        for sensor in sensors {
            let off = self.0.below(3) as i16 - 1;
            *sensor = (i16::from(*sensor) + off).clamp(1, 255) as u8;
        }
    }

    fn on_tracker(&mut self, numbers: &mut [u8]) {
        let mut read: Vec<f64> = numbers
            .as_chunks::<4>()
            .0
            .iter()
            .map(|bytes| f64::from(f32::from_le_bytes(*bytes)))
            .collect();
        let Some((place, &mut [w, x, y, z])) = read
            .split_first_chunk_mut::<3>()
            .and_then(|(place, attitude)| Some((place, <&mut [f64; 4]>::try_from(attitude).ok()?)))
        else {
            return;
        };
        let off = self.normals() * POSITION_CM;
        place.iter_mut().zip(off.iter()).for_each(|(x, off)| *x += off);
        let turn = UnitQuaternion::from_scaled_axis(self.normals() * ATTITUDE_RAD);
        let attitude = UnitQuaternion::new_normalize(Quaternion::new(w, x, y, z)) * turn;
        let all = [place[0], place[1], place[2], attitude.w, attitude.i, attitude.j, attitude.k];
        for (bytes, number) in numbers.as_chunks_mut::<4>().0.iter_mut().zip(all) {
            *bytes = (number as f32).to_le_bytes();
        }
    }
}
