//! VTK legacy files, text and big-endian binary: versions 1 to 4 and 5.1 with its offsets.

use nalgebra::Point3;

use super::cell_kind::vtk_cell;
use super::cursor::Cursor;
use super::error::{Fault, MeshFileError};
use super::raw_mesh::RawMesh;
use super::scalar::{ByteOrder, Scalar};

/// Cells as three arrays: node indices one after another, where each cell ends, and its type.
#[derive(Debug, Default)]
pub(super) struct VtkCells {
    pub(super) connectivity: Vec<i64>,
    /// For each cell, the end of its nodes in `connectivity`.
    pub(super) ends: Vec<i64>,
    pub(super) types: Vec<i64>,
    /// Region label of each cell; empty when there are none.
    pub(super) regions: Vec<i64>,
}

impl VtkCells {
    /// Adds the cells to what was read; `first_node` is the index of the piece's first point.
    ///
    /// # Errors
    /// [`MeshFileError`] when the three arrays do not fit each other.
    pub(super) fn add_to(
        &self,
        raw: &mut RawMesh,
        first_node: usize,
        cursor: &Cursor,
    ) -> Result<(), MeshFileError> {
        if self.types.len() != self.ends.len() {
            let (expected, found) = (self.ends.len(), self.types.len());
            return Err(cursor.count_fault(
                "cell types",
                &expected.to_string(),
                &found.to_string(),
            ));
        }
        let mut start = 0_usize;
        let mut shifted = Vec::new();
        for (cell, (&end, &number)) in self.ends.iter().zip(&self.types).enumerate() {
            let end = usize::try_from(end).unwrap_or(usize::MAX);
            let Some(nodes) = self.connectivity.get(start..end) else {
                let expected = format!("{start} to {}", self.connectivity.len());
                let array = format!("offset of cell {cell} in connectivity");
                return Err(cursor.count_fault(&array, &expected, &end.to_string()));
            };
            start = end;
            let kind = vtk_cell(number, nodes.len());
            if number == 10 && nodes.len() != 4 {
                let array = format!("nodes of tetrahedron in cell {cell}");
                return Err(cursor.count_fault(&array, "4", &nodes.len().to_string()));
            }
            shifted.clear();
            shifted.extend(nodes.iter().map(|node| node.saturating_add(first_node as i64)));
            let region = self.regions.get(cell).copied().unwrap_or(0);
            raw.add_cell(kind, &shifted, [region, 0]);
        }
        if start != self.connectivity.len() {
            let found = self.connectivity.len().to_string();
            return Err(cursor.count_fault("connectivity", &start.to_string(), &found));
        }
        Ok(())
    }
}

/// Text or binary, for one file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Encoding {
    Text,
    Binary,
}

/// Reads a VTK legacy file; data on points and cells is not looked into.
///
/// # Errors
/// [`MeshFileError`]: not an unstructured grid, or the arrays are not as announced.
///
/// Source: VTK user's guide, section "Simple legacy formats".
pub(super) fn read(mut cursor: Cursor) -> Result<RawMesh, MeshFileError> {
    let encoding = read_header(&mut cursor)?;
    cursor.set_binary(encoding == Encoding::Binary);
    let mut raw = RawMesh::default();
    let mut cells = VtkCells::default();
    loop {
        let before = cursor.clone();
        let Some(keyword) = cursor.token() else { break };
        match keyword.to_ascii_uppercase().as_slice() {
            b"POINTS" => read_points(&mut cursor, encoding, &mut raw)?,
            b"CELLS" => read_cells(&mut cursor, encoding, &mut cells)?,
            b"CELL_TYPES" => {
                let count = cursor.count("the number of cell types")?;
                cells.types = integers(&mut cursor, encoding, Scalar::I32, count, "cell types")?;
            }
            b"FIELD" => skip_field(&mut cursor, encoding)?,
            b"METADATA" => skip_metadata(&mut cursor)?,
            // Data on points and cells comes after the grid; its size would have to be guessed.
            b"POINT_DATA" | b"CELL_DATA" => {
                raw.findings.skip(keyword);
                break;
            }
            _ => return Err(before.expected("POINTS, CELLS, CELL_TYPES, FIELD or data")),
        }
    }
    cells.add_to(&mut raw, 0, &cursor)?;
    Ok(raw)
}

