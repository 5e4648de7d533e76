//! The payload of a frame: one part, then little-endian arrays on eight-byte borders.

use wincode::config::Serialize;
use wincode::{SchemaRead, SchemaWrite};

use crate::block::{PartFormat, read_fields};
use crate::trace::{TraceContext, TracePart};
use crate::{DecodeError, DofValue, EncodeError, HEADER_LEN, Header, Kind, Limits, PART_LEN_MAX};

/// Length of the number that states the part's length, bytes.
const LENGTH_LEN: usize = 8;

/// Element of an array: scalars of one width, one behind the other.
pub(crate) trait Flat: bytemuck::Pod {
    /// Length of one scalar, bytes.
    const SCALAR_LEN: usize;
}

impl Flat for u32 {
    const SCALAR_LEN: usize = 4;
}

impl Flat for f64 {
    const SCALAR_LEN: usize = 8;
}

impl Flat for [u32; 3] {
    const SCALAR_LEN: usize = 4;
}
impl Flat for [u32; 4] {
    const SCALAR_LEN: usize = 4;
}
impl Flat for [u32; 6] {
    const SCALAR_LEN: usize = 4;
}

impl Flat for [f32; 3] {
    const SCALAR_LEN: usize = 4;
}

impl Flat for [f64; 2] {
    const SCALAR_LEN: usize = 8;
}

impl Flat for [f64; 3] {
    const SCALAR_LEN: usize = 8;
}

/// Appends the frame of one message to `out`; `fill` writes the payload.
///
/// # Errors
/// [`EncodeError`] if the frame is too large; `out` is then unchanged.
pub(crate) fn encode_frame(
    kind: Kind,
    request_id: u64,
    limits: &Limits,
    out: &mut Vec<u8>,
    fill: impl FnOnce(&mut PayloadWriter<'_>) -> Result<(), EncodeError>,
) -> Result<(), EncodeError> {
    let before = out.len();
    let result = append_frame(kind, request_id, limits, out, fill);
    if result.is_err() {
        out.truncate(before);
    }
    result
}

fn append_frame(
    kind: Kind,
    request_id: u64,
    limits: &Limits,
    out: &mut Vec<u8>,
    fill: impl FnOnce(&mut PayloadWriter<'_>) -> Result<(), EncodeError>,
) -> Result<(), EncodeError> {
    let frame_start = out.len();
    let start = frame_start + HEADER_LEN;
    out.resize(start, 0);
    fill(&mut PayloadWriter { out, start, trace: None })?;
    // The payload stays where it was written; only the header is filled in afterwards.
    let (before, payload) = out.split_at_mut(start);
    let len_max = limits.payload_len_max;
    let too_long = EncodeError::PayloadTooLong { len: payload.len(), len_max };
    let Some(payload_len) = u32::try_from(payload.len()).ok().filter(|len| *len <= len_max) else {
        return Err(too_long);
    };
    let header = Header::encode(kind.number(), request_id, payload_len, payload);
    before[frame_start..].copy_from_slice(&header);
    Ok(())
}

/// Writes one payload at the end of a buffer.
pub(crate) struct PayloadWriter<'a> {
    out: &'a mut Vec<u8>,
    start: usize,
    /// Trace that the message belongs to, written behind the fields of its part.
    trace: Option<TraceContext>,
}

impl PayloadWriter<'_> {
    /// Trace that the part, which is written next, shall tell.
    pub(crate) fn belongs_to(&mut self, trace: Option<TraceContext>) {
        self.trace = trace;
    }

    /// Writes the part as a block, its length first; to be called before any array.
    ///
    /// # Errors
    /// [`EncodeError::Part`] or [`EncodeError::PartTooLong`].
    pub(crate) fn part<T>(&mut self, part: &T) -> Result<(), EncodeError>
    where
        T: SchemaWrite<PartFormat, Src = T>,
    {
        let start = self.out.len();
        self.out.extend_from_slice(&[0; LENGTH_LEN]);
        T::serialize_into(&mut *self.out, part, PartFormat::new())
            .map_err(|source| EncodeError::Part { source })?;
        if let Some(trace) = self.trace.take() {
            let later = TracePart { trace: Some(trace) };
            TracePart::serialize_into(&mut *self.out, &later, PartFormat::new())
                .map_err(|source| EncodeError::Part { source })?;
        }
        let len = self.out.len() - start - LENGTH_LEN;
        if len > PART_LEN_MAX {
            return Err(EncodeError::PartTooLong { len });
        }
        if let Some(length) = self.out.get_mut(start..start + LENGTH_LEN) {
            length.copy_from_slice(&(len as u64).to_le_bytes());
        }
        self.pad();
        Ok(())
    }

    /// Writes one raw array.
    pub(crate) fn array<T: Flat>(&mut self, values: &[T]) {
        let before = self.out.len();
        self.out.extend_from_slice(bytemuck::cast_slice(values));
        if cfg!(target_endian = "big") {
            reverse_scalars(self.out.get_mut(before..).unwrap_or_default(), T::SCALAR_LEN);
        }
        self.pad();
    }

    /// Writes two raw arrays: numbers of the degrees of freedom, then their values.
    pub(crate) fn dof_values(&mut self, entries: &[DofValue]) {
        self.out.reserve(12 * entries.len() + 8);
        for entry in entries {
            self.out.extend_from_slice(&entry.dof.to_le_bytes());
        }
        self.pad();
        for entry in entries {
            self.out.extend_from_slice(&entry.value.to_le_bytes());
        }
    }

    fn pad(&mut self) {
        let len = self.out.len() - self.start;
        self.out.resize(self.start + len.next_multiple_of(8), 0);
    }
}

