//! Gmsh MSH 2.x, text and binary: nodes with labels, elements with tags.

use nalgebra::Point3;

use super::cell_kind::{CellKind, Shape, gmsh_cell};
use super::cursor::Cursor;
use super::error::MeshFileError;
use super::msh1::{Header, end_section, read_integers, read_labelled_points};
use super::raw_mesh::RawMesh;
use super::scalar::ByteOrder;

/// Reads the section `$Nodes`.
pub(super) fn read_nodes(
    cursor: &mut Cursor,
    header: Header,
    raw: &mut RawMesh,
) -> Result<(), MeshFileError> {
    match header.binary {
        None => read_labelled_points(cursor, raw)?,
        Some(order) => read_binary_nodes(cursor, order, raw)?,
    }
    end_section(cursor, "$EndNodes")
}

fn read_binary_nodes(
    cursor: &mut Cursor,
    order: ByteOrder,
    raw: &mut RawMesh,
) -> Result<(), MeshFileError> {
    let count = cursor.count("the number of nodes")?;
    cursor.end_of_line()?;
    cursor.check_count(count, 28, "nodes")?;
    raw.points.reserve(count);
    raw.node_labels.reserve(count);
    for _ in 0..count {
        raw.node_labels.push(order.next_i32(cursor, "a node label")?);
        let x = order.next_f64(cursor, "a coordinate")?;
        let y = order.next_f64(cursor, "a coordinate")?;
        let z = order.next_f64(cursor, "a coordinate")?;
        raw.points.push(Point3::new(x, y, z));
    }
    Ok(())
}

/// Reads the section `$Elements`.
pub(super) fn read_elements(
    cursor: &mut Cursor,
    header: Header,
    raw: &mut RawMesh,
) -> Result<(), MeshFileError> {
    let count = cursor.count("the number of elements")?;
    match header.binary {
        None => read_text_elements(cursor, count, raw)?,
        Some(order) => read_binary_elements(cursor, order, count, raw)?,
    }
    end_section(cursor, "$EndElements")
}

fn read_text_elements(
    cursor: &mut Cursor,
    count: usize,
    raw: &mut RawMesh,
) -> Result<(), MeshFileError> {
    cursor.check_count(count, 8, "elements")?;
    let mut fields = Vec::new();
    let mut without_tags = 0_usize;
    for _ in 0..count {
        read_integers(cursor, &mut fields, "an element line: id, type, tags, nodes")?;
        let &[_, number, tag_count, ref rest @ ..] = fields.as_slice() else {
            return Err(cursor.expected("an element line: id, type, number of tags"));
        };
        let tag_count = usize::try_from(tag_count).unwrap_or(usize::MAX);
        let kind = gmsh_cell(number).unwrap_or_else(|| {
            CellKind::new(Shape::Unknown(number), rest.len().saturating_sub(tag_count))
        });
        let (tags, nodes) = match rest.len().checked_sub(kind.nodes) {
            Some(tags) if tags == tag_count => rest.split_at(tags),
            // Some writers announce tags and write none: the nodes are last in any case.
            Some(0) => {
                without_tags += 1;
                (&[][..], rest)
            }
            _ => {
                let expected = kind.nodes.saturating_add(tag_count).to_string();
                let array = format!("tags and nodes of an element of type {number}");
                return Err(cursor.count_fault(&array, &expected, &rest.len().to_string()));
            }
        };
        raw.add_gmsh_cell(kind, nodes, region(tags));
    }
    if without_tags > 0 {
        raw.findings.note(format!("{without_tags} elements announce tags and have none"));
    }
    Ok(())
}

fn read_binary_elements(
    cursor: &mut Cursor,
    order: ByteOrder,
    count: usize,
    raw: &mut RawMesh,
) -> Result<(), MeshFileError> {
    cursor.end_of_line()?;
    let mut done = 0_usize;
    while done < count {
        let number = order.next_i32(cursor, "an element type")?;
        let follow = order.next_i32(cursor, "a number of elements")?;
        let tag_count = order.next_i32(cursor, "a number of tags")?;
        let Some(kind) = gmsh_cell(number) else {
            return Err(cursor.unsupported(&format!("Gmsh element type {number}")));
        };
        let follow = usize::try_from(follow).unwrap_or(usize::MAX);
        if follow == 0 || follow > count - done {
            let expected = format!("1 to {}", count - done);
            return Err(cursor.count_fault("elements of a block", &expected, &follow.to_string()));
        }
        let tag_count = usize::try_from(tag_count).unwrap_or(usize::MAX);
        let record = kind.nodes.saturating_add(1).saturating_add(tag_count).saturating_mul(4);
        cursor.check_count(follow, record, "elements of a block")?;
        let mut fields = Vec::with_capacity(record / 4);
        for _ in 0..follow {
            fields.clear();
            for bytes in cursor.take(record, "an element")?.chunks_exact(4) {
                let bytes = bytes.try_into().expect("chunks of four are four bytes");
                fields.push(i64::from(order.i32(bytes)));
            }
            let (tags, nodes) = fields.get(1..).unwrap_or_default().split_at(tag_count);
            raw.add_gmsh_cell(kind, nodes, region(tags));
        }
        done += follow;
    }
    Ok(())
}

/// Physical group and geometric entity, the first two tags by convention.
fn region(tags: &[i64]) -> [i64; 2] {
    [tags.first().copied().unwrap_or(0), tags.get(1).copied().unwrap_or(0)]
}
