//! One `DataArray` of a VTU file: text, base64 or appended bytes, plain or compressed.

use std::io::Read;

use super::cursor::Cursor;
use super::encoding;
use super::error::MeshFileError;
use super::scalar::{ByteOrder, Scalar, unsigned};
use super::xml::attribute;

/// All compressed arrays of a mesh that can be modelled are smaller together (16 million
/// tetrahedra); a small file can unpack to anything.
const MAX_UNPACKED_BYTES: usize = 1 << 29;

/// Bytes that binary arrays may still take.
///
/// Arrays that are not compressed take no more than the file has, unless many of them point to
/// the same place, which no writer does.
#[derive(Debug)]
pub(super) struct Budget {
    left: usize,
}

impl Budget {
    /// For a file of this many bytes.
    pub(super) fn new(rules: BinaryRules, file_bytes: usize) -> Self {
        match rules.compressor {
            Compressor::None => Self { left: file_bytes },
            _ => Self { left: MAX_UNPACKED_BYTES },
        }
    }
}

/// What the root element says about all binary arrays.
#[derive(Clone, Copy, Debug)]
pub(super) struct BinaryRules {
    pub(super) order: ByteOrder,
    /// Bytes of a length in front of an array, 4 or 8.
    pub(super) header_bytes: usize,
    pub(super) compressor: Compressor,
}

/// How blocks are packed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Compressor {
    None,
    Zlib,
    Lz4,
}

/// The bytes of `AppendedData` after the underscore.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Appended<'a> {
    pub(super) bytes: &'a [u8],
    pub(super) is_base64: bool,
}

/// A `DataArray` element: its attributes and the text in it.
#[derive(Clone, Debug)]
pub(super) struct DataArray<'a> {
    /// Where it stands, for errors.
    pub(super) cursor: Cursor<'a>,
    pub(super) attributes: &'a [u8],
    pub(super) text: &'a [u8],
}

impl<'a> DataArray<'a> {
    /// The numbers as floating point.
    pub(super) fn reals(
        &self,
        rules: BinaryRules,
        appended: Appended<'a>,
        budget: &mut Budget,
    ) -> Result<Vec<f64>, MeshFileError> {
        match self.bytes(rules, appended, budget)? {
            Some((scalar, bytes)) => Ok(scalar.reals(&bytes, rules.order)),
            None => {
                let scalar =
                    Scalar::from_xml(attribute(self.attributes, "type").unwrap_or_default());
                let scalar = scalar.unwrap_or(Scalar::F64);
                self.cursor
                    .words(self.text.len(), |cursor| Ok(scalar.of_text(cursor.real("a number")?)))
            }
        }
    }

    /// The numbers as integers.
    pub(super) fn integers(
        &self,
        rules: BinaryRules,
        appended: Appended<'a>,
        budget: &mut Budget,
    ) -> Result<Vec<i64>, MeshFileError> {
        match self.bytes(rules, appended, budget)? {
            Some((scalar, bytes)) => Ok(scalar.integers(&bytes, rules.order)),
            None => self.cursor.words(self.text.len(), |cursor| cursor.integer("an integer")),
        }
    }

    /// Number type and bytes of a binary array; `None` for a text array.
    fn bytes(
        &self,
        rules: BinaryRules,
        appended: Appended<'a>,
        budget: &mut Budget,
    ) -> Result<Option<(Scalar, Vec<u8>)>, MeshFileError> {
        let type_name = attribute(self.attributes, "type").unwrap_or_default();
        let Some(scalar) = Scalar::from_xml(type_name) else {
            return Err(self.cursor.expected_instead("a number type such as Float64", type_name));
        };
        let name = attribute(self.attributes, "Name").unwrap_or(b"Points");
        let packed = Packed {
            cursor: &self.cursor,
            rules,
            array: format!("array {}", name.escape_ascii()),
            most_bytes: budget.left,
        };
        let format = attribute(self.attributes, "format").unwrap_or(b"ascii");
        let bytes = match format {
            b"ascii" => return Ok(None),
            b"binary" => packed.unpack_base64(self.text)?,
            b"appended" => {
                let offset = attribute(self.attributes, "offset").unwrap_or_default();
                let start = super::number::parse_integer(offset)
                    .and_then(|offset| appended.bytes.get(usize::try_from(offset).ok()?..));
                let Some(bytes) = start else {
                    let expected = format!("an offset up to {}", appended.bytes.len());
                    let found = offset.escape_ascii().to_string();
                    return Err(self.cursor.count_fault(&packed.array, &expected, &found));
                };
                if appended.is_base64 {
                    packed.unpack_base64(bytes)?
                } else {
                    packed.unpack(bytes)?
                }
            }
            _ => return Err(self.cursor.expected_instead("ascii, binary or appended", format)),
        };
        budget.left = budget.left.saturating_sub(bytes.len());
        if bytes.len() % scalar.bytes() != 0 {
            let expected = format!("a multiple of {} bytes", scalar.bytes());
            return Err(self.cursor.count_fault(
                &packed.array,
                &expected,
                &bytes.len().to_string(),
            ));
        }
        Ok(Some((scalar, bytes)))
    }
}

