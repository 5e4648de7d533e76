//! One record of the tracker: position and attitude of one receiver, as sent and in the world.

use nalgebra::{Isometry3, Matrix3, Quaternion, Rotation3, Translation3, UnitQuaternion, Vector3};

/// How records are written on the line (commands `F` and `f`).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Encoding {
    /// Columns of text.
    Ascii,
    /// Little-endian 32-bit floats behind a header of three characters.
    Binary,
}

/// Which items a record holds (command `O`).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum OutputList {
    /// `2,4,1`: position, azimuth–elevation–roll, CR LF.
    PositionEuler,
    /// `2,11,1`: position, quaternion, CR LF.
    PositionQuaternion,
}

impl OutputList {
    /// How many numbers a record holds.
    pub const fn numbers(self) -> usize {
        match self {
            Self::PositionEuler => 6,
            Self::PositionQuaternion => 7,
        }
    }
}

/// Unit of position on the line (commands `U` and `u`).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LengthUnit {
    /// The tracker's default.
    Inches,
    /// Centimetres.
    Centimetres,
}

impl LengthUnit {
    /// Length of one unit in m.
    pub const fn metres(self) -> f64 {
        match self {
            Self::Inches => 0.0254,
            Self::Centimetres => 0.01,
        }
    }

    /// Name of the unit: `inches` or `centimetres`.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Inches => "inches",
            Self::Centimetres => "centimetres",
        }
    }
}

/// Everything a parser must know about how the tracker was set up.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FastrakFormat {
    /// Whether a record is text or binary floats.
    pub encoding: Encoding,
    /// Items that a record holds.
    pub output: OutputList,
    /// Unit of the position in a record.
    pub units: LengthUnit,
}

impl FastrakFormat {
    /// Bytes of a record, CR LF included: 47 or 54 in text, 29 or 33 in binary.
    pub const fn record_length(self) -> usize {
        let width = match self.encoding {
            Encoding::Ascii => 7,
            Encoding::Binary => 4,
        };
        3 + self.output.numbers() * width + 2
    }
}

/// Number of a receiver, 1 to 4.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Station(u8);

/// A station number that no FASTRAK has.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("station {0} is not 1 to 4")]
pub struct StationError(pub u8);

impl Station {
    /// The first receiver.
    pub const FIRST: Self = Self(1);

    /// The station of this number.
    ///
    /// # Errors
    /// [`StationError`] for another number than 1 to 4.
    pub const fn try_new(number: u8) -> Result<Self, StationError> {
        match number {
            1..=4 => Ok(Self(number)),
            _ => Err(StationError(number)),
        }
    }

    /// The station number, 1 to 4.
    pub const fn number(self) -> u8 {
        self.0
    }

    /// Position in an array with one entry per station.
    pub const fn index(self) -> usize {
        self.0 as usize - 1
    }
}

/// Attitude of a receiver, as sent.
///
/// Frame: transmitter from receiver, transmitter X forward, Y right, Z down.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Attitude {
    /// Angles of `Rz(azimuth) Ry(elevation) Rx(roll)`.
    EulerDeg {
        /// About Z, positive clockwise seen from above, degrees.
        azimuth_deg: f64,
        /// About the turned Y, positive raises the nose, degrees.
        elevation_deg: f64,
        /// About the turned X, degrees.
        roll_deg: f64,
    },
    /// Quaternion, scalar first, about unit length.
    Quaternion([f64; 4]),
}

impl Attitude {
    /// The rotation from receiver to transmitter coordinates.
    pub fn transmitter_from_receiver(&self) -> UnitQuaternion<f64> {
        match *self {
            Self::EulerDeg { azimuth_deg, elevation_deg, roll_deg } => {
                UnitQuaternion::from_euler_angles(
                    roll_deg.to_radians(),
                    elevation_deg.to_radians(),
                    azimuth_deg.to_radians(),
                )
            }
            Self::Quaternion([w, x, y, z]) => {
                UnitQuaternion::new_normalize(Quaternion::new(w, x, y, z))
            }
        }
    }

