//! Turns the bytes of glove and tracker into the pose of the hand.

use nalgebra::{Isometry3, Translation3};
use softgrasp_core::hand::{HandDimensions, HandPose, JointAngles, pose};

use crate::devices::calibration::Calibration;
use crate::devices::cyberglove::{
    self, GloveEvent, GloveParser, GloveRecord, RecordKind, RecordOptions, SensorCount,
    SensorHealth, SensorSet,
};
use crate::devices::fastrak::{
    self, Encoding, FastrakEvent, FastrakFormat, FastrakParser, FastrakRecord, LengthUnit,
    OutputList, Station,
};
use crate::devices::{ReceiverMount, SampleHold};

/// Everything that says how a hand, its glove and its tracker are set up.
#[derive(Clone, Debug)]
pub struct HandSetup {
    /// Sizes of the hand.
    pub dimensions: HandDimensions,
    /// From raw sensor values to angles.
    pub calibration: Calibration,
    /// How many sensors the glove has.
    pub sensors: SensorCount,
    /// Format of the tracker's records.
    pub tracker: FastrakFormat,
    /// Where the receiver sits on the arm.
    pub mount: ReceiverMount,
    /// Where the transmitter stands: its Y-up frame (`docs/frames.md`) in the scene's world, m.
    pub world_from_stand: Isometry3<f64>,
}

impl Default for HandSetup {
    /// The scripted set-up: 22 sensors, binary quaternion records in centimetres, transmitter 60 cm
    /// behind the object so that the hand never crosses the tracker's hemisphere.
    fn default() -> Self {
        Self {
            dimensions: HandDimensions::default(),
            calibration: Calibration::default(),
            sensors: SensorCount::TwentyTwo,
            tracker: FastrakFormat {
                encoding: Encoding::Binary,
                output: OutputList::PositionQuaternion,
                units: LengthUnit::Centimetres,
            },
            mount: ReceiverMount::default(),
            world_from_stand: Translation3::new(0.0, 0.0, 0.6).into(),
        }
    }
}

impl HandSetup {
    /// The angles that the client reads when the glove's sensors measure these.
    pub fn felt(&self, angles: &JointAngles) -> JointAngles {
        let raw = self.calibration.raw_from_angles(angles, self.sensors);
        self.calibration.angles(&raw, SensorSet::EMPTY)
    }

    /// The bytes that glove and tracker send for a hand in this pose.
    pub fn bytes_of(
        &self,
        angles: &JointAngles,
        world_from_palm: &Isometry3<f64>,
    ) -> (Vec<u8>, Vec<u8>) {
        let glove = cyberglove::encode_record(&GloveRecord {
            kind: RecordKind::Polled,
            sensors: self.calibration.raw_from_angles(angles, self.sensors),
            timestamp: None,
            status: None,
        });
        let hand = self.dimensions.handedness;
        let world_from_receiver = self.mount.world_from_receiver(world_from_palm, angles, hand);
        let stand_from_receiver = self.world_from_stand.inverse() * world_from_receiver;
        let FastrakFormat { encoding, output, units } = self.tracker;
        let record = FastrakRecord::from_world(Station::FIRST, &stand_from_receiver, output, units);
        // A pose too far for the record's columns is a record that does not come.
        let tracker = fastrak::encode_record(&record, encoding).unwrap_or_default();
        (glove, tracker)
    }
}

/// Reads a hand from its devices' bytes.
pub struct HandReader {
    setup: HandSetup,
    glove: GloveParser,
    tracker: FastrakParser,
    hold: SampleHold,
    health: SensorHealth,
    faults: DeviceFaults,
}

/// How often the devices' bytes were not good records.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct DeviceFaults {
    /// Faults of the glove's line.
    pub glove: u64,
    /// Faults of the tracker's line.
    pub tracker: u64,
    /// Jumps of the tracker to the opposite side of its field.
    pub hemisphere_flips: u64,
}

impl HandReader {
    /// A reader that has heard nothing yet.
    pub fn new(setup: HandSetup) -> Self {
        let glove =
            GloveParser::new(setup.sensors, RecordOptions { timestamp: false, status: false });
        let tracker = FastrakParser::new(setup.tracker);
        Self {
            setup,
            glove,
            tracker,
            hold: SampleHold::default(),
            health: SensorHealth::default(),
            faults: DeviceFaults::default(),
        }
    }

    /// The set-up.
    pub fn setup(&self) -> &HandSetup {
        &self.setup
    }

    /// Faults so far.
    pub fn faults(&self) -> DeviceFaults {
        self.faults
    }

    /// Takes bytes of both devices that arrived at a time on the client's clock.
    pub fn feed(&mut self, glove: &[u8], tracker: &[u8], time_s: f64) {
        let Self { glove: glove_parser, tracker: tracker_parser, hold, health, faults, .. } = self;
        glove_parser.feed_all(glove, |event| match event {
            GloveEvent::Record(record) => {
                health.observe(&record.sensors);
                hold.on_glove(&record, time_s);
            }
            GloveEvent::Fault(fault) => {
                tracing::debug!(?fault, "glove");
                faults.glove += 1;
            }
        });
        tracker_parser.feed_all(tracker, |event| match event {
            FastrakEvent::Record(record) => hold.on_tracker(&record, time_s),
            FastrakEvent::HemisphereFlip(flip) => {
                tracing::warn!(?flip, "the tracker jumped to the opposite side of its field");
                faults.hemisphere_flips += 1;
            }
            FastrakEvent::Reply(text) => tracing::debug!(text, "tracker"),
            FastrakEvent::Fault(fault) => {
                tracing::debug!(?fault, "tracker");
                faults.tracker += 1;
            }
        });
    }

    /// Pose of the hand by the newest samples; `None` until both devices have spoken.
    pub fn hand(&self, now_s: f64) -> Option<HandPose> {
        let sample = self.hold.sample(now_s);
        let angles = self.setup.calibration.angles(&sample.glove?.sensors, self.health.dead());
        let world_from_receiver = self.setup.world_from_stand * sample.tracker?.world_from_receiver;
        let hand = self.setup.dimensions.handedness;
        let world_from_palm = self.setup.mount.world_from_palm(&world_from_receiver, &angles, hand);
        Some(pose(&self.setup.dimensions, &angles, world_from_palm))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Vector3;

    #[test]
    fn scripted_pose_comes_back_through_the_device_bytes() {
        let setup = HandSetup::default();
        let mut reader = HandReader::new(setup.clone());
        let palm = Isometry3::new(Vector3::new(0.1, 0.05, -0.2), Vector3::new(0.4, -0.3, 1.2));
        let mut angles = JointAngles::flat();
        angles.index.mcp_flexion = 0.7;
        let (glove, tracker) = setup.bytes_of(&angles, &palm);
        assert!(reader.hand(0.0).is_none());
        reader.feed(&glove, &tracker, 0.0);
        let hand = reader.hand(0.0).unwrap();
        let expected = pose(&setup.dimensions, &angles, palm);
        for (got, sent) in hand.fingers.iter().zip(&expected.fingers) {
            // One sensor count is about a degree, 1.5 mm at a fingertip.
            assert!((got.tip() - sent.tip()).norm() < 4e-3);
        }
        assert!((hand.world_from_palm.translation.vector - palm.translation.vector).norm() < 1e-3);
        assert_eq!(reader.faults(), DeviceFaults::default());
    }
}
