//! How a hand, its glove and its tracker are set up, and what the devices then send.

use nalgebra::{Isometry3, Translation3};
use softgrasp_grasp::hand::{HandDimensions, JointAngles};

use crate::devices::ReceiverMount;
use crate::devices::calibration::Calibration;
use crate::devices::cyberglove::{
    self, GloveRecord, RecordKind, RecordOptions, SensorCount, SensorSet,
};
use crate::devices::fastrak::{
    self, Encoding, FastrakFormat, FastrakRecord, LengthUnit, OutputList, Station,
};
use crate::sent::{Arrival, Device};

/// Everything that says how a hand, its glove and its tracker are set up.
#[derive(Clone, Debug)]
pub struct HandSetup {
    /// Bone lengths, widths and side of the hand.
    pub dimensions: HandDimensions,
    /// Calibration: from raw sensor values to joint angles.
    pub calibration: Calibration,
    /// Number of sensors of the glove.
    pub sensors: SensorCount,
    /// What the glove's records hold besides the sensor values.
    pub glove_options: RecordOptions,
    /// Format of the tracker's records.
    pub tracker: FastrakFormat,
    /// Mount of the tracker's receiver: its place on the arm.
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
            glove_options: RecordOptions::default(),
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

    /// What glove and tracker send for a hand in this pose.
    pub fn arrivals_of(
        &self,
        angles: &JointAngles,
        world_from_palm: &Isometry3<f64>,
    ) -> Vec<Arrival> {
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
        vec![Arrival::with_tick(Device::Glove, glove), Arrival::with_tick(Device::Tracker, tracker)]
    }
}
