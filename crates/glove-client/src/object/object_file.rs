//! Object files: a mesh is read, a surface is filled with tetrahedra.

use std::path::Path;

use nalgebra::Vector3;
use softgrasp_core::fill::{FillTarget, Filled, fill};
use softgrasp_core::mesh_io::{
    MeshFile, SurfaceFile, SurfaceFormat, parse_surface, surface_format,
};
use softgrasp_core::surface::TriangleSurface;

use crate::object::mesh_file::{MeshFileReadError, read_bytes, read_companion, read_mesh_file};

/// Content of an object's file.
#[derive(Debug)]
pub enum ObjectFile {
    /// Mesh of tetrahedra, as read.
    Mesh(Box<MeshFile>),
    /// Surface, filled with tetrahedra.
    Surface(Box<FilledSurface>),
}

/// Surface, and the tetrahedra that fill it.
#[derive(Debug)]
pub struct FilledSurface {
    /// Format of the surface file.
    pub format: SurfaceFormat,
    /// Extent of the surface along each axis, m.
    pub extent: Vector3<f64>,
    /// Mesh that fills the surface, and its distance from it, m.
    pub filled: Filled,
    /// Remarks about the file, in sentences.
    pub notes: Vec<String>,
}

/// Extent above which an object is hardly meant for the hand, m.
const LARGE_M: f64 = 2.0;
/// Extent below which an object is hardly meant for the hand, m.
const SMALL_M: f64 = 0.002;

/// Reads a mesh, or fills a surface with about `nodes` nodes; the format is found by content.
///
/// # Errors
/// [`MeshFileReadError`] in one line.
pub fn read_object_file(path: &Path, nodes: usize) -> Result<ObjectFile, MeshFileReadError> {
    if !holds_surface(path)? {
        return Ok(ObjectFile::Mesh(Box::new(read_mesh_file(path)?)));
    }
    let filled = FilledSurface::read(path, 1.0, FillTarget::Nodes(nodes))?;
    Ok(ObjectFile::Surface(Box::new(filled)))
}

/// Whether a file contains a surface and not a mesh.
///
/// # Errors
/// [`MeshFileReadError`] for a file that cannot be read.
pub fn holds_surface(path: &Path) -> Result<bool, MeshFileReadError> {
    Ok(surface_format(&read_bytes(path)?).is_some())
}

/// Reads a surface file, with the files beside it that it needs.
///
/// # Errors
/// [`MeshFileReadError`] in one line that names file and place.
pub fn read_surface_file(path: &Path) -> Result<SurfaceFile, MeshFileReadError> {
    let bytes = read_bytes(path)?;
    let name = path.display().to_string();
    let mut companion = |wanted: &_| read_companion(path, wanted);
    Ok(parse_surface(&name, &bytes, &mut companion)?)
}

impl FilledSurface {
    /// Reads a surface, multiplies its coordinates by `scale`, and fills it.
    ///
    /// # Errors
    /// [`MeshFileReadError`] in one line.
    pub fn read(path: &Path, scale: f64, target: FillTarget) -> Result<Self, MeshFileReadError> {
        let fault = |source| MeshFileReadError::Fill { path: path.to_owned(), source };
        let SurfaceFile { surface, format, notes } = read_surface_file(path)?;
        let surface: TriangleSurface = match scale == 1.0 {
            true => surface,
            false => surface.scaled(scale).map_err(|source| MeshFileReadError::Scale {
                path: path.to_owned(),
                scale,
                source,
            })?,
        };
        let (low, high) = surface.bounds();
        let filled = fill(&surface, target).map_err(fault)?;
        Ok(Self { format, extent: high - low, filled, notes })
    }

    /// One line that tells what was filled and how near the mesh is to the surface.
    pub fn told(&self, path: &Path) -> String {
        let filled = &self.filled;
        format!(
            "{}: {} surface of {} triangles filled: {} nodes, {} tetrahedra, at most {:.2} % of its \
             size away from the surface",
            path.display(),
            self.format,
            filled.mending.triangles,
            filled.mesh.node_count(),
            filled.mesh.tets().len(),
            100.0 * filled.surface_to_mesh.max / self.extent.max()
        )
    }

    /// Faults of the surface, one sentence each.
    pub fn faults(&self) -> Vec<String> {
        let mending = &self.filled.mending;
        let mut said = self.notes.clone();
        let mut say = |count: usize, what: &str| {
            if count > 0 {
                said.push(format!("{count} {what}"));
            }
        };
        say(mending.without_area, "triangles without area were dropped");
        say(mending.doubled, "triangles were there twice; one of each was kept");
        say(mending.turned, "triangles were turned to agree with their neighbours");
        say(mending.turned_shells, "shells were inside out and were turned");
        say(mending.crowded_edges, "edges belong to three and more triangles");
        if let Some(hole) = mending.holes.first() {
            let at = hole.centre;
            said.push(format!(
                "{} open edges bound {} holes, which were closed; the largest, {:.4} m round, is at \
                 ({:.4}, {:.4}, {:.4}); {:.1} % of the mesh's boundary covers holes",
                mending.open_edges,
                mending.holes.len(),
                hole.rim,
                at.x,
                at.y,
                at.z,
                100.0 * self.filled.covered
            ));
        }
        if self.filled.pieces_left_out > 0 {
            said.push(format!(
                "{} pieces do not hang together with the largest and were left out, {:.2} % of the \
                 volume",
                self.filled.pieces_left_out,
                100.0 * self.filled.left_out
            ));
        }
        if self.filled.hinges > 0 {
            said.push(format!(
                "the boundary of the mesh touches itself at {} edges and nodes; more nodes help",
                self.filled.hinges
            ));
        }
        said
    }

    /// Advice where the extent in metres is hardly that of an object for the hand.
    pub fn doubtful_unit(&self) -> Option<String> {
        let longest = self.extent.max();
        let advice = match longest {
            l if l > LARGE_M => {
                "files of surfaces name no unit; if it is in millimetres, say --scale 0.001"
            }
            l if l < SMALL_M => "files of surfaces name no unit; --scale makes it larger",
            _ => return None,
        };
        Some(format!("the object is {longest:.4} m long if its unit is the metre: {advice}"))
    }
}
