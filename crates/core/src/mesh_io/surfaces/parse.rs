//! Reads a surface from the bytes of a file: recognises the format, reads, checks.

use std::fmt;

use super::{gltf, obj, off, ply, stl};
use crate::mesh_io::cursor::Cursor;
use crate::mesh_io::encoding::{Unpacker, is_gzip};
use crate::mesh_io::error::{Fault, MeshFileError};
use crate::mesh_io::sniff::{Sniffed, sniff_unpacked, without_mark};
use crate::mesh_io::{Companion, Foreign};
use crate::surface::TriangleSurface;

/// A format of surfaces that is read.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum SurfaceFormat {
    /// STL, text or binary.
    Stl,
    /// Wavefront OBJ.
    Obj,
    /// PLY, text or binary.
    Ply,
    /// OFF, text.
    Off,
    /// glTF 2.0, `.gltf` or `.glb`.
    Gltf,
}

impl fmt::Display for SurfaceFormat {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Stl => "STL",
            Self::Obj => "Wavefront OBJ",
            Self::Ply => "PLY",
            Self::Off => "OFF",
            Self::Gltf => "glTF",
        })
    }
}

/// A surface as its file has it.
#[derive(Clone, Debug)]
pub struct SurfaceFile {
    /// Points and triangles, not mended.
    pub surface: TriangleSurface,
    /// How it was written.
    pub format: SurfaceFormat,
    /// Sentences for the user.
    pub notes: Vec<String>,
}

/// Format of the bytes, or of what gzip packed in them, if it is one of a surface.
pub fn surface_format(bytes: &[u8]) -> Option<SurfaceFormat> {
    if is_gzip(bytes) {
        return unpacked_format(&Unpacker::default().unpack("", bytes).ok()?);
    }
    unpacked_format(bytes)
}

fn unpacked_format(bytes: &[u8]) -> Option<SurfaceFormat> {
    match sniff_unpacked(bytes)? {
        Sniffed::Foreign(Foreign::Stl) => Some(SurfaceFormat::Stl),
        Sniffed::Foreign(Foreign::Obj) => Some(SurfaceFormat::Obj),
        Sniffed::Foreign(Foreign::Ply) => Some(SurfaceFormat::Ply),
        Sniffed::Foreign(Foreign::Off) => Some(SurfaceFormat::Off),
        Sniffed::Foreign(Foreign::Gltf) => Some(SurfaceFormat::Gltf),
        _ => None,
    }
}

/// Reads a surface file of any format known here.
///
/// `name` is for errors only; the format is found by content, and gzip is unpacked. `companion` is
/// asked for the buffers that a `.gltf` file has beside it.
///
/// # Errors
/// [`MeshFileError`]: one line that names the file, the place, what was expected and what was
/// found. Bytes from outside never make this panic or allocate by an announced count.
pub fn parse_surface(
    name: &str,
    bytes: &[u8],
    companion: &mut dyn FnMut(&Companion) -> Option<Vec<u8>>,
) -> Result<SurfaceFile, MeshFileError> {
    let refuse = |fault| MeshFileError { file: name.to_owned(), fault };
    let unpacked;
    let bytes = match is_gzip(bytes) {
        true => {
            unpacked = Unpacker::default().unpack(name, bytes)?;
            unpacked.as_slice()
        }
        false => bytes,
    };
    let bytes = without_mark(bytes);
    let Some(format) = unpacked_format(bytes) else {
        return Err(refuse(Fault::NoSurface));
    };
    let commented = Cursor::with_comments(name, bytes, b'#');
    let mut raw = match format {
        SurfaceFormat::Stl => stl::read(name, bytes)?,
        SurfaceFormat::Obj => obj::read(commented)?,
        SurfaceFormat::Ply => ply::read(Cursor::new(name, bytes))?,
        SurfaceFormat::Off => off::read(commented)?,
        SurfaceFormat::Gltf => gltf::read(name, bytes, companion)?,
    };
    if raw.polygons > 0 {
        raw.notes.push(format!("{} polygons were cut into fans of triangles", raw.polygons));
    }
    let surface = TriangleSurface::try_new(raw.points, raw.triangles)
        .map_err(|fault| refuse(Fault::Surface(fault)))?;
    Ok(SurfaceFile { surface, format, notes: raw.notes })
}
