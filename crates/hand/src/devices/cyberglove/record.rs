//! One record of the glove's interface unit: what it holds and its bytes.

use super::sensor::{RawSensors, SensorCount};

/// How a record was asked for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RecordKind {
    /// One reply to `G`.
    Polled,
    /// Part of a stream started by `S`.
    Streamed,
}

impl RecordKind {
    /// First byte of the record.
    pub const fn letter(self) -> u8 {
        match self {
            Self::Polled => b'G',
            Self::Streamed => b'S',
        }
    }

    /// The kind announced by a first byte.
    pub const fn from_letter(letter: u8) -> Option<Self> {
        match letter {
            b'G' => Some(Self::Polled),
            b'S' => Some(Self::Streamed),
            _ => None,
        }
    }
}

/// How records are written on the line.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum GloveEncoding {
    /// A byte per sensor (commands `G` and `S`).
    #[default]
    Binary,
    /// Decimal numbers (commands `g` and `s`), without time stamp and status: how those are written
    /// is not documented.
    Ascii,
}

/// What the interface unit was told to append to the sensor bytes (commands `D` and `U`).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct RecordOptions {
    /// Five bytes of time stamp.
    pub timestamp: bool,
    /// One byte of status.
    pub status: bool,
}

impl RecordOptions {
    /// Bytes of a record from its letter up to, but without, the closing NUL.
    pub const fn frame_length(self, count: SensorCount) -> usize {
        let timestamp = if self.timestamp { 5 } else { 0 };
        let status = if self.status { 1 } else { 0 };
        1 + count.number() + timestamp + status
    }
}

/// Clock of the interface unit: 1/115200 s per tick, wraps after about 10.36 h.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct GloveTicks(pub u32);

impl GloveTicks {
    /// Ticks in a second.
    pub const PER_SECOND: f64 = 115_200.0;

    /// Time since the unit's clock was zero, in s.
    pub fn seconds(self) -> f64 {
        f64::from(self.0) / Self::PER_SECOND
    }

    /// Time from an earlier stamp to this one across at most one wrap, in s.
    pub fn seconds_since(self, earlier: Self) -> f64 {
        f64::from(self.0.wrapping_sub(earlier.0)) / Self::PER_SECOND
    }

    /// From flag byte and four bytes, least significant first; flag bit k says byte k is zero and
    /// only a stand-in was sent, because a zero would end the record.
    fn decode(bytes: [u8; 5]) -> Self {
        let [flags, value @ ..] = bytes;
        let mut plain = value;
        for (k, byte) in plain.iter_mut().enumerate() {
            if flags & (1 << k) != 0 {
                *byte = 0;
            }
        }
        Self(u32::from_le_bytes(plain))
    }

    /// The inverse of [`GloveTicks::decode`]; no byte of the result is zero.
    pub fn encode(self) -> [u8; 5] {
        let mut bytes = [0x80, 0, 0, 0, 0];
        for (k, byte) in self.0.to_le_bytes().into_iter().enumerate() {
            if byte == 0 {
                bytes[0] |= 1 << k;
            }
            bytes[k + 1] = byte.max(1);
        }
        bytes
    }
}

/// Status byte of a record.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct GloveStatus {
    /// The glove is plugged into the unit.
    pub plugged_in: bool,
    /// The switch on the wrist is on.
    pub switch_on: bool,
    /// The light on the wrist is on.
    pub light_on: bool,
}

impl GloveStatus {
    fn decode(byte: u8) -> Option<Self> {
        let bit = |k: u8| byte & (1 << k) != 0;
        bit(7).then(|| Self { plugged_in: bit(0), switch_on: bit(1), light_on: bit(2) })
    }

    /// The byte of this status.
    pub fn encode(self) -> u8 {
        0x80 | u8::from(self.plugged_in)
            | u8::from(self.switch_on) << 1
            | u8::from(self.light_on) << 2
    }
}

/// One sample of the glove.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct GloveRecord {
    /// Whether the record was polled or streamed.
    pub kind: RecordKind,
    /// Raw sensor values.
    pub sensors: RawSensors,
    /// The unit's clock, if it was asked for.
    pub timestamp: Option<GloveTicks>,
    /// The unit's status, if it was asked for.
    pub status: Option<GloveStatus>,
}

/// What is wrong with the content of a record that has the right length.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum RecordError {
    Letter(u8),
    Sensors,
    Status(u8),
}

