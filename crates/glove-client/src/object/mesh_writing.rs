//! A mesh as the bytes of a file, in the format that the file's extension names.

use std::path::{Path, PathBuf};

use softgrasp_core::mesh::{Surface, TetMesh};
use softgrasp_core::mesh_io::{
    PointField, WriteError, write_msh41_labelled, write_thesis_lists_labelled, write_vtu_labelled,
};

/// A mesh that cannot be written in the format asked for.
#[derive(Debug, thiserror::Error)]
pub enum EncodeMeshError {
    /// The extension names no format.
    #[error(
        "{path}: the extension names no format to write; use .msh (Gmsh 4.1), .vtu or .txt (the \
         three lists of the thesis)"
    )]
    Extension {
        /// As given.
        path: PathBuf,
    },
    /// The VTU file.
    #[error("cannot form the VTU file: {0}")]
    Vtu(#[source] WriteError),
    /// The three lists.
    #[error(transparent)]
    Lists(#[from] WriteError),
}

/// A mesh in the format that the file's extension names. Only VTU holds fields; the other formats
/// leave them out.
///
/// Shapes: `labels` empty or one per region; each field one vector per node.
///
/// # Errors
/// [`EncodeMeshError`].
pub fn encode_mesh(
    path: &Path,
    mesh: &TetMesh,
    labels: &[String],
    surface: &Surface,
    fields: &[PointField],
) -> Result<Vec<u8>, EncodeMeshError> {
    match path.extension().and_then(|e| e.to_str()) {
        Some("msh") => Ok(write_msh41_labelled(mesh, labels)),
        Some("vtu") => write_vtu_labelled(mesh, labels, fields).map_err(EncodeMeshError::Vtu),
        Some("txt") => Ok(write_thesis_lists_labelled(mesh, labels, &surface.triangles)?),
        _ => Err(EncodeMeshError::Extension { path: path.to_owned() }),
    }
}
