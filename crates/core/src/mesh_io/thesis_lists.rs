//! The three lists of thesis Table 3.1 as text; what is written is read back unchanged.

use std::io::Write;

use super::cell_kind::{CellKind, Shape};
use super::cursor::Cursor;
use super::error::MeshFileError;
use super::labels::RegionNumbers;
use super::raw_mesh::RawMesh;
use super::write::WriteError;
use crate::mesh::TetMesh;

/// First words of the file.
pub(super) const MAGIC: &str = "softgrasp-lists";

/// Writes vertices, elements, regions if there are several, and the display list.
///
/// Shapes: `labels` empty or one per region, which is written where all of them are whole numbers,
/// else regions are numbered from 0; `display_list` P × 3 vertex indices from 0, counter-clockwise
/// seen from outside.
/// Units: the mesh's own.
///
/// # Errors
/// [`WriteError::DisplayNode`] when a triangle names a vertex that is not there.
///
/// Source: thesis Table 3.1; section 6.1.3 for what is saved. Format: `docs/files.md`.
pub fn write_thesis_lists_labelled(
    mesh: &TetMesh,
    labels: &[String],
    display_list: &[[u32; 3]],
) -> Result<Vec<u8>, WriteError> {
    let node_count = mesh.node_count();
    for (triangle, nodes) in display_list.iter().enumerate() {
        if let Some(&node) = nodes.iter().find(|&&node| node as usize >= node_count) {
            return Err(WriteError::DisplayNode { triangle, node, node_count });
        }
    }
    let mut out = Vec::new();
    let written = write_lists(&mut out, mesh, labels, display_list);
    written.expect("writing to memory cannot fail");
    Ok(out)
}

/// Mesh as the lists of the thesis (Table 3.1), with regions numbered from 0.
///
/// # Errors
/// As [`write_thesis_lists_labelled`].
pub fn write_thesis_lists(
    mesh: &TetMesh,
    display_list: &[[u32; 3]],
) -> Result<Vec<u8>, WriteError> {
    write_thesis_lists_labelled(mesh, &[], display_list)
}

fn write_lists(
    out: &mut Vec<u8>,
    mesh: &TetMesh,
    labels: &[String],
    display_list: &[[u32; 3]],
) -> std::io::Result<()> {
    writeln!(out, "{MAGIC} 1\n# thesis Table 3.1; indices count from 0")?;
    writeln!(out, "vertices {}", mesh.node_count())?;
    for p in mesh.vertices() {
        // Debug format: the shortest text that gives the same number back.
        writeln!(out, "{:?} {:?} {:?}", p.x, p.y, p.z)?;
    }
    writeln!(out, "elements {}", mesh.tets().len())?;
    for [a, b, c, d] in mesh.tets() {
        writeln!(out, "{a} {b} {c} {d}")?;
    }
    if !mesh.regions().is_empty() {
        writeln!(out, "regions {}", mesh.regions().len())?;
        let numbers = RegionNumbers::new(mesh, labels);
        for &region in mesh.regions() {
            writeln!(out, "{}", numbers.of(region))?;
        }
    }
    writeln!(out, "display {}", display_list.len())?;
    for [a, b, c] in display_list {
        writeln!(out, "{a} {b} {c}")?;
    }
    Ok(())
}

/// Reads the lists. The display list is checked and counted, not kept: the surface is computed
/// from the elements.
///
/// # Errors
/// [`MeshFileError`]: another version, a list that is not as long as announced, or an index that
/// is not there.
pub(super) fn read(mut cursor: Cursor) -> Result<RawMesh, MeshFileError> {
    cursor.word(MAGIC)?;
    let before = cursor.clone();
    if cursor.integer("version 1")? != 1 {
        return Err(before.expected("version 1"));
    }
    let mut raw = RawMesh::default();
    loop {
        let before = cursor.clone();
        let Some(keyword) = cursor.token() else { break };
        match keyword {
            b"vertices" => read_vertices(&mut cursor, &mut raw)?,
            b"elements" => read_elements(&mut cursor, &mut raw)?,
            b"regions" => read_regions(&mut cursor, &mut raw)?,
            b"display" => read_display(&mut cursor, &mut raw)?,
            _ => return Err(before.expected("vertices, elements, regions or display")),
        }
    }
    Ok(raw)
}

fn read_vertices(cursor: &mut Cursor, raw: &mut RawMesh) -> Result<(), MeshFileError> {
    let count = cursor.count("the number of vertices")?;
    cursor.check_count(count, 6, "vertices")?;
    raw.points.reserve(count);
    for _ in 0..count {
        raw.points.push(cursor.point()?);
    }
    Ok(())
}

fn read_elements(cursor: &mut Cursor, raw: &mut RawMesh) -> Result<(), MeshFileError> {
    let count = cursor.count("the number of elements")?;
    cursor.check_count(count, 8, "elements")?;
    raw.tets.reserve(count);
    for _ in 0..count {
        let mut nodes = [0; 4];
        for node in &mut nodes {
            *node = cursor.integer("a vertex index")?;
        }
        raw.tets.push(nodes);
    }
    Ok(())
}

fn read_regions(cursor: &mut Cursor, raw: &mut RawMesh) -> Result<(), MeshFileError> {
    let count = cursor.count("the number of region labels")?;
    if count != raw.tets.len() {
        let expected = format!("{} like elements", raw.tets.len());
        return Err(cursor.count_fault("regions", &expected, &count.to_string()));
    }
    raw.regions.clear();
    for _ in 0..count {
        raw.regions.push([cursor.integer("a region label")?, 0]);
    }
    Ok(())
}

fn read_display(cursor: &mut Cursor, raw: &mut RawMesh) -> Result<(), MeshFileError> {
    let count = cursor.count("the number of display triangles")?;
    cursor.check_count(count, 6, "display")?;
    for triangle in 0..count {
        for _ in 0..3 {
            let label = cursor.integer("a vertex index")?;
            if !usize::try_from(label).is_ok_and(|node| node < raw.points.len()) {
                let expected = format!("below {}", raw.points.len());
                let array = format!("vertex of display triangle {triangle}");
                return Err(cursor.count_fault(&array, &expected, &label.to_string()));
            }
        }
    }
    if count > 0 {
        raw.count_cells(CellKind::new(Shape::Named("display triangles"), 3), count);
    }
    Ok(())
}
