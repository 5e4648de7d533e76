//! `.tet`: lines `v x y z` and `t a b c d`, indices from 0 (Isaac Gym, FleX).

use nalgebra::Point3;

use super::cell_kind::{CellKind, Shape};
use super::cursor::{Cursor, words};
use super::error::MeshFileError;
use super::number::{parse_integer, parse_real};
use super::raw_mesh::RawMesh;

/// Reads a `.tet` file; `l` lines (links) are counted.
///
/// # Errors
/// [`MeshFileError`]: a line is none of these.
pub(super) fn read(mut cursor: Cursor) -> Result<RawMesh, MeshFileError> {
    let mut raw = RawMesh::default();
    while let Some(line) = cursor.line() {
        let mut fields = words(line);
        match fields.next() {
            Some(b"v") => {
                let mut real = || fields.next().and_then(parse_real);
                let (Some(x), Some(y), Some(z)) = (real(), real(), real()) else {
                    return Err(cursor.expected_instead("v x y z", line));
                };
                raw.points.push(Point3::new(x, y, z));
            }
            Some(b"t") => {
                let mut node = || fields.next().and_then(parse_integer);
                let (Some(a), Some(b), Some(c), Some(d)) = (node(), node(), node(), node()) else {
                    return Err(cursor.expected_instead("t a b c d", line));
                };
                raw.tets.push([a, b, c, d]);
                raw.regions.push([0, 0]);
            }
            Some(b"l") => raw.count_cells(CellKind::new(Shape::Named("links"), 2), 1),
            _ => return Err(cursor.expected_instead("a line v, t or l", line)),
        }
    }
    Ok(raw)
}
