//! Even motion between samples: a hand that is sampled less often than ticks come does not leap.

use nalgebra::Isometry3;
use softgrasp_grasp::hand::JointAngles;

use crate::sent::Device;

/// Joint angles of a hand and its palm in the world.
pub type MeasuredHand = (JointAngles, Isometry3<f64>);

/// Spreads the way to each new sample over the ticks until the next one is expected.
///
/// A sample that comes every tick is taken as it is, to the bit. One that comes every n ticks is reached in n
/// equal steps, the first in the tick that takes it: the hand is (n − 1)/2 ticks later than its samples in the
/// mean. Without it the hand would go the whole way in one tick and rest in n − 1: an object that it holds by
/// friction would have to start and stop at n times its speed, and slips.
///
/// Units: s on the client's clock. Frame: world.
pub struct EvenMotion {
    /// Time from tick to tick, s.
    tick_s: f64,
    /// Where the hand was when the newest sample came.
    from: MeasuredHand,
    /// The newest sample.
    to: MeasuredHand,
    /// When the newest sample came, s.
    begun_s: f64,
    /// Time in which the newest sample is reached, s.
    lasts_s: f64,
    /// Times from sample to sample of each device.
    intervals: [Intervals; 3],
}

/// The last times from sample to sample of a device.
#[derive(Clone, Copy, Debug, Default)]
struct Intervals {
    /// When the newest sample came, s; `None` before the first.
    newest_s: Option<f64>,
    /// The last three times between samples, s.
    last_s: [f64; 3],
}

/// A device that is silent for longer begins anew: its next sample is reached at once, s.
const INTERVAL_MAX_S: f64 = 1.0;
/// A share of the way that differs from the whole way by rounding is the whole way.
const SHARE_EPS: f64 = 1e-6;

impl Intervals {
    /// Takes the time of a sample, s.
    fn add(&mut self, time_s: f64) {
        let Some(before_s) = self.newest_s.replace(time_s) else { return };
        let interval_s = time_s - before_s;
        self.last_s = match interval_s <= INTERVAL_MAX_S {
            true => [self.last_s[1], self.last_s[2], interval_s.max(0.0)],
            false => [0.0; 3],
        };
    }

    /// Time until the next sample is expected, s: the longest of the last three. Of samples that come at odd
    /// times a mean would be reached too early, and the hand would leap to the late ones.
    fn expected_s(&self) -> f64 {
        self.last_s.iter().copied().fold(0.0, f64::max)
    }
}

impl EvenMotion {
    /// Motion of a hand whose first sample is this one, in ticks of this length, s.
    pub fn begin(tick_s: f64, device: Device, first: MeasuredHand, time_s: f64) -> Self {
        let mut intervals = [Intervals::default(); 3];
        intervals[place(device)].add(time_s);
        Self { tick_s, from: first, to: first, begun_s: time_s, lasts_s: 0.0, intervals }
    }

    /// Takes a newer sample of a device, which came at a time, s.
    pub fn meet(&mut self, device: Device, newest: MeasuredHand, time_s: f64) {
        self.from = self.reached(time_s);
        self.to = newest;
        self.begun_s = time_s;
        self.intervals[place(device)].add(time_s);
        let expected = self.intervals.iter().map(Intervals::expected_s);
        self.lasts_s = expected.fold(0.0, f64::max);
    }

    /// The hand in a tick at a time, s.
    pub fn at(&self, now_s: f64) -> MeasuredHand {
        self.reached(now_s + self.tick_s)
    }

    /// Whether the hand in a tick at a time, s, is the newest sample.
    pub fn has_arrived(&self, now_s: f64) -> bool {
        self.share(now_s + self.tick_s) >= 1.0
    }

    /// Share of the way to the newest sample that is gone at a time, s.
    fn share(&self, time_s: f64) -> f64 {
        let gone_s = (time_s - self.begun_s).max(0.0);
        let share = gone_s / self.lasts_s;
        // A way that takes no time is no number at its beginning.
        if share < 1.0 - SHARE_EPS { share } else { 1.0 }
    }

    fn reached(&self, time_s: f64) -> MeasuredHand {
        let share = self.share(time_s);
        if share >= 1.0 {
            return self.to;
        }
        let ((angles, palm), (to_angles, to_palm)) = (self.from, self.to);
        // Half a turn has no shorter way.
        let between = palm.try_lerp_slerp(&to_palm, share, 1e-9).unwrap_or(to_palm);
        (angles.lerp(&to_angles, share), between)
    }
}

