//! A mesh and its material as they travel to the server.

use std::sync::Arc;

use softgrasp_core::mesh::TetMesh;
use softgrasp_protocol::{ElementName, Material, MeshData, ModelHash, UploadModel};

/// Model that questions refer to.
#[derive(Clone, Debug)]
pub struct ModelUpload {
    /// Number of the object's rest shape, from 1.
    pub rest_shape: u64,
    /// Hash that names the model.
    pub hash: ModelHash,
    /// Message with the model, kept for servers that do not know the model.
    pub message: Arc<UploadModel>,
}

impl ModelUpload {
    /// Model of a rest shape of one material, without fixed nodes.
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

/// Mesh as it travels.
pub fn mesh_data(mesh: &TetMesh) -> MeshData {
    MeshData {
        vertices: mesh.vertices().iter().map(|p| [p.x, p.y, p.z]).collect(),
        tets: mesh.tets().to_vec(),
        regions: mesh.regions().to_vec(),
    }
}
