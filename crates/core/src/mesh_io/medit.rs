//! MEDIT files: `.mesh`, and binary `.meshb` with keywords by number, each with the place of the next one.

use nalgebra::Point3;

use super::cell_kind::{CellKind, Shape};
use super::cursor::Cursor;
use super::error::{Fault, MeshFileError};
use super::number::parse_integer;
use super::raw_mesh::RawMesh;
use super::scalar::{ByteOrder, Scalar};

/// Reads a MEDIT file.
///
/// # Errors
/// [`MeshFileError`]: the file ends too early, or something else stands where a number should be.
///
/// Source: P. Frey, "MEDIT: an interactive mesh visualization software", INRIA RT-0253, 2001.
pub(super) fn read(mut cursor: Cursor) -> Result<RawMesh, MeshFileError> {
    let mut raw = RawMesh { first_label: 1, ..RawMesh::default() };
    let mut dimension = 3;
    loop {
        let before = cursor.clone();
        let Some(keyword) = cursor.token() else { break };
        match keyword.to_ascii_lowercase().as_slice() {
            b"meshversionformatted" => {
                cursor.integer("the version")?;
            }
            b"dimension" => dimension = cursor.integer("the dimension")?,
            b"vertices" if dimension == 3 => read_vertices(&mut cursor, &mut raw)?,
            b"vertices" => {
                let found = format!("a mesh of dimension {dimension}");
                return Err(cursor.fault(Fault::NoTetrahedra { found }));
            }
            b"tetrahedra" => read_tets(&mut cursor, 4, &mut raw)?,
            b"tetrahedrap2" => read_tets(&mut cursor, 10, &mut raw)?,
            b"end" => break,
            [b'a'..=b'z', ..] => skip_keyword(&mut cursor, keyword, &mut raw),
            _ => return Err(before.expected("a keyword such as Vertices or Tetrahedra")),
        }
    }
    Ok(raw)
}

fn read_vertices(cursor: &mut Cursor, raw: &mut RawMesh) -> Result<(), MeshFileError> {
    let count = cursor.count("the number of vertices")?;
    cursor.check_count(count, 8, "Vertices")?;
    raw.points.reserve(count);
    for _ in 0..count {
        let point = cursor.point()?;
        // References are whole, but some writers print them as real numbers.
        cursor.real("the reference of a vertex")?;
        raw.points.push(point);
    }
    Ok(())
}

fn read_tets(
    cursor: &mut Cursor,
    node_count: usize,
    raw: &mut RawMesh,
) -> Result<(), MeshFileError> {
    let count = cursor.count("the number of tetrahedra")?;
    cursor.check_count(count, 10, "Tetrahedra")?;
    raw.tets.reserve(count);
    raw.regions.reserve(count);
    let kind = CellKind::new(Shape::Tetrahedron, node_count);
    let mut nodes = Vec::with_capacity(node_count);
    for _ in 0..count {
        nodes.clear();
        for _ in 0..node_count {
            nodes.push(cursor.integer("a vertex of a tetrahedron")?);
        }
        let reference = cursor.integer("the reference of a tetrahedron")?;
        raw.add_cell(kind, &nodes, [reference, 0]);
    }
    Ok(())
}

/// Moves past the numbers of a keyword; the first is a count, which is kept for cells.
fn skip_keyword(cursor: &mut Cursor, keyword: &[u8], raw: &mut RawMesh) {
    let kind = match keyword.to_ascii_lowercase().as_slice() {
        b"edges" => Some(CellKind::new(Shape::Line, 2)),
        b"triangles" => Some(CellKind::new(Shape::Triangle, 3)),
        b"quadrilaterals" => Some(CellKind::new(Shape::Quadrangle, 4)),
        b"hexahedra" | b"hexaedra" => Some(CellKind::new(Shape::Hexahedron, 8)),
        b"prisms" | b"pentahedra" => Some(CellKind::new(Shape::Prism, 6)),
        b"pyramids" => Some(CellKind::new(Shape::Pyramid, 5)),
        b"edgesp2" => Some(CellKind::new(Shape::Line, 3)),
        b"trianglesp2" => Some(CellKind::new(Shape::Triangle, 6)),
        _ => None,
    };
    let mut first = None;
    let mut numbers = 0_usize;
    let starts_keyword = |token: &[u8]| token.first().is_some_and(u8::is_ascii_alphabetic);
    while let Some(token) = cursor.peek().filter(|token| !starts_keyword(token)) {
        first = first.or_else(|| parse_integer(token));
        numbers += 1;
        cursor.token();
    }
    match (kind, first.and_then(|count| usize::try_from(count).ok())) {
        (Some(_), Some(0)) => {}
        // The cells are not read, so that their count is believed up to the numbers there are.
        (Some(kind), Some(count)) => raw.count_cells(kind, count.min(numbers)),
        _ => raw.findings.skip(keyword),
    }
}

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
    fn read_binary(cursor: &mut Cursor) -> Result<Self, MeshFileError> {
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
pub(super) fn read_binary(mut cursor: Cursor) -> Result<RawMesh, MeshFileError> {
    const END: i64 = 54;
    cursor.set_binary(true);
    let length = cursor.rest().len();
    let numbers = Numbers::read_binary(&mut cursor)?;
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
        4 => return read_binary_vertices(data, numbers, raw),
        8 => return read_binary_tets(data, numbers, 4, raw),
        30 => return read_binary_tets(data, numbers, 10, raw),
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

fn read_binary_vertices(
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
fn read_binary_tets(
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
