//! PLY, text and binary in both byte orders: points from `vertex`, polygons from `face`.

use nalgebra::Point3;

use super::raw_surface::RawSurface;
use crate::mesh_io::cursor::{Cursor, words};
use crate::mesh_io::error::MeshFileError;
use crate::mesh_io::number::parse_integer;
use crate::mesh_io::scalar::{ByteOrder, Scalar};

/// Reads points and polygons; other elements and properties are passed over.
pub(super) fn read(mut cursor: Cursor) -> Result<RawSurface, MeshFileError> {
    let (encoding, elements) = read_header(&mut cursor)?;
    let mut raw = RawSurface::default();
    for element in elements {
        match element.name.as_slice() {
            b"vertex" => read_points(&mut cursor, encoding, &element, &mut raw)?,
            b"face" => read_faces(&mut cursor, encoding, &element, &mut raw)?,
            b"tristrips" => return Err(cursor.unsupported("a PLY file of triangle strips")),
            // Without properties there is nothing to pass over, however many rows are announced.
            _ if element.properties.is_empty() => {}
            _ => {
                for _ in 0..element.rows {
                    read_row(&mut cursor, encoding, &element, |_, _| {})?;
                }
            }
        }
    }
    Ok(raw)
}

fn read_points(
    cursor: &mut Cursor,
    encoding: Encoding,
    element: &Element,
    raw: &mut RawSurface,
) -> Result<(), MeshFileError> {
    let place = |wanted: &[u8]| {
        element.properties.iter().position(
            |p| matches!(p, Property::Single { name, .. } if name.eq_ignore_ascii_case(wanted)),
        )
    };
    let (Some(x), Some(y), Some(z)) = (place(b"x"), place(b"y"), place(b"z")) else {
        return Err(cursor.unsupported("a PLY file whose vertices have no x, y and z"));
    };
    for _ in 0..element.rows {
        let mut point = Point3::origin();
        read_row(cursor, encoding, element, |property, values| {
            for (d, wanted) in [x, y, z].into_iter().enumerate() {
                if property == wanted {
                    point[d] = values.first().copied().unwrap_or(f64::NAN);
                }
            }
        })?;
        raw.points.push(point);
    }
    Ok(())
}

fn read_faces(
    cursor: &mut Cursor,
    encoding: Encoding,
    element: &Element,
    raw: &mut RawSurface,
) -> Result<(), MeshFileError> {
    let corners_at = element.properties.iter().position(|p| {
        matches!(p, Property::List { name, .. }
            if name == b"vertex_indices" || name == b"vertex_index")
    });
    let Some(corners_at) = corners_at else {
        return Err(cursor.unsupported("a PLY file whose faces have no vertex_indices"));
    };
    let mut corners = Vec::new();
    for _ in 0..element.rows {
        read_row(cursor, encoding, element, |property, values| {
            if property == corners_at {
                corners.clear();
                corners.extend(values.iter().map(|v| *v as i64));
            }
        })?;
        raw.add_polygon(&corners, cursor)?;
    }
    Ok(())
}

/// Reads one row; `take` gets the place of each property and its numbers.
fn read_row(
    cursor: &mut Cursor,
    encoding: Encoding,
    element: &Element,
    mut take: impl FnMut(usize, &[f64]),
) -> Result<(), MeshFileError> {
    for (place, property) in element.properties.iter().enumerate() {
        let (count, kind) = match property {
            Property::Single { kind, .. } => (1, *kind),
            Property::List { count_kind, kind, .. } => {
                let count = numbers(cursor, encoding, *count_kind, 1)?;
                let count = count.first().copied().unwrap_or(-1.0);
                if !(0.0..=f64::from(u32::MAX)).contains(&count) {
                    return Err(cursor
                        .expected_instead("the length of a list", count.to_string().as_bytes()));
                }
                (count as usize, *kind)
            }
        };
        take(place, &numbers(cursor, encoding, kind, count)?);
    }
    Ok(())
}

fn numbers(
    cursor: &mut Cursor,
    encoding: Encoding,
    kind: Scalar,
    count: usize,
) -> Result<Vec<f64>, MeshFileError> {
    match encoding {
        Encoding::Text => {
            cursor.check_count(count, 2, "numbers of a PLY row")?;
            (0..count).map(|_| cursor.real("a number").map(|v| kind.of_text(v))).collect()
        }
        Encoding::Binary(order) => {
            let bytes = cursor.take(count.saturating_mul(kind.bytes()), "numbers of a PLY row")?;
            Ok(kind.reals(bytes, order))
        }
    }
}

/// How rows are written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Encoding {
    Text,
    Binary(ByteOrder),
}

/// What a row of an element holds at one place.
#[derive(Clone, Debug)]
pub(super) enum Property {
    /// A property of one number.
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
pub(super) fn read_header(cursor: &mut Cursor) -> Result<(Encoding, Vec<Element>), MeshFileError> {
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
