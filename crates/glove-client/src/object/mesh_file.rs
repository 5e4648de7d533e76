//! Reads a mesh file, and the files beside it that belong to it, from disk.

use std::ffi::OsStr;
use std::path::{Path, PathBuf};

use softgrasp_core::fill::FillError;
use softgrasp_core::mesh_io::{self, Companion, MeshFile, MeshFileError};
use softgrasp_core::surface::SurfaceError;

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
    /// Its surface cannot be filled.
    #[error("{path}: {source}")]
    Fill {
        /// As given.
        path: PathBuf,
        /// Why not.
        source: FillError,
    },
    /// Its surface cannot be scaled.
    #[error("{path} cannot be scaled by {scale}: {source}")]
    Scale {
        /// As given.
        path: PathBuf,
        /// The factor.
        scale: f64,
        /// What broke.
        source: SurfaceError,
    },
}

/// Reads a mesh file of any known format, with the files beside it that it needs.
///
/// # Errors
/// [`MeshFileReadError`] in one line that names file and place.
pub fn read_mesh_file(path: &Path) -> Result<MeshFile, MeshFileReadError> {
    let bytes = read_bytes(path)?;
    let mut companion = |wanted: &Companion| std::fs::read(companion_path(path, wanted)).ok();
    Ok(mesh_io::parse(&path.display().to_string(), &bytes, &mut companion)?)
}

/// All bytes of a file.
pub(super) fn read_bytes(path: &Path) -> Result<Vec<u8>, MeshFileReadError> {
    std::fs::read(path).map_err(|source| MeshFileReadError::Read { path: path.to_owned(), source })
}

/// Where a file that another one names is looked for.
pub(super) fn companion_path(path: &Path, wanted: &Companion) -> PathBuf {
    match wanted {
        Companion::Extension(extension) => path.with_extension(extension),
        // Only files beside the mesh: a name from inside a file must not reach other folders.
        Companion::FileName(name) => {
            path.with_file_name(Path::new(name).file_name().unwrap_or(OsStr::new("")))
        }
    }
}
