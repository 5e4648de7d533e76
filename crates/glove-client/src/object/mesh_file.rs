//! Reads a mesh file, and the files beside it that belong to it, from disk.

use std::ffi::OsStr;
use std::path::{Path, PathBuf};

use softgrasp_core::mesh_io::{self, Companion, MeshFile, MeshFileError};

/// Why a mesh file gives no mesh.
#[derive(Debug, thiserror::Error)]
pub enum MeshFileReadError {
    /// The system does not let the file be read.
    #[error("cannot read {path}: {source}")]
    Read {
        /// As given.
        path: PathBuf,
        /// The system's reason.
        source: std::io::Error,
    },
    /// Its content is no usable mesh; the message names the file.
    #[error(transparent)]
    Parse(#[from] MeshFileError),
}

/// Reads a mesh file of any known format, with the files beside it that it needs.
///
/// # Errors
/// [`MeshFileReadError`] in one line that names file and place.
pub fn read_mesh_file(path: &Path) -> Result<MeshFile, MeshFileReadError> {
    let read_error = |source| MeshFileReadError::Read { path: path.to_owned(), source };
    let bytes = std::fs::read(path).map_err(read_error)?;
    let mut companion = |wanted: &Companion| std::fs::read(companion_path(path, wanted)).ok();
    Ok(mesh_io::parse(&path.display().to_string(), &bytes, &mut companion)?)
}

fn companion_path(path: &Path, wanted: &Companion) -> PathBuf {
    match wanted {
        Companion::Extension(extension) => path.with_extension(extension),
        // Only files beside the mesh: a name from inside a file must not reach other folders.
        Companion::FileName(name) => {
            path.with_file_name(Path::new(name).file_name().unwrap_or(OsStr::new("")))
        }
    }
}
