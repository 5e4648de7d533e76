//! Header of a PLY file: its encoding, and which numbers stand in the rows of each element.

use crate::mesh_io::byte_order::ByteOrder;
use crate::mesh_io::cursor::{Cursor, words};
use crate::mesh_io::error::MeshFileError;
use crate::mesh_io::number::parse_integer;
use crate::mesh_io::scalar::Scalar;

/// How rows are written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Encoding {
    Text,
    Binary(ByteOrder),
}

/// What a row of an element holds at one place.
#[derive(Clone, Debug)]
pub(super) enum Property {
    /// One number.
    Single { name: Vec<u8>, kind: Scalar },
    /// A count, then as many numbers.
    List { name: Vec<u8>, count_kind: Scalar, kind: Scalar },
}

/// Rows of one kind.
#[derive(Clone, Debug)]
pub(super) struct Element {
    pub(super) name: Vec<u8>,
    pub(super) rows: usize,
    pub(super) properties: Vec<Property>,
}

/// Reads the header; the cursor stands at the first row afterwards.
pub(super) fn read(cursor: &mut Cursor) -> Result<(Encoding, Vec<Element>), MeshFileError> {
    cursor.token();
    let mut encoding = None;
    let mut elements: Vec<Element> = Vec::new();
    loop {
        let Some(line) = cursor.line() else { return Err(cursor.expected("end_header")) };
        let parts: Vec<&[u8]> = words(line).collect();
        match parts.as_slice() {
            [b"comment" | b"obj_info", ..] => {}
            [b"format", word, ..] => encoding = Some(encoding_of(word, line, cursor)?),
            [b"element", name, rows] => {
                let rows = parse_integer(rows).and_then(|n| usize::try_from(n).ok());
                let rows = rows.ok_or_else(|| {
                    cursor.expected_instead("element, name and number of rows", line)
                })?;
                elements.push(Element { name: name.to_vec(), rows, properties: Vec::new() });
            }
            [b"property", rest @ ..] => {
                let property = property(rest);
                match (elements.last_mut(), property) {
                    (Some(element), Some(property)) => element.properties.push(property),
                    _ => return Err(cursor.expected_instead("a property of an element", line)),
                }
            }
            [b"end_header"] => break,
            _ => return Err(cursor.expected_instead("a line of a PLY header", line)),
        }
    }
    let Some(encoding) = encoding else { return Err(cursor.expected("a format line before")) };
    if encoding != Encoding::Text {
        cursor.end_of_line()?;
        cursor.set_binary(true);
    }
    Ok((encoding, elements))
}

fn encoding_of(word: &[u8], line: &[u8], cursor: &Cursor) -> Result<Encoding, MeshFileError> {
    Ok(match word {
        b"ascii" => Encoding::Text,
        b"binary_little_endian" => Encoding::Binary(ByteOrder::Little),
        b"binary_big_endian" => Encoding::Binary(ByteOrder::Big),
        _ => {
            return Err(cursor.expected_instead(
                "format ascii, binary_little_endian or binary_big_endian",
                line,
            ));
        }
    })
}

fn property(words: &[&[u8]]) -> Option<Property> {
    Some(match words {
        [b"list", count, kind, name] => {
            Property::List { name: name.to_vec(), count_kind: scalar(count)?, kind: scalar(kind)? }
        }
        [kind, name] => Property::Single { name: name.to_vec(), kind: scalar(kind)? },
        _ => return None,
    })
}

fn scalar(name: &[u8]) -> Option<Scalar> {
    Some(match name {
        b"char" | b"int8" => Scalar::I8,
        b"uchar" | b"uint8" => Scalar::U8,
        b"short" | b"int16" => Scalar::I16,
        b"ushort" | b"uint16" => Scalar::U16,
        b"int" | b"int32" => Scalar::I32,
        b"uint" | b"uint32" => Scalar::U32,
        b"float" | b"float32" => Scalar::F32,
        b"double" | b"float64" => Scalar::F64,
        _ => return None,
    })
}
