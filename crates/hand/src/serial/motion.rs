//! The motion that emulated devices feel.

use nalgebra::{Isometry3, Translation3, Vector3};
use softgrasp_grasp::hand::JointAngles;

use crate::devices::cyberglove::{RawSensors, SensorCount};
use crate::devices::recordings::Trajectory;
use crate::hand_reader::HandReader;
use crate::hand_setup::HandSetup;
use crate::recording::Recording;
use crate::scripted::Rehearsal;

/// What moves the emulated hand; it rests before the beginning and after the end.
#[derive(Clone, Debug)]
pub enum Motion {
    /// A script.
    Script {
        /// Set-up of the hand.
        setup: Box<HandSetup>,
        /// Motion of the script, in time.
        rehearsal: Rehearsal,
    },
    /// A recording of the tracker; the hand stays flat.
    Trajectory {
        /// Set-up of the hand.
        setup: Box<HandSetup>,
        /// Places of the receiver in the stand's frame, at [`Motion::TRAJECTORY_HZ`].
        stand_from_receiver: Vec<Isometry3<f64>>,
    },
    /// What glove and tracker measured in a recorded run.
    Recorded {
        /// Readings of the glove, at times from the first, s.
        raw: Vec<(f64, RawSensors)>,
        /// Places of the receiver in the stand's frame, at times from the first, s.
        stand_from_receiver: Vec<(f64, Isometry3<f64>)>,
    },
}

/// Where a replayed recording is put: its middle is so far before the transmitter, m.
const BEFORE_TRANSMITTER: f64 = 0.5;

impl Motion {
    /// Nominal rate of the recordings, which have no time stamps.
    pub const TRAJECTORY_HZ: f64 = 100.0;

    /// The motion of a script.
    pub fn script(setup: HandSetup, rehearsal: Rehearsal) -> Self {
        Self::Script { setup: Box::new(setup), rehearsal }
    }

    /// The motion of a recording, moved as a whole to before the transmitter: where the recording's
    /// own transmitter stood is not known.
    pub fn trajectory(setup: HandSetup, trajectory: &Trajectory) -> Self {
        let poses = &trajectory.base_from_receiver;
        let sum: Vector3<f64> = poses.iter().map(|pose| pose.translation.vector).sum();
        let middle = sum / poses.len().max(1) as f64;
        let shift = Translation3::from(Vector3::new(0.0, 0.0, -BEFORE_TRANSMITTER) - middle);
        let stand_from_receiver = poses.iter().map(|pose| shift * pose).collect();
        Self::Trajectory { setup: Box::new(setup), stand_from_receiver }
    }

    /// What the devices of a recorded run measured, tick by tick; `None` if one of them was silent.
    pub fn recorded(recording: &Recording, setup: HandSetup) -> Option<Self> {
        let mut reader = HandReader::of_devices(setup, None);
        let (mut raw, mut poses) = (Vec::new(), Vec::new());
        for tick in &recording.ticks {
            let now_s = tick.seen.now_s;
            reader.feed(&tick.arrivals, now_s);
            let sample = reader.sample(now_s);
            raw.extend(sample.glove.map(|reading| (now_s, reading.sensors)));
            // Readings are in the transmitter's Y-up frame until the stand places them.
            poses.extend(sample.tracker.map(|reading| (now_s, reading.world_from_receiver)));
        }
        let begin_s = raw.first()?.0.min(poses.first()?.0);
        raw.iter_mut().for_each(|(at_s, _)| *at_s -= begin_s);
        poses.iter_mut().for_each(|(at_s, _)| *at_s -= begin_s);
        Some(Self::Recorded { raw, stand_from_receiver: poses })
    }

    /// Duration of the motion, s.
    pub fn duration_s(&self) -> f64 {
        match self {
            Self::Script { rehearsal, .. } => rehearsal.duration_s(),
            Self::Trajectory { stand_from_receiver, .. } => {
                stand_from_receiver.len().saturating_sub(1) as f64 / Self::TRAJECTORY_HZ
            }
            Self::Recorded { raw, .. } => raw.last().map_or(0.0, |(at_s, _)| *at_s),
        }
    }

    /// What the glove's sensors measure at a time, s.
    pub fn raw(&self, time_s: f64) -> RawSensors {
        let (setup, angles) = match self {
            Self::Script { setup, rehearsal } => (setup, rehearsal.at(time_s).0),
            Self::Trajectory { setup, .. } => (setup, JointAngles::flat()),
            Self::Recorded { raw, .. } => {
                let silent = || RawSensors::from_fn(SensorCount::TwentyTwo, |_| 1);
                return at(raw, time_s).map_or_else(silent, |raw| *raw);
            }
        };
        setup.calibration.raw_from_angles(&angles, setup.sensors)
    }

    /// Pose of the receiver at a time, s.
    ///
    /// Frame: stand, the transmitter's Y-up frame (`docs/frames.md`), m.
    pub fn stand_from_receiver(&self, time_s: f64) -> Isometry3<f64> {
        match self {
            Self::Script { setup, rehearsal } => {
                let (angles, world_from_palm) = rehearsal.at(time_s);
                let hand = setup.dimensions.handedness;
                let receiver = setup.mount.world_from_receiver(&world_from_palm, &angles, hand);
                setup.world_from_stand.inverse() * receiver
            }
            Self::Trajectory { stand_from_receiver, .. } => {
                let index = (time_s * Self::TRAJECTORY_HZ + 1e-6) as usize;
                let last = stand_from_receiver.len().saturating_sub(1);
                let pose = stand_from_receiver.get(index.min(last)).copied();
                pose.unwrap_or_else(Isometry3::identity)
            }
            Self::Recorded { stand_from_receiver, .. } => {
                at(stand_from_receiver, time_s).copied().unwrap_or_else(Isometry3::identity)
            }
        }
    }
}

/// Newest entry of a list at a time; before the first entry that entry.
fn at<T>(list: &[(f64, T)], time_s: f64) -> Option<&T> {
    let after = list.partition_point(|(at_s, _)| *at_s <= time_s);
    list.get(after.saturating_sub(1)).map(|(_, value)| value)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_recording_is_played_pose_by_pose_before_the_transmitter() {
        let poses = (0..5).map(|i| Isometry3::translation(f64::from(i), 0.0, 7.0)).collect();
        let motion =
            Motion::trajectory(HandSetup::default(), &Trajectory { base_from_receiver: poses });
        assert_eq!(motion.duration_s(), 0.04);
        let x = |time_s| motion.stand_from_receiver(time_s).translation.x;
        assert_eq!([x(-1.0), x(0.0), x(0.01), x(0.02), x(9.0)], [-2.0, -2.0, -1.0, 0.0, 2.0]);
        assert_eq!(motion.stand_from_receiver(0.0).translation.z, -0.5);
        assert_eq!(motion.raw(0.0), motion.raw(3.0));
    }
}
