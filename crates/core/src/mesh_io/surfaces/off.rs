//! OFF: counts, then points, then polygons; colours and normals behind them are passed over.

use nalgebra::Point3;

use super::raw_surface::RawSurface;
use crate::mesh_io::cursor::{Cursor, words};
use crate::mesh_io::error::MeshFileError;
use crate::mesh_io::number::{parse_integer, parse_real};

/// Reads the text form.
pub(super) fn read(mut cursor: Cursor) -> Result<RawSurface, MeshFileError> {
    let mut raw = RawSurface::default();
    cursor.token();
    if cursor.peek() == Some(b"BINARY") {
        return Err(cursor.unsupported("binary OFF"));
    }
    let points = cursor.count("the number of points")?;
    let faces = cursor.count("the number of faces")?;
    cursor.rest_of_line();
    cursor.check_count(points, 6, "points")?;
    for _ in 0..points {
        let line = cursor.line().unwrap_or_default();
        let mut numbers = words(line).map_while(parse_real);
        let (Some(x), Some(y), Some(z)) = (numbers.next(), numbers.next(), numbers.next()) else {
            return Err(cursor.expected_instead("three numbers of a point", line));
        };
        raw.points.push(Point3::new(x, y, z));
    }
    cursor.check_count(faces, 2, "faces")?;
    for _ in 0..faces {
        let line = cursor.line().unwrap_or_default();
        let mut numbers = words(line).map_while(parse_integer);
        let count = numbers.next().and_then(|n| usize::try_from(n).ok());
        let corners: Vec<i64> = numbers.take(count.unwrap_or(0)).collect();
        if count != Some(corners.len()) {
            return Err(cursor.expected_instead("a number of corners and as many points", line));
        }
        raw.add_polygon(&corners, &cursor)?;
    }
    Ok(raw)
}