/// The four header lines, up to the kind of data set.
fn read_header(cursor: &mut Cursor) -> Result<Encoding, MeshFileError> {
    cursor.skip_space();
    cursor.rest_of_line();
    cursor.end_of_line()?;
    // The title may be empty, and may begin with a word that means something elsewhere.
    cursor.rest_of_line();
    cursor.end_of_line()?;
    let before = cursor.clone();
    let encoding = match cursor.token().unwrap_or_default().to_ascii_uppercase().as_slice() {
        b"ASCII" => Encoding::Text,
        b"BINARY" => Encoding::Binary,
        _ => return Err(before.expected("ASCII or BINARY")),
    };
    if cursor.peek().is_some_and(|word| word.eq_ignore_ascii_case(b"FIELD")) {
        cursor.token();
        skip_field(cursor, encoding)?;
        if cursor.peek() == Some(b"METADATA") {
            skip_metadata(cursor)?;
        }
    }
    let before = cursor.clone();
    if !cursor.token().is_some_and(|word| word.eq_ignore_ascii_case(b"DATASET")) {
        return Err(before.expected("DATASET"));
    }
    match cursor.token().unwrap_or_default() {
        kind if kind.eq_ignore_ascii_case(b"UNSTRUCTURED_GRID") => Ok(encoding),
        kind if kind.eq_ignore_ascii_case(b"POLYDATA") => {
            let found = "a POLYDATA surface".to_owned();
            Err(cursor.fault(Fault::NoTetrahedra { found }))
        }
        kind if kind.starts_with(b"STRUCTURED") || kind.starts_with(b"RECTILINEAR") => {
            let found = format!("a {} data set", kind.escape_ascii());
            Err(cursor.fault(Fault::NoTetrahedra { found }))
        }
        kind => Err(cursor.expected_instead("UNSTRUCTURED_GRID", kind)),
    }
}

fn read_points(
    cursor: &mut Cursor,
    encoding: Encoding,
    raw: &mut RawMesh,
) -> Result<(), MeshFileError> {
    let count = cursor.count("the number of points")?;
    let scalar = read_type(cursor)?;
    let values = reals(cursor, encoding, scalar, count.saturating_mul(3), "POINTS")?;
    raw.points = values.chunks_exact(3).map(|p| Point3::new(p[0], p[1], p[2])).collect();
    Ok(())
}

fn read_cells(
    cursor: &mut Cursor,
    encoding: Encoding,
    cells: &mut VtkCells,
) -> Result<(), MeshFileError> {
    let first = cursor.count("the number of cells")?;
    let second = cursor.count("the size of the cell list")?;
    if cursor.peek() == Some(b"OFFSETS") {
        return read_offset_cells(cursor, encoding, first, second, cells);
    }
    let list = integers(cursor, encoding, Scalar::I32, second, "CELLS")?;
    let mut rest = list.as_slice();
    for cell in 0..first {
        let nodes = rest.split_first().and_then(|(&count, after)| {
            let count = usize::try_from(count).ok()?;
            Some((after.get(..count)?, after.get(count..)?))
        });
        let Some((nodes, after)) = nodes else {
            let (expected, found) = (format!("{first} cells"), format!("{cell} complete cells"));
            return Err(cursor.count_fault("CELLS", &expected, &found));
        };
        cells.connectivity.extend_from_slice(nodes);
        cells.ends.push(cells.connectivity.len() as i64);
        rest = after;
    }
    if !rest.is_empty() {
        let found = format!("{} numbers more than {first} cells have", rest.len());
        return Err(cursor.count_fault("CELLS", &second.to_string(), &found));
    }
    Ok(())
}

