//! Keeps out poses of the tracker that no hand can have come to in the time.

use nalgebra::Isometry3;

/// Compares each pose with the one before. One that is too far away waits for the next: two that
/// agree are a hand that really is there, a single one is a damaged record. The serial protocol has no
/// check sum, so a flipped bit looks like any number.
#[derive(Clone, Debug, Default)]
pub struct PoseGate {
    last: Option<Seen>,
    waiting: Option<Seen>,
    refused: u64,
}

#[derive(Clone, Copy, Debug)]
struct Seen {
    pose: Isometry3<f64>,
    time_s: f64,
}

/// Fastest motion of a hand, m/s, and a length that the receiver's noise does not exceed, m.
const SPEED_MAX: f64 = 5.0;
const STEP_M: f64 = 0.02;
/// Fastest turn of a hand, rad/s, and an angle that the receiver's noise does not exceed, rad.
const TURN_RATE_MAX: f64 = 20.0;
const TURN_RAD: f64 = 0.3;
/// Shortest time that is assumed between two records, s: several may be read at once.
const RECORD_S: f64 = 1.0 / 120.0;

impl PoseGate {
    /// The pose, if a hand can have come there. The very first one waits for the second.
    ///
    /// Units: m, s.
    pub fn take(&mut self, pose: Isometry3<f64>, time_s: f64) -> Option<Isometry3<f64>> {
        let seen = Seen { pose, time_s };
        let waited = self.waiting.take();
        let agrees = |other: Option<Seen>| other.is_some_and(|other| seen.follows(&other));
        if agrees(self.last) || agrees(waited) {
            self.last = Some(seen);
            return Some(pose);
        }
        self.refused += u64::from(self.last.is_some());
        self.waiting = Some(seen);
        None
    }

    /// Number of poses that were not taken.
    pub fn refused(&self) -> u64 {
        self.refused
    }
}

impl Seen {
    /// Whether a hand can have come to this pose from the earlier one in the time between them.
    fn follows(&self, before: &Self) -> bool {
        let elapsed_s = (self.time_s - before.time_s).max(RECORD_S);
        let moved = before.pose.inverse() * self.pose;
        // Written so that numbers that are none do not follow.
        moved.translation.vector.norm() <= STEP_M + SPEED_MAX * elapsed_s
            && moved.rotation.angle() <= TURN_RAD + TURN_RATE_MAX * elapsed_s
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector3;

    use super::*;

    /// A hand that swings by 20 cm, with 2 m/s at most.
    fn swinging(record: u32) -> (Isometry3<f64>, f64) {
        let t = f64::from(record) / 120.0;
        let at = Vector3::new(0.3 + 0.1 * (10.0 * t).sin(), 0.2, -0.4);
        (Isometry3::new(at, Vector3::new(0.0, (3.0 * t).sin(), 0.0)), t)
    }

    #[test]
    fn hand_that_moves_is_followed_and_single_wild_poses_are_left_out() {
        let mut gate = PoseGate::default();
        let mut wild = 0;
        for record in 0..1200 {
            let (pose, time_s) = swinging(record);
            if record % 7 == 3 {
                // What a flipped bit of an exponent or a sign makes of it.
                let mut at = pose.translation.vector;
                at[record as usize % 3] *= if record % 2 == 0 { -2.0 } else { 256.0 };
                let damaged = Isometry3::from_parts(at.into(), pose.rotation);
                assert_eq!(gate.take(damaged, time_s), None, "record {record}");
                wild += 1;
            } else {
                let taken = gate.take(pose, time_s).is_some();
                assert!(taken || record == 0, "record {record}");
            }
        }
        assert_eq!(gate.refused(), wild);
    }

    #[test]
    fn hand_that_is_elsewhere_after_a_gap_is_taken_there() {
        let mut gate = PoseGate::default();
        for record in 0..10 {
            let (pose, time_s) = swinging(record);
            gate.take(pose, time_s);
        }
        let there = Isometry3::translation(1.0, 1.0, 1.0);
        assert_eq!(gate.take(there, 0.09), None);
        assert_eq!(gate.take(there, 0.1), Some(there), "two agree");
        assert!(gate.take(Isometry3::identity(), 5.0).is_some(), "there was time enough");
        assert_eq!(gate.take(Isometry3::translation(f64::NAN, 0.0, 0.0), 5.1), None);
    }
}
