//! Binary numbers: their byte order, and the number types of VTK arrays by the names of the legacy and the
//! XML format.

use super::cursor::Cursor;
use super::error::MeshFileError;

/// Order of the bytes of a number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum ByteOrder {
    Little,
    Big,
}

impl ByteOrder {
    /// A 32-bit integer from its bytes.
    pub(super) fn i32(self, bytes: [u8; 4]) -> i32 {
        match self {
            Self::Little => i32::from_le_bytes(bytes),
            Self::Big => i32::from_be_bytes(bytes),
        }
    }

    /// Unsigned 64-bit integer.
    pub(super) fn u64(self, bytes: [u8; 8]) -> u64 {
        match self {
            Self::Little => u64::from_le_bytes(bytes),
            Self::Big => u64::from_be_bytes(bytes),
        }
    }

    /// Double precision number.
    pub(super) fn f64(self, bytes: [u8; 8]) -> f64 {
        f64::from_bits(self.u64(bytes))
    }

    /// Next 32-bit integer of a file.
    pub(super) fn next_i32(self, cursor: &mut Cursor, what: &str) -> Result<i64, MeshFileError> {
        cursor.take_array(what).map(|bytes| i64::from(self.i32(bytes)))
    }

    /// Next double precision number of a file.
    pub(super) fn next_f64(self, cursor: &mut Cursor, what: &str) -> Result<f64, MeshFileError> {
        cursor.take_array(what).map(|bytes| self.f64(bytes))
    }
}

/// Type of the numbers of a VTK array.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Scalar {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    I64,
    U64,
    F32,
    F64,
}

impl Scalar {
    /// From the XML format: `Float32`, `Int64`.
    pub(super) fn from_xml(name: &[u8]) -> Option<Self> {
        Some(match name {
            b"Int8" => Self::I8,
            b"UInt8" => Self::U8,
            b"Int16" => Self::I16,
            b"UInt16" => Self::U16,
            b"Int32" => Self::I32,
            b"UInt32" => Self::U32,
            b"Int64" => Self::I64,
            b"UInt64" => Self::U64,
            b"Float32" => Self::F32,
            b"Float64" => Self::F64,
            _ => return None,
        })
    }

    /// From the legacy format: `float`, `vtktypeint64`. Sizes are those of 64-bit Linux.
    pub(super) fn from_legacy(name: &[u8]) -> Option<Self> {
        Some(match name.to_ascii_lowercase().as_slice() {
            b"char" | b"vtktypeint8" => Self::I8,
            b"unsigned_char" | b"vtktypeuint8" => Self::U8,
            b"short" | b"vtktypeint16" => Self::I16,
            b"unsigned_short" | b"vtktypeuint16" => Self::U16,
            // VTK writes its own index type as `int` in legacy files.
            b"int" | b"vtkidtype" | b"vtktypeint32" => Self::I32,
            b"unsigned_int" | b"vtktypeuint32" => Self::U32,
            b"long" | b"vtktypeint64" => Self::I64,
            b"unsigned_long" | b"vtktypeuint64" => Self::U64,
            b"float" => Self::F32,
            b"double" => Self::F64,
            _ => return None,
        })
    }

    /// Bytes of one number.
    pub(super) fn bytes(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::I32 | Self::U32 | Self::F32 => 4,
            Self::I64 | Self::U64 | Self::F64 => 8,
        }
    }

    /// A number read from text, as this type holds it: VTK reads the text of a `float` array into
    /// single precision, and two programs must see the same mesh.
    pub(super) fn of_text(self, value: f64) -> f64 {
        match self {
            Self::F32 => f64::from(value as f32),
            _ => value,
        }
    }

    /// Numbers of an array as floating point; a rest shorter than a number is left.
    pub(super) fn reals(self, bytes: &[u8], order: ByteOrder) -> Vec<f64> {
        let values = bytes.chunks_exact(self.bytes());
        match self {
            Self::F32 => {
                values.map(|v| f64::from(f32::from_bits(unsigned(v, order) as u32))).collect()
            }
            Self::F64 => values.map(|v| f64::from_bits(unsigned(v, order))).collect(),
            _ => values.map(|v| self.integer(v, order) as f64).collect(),
        }
    }

    /// Numbers of an array as integers; fractions of floating point numbers are cut off.
    pub(super) fn integers(self, bytes: &[u8], order: ByteOrder) -> Vec<i64> {
        match self {
            Self::F32 | Self::F64 => {
                self.reals(bytes, order).into_iter().map(|value| value as i64).collect()
            }
            _ => bytes.chunks_exact(self.bytes()).map(|v| self.integer(v, order)).collect(),
        }
    }

    fn integer(self, value: &[u8], order: ByteOrder) -> i64 {
        let bits = unsigned(value, order);
        match self {
            Self::I8 => i64::from(bits as i8),
            Self::I16 => i64::from(bits as i16),
            Self::I32 => i64::from(bits as i32),
            // An index above i64::MAX becomes negative and is refused as an index.
            _ => bits as i64,
        }
    }
}

/// Up to eight bytes as one unsigned number.
pub(super) fn unsigned(value: &[u8], order: ByteOrder) -> u64 {
    let join = |bits: u64, byte: &u8| bits << 8 | u64::from(*byte);
    match order {
        ByteOrder::Big => value.iter().fold(0, join),
        ByteOrder::Little => value.iter().rev().fold(0, join),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn both_byte_orders_give_the_same_numbers() {
        for value in [-2.5_f64, 7.0, 1e300] {
            assert_eq!(Scalar::F64.reals(&value.to_be_bytes(), ByteOrder::Big), [value]);
            assert_eq!(Scalar::F64.reals(&value.to_le_bytes(), ByteOrder::Little), [value]);
        }
        for value in [-2_i16, 300] {
            let known = [i64::from(value)];
            assert_eq!(Scalar::I16.integers(&value.to_be_bytes(), ByteOrder::Big), known);
            assert_eq!(Scalar::I16.integers(&value.to_le_bytes(), ByteOrder::Little), known);
        }
        assert_eq!(Scalar::I8.integers(&[0xff, 2], ByteOrder::Big), [-1, 2]);
        assert_eq!(Scalar::U32.integers(&[0xff; 4], ByteOrder::Big), [0xffff_ffff]);
        assert_eq!(Scalar::F32.integers(&3_f32.to_be_bytes(), ByteOrder::Big), [3]);
    }
}
