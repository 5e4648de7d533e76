//! PLY, text and binary in both byte orders: points from `vertex`, polygons from `face`.

use nalgebra::Point3;

use super::ply_header::{self, Element, Encoding, Property};
use super::raw_surface::RawSurface;
use crate::mesh_io::cursor::Cursor;
use crate::mesh_io::error::MeshFileError;
use crate::mesh_io::scalar::Scalar;

/// Reads points and polygons; other elements and properties are passed over.
pub(super) fn read(mut cursor: Cursor) -> Result<RawSurface, MeshFileError> {
    let (encoding, elements) = ply_header::read(&mut cursor)?;
    let mut raw = RawSurface::default();
    for element in elements {
        match element.name.as_slice() {
            b"vertex" => read_points(&mut cursor, encoding, &element, &mut raw)?,
            b"face" => read_faces(&mut cursor, encoding, &element, &mut raw)?,
            b"tristrips" => return Err(cursor.unsupported("a PLY file of triangle strips")),
            // Without properties there is nothing to pass over, however many rows are announced.
            _ if element.properties.is_empty() => {}
            _ => {
                for _ in 0..element.rows {
                    read_row(&mut cursor, encoding, &element, |_, _| {})?;
                }
            }
        }
    }
    Ok(raw)
}

fn read_points(
    cursor: &mut Cursor,
    encoding: Encoding,
    element: &Element,
    raw: &mut RawSurface,
) -> Result<(), MeshFileError> {
    let place = |wanted: &[u8]| {
        element.properties.iter().position(
            |p| matches!(p, Property::Single { name, .. } if name.eq_ignore_ascii_case(wanted)),
        )
    };
    let (Some(x), Some(y), Some(z)) = (place(b"x"), place(b"y"), place(b"z")) else {
        return Err(cursor.unsupported("a PLY file whose vertices have no x, y and z"));
    };
    for _ in 0..element.rows {
        let mut point = Point3::origin();
        read_row(cursor, encoding, element, |property, values| {
            for (d, wanted) in [x, y, z].into_iter().enumerate() {
                if property == wanted {
                    point[d] = values.first().copied().unwrap_or(f64::NAN);
                }
            }
        })?;
        raw.points.push(point);
    }
    Ok(())
}

fn read_faces(
    cursor: &mut Cursor,
    encoding: Encoding,
    element: &Element,
    raw: &mut RawSurface,
) -> Result<(), MeshFileError> {
    let corners_at = element.properties.iter().position(|p| {
        matches!(p, Property::List { name, .. }
            if name == b"vertex_indices" || name == b"vertex_index")
    });
    let Some(corners_at) = corners_at else {
        return Err(cursor.unsupported("a PLY file whose faces have no vertex_indices"));
    };
    let mut corners = Vec::new();
    for _ in 0..element.rows {
        read_row(cursor, encoding, element, |property, values| {
            if property == corners_at {
                corners.clear();
                corners.extend(values.iter().map(|v| *v as i64));
            }
        })?;
        raw.add_polygon(&corners, cursor)?;
    }
    Ok(())
}

/// Reads one row; `take` gets the place of each property and its numbers.
fn read_row(
    cursor: &mut Cursor,
    encoding: Encoding,
    element: &Element,
    mut take: impl FnMut(usize, &[f64]),
) -> Result<(), MeshFileError> {
    for (place, property) in element.properties.iter().enumerate() {
        let (count, kind) = match property {
            Property::Single { kind, .. } => (1, *kind),
            Property::List { count_kind, kind, .. } => {
                let count = numbers(cursor, encoding, *count_kind, 1)?;
                let count = count.first().copied().unwrap_or(-1.0);
                if !(0.0..=f64::from(u32::MAX)).contains(&count) {
                    return Err(cursor
                        .expected_instead("the length of a list", count.to_string().as_bytes()));
                }
                (count as usize, *kind)
            }
        };
        take(place, &numbers(cursor, encoding, kind, count)?);
    }
    Ok(())
}

fn numbers(
    cursor: &mut Cursor,
    encoding: Encoding,
    kind: Scalar,
    count: usize,
) -> Result<Vec<f64>, MeshFileError> {
    match encoding {
        Encoding::Text => {
            cursor.check_count(count, 2, "numbers of a PLY row")?;
            (0..count).map(|_| cursor.real("a number").map(|v| kind.of_text(v))).collect()
        }
        Encoding::Binary(order) => {
            let bytes = cursor.take(count.saturating_mul(kind.bytes()), "numbers of a PLY row")?;
            Ok(kind.reals(bytes, order))
        }
    }
}
