//! The data records of the emulated tracker: any output list of the items that it has.

use nalgebra::Isometry3;
use softgrasp_hand::devices::fastrak::{
    Attitude, Encoding, LengthUnit, OutputList, Station, push_number,
};

/// An item of a record, by its number in the output list.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Item {
    /// Item 0: a blank.
    Space,
    /// Item 1: CR LF.
    LineEnd,
    /// Item 2: position.
    Position,
    /// Item 4: azimuth, elevation, roll.
    Angles,
    /// Item 11: quaternion, scalar first.
    Quaternion,
}

impl Item {
    /// The item with a number, if this emulator has it.
    pub(super) fn with_number(number: f64) -> Option<Self> {
        let known = [Self::Space, Self::LineEnd, Self::Position, Self::Angles, Self::Quaternion];
        known.into_iter().find(|item| f64::from(item.number()) == number)
    }

    pub(super) const fn number(self) -> u8 {
        match self {
            Self::Space => 0,
            Self::LineEnd => 1,
            Self::Position => 2,
            Self::Angles => 4,
            Self::Quaternion => 11,
        }
    }
}

/// Largest magnitude of a number that fits the columns of a record.
const LARGEST: f64 = 999.99;

/// The bytes of one record.
///
/// Frames: `pose` is that of the receiver in the transmitter's frame, m.
pub(super) fn record(
    station: Station,
    error: u8,
    items: &[Item],
    pose: &Isometry3<f64>,
    encoding: Encoding,
    units: LengthUnit,
) -> Vec<u8> {
    let mut bytes = vec![b'0', b'0' + station.number(), error];
    let push = |bytes: &mut Vec<u8>, values: &[f64], decimals| {
        for value in values {
            // A number that is none is 0, so that the record keeps its length.
            let value = if value.is_finite() { value.clamp(-LARGEST, LARGEST) } else { 0.0 };
            push_number(bytes, value, decimals, encoding);
        }
    };
    for item in items {
        match item {
            Item::Space => bytes.push(b' '),
            Item::LineEnd => bytes.extend(b"\r\n"),
            Item::Position => {
                let position = pose.translation.vector / units.metres();
                push(&mut bytes, position.as_slice(), 2);
            }
            Item::Angles => {
                let angles = Attitude::from_rotation(&pose.rotation, OutputList::PositionEuler);
                let (values, count) = angles.numbers();
                push(&mut bytes, &values[..count], 2);
            }
            Item::Quaternion => {
                let attitude =
                    Attitude::from_rotation(&pose.rotation, OutputList::PositionQuaternion);
                push(&mut bytes, &attitude.numbers().0, 4);
            }
        }
    }
    bytes
}

#[cfg(test)]
mod tests {
    use super::*;
    use softgrasp_hand::devices::fastrak::{FastrakRecord, encode_record};

    fn pose() -> Isometry3<f64> {
        let attitude =
            Attitude::EulerDeg { azimuth_deg: 30.0, elevation_deg: 20.0, roll_deg: 10.0 };
        let inches = nalgebra::Vector3::new(10.25, -3.5, 22.0) * 0.0254;
        Isometry3::from_parts(inches.into(), attitude.transmitter_from_receiver())
    }

    #[test]
    fn worked_example_is_written_byte_for_byte() {
        let items = [Item::Position, Item::Angles, Item::LineEnd];
        let ascii =
            record(Station::FIRST, b' ', &items, &pose(), Encoding::Ascii, LengthUnit::Inches);
        assert_eq!(ascii, b"01   10.25  -3.50  22.00  30.00  20.00  10.00\r\n");
        let items = [Item::Position, Item::Quaternion, Item::LineEnd];
        let binary =
            record(Station::FIRST, b' ', &items, &pose(), Encoding::Binary, LengthUnit::Inches);
        let documented = [
            0x30, 0x31, 0x20, 0x00, 0x00, 0x24, 0x41, 0x00, 0x00, 0x60, 0xc0, 0x00, 0x00, 0xb0,
            0x41, 0xaf, 0x98, 0x73, 0x3f, 0x00, 0x33, 0x1c, 0x3d, 0xeb, 0xd9, 0x41, 0x3e, 0xa0,
            0x0a, 0x75, 0x3e, 0x0d, 0x0a,
        ];
        assert_eq!(binary, documented);
        // The list of another well-known driver: 32 bytes.
        let items = [Item::Position, Item::Quaternion, Item::Space];
        let other =
            record(Station::FIRST, b' ', &items, &pose(), Encoding::Binary, LengthUnit::Inches);
        assert_eq!((other.len(), other[31]), (32, b' '));
    }

    #[test]
    fn records_equal_those_of_the_encoder() {
        for encoding in [Encoding::Ascii, Encoding::Binary] {
            for units in [LengthUnit::Inches, LengthUnit::Centimetres] {
                for (output, attitude) in [
                    (OutputList::PositionEuler, Item::Angles),
                    (OutputList::PositionQuaternion, Item::Quaternion),
                ] {
                    let items = [Item::Position, attitude, Item::LineEnd];
                    let written = record(Station::FIRST, b'k', &items, &pose(), encoding, units);
                    let expected = FastrakRecord {
                        station: Station::FIRST,
                        error: Some(b'k'),
                        position: (pose().translation.vector / units.metres()).into(),
                        units,
                        attitude: Attitude::from_rotation(&pose().rotation, output),
                    };
                    assert_eq!(written, encode_record(&expected, encoding).unwrap());
                }
            }
        }
    }

    #[test]
    fn a_place_that_fits_no_column_keeps_the_length() {
        let far = Isometry3::translation(1e9, -1e9, f64::NAN);
        let items = [Item::Position, Item::LineEnd];
        let bytes = record(Station::FIRST, b' ', &items, &far, Encoding::Ascii, LengthUnit::Inches);
        assert_eq!(bytes, b"01  999.99-999.99   0.00\r\n");
    }
}