/// `len` as the number of entries that announces an array.
///
/// # Errors
/// [`EncodeError::TooMany`] if 32 bits do not suffice.
pub(crate) fn count_of(what: &'static str, len: usize) -> Result<u32, EncodeError> {
    u32::try_from(len).map_err(|_| EncodeError::TooMany { what, count: len })
}

/// Reads one payload, front to back.
///
/// Invariant: `0 ≤ position ≤ payload.len()`, and `position` is a multiple of eight between calls.
pub(crate) struct PayloadReader<'a> {
    payload: &'a [u8],
    position: usize,
}

impl<'a> PayloadReader<'a> {
    pub(crate) fn new(payload: &'a [u8]) -> Self {
        Self { payload, position: 0 }
    }

    /// Reads the part, to be called first. Unknown fields at its end are skipped, missing ones are zero.
    ///
    /// # Errors
    /// [`DecodeError::ArrayCut`] if bytes are missing, [`DecodeError::PartTooLong`], and
    /// [`DecodeError::Part`] for a value that does not exist.
    pub(crate) fn part<T>(&mut self) -> Result<T, DecodeError>
    where
        T: for<'de> SchemaRead<'de, PartFormat, Dst = T>,
    {
        let part = read_fields(self.part_bytes()?)?;
        self.skip_padding()?;
        Ok(part)
    }

    /// Reads the part, to be called first, and the fields behind it that came later and may be left out.
    ///
    /// # Errors
    /// As [`PayloadReader::part`].
    pub(crate) fn part_and_later<T, L>(&mut self) -> Result<(T, L), DecodeError>
    where
        T: for<'de> SchemaRead<'de, PartFormat, Dst = T>,
        L: for<'de> SchemaRead<'de, PartFormat, Dst = L> + Default,
    {
        let fields = self.part_bytes()?;
        let mut rest = fields;
        let (part, later) = match T::get(&mut rest) {
            Ok(part) if rest.is_empty() => (part, L::default()),
            Ok(part) => (part, read_fields(rest)?),
            Err(_) => (read_fields(fields)?, L::default()),
        };
        self.skip_padding()?;
        Ok((part, later))
    }