/// Version 5.1: one offset more than cells, then the nodes of all cells.
fn read_offset_cells(
    cursor: &mut Cursor,
    encoding: Encoding,
    offset_count: usize,
    node_count: usize,
    cells: &mut VtkCells,
) -> Result<(), MeshFileError> {
    cursor.word("OFFSETS")?;
    let scalar = read_type(cursor)?;
    let offsets = integers(cursor, encoding, scalar, offset_count, "OFFSETS")?;
    cursor.word("CONNECTIVITY")?;
    let scalar = read_type(cursor)?;
    cells.connectivity = integers(cursor, encoding, scalar, node_count, "CONNECTIVITY")?;
    match offsets.split_first() {
        Some((0, ends)) => cells.ends = ends.to_vec(),
        None => {}
        Some((first, _)) => {
            return Err(cursor.count_fault("first of OFFSETS", "0", &first.to_string()));
        }
    }
    Ok(())
}

/// `FIELD name count`, then arrays `name components tuples type` with their numbers.
fn skip_field(cursor: &mut Cursor, encoding: Encoding) -> Result<(), MeshFileError> {
    cursor.token();
    let arrays = cursor.count("the number of field arrays")?;
    for _ in 0..arrays {
        if cursor.peek() == Some(b"METADATA") {
            cursor.token();
            skip_metadata(cursor)?;
        }
        if cursor.token().is_none() {
            return Err(cursor.expected("a field array"));
        }
        let components = cursor.count("the number of components")?;
        let tuples = cursor.count("the number of tuples")?;
        let count = components.saturating_mul(tuples);
        if cursor.peek() == Some(b"string") {
            if encoding == Encoding::Binary {
                return Err(cursor.unsupported("a binary field of strings"));
            }
            cursor.token();
            cursor.check_count(count, 1, "field strings")?;
            (0..count).for_each(|_| {
                cursor.line();
            });
            continue;
        }
        let scalar = read_type(cursor)?;
        reals(cursor, encoding, scalar, count, "field values")?;
    }
    Ok(())
}

/// Lines up to the first empty one.
fn skip_metadata(cursor: &mut Cursor) -> Result<(), MeshFileError> {
    loop {
        cursor.rest_of_line();
        if cursor.rest().is_empty() {
            return Ok(());
        }
        cursor.end_of_line()?;
        if matches!(cursor.rest(), [b'\n', ..] | [b'\r', b'\n', ..]) {
            return Ok(());
        }
    }
}

fn read_type(cursor: &mut Cursor) -> Result<Scalar, MeshFileError> {
    let before = cursor.clone();
    let name = cursor.token().unwrap_or_default();
    Scalar::from_legacy(name).ok_or_else(|| before.expected("a number type such as float"))
}

/// `count` numbers as floating point, after their announcement has ended.
fn reals(
    cursor: &mut Cursor,
    encoding: Encoding,
    scalar: Scalar,
    count: usize,
    array: &str,
) -> Result<Vec<f64>, MeshFileError> {
    if encoding == Encoding::Binary {
        return Ok(scalar.reals(binary(cursor, scalar, count, array)?, ByteOrder::Big));
    }
    cursor.check_count(count, 2, array)?;
    let what = format!("the next number of {array}");
    (0..count).map(|_| Ok(scalar.of_text(cursor.real(&what)?))).collect()
}

/// `count` numbers as integers, after their announcement has ended.
fn integers(
    cursor: &mut Cursor,
    encoding: Encoding,
    scalar: Scalar,
    count: usize,
    array: &str,
) -> Result<Vec<i64>, MeshFileError> {
    if encoding == Encoding::Binary {
        return Ok(scalar.integers(binary(cursor, scalar, count, array)?, ByteOrder::Big));
    }
    cursor.check_count(count, 2, array)?;
    let what = format!("the next integer of {array}");
    (0..count).map(|_| cursor.integer(&what)).collect()
}

fn binary<'a>(
    cursor: &mut Cursor<'a>,
    scalar: Scalar,
    count: usize,
    array: &str,
) -> Result<&'a [u8], MeshFileError> {
    cursor.end_of_line()?;
    cursor.take(count.saturating_mul(scalar.bytes()), array)
}
