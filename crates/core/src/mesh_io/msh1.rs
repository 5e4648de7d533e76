//! Gmsh MSH 1: `$NOD` with `id x y z`, `$ELM` with `id type physical elementary count nodes…`.

use super::cell_kind::{CellKind, Shape, gmsh_cell};
use super::cursor::{Cursor, words};
use super::error::MeshFileError;
use super::gmsh_header::end_section;
use super::number::parse_integer;
use super::raw_mesh::RawMesh;

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
        raw.add_cell(kind, nodes, regions);
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