    /// Bytes of the part, behind their length.
    fn part_bytes(&mut self) -> Result<&'a [u8], DecodeError> {
        let length = self.take("the length of the part", LENGTH_LEN, 1)?;
        let length = length.iter().rev().fold(0, |sum: u64, byte| (sum << 8) | u64::from(*byte));
        let len = usize::try_from(length).ok().filter(|len| *len <= PART_LEN_MAX);
        let len = len.ok_or(DecodeError::PartTooLong { len: length })?;
        self.take("the part", len, 1)
    }

    /// Reads one raw array of `count` entries; memory is taken only if its bytes are there.
    ///
    /// # Errors
    /// [`DecodeError::ArrayCut`] with the name of the array.
    pub(crate) fn array<T: Flat>(
        &mut self,
        what: &'static str,
        count: usize,
    ) -> Result<Vec<T>, DecodeError> {
        let bytes = self.take(what, count, size_of::<T>())?;
        let mut values = vec![T::zeroed(); count];
        let target: &mut [u8] = bytemuck::cast_slice_mut(&mut values);
        target.copy_from_slice(bytes);
        if cfg!(target_endian = "big") {
            reverse_scalars(target, T::SCALAR_LEN);
        }
        self.skip_padding()?;
        Ok(values)
    }

    /// Reads two raw arrays of `count` entries: numbers of the degrees of freedom, then their values.
    ///
    /// # Errors
    /// [`DecodeError::ArrayCut`] with the name of the list.
    pub(crate) fn dof_values(
        &mut self,
        what: &'static str,
        count: usize,
    ) -> Result<Vec<DofValue>, DecodeError> {
        let dofs = self.take(what, count, 4)?;
        self.skip_padding()?;
        let values = self.take(what, count, 8)?;
        let (dofs, _) = dofs.as_chunks::<4>();
        let (values, _) = values.as_chunks::<8>();
        let entry = |(dof, value): (&[u8; 4], &[u8; 8])| DofValue {
            dof: u32::from_le_bytes(*dof),
            value: f64::from_le_bytes(*value),
        };
        Ok(dofs.iter().zip(values).map(entry).collect())
    }

    /// Checks that the payload has been read to its end.
    ///
    /// # Errors
    /// [`DecodeError::LeftOver`] if bytes are left.
    pub(crate) fn finish(self) -> Result<(), DecodeError> {
        match self.payload.len() - self.position {
            0 => Ok(()),
            count => Err(DecodeError::LeftOver { count }),
        }
    }

    fn take(
        &mut self,
        what: &'static str,
        count: usize,
        entry_len: usize,
    ) -> Result<&'a [u8], DecodeError> {
        let rest = self.payload.get(self.position..).unwrap_or_default();
        let needed = count as u64 * entry_len as u64;
        let bytes = usize::try_from(needed).ok().and_then(|len| rest.get(..len));
        let bytes = bytes.ok_or(DecodeError::ArrayCut { what, needed, there: rest.len() })?;
        self.position += bytes.len();
        Ok(bytes)
    }

    /// Skips zero bytes up to the next multiple of eight; the last multiple may be the payload's end.
    fn skip_padding(&mut self) -> Result<(), DecodeError> {
        let position = self.position.next_multiple_of(8);
        match self.payload.get(self.position..position) {
            Some(padding) if padding.iter().all(|byte| *byte == 0) => {
                self.position = position;
                Ok(())
            }
            _ => Err(DecodeError::Padding { position }),
        }
    }
}

