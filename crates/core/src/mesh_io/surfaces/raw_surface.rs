//! Points and triangles while a surface file is read.

use nalgebra::Point3;

use crate::mesh_io::cursor::Cursor;
use crate::mesh_io::error::MeshFileError;

/// What was read so far; triangles may name points that come later in the file.
#[derive(Clone, Debug, Default)]
pub(super) struct RawSurface {
    pub(super) points: Vec<Point3<f64>>,
    pub(super) triangles: Vec<[u32; 3]>,
    /// Polygons with more than three corners, cut into fans.
    pub(super) polygons: usize,
    /// Sentences for the user.
    pub(super) notes: Vec<String>,
}

impl RawSurface {
    /// Adds a polygon as a fan of triangles around its first corner.
    ///
    /// # Errors
    /// A corner below 0 or too large for an index. Those behind the last point are found at the end.
    pub(super) fn add_polygon(
        &mut self,
        corners: &[i64],
        cursor: &Cursor,
    ) -> Result<(), MeshFileError> {
        let index = |n: &i64| {
            u32::try_from(*n).map_err(|_| {
                cursor.expected_instead("the number of a point", n.to_string().as_bytes())
            })
        };
        let corners = corners.iter().map(index).collect::<Result<Vec<u32>, _>>()?;
        let [first, rest @ ..] = corners.as_slice() else { return Ok(()) };
        self.polygons += usize::from(corners.len() > 3);
        self.triangles.extend(rest.windows(2).map(|pair| [*first, pair[0], pair[1]]));
        Ok(())
    }
}
