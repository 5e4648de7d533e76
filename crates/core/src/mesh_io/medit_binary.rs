//! Binary MEDIT `.meshb`: keywords by number, each with the place of the next one.

use nalgebra::Point3;

use super::byte_order::ByteOrder;
use super::cell_kind::{CellKind, Shape};
use super::cursor::Cursor;
use super::error::{Fault, MeshFileError};
use super::raw_mesh::RawMesh;
use super::scalar::Scalar;

/// Sizes of the numbers of a version, in the byte order of the file.
#[derive(Clone, Copy, Debug)]
struct Numbers {
    order: ByteOrder,
    integer: Scalar,
    real: Scalar,
    position: Scalar,
}

impl Numbers {
    /// Of version 1 to 4; the number one in front of it tells the order.
    fn read(cursor: &mut Cursor) -> Result<Self, MeshFileError> {
        let order = match cursor.take_array::<4>("the number one")? {
            [1, 0, 0, 0] => ByteOrder::Little,
            _ => ByteOrder::Big,
        };
        let version = order.next_i32(cursor, "the version")?;
        if !(1..=4).contains(&version) {
            return Err(cursor.count_fault("the version", "1 to 4", &version.to_string()));
        }
        Ok(Self {
            order,
            integer: if version < 4 { Scalar::I32 } else { Scalar::I64 },
            real: if version < 2 { Scalar::F32 } else { Scalar::F64 },
            position: if version < 3 { Scalar::I32 } else { Scalar::I64 },
        })
    }

    fn next(self, cursor: &mut Cursor, kind: Scalar, what: &str) -> Result<i64, MeshFileError> {
        let bytes = cursor.take(kind.bytes(), what)?;
        Ok(kind.integers(bytes, self.order).first().copied().unwrap_or(0))
    }
}

/// Reads a binary MEDIT file.
///
/// # Errors
/// [`MeshFileError`]: the file ends too early, or a keyword's place or count cannot be.
///
/// Source: L. Maréchal, "The GMF library v7", INRIA, with the numbers of the keywords.
pub(super) fn read(mut cursor: Cursor) -> Result<RawMesh, MeshFileError> {
    const END: i64 = 54;
    cursor.set_binary(true);
    let length = cursor.rest().len();
    let numbers = Numbers::read(&mut cursor)?;
    let mut raw = RawMesh { first_label: 1, ..RawMesh::default() };
    loop {
        let keyword = numbers.order.next_i32(&mut cursor, "a keyword")?;
        if keyword == END {
            break;
        }
        let next = numbers.next(&mut cursor, numbers.position, "the place of the next keyword")?;
        let here = length - cursor.rest().len();
        // Zero: nothing follows.
        let next = if next == 0 { Some(length) } else { usize::try_from(next).ok() };
        let Some(size) = next.filter(|&next| next <= length).and_then(|n| n.checked_sub(here))
        else {
            let expected = format!("{here} to {length}");
            let found = next.map_or_else(|| "less".to_owned(), |next| next.to_string());
            return Err(cursor.count_fault("the place of the next keyword", &expected, &found));
        };
        let mut data = cursor.limited(size);
        read_keyword(&mut data, numbers, keyword, &mut raw)?;
        cursor.take(size, "the data of a keyword")?;
        if next == Some(length) {
            break;
        }
    }
    Ok(raw)
}

fn read_keyword(
    data: &mut Cursor,
    numbers: Numbers,
    keyword: i64,
    raw: &mut RawMesh,
) -> Result<(), MeshFileError> {
    let kind = match keyword {
        3 => {
            let dimension = numbers.order.next_i32(data, "the dimension")?;
            return match dimension {
                3 => Ok(()),
                _ => {
                    let found = format!("a mesh of dimension {dimension}");
                    Err(data.fault(Fault::NoTetrahedra { found }))
                }
            };
        }
        4 => return read_vertices(data, numbers, raw),
        8 => return read_tets(data, numbers, 4, raw),
        30 => return read_tets(data, numbers, 10, raw),
        5 => CellKind::new(Shape::Line, 2),
        6 => CellKind::new(Shape::Triangle, 3),
        7 => CellKind::new(Shape::Quadrangle, 4),
        9 => CellKind::new(Shape::Prism, 6),
        10 => CellKind::new(Shape::Hexahedron, 8),
        24 => CellKind::new(Shape::Triangle, 6),
        25 => CellKind::new(Shape::Line, 3),
        27 => CellKind::new(Shape::Quadrangle, 9),
        33 => CellKind::new(Shape::Hexahedron, 27),
        49 => CellKind::new(Shape::Pyramid, 5),
        _ => {
            raw.findings.skip(keyword_name(keyword).as_bytes());
            return Ok(());
        }
    };
    let record = (kind.nodes + 1) * numbers.integer.bytes();
    let count = announced(data, numbers, record, "cells")?;
    raw.count_cells(kind, count);
    Ok(())
}

/// What the text form calls a keyword that is passed over.
fn keyword_name(keyword: i64) -> String {
    let name = match keyword {
        13 => "Corners",
        14 => "Ridges",
        15 => "RequiredVertices",
        16 => "RequiredEdges",
        17 => "RequiredTriangles",
        20 => "NormalAtVertices",
        59 => "Tangents",
        60 => "Normals",
        61 => "TangentAtVertices",
        _ => return format!("keyword {keyword}"),
    };
    name.to_owned()
}

/// A count whose records the data has.
fn announced(
    data: &mut Cursor,
    numbers: Numbers,
    record: usize,
    array: &str,
) -> Result<usize, MeshFileError> {
    let count = numbers.next(data, numbers.integer, "a count")?;
    let there = data.rest().len();
    usize::try_from(count)
        .ok()
        .filter(|count| count.checked_mul(record).is_some_and(|bytes| bytes <= there))
        .ok_or_else(|| {
            let found = format!("{there} bytes to the next keyword");
            data.count_fault(array, &count.to_string(), &found)
        })
}

fn read_vertices(
    data: &mut Cursor,
    numbers: Numbers,
    raw: &mut RawMesh,
) -> Result<(), MeshFileError> {
    let coordinates = 3 * numbers.real.bytes();
    let record = coordinates + numbers.integer.bytes();
    let count = announced(data, numbers, record, "Vertices")?;
    raw.points.reserve(count);
    for bytes in data.take(count * record, "vertices")?.chunks_exact(record) {
        let (point, _reference) = bytes.split_at(coordinates);
        if let [x, y, z] = numbers.real.reals(point, numbers.order)[..] {
            raw.points.push(Point3::new(x, y, z));
        }
    }
    Ok(())
}

/// Nodes and reference; the corners come first.
fn read_tets(
    data: &mut Cursor,
    numbers: Numbers,
    node_count: usize,
    raw: &mut RawMesh,
) -> Result<(), MeshFileError> {
    let record = (node_count + 1) * numbers.integer.bytes();
    let count = announced(data, numbers, record, "Tetrahedra")?;
    let kind = CellKind::new(Shape::Tetrahedron, node_count);
    for bytes in data.take(count * record, "tetrahedra")?.chunks_exact(record) {
        let fields = numbers.integer.integers(bytes, numbers.order);
        if let [nodes @ .., reference] = fields.as_slice() {
            raw.add_cell(kind, nodes, [*reference, 0]);
        }
    }
    Ok(())
}