/// Reverses the bytes of each scalar, for big-endian hosts.
fn reverse_scalars(bytes: &mut [u8], scalar_len: usize) {
    for scalar in bytes.chunks_exact_mut(scalar_len) {
        scalar.reverse();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn payload_of(fill: impl FnOnce(&mut PayloadWriter<'_>)) -> Vec<u8> {
        let mut out = Vec::new();
        fill(&mut PayloadWriter { out: &mut out, start: 0, trace: None });
        out
    }

    #[test]
    fn arrays_equal_their_entries_written_one_by_one() {
        let vertices = [[1.5, -2.0, f64::MIN_POSITIVE], [0.0, -0.0, 1e300]];
        let naive: Vec<u8> = vertices.iter().flatten().flat_map(|v| v.to_le_bytes()).collect();
        assert_eq!(payload_of(|w| w.array(&vertices)), naive);
        let labels = [1_u32, 2, u32::MAX];
        let mut naive: Vec<u8> = labels.iter().flat_map(|v| v.to_le_bytes()).collect();
        naive.extend([0; 4]);
        assert_eq!(payload_of(|w| w.array(&labels)), naive);
    }

    #[test]
    fn reversed_scalars_are_the_other_byte_order() {
        let mut bytes: Vec<u8> = [1.5_f64, -7.25].iter().flat_map(|v| v.to_be_bytes()).collect();
        reverse_scalars(&mut bytes, f64::SCALAR_LEN);
        let little: Vec<u8> = [1.5_f64, -7.25].iter().flat_map(|v| v.to_le_bytes()).collect();
        assert_eq!(bytes, little);
    }

    #[test]
    fn an_array_at_an_odd_address_is_read_all_the_same() {
        let mut bytes = vec![0];
        bytes.extend([3.5_f64, 4.5].iter().flat_map(|v| v.to_le_bytes()));
        let mut reader = PayloadReader::new(&bytes[1..]);
        assert_eq!(reader.array::<f64>("values", 2).unwrap(), [3.5, 4.5]);
        reader.finish().unwrap();
    }

    #[test]
    fn a_count_beyond_the_bytes_names_both_numbers() {
        let mut reader = PayloadReader::new(&[0; 16]);
        assert!(matches!(
            reader.array::<[f64; 3]>("vertices", usize::MAX >> 32),
            Err(DecodeError::ArrayCut { what: "vertices", needed, there: 16 })
                if needed == 24 * (u64::from(u32::MAX))
        ));
    }

    #[test]
    fn padding_that_is_not_zero_or_not_there_is_refused() {
        let mut bytes = payload_of(|w| w.array(&[5_u32]));
        bytes[6] = 1;
        let read = |bytes: &[u8]| PayloadReader::new(bytes).array::<u32>("labels", 1);
        assert!(matches!(read(&bytes), Err(DecodeError::Padding { position: 8 })));
        assert!(matches!(read(&bytes[..6]), Err(DecodeError::Padding { position: 8 })));
        bytes[6] = 0;
        assert_eq!(read(&bytes).unwrap(), [5]);
    }

    #[test]
    fn left_over_bytes_are_counted() {
        let reader = PayloadReader::new(&[0; 3]);
        assert!(matches!(reader.finish(), Err(DecodeError::LeftOver { count: 3 })));
    }

    #[test]
    fn a_part_over_its_limit_is_not_sent() {
        let texts = vec!["x".repeat(40_000); 2];
        let mut out = vec![9];
        let error = encode_frame(Kind::Ping, 1, &Limits::default(), &mut out, |w| w.part(&texts));
        assert!(matches!(error, Err(EncodeError::PartTooLong { .. })));
        let text = "x".repeat(70_000);
        let error = encode_frame(Kind::Ping, 1, &Limits::default(), &mut out, |w| w.part(&text));
        assert!(matches!(error, Err(EncodeError::Part { .. })));
        assert_eq!(out, [9], "nothing is appended");
    }

    #[test]
    fn a_payload_over_its_limit_is_not_sent() {
        let limits = Limits { payload_len_max: 15, ..Limits::default() };
        let mut out = Vec::new();
        let error = encode_frame(Kind::Ping, 1, &limits, &mut out, |w| {
            w.array(&[1.0, 2.0]);
            Ok(())
        });
        assert!(matches!(error, Err(EncodeError::PayloadTooLong { len: 16, len_max: 15 })));
        assert!(out.is_empty());
    }
}