/// Binary data of one array: lengths in front, then bytes or compressed blocks.
struct Packed<'c, 'a> {
    cursor: &'c Cursor<'a>,
    rules: BinaryRules,
    array: String,
    /// What is left of the budget.
    most_bytes: usize,
}

impl Packed<'_, '_> {
    /// Base64 of lengths and data; appended arrays are followed by others, so that the lengths
    /// are read first to know where this one ends.
    fn unpack_base64(&self, text: &[u8]) -> Result<Vec<u8>, MeshFileError> {
        let first = encoding::decode(text, self.rules.header_bytes);
        let mut length = self.header_length(&first)?;
        let header = encoding::decode(text, length);
        length = length.saturating_add(self.data_length(&header)?);
        self.unpack(&encoding::decode(text, length))
    }

    /// Bytes of the array out of bytes that begin with its lengths.
    fn unpack(&self, bytes: &[u8]) -> Result<Vec<u8>, MeshFileError> {
        let header_length = self.header_length(bytes)?;
        let data_length = self.data_length(bytes)?;
        let after = bytes.get(header_length..).unwrap_or_default();
        let Some(data) = after.get(..data_length) else {
            return Err(self.wrong(&format!("{data_length} bytes"), &format!("{}", after.len())));
        };
        match self.rules.compressor {
            Compressor::None if data.len() > self.most_bytes => {
                Err(self.wrong(&format!("at most {} bytes", self.most_bytes), "more"))
            }
            Compressor::None => Ok(data.to_vec()),
            compressor => self.decompress(compressor, bytes, data),
        }
    }

    /// Length `index` in front of the data.
    fn length(&self, header: &[u8], index: usize) -> Result<usize, MeshFileError> {
        let size = self.rules.header_bytes;
        let at = index.saturating_mul(size);
        match header.get(at..at.saturating_add(size)) {
            Some(bytes) => {
                Ok(usize::try_from(unsigned(bytes, self.rules.order)).unwrap_or(usize::MAX))
            }
            None => Err(self.wrong("its length in front of the data", "the end of the data")),
        }
    }

    /// Bytes of all lengths: one, or three and one per block.
    fn header_length(&self, header: &[u8]) -> Result<usize, MeshFileError> {
        let size = self.rules.header_bytes;
        match self.rules.compressor {
            Compressor::None => Ok(size),
            _ => Ok(self.length(header, 0)?.saturating_add(3).saturating_mul(size)),
        }
    }

    /// Bytes of the data after the lengths.
    fn data_length(&self, header: &[u8]) -> Result<usize, MeshFileError> {
        if self.rules.compressor == Compressor::None {
            return self.length(header, 0);
        }
        let blocks = self.length(header, 0)?;
        let mut total = 0_usize;
        for block in 0..blocks {
            total = total.saturating_add(self.length(header, block.saturating_add(3))?);
        }
        Ok(total)
    }

    fn decompress(
        &self,
        compressor: Compressor,
        header: &[u8],
        mut data: &[u8],
    ) -> Result<Vec<u8>, MeshFileError> {
        let blocks = self.length(header, 0)?;
        let mut bytes = Vec::new();
        for block in 0..blocks {
            // A last length of zero means that the last block is as long as the others.
            let last = if block + 1 == blocks { self.length(header, 2)? } else { 0 };
            let unpacked = if last > 0 { last } else { self.length(header, 1)? };
            let packed = self.length(header, block.saturating_add(3))?;
            let (Some(source), Some(rest)) = (data.get(..packed), data.get(packed..)) else {
                return Err(self.wrong(&format!("{packed} bytes"), &data.len().to_string()));
            };
            data = rest;
            if bytes.len().saturating_add(unpacked) > self.most_bytes {
                return Err(self.wrong(&format!("at most {} bytes", self.most_bytes), "more"));
            }
            let before = bytes.len();
            match compressor {
                Compressor::Lz4 => bytes.extend(self.lz4(source, unpacked)?),
                _ => {
                    let limit = unpacked as u64 + 1;
                    let mut decoder = flate2::read::ZlibDecoder::new(source).take(limit);
                    decoder
                        .read_to_end(&mut bytes)
                        .map_err(|e| self.wrong("a zlib stream", &e.to_string()))?;
                }
            }
            let found = bytes.len() - before;
            if found != unpacked {
                let block = format!("{unpacked} bytes from block {block}");
                return Err(self.wrong(&block, &found.to_string()));
            }
        }
        Ok(bytes)
    }

    fn lz4(&self, source: &[u8], unpacked: usize) -> Result<Vec<u8>, MeshFileError> {
        // One byte of LZ4 cannot mean more than 255, so that the announcement is not trusted.
        if unpacked > source.len().saturating_mul(255) {
            return Err(self.wrong(&format!("{unpacked} bytes"), "too few packed bytes for that"));
        }
        lz4_flex::block::decompress(source, unpacked)
            .map_err(|e| self.wrong("an LZ4 block", &e.to_string()))
    }

    fn wrong(&self, expected: &str, found: &str) -> MeshFileError {
        self.cursor.count_fault(&self.array, expected, found)
    }
}
