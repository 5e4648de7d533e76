//! MEDIT text `.mesh`: keywords with counts, comments after `#`.

use super::cell_kind::{CellKind, Shape};
use super::cursor::Cursor;
use super::error::{Fault, MeshFileError};
use super::number::parse_integer;
use super::raw_mesh::RawMesh;

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
