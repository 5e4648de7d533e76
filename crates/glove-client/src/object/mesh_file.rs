//! Mesh files: read with the files beside them, and written in the format that the extension names.

use std::ffi::OsStr;
use std::path::{Component, Path, PathBuf};

use softgrasp_core::fill::FillError;
use softgrasp_core::mesh::{Surface, TetMesh};
use softgrasp_core::mesh_io;
use softgrasp_core::mesh_io::{
    Companion, MeshFile, MeshFileError, PointField, WriteError, write_msh41_labelled,
    write_thesis_lists_labelled, write_vtu_labelled,
};
use softgrasp_core::surface::SurfaceError;

/// Why a mesh file gives no mesh.
#[derive(Debug, thiserror::Error)]
pub enum MeshFileReadError {
    /// The file cannot be read.
    #[error("cannot read {path}: {source}")]
    Read {
        /// Path as it was given.
        path: PathBuf,
        /// Error of the operating system.
        source: std::io::Error,
    },
    /// The content of the file is no usable mesh; the message names the file.
    #[error(transparent)]
    Parse(#[from] MeshFileError),
    /// The surface in the file cannot be filled.
    #[error("{path}: {source}")]
    Fill {
        /// Path as it was given.
        path: PathBuf,
        /// Why the surface cannot be filled.
        source: FillError,
    },
    /// The surface in the file cannot be scaled.
    #[error("{path} cannot be scaled by {scale}: {source}")]
    Scale {
        /// Path as it was given.
        path: PathBuf,
        /// Factor of the scaling.
        scale: f64,
        /// Why the scaled surface is none.
        source: SurfaceError,
    },
}

/// Reads a mesh file of any known format, with the files beside it that it needs.
///
/// # Errors
/// [`MeshFileReadError`] in one line that names file and place.
pub fn read_mesh_file(path: &Path) -> Result<MeshFile, MeshFileReadError> {
    let bytes = read_bytes(path)?;
    let mut companion = |wanted: &Companion| read_companion(path, wanted);
    Ok(mesh_io::parse(&path.display().to_string(), &bytes, &mut companion)?)
}

/// All bytes of a file.
pub(super) fn read_bytes(path: &Path) -> Result<Vec<u8>, MeshFileReadError> {
    std::fs::read(path).map_err(|source| MeshFileReadError::Read { path: path.to_owned(), source })
}

/// Bytes of a file that another one names, from the first path where it exists.
pub(super) fn read_companion(path: &Path, wanted: &Companion) -> Option<Vec<u8>> {
    companion_paths(path, wanted).into_iter().find_map(|path| std::fs::read(path).ok())
}

/// Paths at which a file that another one names is looked for, in this order.
fn companion_paths(path: &Path, wanted: &Companion) -> Vec<PathBuf> {
    match wanted {
        Companion::Extension(extension) => {
            // The other half of `a.node.gz` is `a.ele.gz` or `a.ele`.
            let is_packed = path.extension().is_some_and(|e| e.eq_ignore_ascii_case("gz"));
            let unpacked = if is_packed { path.with_extension("") } else { path.to_owned() };
            let other = unpacked.with_extension(extension);
            let mut packed = other.clone().into_os_string();
            packed.push(".gz");
            vec![other, packed.into()]
        }
        // Only files below the folder of the mesh: a name from inside a file must not reach others.
        Companion::FileName(name) => {
            let name = name.replace('\\', "/");
            let named = Path::new(&name);
            let beside = path.with_file_name(named.file_name().unwrap_or(OsStr::new("")));
            let is_below =
                |part: Component| matches!(part, Component::Normal(_) | Component::CurDir);
            match named.components().all(is_below) {
                true => vec![path.with_file_name(named), beside],
                false => vec![beside],
            }
        }
    }
}

/// Why a mesh cannot be written in the format asked for.
#[derive(Debug, thiserror::Error)]
pub enum EncodeMeshError {
    /// The extension of the file names no format.
    #[error(
        "{path}: the extension names no format to write; use .msh (Gmsh 4.1), .vtu or .txt (the \
         three lists of the thesis)"
    )]
    Extension {
        /// Path as it was given.
        path: PathBuf,
    },
    /// The VTU file cannot be encoded.
    #[error("cannot form the VTU file: {0}")]
    Vtu(#[source] WriteError),
    /// The three lists cannot be encoded.
    #[error(transparent)]
    Lists(#[from] WriteError),
}

/// Encodes a mesh in the format that the file's extension names. Only VTU holds fields; the other formats
/// leave them out.
///
/// Shapes: `labels` empty or one for each region; each field one vector for each node.
///
/// # Errors
/// [`EncodeMeshError`] for another extension, or fields that do not fit the mesh.
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

#[cfg(test)]
mod tests {
    use super::*;

    #[track_caller]
    fn check(path: &str, wanted: &Companion, known: &[&str]) {
        let paths = companion_paths(Path::new(path), wanted);
        assert_eq!(paths, known.iter().map(PathBuf::from).collect::<Vec<_>>());
    }

    #[test]
    fn names_out_of_a_file_reach_no_other_folder_than_those_below() {
        let name = |name: &str| Companion::FileName(name.to_owned());
        check("a/deck.inp", &name("mesh.inp"), &["a/mesh.inp", "a/mesh.inp"]);
        check("a/deck.inp", &name("b\\mesh.inp"), &["a/b/mesh.inp", "a/mesh.inp"]);
        for outside in ["../b/mesh.inp", "/etc/mesh.inp", "b/../../mesh.inp"] {
            check("a/deck.inp", &name(outside), &["a/mesh.inp"]);
        }
        check("a/deck.inp", &name(".."), &["a/"]);
    }

    #[test]
    fn the_other_half_may_be_packed() {
        let ele = Companion::Extension("ele");
        check("a/m.node", &ele, &["a/m.ele", "a/m.ele.gz"]);
        check("a/m.1.node.gz", &ele, &["a/m.1.ele", "a/m.1.ele.gz"]);
    }
}
