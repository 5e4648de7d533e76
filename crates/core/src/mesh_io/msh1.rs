//! Gmsh MSH 1 (`$NOD` with `id x y z`, `$ELM` with `id type physical elementary count nodes…`), and what later
//! versions share with it: the `$MeshFormat` section and the end marks of all sections.

use super::cell_kind::{CellKind, Shape, gmsh_cell};
use super::cursor::{Cursor, words};
use super::error::MeshFileError;
use super::number::parse_integer;
use super::raw_mesh::RawMesh;
use super::scalar::ByteOrder;

/// What `$MeshFormat` says; MSH 1 has no such section.
#[derive(Clone, Copy, Debug)]
pub(super) struct Header {
    /// Version of the format: 2 or 4.
    pub(super) major: i64,
    /// Digits after the point.
    pub(super) minor: i64,
    /// Byte order of binary sections; `None` in a text file.
    pub(super) binary: Option<ByteOrder>,
    /// Size of `size_t` in binary MSH 4, 4 or 8 bytes.
    pub(super) size_bytes: i64,
}

/// Moves past the end mark of a section; a file cut short lacks it.
pub(super) fn end_section(cursor: &mut Cursor, mark: &str) -> Result<(), MeshFileError> {
    cursor.word(mark)
}

/// Reads the section after its name, end mark included.
pub(super) fn read_header(cursor: &mut Cursor) -> Result<Header, MeshFileError> {
    cursor.skip_space();
    let here = cursor.clone();
    let version = cursor.token().and_then(|token| {
        let mut parts = token.splitn(2, |&b| b == b'.');
        let major = parse_integer(parts.next()?)?;
        // Gmsh writes 4 for 4.0.
        Some((major, parts.next().map_or(Some(0), parse_integer)?))
    });
    let Some((major @ (2 | 4), minor)) = version else {
        return Err(here.expected("version 2.x or 4.x"));
    };
    let file_type = cursor.integer("file type 0 (text) or 1 (binary)")?;
    let size_bytes = cursor.integer("the size of a number in bytes")?;
    let mut header = Header { major, minor, binary: None, size_bytes };
    if file_type == 1 {
        if major == 4 && minor == 0 {
            return Err(here.unsupported("binary MSH 4.0"));
        }
        if !matches!((major, size_bytes), (2, 8) | (4, 4 | 8)) {
            return Err(here.unsupported(&format!("binary MSH with numbers of {size_bytes} bytes")));
        }
        cursor.end_of_line()?;
        cursor.set_binary(true);
        let before = cursor.clone();
        header.binary = match cursor.take_array("the number one in binary")? {
            [1, 0, 0, 0] => Some(ByteOrder::Little),
            [0, 0, 0, 1] => Some(ByteOrder::Big),
            _ => return Err(before.expected("the number one in binary")),
        };
    }
    // TetWild and PyMesh put no newline between the binary one and the end mark.
    end_section(cursor, "$EndMeshFormat")?;
    Ok(header)
}

/// Reads the section `$NOD`.
pub(super) fn read_nodes(cursor: &mut Cursor, raw: &mut RawMesh) -> Result<(), MeshFileError> {
    read_labelled_points(cursor, raw)?;
    end_section(cursor, "$ENDNOD")
}

/// A count, then `label x y z` for each node: the same in the text files of MSH 1 and 2.
pub(super) fn read_labelled_points(
    cursor: &mut Cursor,
    raw: &mut RawMesh,
) -> Result<(), MeshFileError> {
    let count = cursor.count("the number of nodes")?;
    cursor.check_count(count, 8, "nodes")?;
    raw.points.reserve(count);
    raw.node_labels.reserve(count);
    for _ in 0..count {
        raw.node_labels.push(cursor.integer("a node label")?);
        raw.points.push(cursor.point()?);
    }
    Ok(())
}

/// Reads the section `$ELM`.
pub(super) fn read_elements(cursor: &mut Cursor, raw: &mut RawMesh) -> Result<(), MeshFileError> {
    let count = cursor.count("the number of elements")?;
    cursor.check_count(count, 10, "elements")?;
    let mut fields = Vec::new();
    for _ in 0..count {
        read_integers(cursor, &mut fields, "an element line: id, type, two regions, count, nodes")?;
        let (number, regions, announced, nodes) = match fields.as_slice() {
            &[_, number, physical, elementary, announced, ref nodes @ ..] => {
                (number, [physical, elementary], announced, nodes)
            }
            _ => return Err(cursor.expected("five numbers and the nodes of an element")),
        };
        if usize::try_from(announced) != Ok(nodes.len()) {
            let found = nodes.len().to_string();
            return Err(cursor.count_fault("nodes of an element", &announced.to_string(), &found));
        }
        let kind = gmsh_cell(number).unwrap_or(CellKind::new(Shape::Unknown(number), nodes.len()));
        if kind.nodes != nodes.len() {
            let (expected, found) = (kind.nodes.to_string(), nodes.len().to_string());
            let array = format!("nodes of an element of type {number}");
            return Err(cursor.count_fault(&array, &expected, &found));
        }
        raw.add_gmsh_cell(kind, nodes, regions);
    }
    end_section(cursor, "$ENDELM")
}

/// The next line as integers, into a buffer that is used again and again.
pub(super) fn read_integers(
    cursor: &mut Cursor,
    fields: &mut Vec<i64>,
    what: &str,
) -> Result<(), MeshFileError> {
    let before = cursor.clone();
    fields.clear();
    let line = cursor.line().unwrap_or_default();
    for word in words(line) {
        match parse_integer(word) {
            Some(value) => fields.push(value),
            None => return Err(cursor.expected_instead(what, line)),
        }
    }
    if fields.is_empty() { Err(before.expected(what)) } else { Ok(()) }
}