    /// The attitude a record with this output list would carry.
    pub fn from_rotation(rotation: &UnitQuaternion<f64>, output: OutputList) -> Self {
        match output {
            OutputList::PositionEuler => {
                let (roll, elevation, azimuth) = rotation.euler_angles();
                Self::EulerDeg {
                    azimuth_deg: azimuth.to_degrees(),
                    elevation_deg: elevation.to_degrees(),
                    roll_deg: roll.to_degrees(),
                }
            }
            OutputList::PositionQuaternion => {
                let q = rotation.quaternion();
                Self::Quaternion([q.w, q.i, q.j, q.k])
            }
        }
    }

    /// The output list whose records carry this kind of attitude.
    pub const fn output(&self) -> OutputList {
        match self {
            Self::EulerDeg { .. } => OutputList::PositionEuler,
            Self::Quaternion(_) => OutputList::PositionQuaternion,
        }
    }

    /// The attitude's numbers in the order of the record, and how many of the four are used.
    pub fn numbers(&self) -> ([f64; 4], usize) {
        match *self {
            Self::EulerDeg { azimuth_deg, elevation_deg, roll_deg } => {
                ([azimuth_deg, elevation_deg, roll_deg, 0.0], 3)
            }
            Self::Quaternion(q) => (q, 4),
        }
    }
}

/// One sample of one receiver, as sent.
///
/// Source: thesis section 2.1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FastrakRecord {
    /// Station number of the receiver.
    pub station: Station,
    /// Letter of a failed built-in test, for example `x` outside the position envelope.
    pub error: Option<u8>,
    /// Position of the receiver in the transmitter frame, in `units`.
    pub position: [f64; 3],
    /// Unit of `position`.
    pub units: LengthUnit,
    /// Attitude of the receiver.
    pub attitude: Attitude,
}

impl FastrakRecord {
    /// Position in the transmitter frame, in m.
    pub fn position_in_transmitter(&self) -> Vector3<f64> {
        Vector3::from(self.position) * self.units.metres()
    }

    /// The record of the opposite place, which the tracker's field cannot tell from this one.
    #[must_use]
    pub fn mirrored(self) -> Self {
        Self { position: self.position.map(|x| -x), ..self }
    }

    /// Receiver frame in the transmitter frame, in m.
    pub fn transmitter_from_receiver(&self) -> Isometry3<f64> {
        Isometry3::from_parts(
            Translation3::from(self.position_in_transmitter()),
            self.attitude.transmitter_from_receiver(),
        )
    }

    /// Receiver frame in the world, in m.
    ///
    /// Frame: world Y up, −Z forward, origin at the transmitter; the receiver keeps its own axes,
    /// X forward, Y right, Z down (`docs/frames.md`).
    pub fn world_from_receiver(&self) -> Isometry3<f64> {
        world_from_transmitter() * self.transmitter_from_receiver()
    }

    /// The record a tracker would send for a receiver at this place.
    pub fn from_world(
        station: Station,
        world_from_receiver: &Isometry3<f64>,
        output: OutputList,
        units: LengthUnit,
    ) -> Self {
        let pose = world_from_transmitter().inverse() * world_from_receiver;
        Self {
            station,
            error: None,
            position: (pose.translation.vector / units.metres()).into(),
            units,
            attitude: Attitude::from_rotation(&pose.rotation, output),
        }
    }
}

