//! Wavefront OBJ: lines `v x y z` and `f a/b/c …`; all else is passed over.

use nalgebra::Point3;

use super::raw_surface::RawSurface;
use crate::mesh_io::cursor::{Cursor, words};
use crate::mesh_io::error::MeshFileError;
use crate::mesh_io::number::{parse_integer, parse_real};

/// Reads points and faces of all groups and objects.
pub(super) fn read(mut cursor: Cursor) -> Result<RawSurface, MeshFileError> {
    let mut raw = RawSurface::default();
    let mut corners = Vec::new();
    while let Some(line) = cursor.line() {
        let mut line_words = words(line);
        match line_words.next().unwrap_or_default() {
            b"v" => {
                let mut coordinates = [0.0; 3];
                for coordinate in &mut coordinates {
                    *coordinate = line_words
                        .next()
                        .and_then(parse_real)
                        .ok_or_else(|| cursor.expected_instead("v and three numbers", line))?;
                }
                raw.points.push(Point3::from(coordinates));
            }
            b"f" => {
                corners.clear();
                for word in line_words {
                    corners.push(corner(word, raw.points.len()).ok_or_else(|| {
                        cursor.expected_instead("f and numbers of points, none of them 0", line)
                    })?);
                }
                raw.add_polygon(&corners, &cursor)?;
            }
            _ => {}
        }
    }
    Ok(raw)
}

/// Index from 0 of the point of a face's corner `a/b/c`; negative numbers count back from the
/// newest point.
fn corner(word: &[u8], points: usize) -> Option<i64> {
    let number = parse_integer(word.split(|b| *b == b'/').next()?)?;
    match number {
        0 => None,
        n if n > 0 => Some(n - 1),
        n => i64::try_from(points).ok()?.checked_add(n),
    }
}
