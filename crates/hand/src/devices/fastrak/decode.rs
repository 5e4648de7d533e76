//! Recognises records and replies at the head of the tracker's byte stream.

use super::encode::NUMBER_LIMIT;
use super::fault::FastrakFaultKind;
use super::record::{Attitude, Encoding, FastrakFormat, FastrakRecord, OutputList, Station};

/// What the first bytes of the stream are.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Head {
    /// More bytes are needed before the head can be told.
    NeedMore,
    /// A data record of the format's length.
    Record(FastrakRecord),
    /// A status, read-back or error record of this many bytes.
    Reply(usize),
    /// The first byte begins neither a record nor a reply.
    Skip(FastrakFaultKind),
}

/// Longest status, read-back or error record; the longest known has 55 bytes.
pub(super) const REPLY_LIMIT: usize = 128;

/// Looks at the head of `bytes`; the answer depends on the bytes alone, not on how they came.
pub(super) fn head(bytes: &[u8], format: FastrakFormat) -> Head {
    match bytes.first() {
        None => Head::NeedMore,
        Some(b'0') => data_record(bytes, format),
        Some(b'2') => reply(bytes),
        Some(&byte) => Head::Skip(FastrakFaultKind::UnexpectedByte { byte }),
    }
}

fn data_record(bytes: &[u8], format: FastrakFormat) -> Head {
    let Some(&station_byte) = bytes.get(1) else { return Head::NeedMore };
    let Ok(station) = Station::try_new(station_byte.wrapping_sub(b'0')) else {
        return Head::Skip(FastrakFaultKind::BadStation { byte: station_byte });
    };
    let Some(&error_byte) = bytes.get(2) else { return Head::NeedMore };
    let error = match error_byte {
        b' ' => None,
        letter if letter.is_ascii_alphabetic() => Some(letter),
        byte => return Head::Skip(FastrakFaultKind::BadErrorByte { byte }),
    };
    let Some(record) = bytes.get(..format.record_length()) else { return Head::NeedMore };
    let (body, end) = record.split_at(record.len() - 2);
    if end != b"\r\n" {
        return Head::Skip(FastrakFaultKind::BadTerminator);
    }
    match numbers(&body[3..], format) {
        Ok(values) => Head::Record(FastrakRecord {
            station,
            error,
            position: [values[0], values[1], values[2]],
            units: format.units,
            attitude: match format.output {
                OutputList::PositionEuler => Attitude::EulerDeg {
                    azimuth_deg: values[3],
                    elevation_deg: values[4],
                    roll_deg: values[5],
                },
                OutputList::PositionQuaternion => {
                    Attitude::Quaternion([values[3], values[4], values[5], values[6]])
                }
            },
        }),
        Err(index) => Head::Skip(FastrakFaultKind::BadNumber { index }),
    }
}

/// The numbers of a record body, or the index of the first that no tracker sends.
fn numbers(body: &[u8], format: FastrakFormat) -> Result<[f64; 7], usize> {
    let mut values = [0.0; 7];
    let count = format.output.numbers();
    for (index, field) in body.chunks_exact(body.len() / count).enumerate() {
        let value = match format.encoding {
            Encoding::Ascii => ascii_number(field),
            Encoding::Binary => field.try_into().ok().map(|b| f64::from(f32::from_le_bytes(b))),
        };
        let limit = match (index, format.output) {
            (0..3, _) => NUMBER_LIMIT,
            (_, OutputList::PositionEuler) => 361.0,
            (_, OutputList::PositionQuaternion) => 1.1,
        };
        // `get_mut` keeps the loop inside the array for any future output list.
        match (values.get_mut(index), value.filter(|v| v.abs() < limit)) {
            (Some(slot), Some(value)) => *slot = value,
            _ => return Err(index),
        }
    }
    if format.output == OutputList::PositionQuaternion {
        let norm = values[3..].iter().map(|q| q * q).sum::<f64>().sqrt();
        if !(0.9..1.1).contains(&norm) {
            return Err(3);
        }
    }
    Ok(values)
}

/// A column: blanks, an optional sign, digits with at most one point, nothing else.
fn ascii_number(field: &[u8]) -> Option<f64> {
    let text = field.trim_ascii_start();
    let digits = text.strip_prefix(b"-").or_else(|| text.strip_prefix(b"+")).unwrap_or(text);
    let plain = digits.iter().all(|b| b.is_ascii_digit() || *b == b'.');
    if !plain || !digits.iter().any(u8::is_ascii_digit) {
        return None;
    }
    std::str::from_utf8(text).ok()?.parse().ok()
}

/// `2`, a station digit or blank, a letter, printable text, CR LF.
fn reply(bytes: &[u8]) -> Head {
    for (i, &byte) in bytes.iter().enumerate().take(REPLY_LIMIT) {
        let fits = match i {
            0 => true,
            1 => matches!(byte, b' ' | b'1'..=b'4'),
            2 => byte.is_ascii_alphabetic(),
            _ => byte == b'\r' || byte == b'\n' || byte == b' ' || byte.is_ascii_graphic(),
        };
        if !fits {
            return Head::Skip(FastrakFaultKind::BadReply);
        }
        if byte == b'\n' && i > 3 && bytes[i - 1] == b'\r' {
            return Head::Reply(i + 1);
        }
    }
    if bytes.len() < REPLY_LIMIT { Head::NeedMore } else { Head::Skip(FastrakFaultKind::BadReply) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_are_read_with_sign_and_blanks_and_nothing_else() {
        let good: [(&[u8], f64); 5] = [
            (b"  10.25", 10.25),
            (b"-100.25", -100.25),
            (b" +0.500", 0.5),
            (b"   -.50", -0.5),
            (b"     7.", 7.0),
        ];
        for (field, value) in good {
            assert_eq!(ascii_number(field), Some(value));
        }
        for field in [
            &b"       "[..],
            b"  1e5  ",
            b"    inf",
            b"    NaN",
            b"1.0 2.0",
            b"   1.2.",
            b"      .",
        ] {
            assert_eq!(ascii_number(field), None, "{field:?}");
        }
    }

    #[test]
    fn replies_are_told_from_the_tail_of_a_data_record() {
        assert_eq!(head(b"21S3F0  1 text\r\n01 ", ASCII), Head::Reply(16));
        assert_eq!(head(b"2 E*ERROR*O*ERROR* EC -99*\r\n", ASCII), Head::Reply(28));
        assert_eq!(head(b"2 x", ASCII), Head::NeedMore);
        let tail = head(b"22.00  30.00\r\n", ASCII);
        assert_eq!(tail, Head::Skip(FastrakFaultKind::BadReply));
        let endless = [&b"21S"[..], &[b'a'; REPLY_LIMIT]].concat();
        assert_eq!(head(&endless, ASCII), Head::Skip(FastrakFaultKind::BadReply));
    }

    const ASCII: FastrakFormat = FastrakFormat {
        encoding: Encoding::Ascii,
        output: OutputList::PositionEuler,
        units: super::super::record::LengthUnit::Inches,
    };
}
