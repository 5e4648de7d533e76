//! Writes the object in its present shape to a file of any format that can be written.

use std::path::PathBuf;
use std::sync::Arc;

use nalgebra::Point3;
use softgrasp_core::mesh::{Inversion, MeshError};
use softgrasp_core::mesh_io::PointField;
use softgrasp_grasp::object::RestShape;

use crate::object::file_writing::{FileWriteError, write_file};
use crate::object::mesh_file::{EncodeMeshError, encode_mesh};

/// Shape that is to be written.
///
/// Shapes: `vertices` and `displacement` one per node. Units: m. Frame: the object's own.
pub struct ShapeToSave {
    /// Path of the file; its extension names the format.
    pub path: PathBuf,
    /// Rest shape from which the displacement counts.
    pub rest: Arc<RestShape>,
    /// Present position of every vertex.
    pub vertices: Vec<Point3<f64>>,
    /// Displacement of every vertex; a VTU file contains it as `displacement`.
    pub displacement: Vec<[f64; 3]>,
}

/// Why a shape is not saved.
#[derive(Debug, thiserror::Error)]
pub enum SaveError {
    /// Elements are turned inside out; no program could use such a mesh.
    #[error("cannot save {path}: {inversion}; open the hand a little and save it then")]
    Inverted {
        /// Path as it was given.
        path: PathBuf,
        /// Number of inverted elements, and how far they are.
        inversion: Inversion,
    },
    /// The vertices make no mesh.
    #[error("cannot save {path}: {source}")]
    Shape {
        /// Path as it was given.
        path: PathBuf,
        /// Fault of the mesh.
        source: MeshError,
    },
    /// The mesh cannot be encoded in the file's format.
    #[error("cannot save {0}")]
    Encode(#[from] EncodeMeshError),
    /// The file cannot be written.
    #[error(transparent)]
    Write(#[from] FileWriteError),
}

impl ShapeToSave {
    /// Writes the file; returns the sentence for the person.
    ///
    /// # Errors
    /// [`SaveError`]; an older file then stays as it was.
    pub fn save(&self) -> Result<String, SaveError> {
        let path = &self.path;
        if let Some(inversion) = Inversion::of(self.rest.mesh(), &self.vertices) {
            return Err(SaveError::Inverted { path: path.clone(), inversion });
        }
        let shape = |source| SaveError::Shape { path: path.clone(), source };
        let mesh = self.rest.mesh().with_vertices(self.vertices.clone()).map_err(shape)?;
        let field = PointField { name: "displacement", values: &self.displacement };
        let bytes = encode_mesh(path, &mesh, &[], self.rest.surface(), &[field])?;
        write_file(path, &bytes)?;
        Ok(format!("saved {}: {} nodes", path.display(), mesh.node_count()))
    }
}
