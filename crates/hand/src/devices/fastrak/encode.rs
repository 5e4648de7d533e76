//! Bytes of a record, for the scripted hand and for emulators.

use super::record::{Encoding, FastrakRecord, OutputList};

/// Why a record cannot be written.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum EncodeError {
    /// A number is not finite or has more digits than its column.
    #[error("number {index} of the record is {value}, which no record can hold")]
    OutOfRange {
        /// Position among the numbers of the record, from 0.
        index: usize,
        /// Value of that number.
        value: f64,
    },
    /// The error byte is not a letter.
    #[error("error byte {0:#04x} is not a letter")]
    ErrorByte(u8),
}

/// Largest magnitude of a number in a record (`Sxxx.xx`).
pub(super) const NUMBER_LIMIT: f64 = 1000.0;

/// The bytes of one record, CR LF included.
///
/// The output list follows from the attitude: `2,4,1` for angles, `2,11,1` for a quaternion.
///
/// # Errors
/// [`EncodeError`] for a number or an error byte that no tracker could send.
pub fn encode_record(record: &FastrakRecord, encoding: Encoding) -> Result<Vec<u8>, EncodeError> {
    let error = record.error.unwrap_or(b' ');
    if record.error.is_some_and(|letter| !letter.is_ascii_alphabetic()) {
        return Err(EncodeError::ErrorByte(error));
    }
    let mut bytes = vec![b'0', b'0' + record.station.number(), error];
    let (attitude, attitude_count) = record.attitude.numbers();
    let quaternion = record.attitude.output() == OutputList::PositionQuaternion;
    let numbers = record.position.iter().chain(&attitude[..attitude_count]);
    for (index, &value) in numbers.enumerate() {
        let decimals = if quaternion && index >= 3 { 4 } else { 2 };
        if !push_number(&mut bytes, value, decimals, encoding) {
            return Err(EncodeError::OutOfRange { index, value });
        }
    }
    bytes.extend_from_slice(b"\r\n");
    Ok(bytes)
}

/// Writes one number of a record; `false`, and nothing written, if it fits no column.
pub fn push_number(bytes: &mut Vec<u8>, value: f64, decimals: usize, encoding: Encoding) -> bool {
    let text = format!("{value:7.decimals$}");
    if !value.is_finite() || value.abs() >= NUMBER_LIMIT || text.len() > 7 {
        return false;
    }
    match encoding {
        Encoding::Ascii => bytes.extend_from_slice(text.as_bytes()),
        Encoding::Binary => bytes.extend_from_slice(&(value as f32).to_le_bytes()),
    }
    true
}

#[cfg(test)]
mod tests {
    use super::super::record::{Attitude, LengthUnit, Station};
    use super::*;

    fn example(attitude: Attitude) -> FastrakRecord {
        FastrakRecord {
            station: Station::try_new(1).unwrap(),
            error: None,
            position: [10.25, -3.5, 22.0],
            units: LengthUnit::Inches,
            attitude,
        }
    }

    fn angles() -> Attitude {
        Attitude::EulerDeg { azimuth_deg: 30.0, elevation_deg: 20.0, roll_deg: 10.0 }
    }

    #[test]
    fn worked_example_is_written_byte_for_byte() {
        let ascii = encode_record(&example(angles()), Encoding::Ascii).unwrap();
        assert_eq!(ascii, b"01   10.25  -3.50  22.00  30.00  20.00  10.00\r\n");
        let binary = encode_record(&example(angles()), Encoding::Binary).unwrap();
        let expected = [
            0x30, 0x31, 0x20, 0x00, 0x00, 0x24, 0x41, 0x00, 0x00, 0x60, 0xc0, 0x00, 0x00, 0xb0,
            0x41, 0x00, 0x00, 0xf0, 0x41, 0x00, 0x00, 0xa0, 0x41, 0x00, 0x00, 0x20, 0x41, 0x0d,
            0x0a,
        ];
        assert_eq!(binary, expected);
    }

    #[test]
    fn worked_example_with_a_quaternion_is_written_byte_for_byte() {
        let rotation = angles().transmitter_from_receiver();
        let attitude = Attitude::from_rotation(&rotation, OutputList::PositionQuaternion);
        let binary = encode_record(&example(attitude), Encoding::Binary).unwrap();
        let expected = [
            0x30, 0x31, 0x20, 0x00, 0x00, 0x24, 0x41, 0x00, 0x00, 0x60, 0xc0, 0x00, 0x00, 0xb0,
            0x41, 0xaf, 0x98, 0x73, 0x3f, 0x00, 0x33, 0x1c, 0x3d, 0xeb, 0xd9, 0x41, 0x3e, 0xa0,
            0x0a, 0x75, 0x3e, 0x0d, 0x0a,
        ];
        assert_eq!(binary, expected);
        let ascii = encode_record(&example(attitude), Encoding::Ascii).unwrap();
        assert_eq!(ascii, b"01   10.25  -3.50  22.00 0.9515 0.0381 0.1893 0.2393\r\n");
    }

    #[test]
    fn numbers_that_fit_no_column_are_refused() {
        for value in [1000.0, -999.999, f64::NAN, f64::NEG_INFINITY] {
            let mut record = example(angles());
            record.position[1] = value;
            let error = encode_record(&record, Encoding::Ascii).unwrap_err();
            assert!(matches!(error, EncodeError::OutOfRange { index: 1, .. }));
        }
        let record = FastrakRecord { error: Some(0xff), ..example(angles()) };
        assert_eq!(encode_record(&record, Encoding::Binary), Err(EncodeError::ErrorByte(0xff)));
    }
}
