//! One `DataItem` of an XDMF file: numbers as text, or raw bytes in a file beside it.

use super::companion::{Companion, FindCompanion};
use super::cursor::Cursor;
use super::error::{Fault, MeshFileError};
use super::number::parse_integer;
use super::scalar::{ByteOrder, Scalar};
use super::xml::attribute;

/// All arrays in raw bytes of a mesh that can be modelled are smaller together; many items may
/// name the same file.
const MAX_BYTES: usize = 1 << 29;

/// A `DataItem` element: its attributes and the text in it.
#[derive(Clone, Debug)]
pub(super) struct DataItem<'a> {
    /// Where its text stands.
    pub(super) cursor: Cursor<'a>,
    pub(super) attributes: &'a [u8],
    pub(super) text: &'a [u8],
}

/// Reads items; counts the bytes that they take.
pub(super) struct ItemReader<'f, 'g> {
    find: &'f mut FindCompanion<'g>,
    left: usize,
}

impl<'f, 'g> ItemReader<'f, 'g> {
    pub(super) fn new(find: &'f mut FindCompanion<'g>) -> Self {
        Self { find, left: MAX_BYTES }
    }

    /// The numbers as floating point.
    pub(super) fn reals(&mut self, item: &DataItem) -> Result<Vec<f64>, MeshFileError> {
        let scalar = item.scalar()?;
        let values = match self.bytes(item, scalar)? {
            Some((bytes, order)) => scalar.reals(&bytes, order),
            None => item
                .cursor
                .words(item.text.len(), |cursor| Ok(scalar.of_text(cursor.real("a number")?)))?,
        };
        item.check_length(values.len())?;
        Ok(values)
    }

    /// The numbers as integers.
    pub(super) fn integers(&mut self, item: &DataItem) -> Result<Vec<i64>, MeshFileError> {
        let scalar = item.scalar()?;
        let values = match self.bytes(item, scalar)? {
            Some((bytes, order)) => scalar.integers(&bytes, order),
            None => item.cursor.words(item.text.len(), |cursor| cursor.integer("an integer"))?,
        };
        item.check_length(values.len())?;
        Ok(values)
    }

    /// Bytes of an item in a file of its own; `None` where its numbers stand in the document.
    fn bytes(
        &mut self,
        item: &DataItem,
        scalar: Scalar,
    ) -> Result<Option<(Vec<u8>, ByteOrder)>, MeshFileError> {
        let file = String::from_utf8_lossy(item.text.trim_ascii()).into_owned();
        let is_raw = attribute(item.attributes, "Compression")
            .is_none_or(|name| name.eq_ignore_ascii_case(b"raw"));
        match attribute(item.attributes, "Format").unwrap_or(b"XML") {
            b"XML" => return Ok(None),
            b"Binary" if is_raw => {}
            b"Binary" => return Err(item.cursor.unsupported("compressed binary data of XDMF")),
            b"HDF" => {
                let what = format!("data in HDF5 ({})", file.escape_debug());
                return Err(item.cursor.unsupported(&what));
            }
            other => {
                return Err(item.cursor.expected_instead("Format XML, Binary or HDF", other));
            }
        }
        let order = match attribute(item.attributes, "Endian").unwrap_or(b"Native") {
            b"Big" => ByteOrder::Big,
            _ => ByteOrder::Little,
        };
        let companion = Companion::FileName(file);
        let Some(mut bytes) = (self.find)(&companion) else {
            return Err(item.cursor.fault(Fault::MissingCompanion { companion }));
        };
        let seek = attribute(item.attributes, "Seek").unwrap_or(b"0");
        let seek = parse_integer(seek).and_then(|seek| usize::try_from(seek).ok());
        let there = bytes.len();
        let length = match item.announced()? {
            Some(count) => count.saturating_mul(scalar.bytes()),
            None => there.saturating_sub(seek.unwrap_or(0)),
        };
        let range = seek.and_then(|from| Some(from..from.checked_add(length)?));
        let Some(range) = range.filter(|range| range.end <= there && length <= self.left) else {
            let expected = format!("{length} bytes");
            let found = format!("{there} in {companion}");
            return Err(item.cursor.count_fault("a DataItem", &expected, &found));
        };
        self.left -= length;
        bytes.truncate(range.end);
        bytes.drain(..range.start);
        Ok(Some((bytes, order)))
    }
}

impl DataItem<'_> {
    /// Whether its numbers are whole.
    pub(super) fn is_whole(&self) -> bool {
        !matches!(self.scalar(), Ok(Scalar::F32 | Scalar::F64) | Err(_))
    }

    fn scalar(&self) -> Result<Scalar, MeshFileError> {
        let name = attribute(self.attributes, "NumberType")
            .or_else(|| attribute(self.attributes, "DataType"))
            .unwrap_or(b"Float");
        let usual: &[u8] = if matches!(name, b"Char" | b"UChar") { b"1" } else { b"4" };
        let precision = attribute(self.attributes, "Precision").unwrap_or(usual);
        Ok(match (name, precision) {
            (b"Float", b"4") => Scalar::F32,
            (b"Float", b"8") => Scalar::F64,
            (b"Int" | b"Char", b"1") => Scalar::I8,
            (b"Int", b"2") => Scalar::I16,
            (b"Int", b"4") => Scalar::I32,
            (b"Int", b"8") => Scalar::I64,
            (b"UInt" | b"UChar", b"1") => Scalar::U8,
            (b"UInt", b"2") => Scalar::U16,
            (b"UInt", b"4") => Scalar::U32,
            (b"UInt", b"8") => Scalar::U64,
            _ => {
                let found = [name, b" of Precision ", precision].concat();
                return Err(self.cursor.expected_instead("a number type such as Float", &found));
            }
        })
    }

    /// Product of `Dimensions`.
    fn announced(&self) -> Result<Option<usize>, MeshFileError> {
        let Some(dimensions) = attribute(self.attributes, "Dimensions") else { return Ok(None) };
        let mut product = Some(1_usize);
        for word in super::cursor::words(dimensions) {
            let size = parse_integer(word).and_then(|size| usize::try_from(size).ok());
            product = product.zip(size).and_then(|(product, size)| product.checked_mul(size));
        }
        match product {
            Some(count) => Ok(Some(count)),
            None => Err(self.cursor.expected_instead("Dimensions of whole numbers", dimensions)),
        }
    }

    fn check_length(&self, found: usize) -> Result<(), MeshFileError> {
        match self.announced()? {
            Some(count) if count != found => {
                Err(self.cursor.count_fault("a DataItem", &count.to_string(), &found.to_string()))
            }
            _ => Ok(()),
        }
    }
}