/// The transmitter's axes (X forward, Y right, Z down) in the world (Y up, −Z forward).
pub fn world_from_transmitter() -> UnitQuaternion<f64> {
    let rows = Matrix3::new(0.0, 1.0, 0.0, 0.0, 0.0, -1.0, -1.0, 0.0, 0.0);
    UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(rows))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn euler(azimuth_deg: f64, elevation_deg: f64, roll_deg: f64) -> Attitude {
        Attitude::EulerDeg { azimuth_deg, elevation_deg, roll_deg }
    }

    fn at(position: [f64; 3], attitude: Attitude, units: LengthUnit) -> FastrakRecord {
        let station = Station::try_new(1).unwrap();
        FastrakRecord { station, error: None, position, units, attitude }
    }

    #[test]
    fn worked_example_gives_the_documented_rotation_matrix() {
        let rotation = euler(30.0, 20.0, 10.0).transmitter_from_receiver().to_rotation_matrix();
        let expected = Matrix3::new(
            0.813798, -0.440970, 0.378522, 0.469846, 0.882564, 0.018028, -0.342020, 0.163176,
            0.925417,
        );
        assert!((rotation.matrix() - expected).abs().max() < 5e-7);
        let quaternion = Attitude::Quaternion([0.951549, 0.038135, 0.189308, 0.239298]);
        assert!(quaternion.transmitter_from_receiver().angle_to(&rotation.into()) < 2e-6);
    }

    #[test]
    fn forward_right_and_down_become_minus_z_x_and_minus_y() {
        let inches = |p| at(p, euler(0.0, 0.0, 0.0), LengthUnit::Inches).world_from_receiver();
        let place = |p| inches(p).translation.vector;
        assert!((place([10.0, 0.0, 0.0]) - Vector3::new(0.0, 0.0, -0.254)).norm() < 1e-15);
        assert!((place([0.0, 10.0, 0.0]) - Vector3::new(0.254, 0.0, 0.0)).norm() < 1e-15);
        assert!((place([0.0, 0.0, 10.0]) - Vector3::new(0.0, -0.254, 0.0)).norm() < 1e-15);
        let cm = at([0.0, 0.0, 10.0], euler(0.0, 0.0, 0.0), LengthUnit::Centimetres);
        assert!((cm.world_from_receiver().translation.y + 0.1).abs() < 1e-15);
    }

    #[test]
    fn positive_azimuth_turns_right_and_positive_elevation_raises_the_nose() {
        let nose = |attitude| {
            at([0.0; 3], attitude, LengthUnit::Inches).world_from_receiver() * Vector3::x()
        };
        assert!(nose(euler(10.0, 0.0, 0.0)).x > 0.1);
        assert!(nose(euler(0.0, 10.0, 0.0)).y > 0.1);
    }

    #[test]
    fn record_lengths_are_the_documented_ones() {
        let length = |encoding, output| {
            FastrakFormat { encoding, output, units: LengthUnit::Inches }.record_length()
        };
        assert_eq!(length(Encoding::Ascii, OutputList::PositionEuler), 47);
        assert_eq!(length(Encoding::Ascii, OutputList::PositionQuaternion), 54);
        assert_eq!(length(Encoding::Binary, OutputList::PositionEuler), 29);
        assert_eq!(length(Encoding::Binary, OutputList::PositionQuaternion), 33);
    }

    #[test]
    fn stations_are_one_to_four() {
        for number in 0..=255 {
            assert_eq!(Station::try_new(number).is_ok(), (1..=4).contains(&number));
        }
    }

    proptest! {
        #[test]
        fn a_world_pose_survives_both_output_lists(
            shift in prop::array::uniform3(-1.0..1.0f64),
            turn in prop::array::uniform3(-3.0..3.0f64),
            quaternion in any::<bool>(), inches in any::<bool>(),
        ) {
            let pose = Isometry3::new(shift.into(), turn.into());
            let output =
                if quaternion { OutputList::PositionQuaternion } else { OutputList::PositionEuler };
            let units = if inches { LengthUnit::Inches } else { LengthUnit::Centimetres };
            let station = Station::try_new(2).unwrap();
            let record = FastrakRecord::from_world(station, &pose, output, units);
            let back = record.world_from_receiver();
            prop_assert!((back.translation.vector - pose.translation.vector).norm() < 1e-12);
            // Near elevation ±90° the angles lose half of the digits.
            prop_assert!(back.rotation.angle_to(&pose.rotation) < 1e-6);
        }
    }

    #[test]
    fn looking_straight_up_survives_the_euler_angles() {
        for elevation in [90.0f64, -90.0] {
            let rotation = euler(25.0, elevation, 0.0).transmitter_from_receiver();
            let back = Attitude::from_rotation(&rotation, OutputList::PositionEuler);
            assert!(back.transmitter_from_receiver().angle_to(&rotation) < 1e-6);
        }
    }
}
