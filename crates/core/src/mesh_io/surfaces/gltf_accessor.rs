//! Arrays of numbers in the buffers of a glTF file.

use nalgebra::Point3;
use serde_json::Value;

use crate::mesh_io::byte_order::ByteOrder;
use crate::mesh_io::cursor::Cursor;
use crate::mesh_io::error::MeshFileError;
use crate::mesh_io::scalar::Scalar;

/// The buffers, and the text that says what lies where in them.
pub(super) struct Buffers<'a> {
    pub(super) json: &'a Value,
    pub(super) data: &'a [Vec<u8>],
    pub(super) cursor: &'a Cursor<'a>,
}

impl Buffers<'_> {
    /// Points of an accessor of three single precision numbers each.
    pub(super) fn points(&self, accessor: u64) -> Result<Vec<Point3<f64>>, MeshFileError> {
        let about = self.entry("accessors", Some(accessor))?;
        if about["type"] != "VEC3" || about["componentType"].as_u64() != Some(5126) {
            return Err(self.cursor.unsupported("glTF positions other than three floats"));
        }
        let records = self.records(about, 12)?;
        Ok(records
            .map(|bytes| Point3::from_slice(&Scalar::F32.reals(bytes, ByteOrder::Little)))
            .collect())
    }

    /// Indices of an accessor of whole numbers of any size.
    pub(super) fn indices(&self, accessor: u64) -> Result<Vec<u32>, MeshFileError> {
        let about = self.entry("accessors", Some(accessor))?;
        let kind = match about["componentType"].as_u64() {
            Some(5121) => Scalar::U8,
            Some(5123) => Scalar::U16,
            Some(5125) => Scalar::U32,
            _ => return Err(self.cursor.unsupported("glTF indices other than whole numbers")),
        };
        let records = self.records(about, kind.bytes())?;
        let index = |bytes| {
            let values = kind.integers(bytes, ByteOrder::Little);
            values.first().and_then(|v| u32::try_from(*v).ok()).unwrap_or(u32::MAX)
        };
        Ok(records.map(index).collect())
    }

    /// The bytes of each record of an accessor, `length` of them each; checked against the buffer
    /// before anything is made.
    fn records(
        &self,
        about: &Value,
        length: usize,
    ) -> Result<impl Iterator<Item = &[u8]>, MeshFileError> {
        if about.get("sparse").is_some() {
            return Err(self.cursor.unsupported("a sparse glTF accessor"));
        }
        let view = self.entry("bufferViews", about["bufferView"].as_u64())?;
        let buffer = usize_of(&view["buffer"]).and_then(|b| self.data.get(b));
        let number = |value: &Value| if value.is_null() { Some(0) } else { usize_of(value) };
        let stride = match view.get("byteStride") {
            Some(stride) => usize_of(stride).filter(|s| *s >= length),
            None => Some(length),
        };
        let count = usize_of(&about["count"]);
        let offset = number(&view["byteOffset"])
            .zip(number(&about["byteOffset"]))
            .and_then(|(view, own)| view.checked_add(own));
        let whole = (|| {
            let (count, stride, offset) = (count?, stride?, offset?);
            let bytes = buffer?.get(offset..)?;
            let needed = match count {
                0 => 0,
                _ => (count - 1).checked_mul(stride)?.checked_add(length)?,
            };
            Some(bytes.get(..needed)?.chunks(stride))
        })();
        let whole = whole.ok_or_else(|| {
            self.cursor.count_fault(
                "a glTF accessor",
                &format!("{} records of {length} bytes", about["count"]),
                &format!("a buffer of {} bytes", buffer.map_or(0, Vec::len)),
            )
        })?;
        Ok(whole.filter_map(move |record| record.get(..length)))
    }

    fn entry(&self, list: &str, index: Option<u64>) -> Result<&Value, MeshFileError> {
        let found = index
            .and_then(|i| usize::try_from(i).ok())
            .and_then(|i| self.json[list].as_array()?.get(i));
        found.ok_or_else(|| {
            let index = index.map_or("none".to_owned(), |i| i.to_string());
            self.cursor.count_fault(list, &format!("an entry {index}"), "no such entry")
        })
    }
}

fn usize_of(value: &Value) -> Option<usize> {
    value.as_u64().and_then(|n| usize::try_from(n).ok())
}
