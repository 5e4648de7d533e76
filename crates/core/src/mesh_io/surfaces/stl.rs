//! STL, text and binary: every triangle has three points of its own.

use nalgebra::Point3;

use super::raw_surface::RawSurface;
use crate::mesh_io::cursor::{Cursor, words};
use crate::mesh_io::error::MeshFileError;
use crate::mesh_io::number::parse_real;

/// Bytes before the first triangle, and bytes of one.
const HEADER: usize = 84;
const RECORD: usize = 50;

/// Whether the length is that of as many triangles as a binary file announces.
pub(super) fn is_binary(bytes: &[u8]) -> bool {
    let count = bytes.get(80..HEADER).and_then(|b| b.try_into().ok()).map(u32::from_le_bytes);
    count
        .is_some_and(|count| bytes.len() as u64 == HEADER as u64 + RECORD as u64 * u64::from(count))
}

/// Reads either form.
pub(super) fn read(name: &str, bytes: &[u8]) -> Result<RawSurface, MeshFileError> {
    if is_binary(bytes) { Ok(read_binary(bytes)) } else { read_text(Cursor::new(name, bytes)) }
}

fn read_binary(bytes: &[u8]) -> RawSurface {
    let mut raw = RawSurface::default();
    for record in bytes.get(HEADER..).unwrap_or_default().chunks_exact(RECORD) {
        // The normal in front of the corners is not needed: their order says the same.
        let numbers = record.get(12..48).unwrap_or_default().chunks_exact(4);
        let numbers: Vec<f64> =
            numbers.map(|b| f64::from(f32::from_le_bytes([b[0], b[1], b[2], b[3]]))).collect();
        add_triangle(&mut raw, &numbers);
    }
    raw
}

fn read_text(mut cursor: Cursor) -> Result<RawSurface, MeshFileError> {
    let mut raw = RawSurface::default();
    let mut numbers = Vec::new();
    let mut is_ended = false;
    while let Some(line) = cursor.line() {
        let mut line_words = words(line);
        match line_words.next().unwrap_or_default().to_ascii_lowercase().as_slice() {
            b"vertex" => {
                for _ in 0..3 {
                    let number = line_words.next().and_then(parse_real);
                    numbers.push(number.ok_or_else(|| {
                        cursor.expected_instead("vertex and three numbers", line)
                    })?);
                }
            }
            b"endloop" => {
                if numbers.len() != 9 {
                    let corners = (numbers.len() / 3).to_string();
                    return Err(cursor.count_fault("corners of a facet", "3", &corners));
                }
                add_triangle(&mut raw, &numbers);
                numbers.clear();
            }
            b"endsolid" => is_ended = true,
            _ => {}
        }
    }
    if !numbers.is_empty() {
        return Err(cursor.expected("endloop"));
    }
    if !is_ended {
        raw.notes.push("endsolid is missing: the file may have been cut off".to_owned());
    }
    Ok(raw)
}

fn add_triangle(raw: &mut RawSurface, numbers: &[f64]) {
    // A file of more points than an index can name does not fit in memory as text or records.
    let first = raw.points.len() as u32;
    raw.points.extend(numbers.chunks_exact(3).map(|p| Point3::new(p[0], p[1], p[2])));
    raw.triangles.push([first, first + 1, first + 2]);
}