/// Position of a device among all three.
const fn place(device: Device) -> usize {
    match device {
        Device::Glove => 0,
        Device::Tracker => 1,
        Device::Joints => 2,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{UnitQuaternion, Vector3};

    const TICK_S: f64 = 1.0 / 60.0;

    fn hand(x: f64) -> MeasuredHand {
        let turn = UnitQuaternion::from_scaled_axis(Vector3::y() * x);
        let angles = JointAngles::flat().lerp(&JointAngles::fist(), x);
        (angles, Isometry3::from_parts(Vector3::new(x, 0.0, 0.0).into(), turn))
    }

    /// Place along X in each tick of a hand that moves by 1 m/s and is sampled every `every` ticks.
    fn ticks(every: usize) -> Vec<f64> {
        let time_s = |tick: usize| tick as f64 * TICK_S;
        let mut motion = EvenMotion::begin(TICK_S, Device::Joints, hand(0.0), 0.0);
        let played = (0..60).map(|tick| {
            if tick > 0 && tick % every == 0 {
                motion.meet(Device::Joints, hand(time_s(tick)), time_s(tick));
            }
            motion.at(time_s(tick)).1.translation.x
        });
        played.collect()
    }

    #[test]
    fn samples_of_every_tick_are_taken_to_the_bit() {
        for (tick, x) in ticks(1).into_iter().enumerate() {
            assert_eq!(x, hand(tick as f64 * TICK_S).1.translation.x, "tick {tick}");
        }
    }

    #[test]
    fn hand_that_is_sampled_every_twelfth_tick_goes_the_same_way_in_each() {
        for every in [2, 3, 5, 12] {
            let x = ticks(every);
            // The first interval is not known yet.
            for tick in 2 * every..x.len() - 1 {
                let step = x[tick + 1] - x[tick];
                assert!((step - TICK_S).abs() < 1e-9, "every {every}: tick {tick} goes {step}");
            }
            let last = x.len() - 1;
            let lag = last as f64 * TICK_S - x[last];
            assert!(lag < every as f64 * TICK_S, "every {every}: {lag} s behind");
        }
    }

    #[test]
    fn samples_that_come_at_odd_times_make_no_tick_longer_than_twice_the_mean() {
        let mut motion = EvenMotion::begin(TICK_S, Device::Joints, hand(0.0), 0.0);
        // Thirty samples a second, up to 12 ms early or late, seen by ticks that come between them.
        let arrives = |i: usize| i as f64 / 30.0 + 0.012 * (2.4 * i as f64).sin();
        let (mut next, mut before) = (1, 0.0);
        for tick in 0..300 {
            let now_s = tick as f64 * TICK_S + 0.004;
            while arrives(next) <= now_s {
                motion.meet(Device::Joints, hand(arrives(next)), arrives(next));
                next += 1;
            }
            let x = motion.at(now_s).1.translation.x;
            if tick > 20 {
                assert!((0.0..2.0 * TICK_S).contains(&(x - before)), "tick {tick}: {}", x - before);
            }
            before = x;
        }
    }

    #[test]
    fn hand_that_was_lost_is_where_it_is_found() {
        let mut motion = EvenMotion::begin(TICK_S, Device::Joints, hand(0.0), 0.0);
        for i in 1..5 {
            motion.meet(Device::Joints, hand(0.1), 0.1 * f64::from(i));
        }
        motion.meet(Device::Joints, hand(0.5), 2.0);
        assert_eq!(motion.at(2.0), hand(0.5));
        assert!(motion.has_arrived(2.0));
    }

    #[test]
    fn way_is_the_shorter_one_whatever_the_sign_of_the_quaternion() {
        let (angles, palm) = hand(0.2);
        let flipped = UnitQuaternion::new_unchecked(-palm.rotation.into_inner());
        let flipped = (angles, Isometry3::from_parts(palm.translation, flipped));
        let mut motion = EvenMotion::begin(TICK_S, Device::Joints, hand(0.0), 0.0);
        motion.meet(Device::Joints, hand(0.0), 0.1);
        motion.meet(Device::Joints, flipped, 0.2);
        assert!(!motion.has_arrived(0.2));
        let (_, half) = motion.at(0.25 - TICK_S);
        let off = half.rotation.angle_to(&hand(0.1).1.rotation);
        assert!(off < 1e-4, "{off} rad off");
    }
}