/// Reads one record, from its letter to the last byte before the NUL.
///
/// Shapes: `frame` has [`RecordOptions::frame_length`] bytes.
pub(super) fn decode_frame(
    frame: &[u8],
    count: SensorCount,
    options: RecordOptions,
) -> Result<GloveRecord, RecordError> {
    let (&letter, rest) = frame.split_first().ok_or(RecordError::Letter(0))?;
    let kind = RecordKind::from_letter(letter).ok_or(RecordError::Letter(letter))?;
    let (sensors, rest) = rest.split_at_checked(count.number()).ok_or(RecordError::Sensors)?;
    let sensors = RawSensors::try_new(count, sensors).map_err(|_| RecordError::Sensors)?;
    let (timestamp, rest) = match (options.timestamp, rest.split_first_chunk::<5>()) {
        (true, Some((bytes, rest))) => (Some(GloveTicks::decode(*bytes)), rest),
        _ => (None, rest),
    };
    let status = match (options.status, rest.first()) {
        (true, Some(&byte)) => Some(GloveStatus::decode(byte).ok_or(RecordError::Status(byte))?),
        _ => None,
    };
    Ok(GloveRecord { kind, sensors, timestamp, status })
}

/// Reads one line of decimal numbers, from its letter to the last byte before the NUL.
///
/// Shapes: a small letter and one number per sensor, separated by blanks, CR LF.
pub(super) fn decode_line(line: &[u8], count: SensorCount) -> Result<GloveRecord, RecordError> {
    let (&letter, rest) = line.split_first().ok_or(RecordError::Letter(0))?;
    let kind = match letter {
        b'g' | b's' => RecordKind::from_letter(letter.to_ascii_uppercase()),
        _ => None,
    };
    let kind = kind.ok_or(RecordError::Letter(letter))?;
    let text = std::str::from_utf8(rest).map_err(|_| RecordError::Sensors)?;
    let values: Result<Vec<u8>, _> = text.split_ascii_whitespace().map(str::parse).collect();
    let values = values.map_err(|_| RecordError::Sensors)?;
    let sensors = RawSensors::try_new(count, &values).map_err(|_| RecordError::Sensors)?;
    Ok(GloveRecord { kind, sensors, timestamp: None, status: None })
}

/// The bytes of one record as the interface unit sends them, NUL included.
pub fn encode_record(record: &GloveRecord) -> Vec<u8> {
    let mut bytes = vec![record.kind.letter()];
    bytes.extend_from_slice(record.sensors.as_slice());
    if let Some(timestamp) = record.timestamp {
        bytes.extend_from_slice(&timestamp.encode());
    }
    if let Some(status) = record.status {
        bytes.push(status.encode());
    }
    bytes.push(0);
    bytes
}

/// A record as a line of decimal numbers; time stamp and status are left out.
pub fn encode_line(record: &GloveRecord) -> Vec<u8> {
    let mut bytes = vec![record.kind.letter().to_ascii_lowercase()];
    for value in record.sensors.as_slice() {
        bytes.extend_from_slice(format!(" {value}").as_bytes());
    }
    bytes.extend_from_slice(b"\r\n\0");
    bytes
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn a_polled_record_of_22_sensors_is_24_bytes() {
        let bytes: Vec<u8> = (1..=22).collect();
        let sensors = RawSensors::try_new(SensorCount::TwentyTwo, &bytes).unwrap();
        let record =
            GloveRecord { kind: RecordKind::Polled, sensors, timestamp: None, status: None };
        let encoded = encode_record(&record);
        assert_eq!(encoded.len(), 24);
        assert_eq!((encoded[0], encoded[1], encoded[22], encoded[23]), (b'G', 1, 22, 0));
    }

    #[test]
    fn ticks_with_zero_bytes_are_sent_as_stand_ins() {
        assert_eq!(GloveTicks(0x0012_0034).encode(), [0x8a, 0x34, 0x01, 0x12, 0x01]);
        assert_eq!(GloveTicks::decode([0x0a, 0x34, 0x77, 0x12, 0x33]), GloveTicks(0x0012_0034));
        assert_eq!(GloveTicks(115_200).seconds(), 1.0);
        assert_eq!(GloveTicks(57_600).seconds_since(GloveTicks(u32::MAX - 57_599)), 1.0);
    }

    #[test]
    fn a_status_byte_without_its_top_bit_is_refused() {
        assert_eq!(GloveStatus::decode(0x05), None);
        let status = GloveStatus::decode(0x85).unwrap();
        assert!(status.plugged_in && !status.switch_on && status.light_on);
        assert_eq!(status.encode(), 0x85);
    }

    proptest! {
        #[test]
        fn ticks_survive_their_encoding_and_never_hold_a_zero(ticks in any::<u32>(), mask in any::<u32>()) {
            let ticks = GloveTicks(ticks & mask);
            let bytes = ticks.encode();
            prop_assert!(!bytes.contains(&0));
            prop_assert_eq!(GloveTicks::decode(bytes), ticks);
        }
    }
}
