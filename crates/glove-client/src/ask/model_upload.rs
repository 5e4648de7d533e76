//! A mesh and its material as they travel to the server.

use std::sync::Arc;

use softgrasp_core::mesh::TetMesh;
use softgrasp_protocol::{ElementName, Material, MeshData, ModelHash, UploadModel};

/// The model that frames refer to.
#[derive(Clone, Debug)]
pub struct ModelUpload {
    /// Which rest shape of the object it is, from 1.
    pub rest_shape: u64,
    /// Its name.
    pub hash: ModelHash,
    /// The message, kept so that a server that does not know the model gets it.
    pub message: Arc<UploadModel>,
}

impl ModelUpload {
    /// The model of a rest shape of one material, with no node fixed.
    pub fn new(rest: &TetMesh, rest_shape: u64, material: Material, element: ElementName) -> Self {
        let message = UploadModel {
            mesh: mesh_data(rest),
            materials: vec![material],
            element,
            fixed: Vec::new(),
        };
        Self { rest_shape, hash: ModelHash::of(&message), message: Arc::new(message) }
    }
}

/// A mesh as it travels.
pub fn mesh_data(mesh: &TetMesh) -> MeshData {
    MeshData {
        vertices: mesh.vertices().iter().map(|p| [p.x, p.y, p.z]).collect(),
        tets: mesh.tets().to_vec(),
        regions: mesh.regions().to_vec(),
    }
}
