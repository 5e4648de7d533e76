//! A mesh and its material as they travel to the server.

use std::sync::Arc;

use softgrasp_core::fem::Material as ElasticMaterial;
use softgrasp_core::mesh::TetMesh;
use softgrasp_grasp::object::{Regions, RestShape};
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
    /// The model of a rest shape whose body is of a material, with no node fixed.
    pub fn new(
        rest: &RestShape,
        rest_shape: u64,
        material: Material,
        element: ElementName,
    ) -> Self {
        Self::of_mesh(
            rest.mesh(),
            rest_shape,
            materials(rest.mesh(), rest.regions(), material),
            element,
        )
    }

    /// The model of a mesh, with no node fixed.
    ///
    /// Shapes: `materials` as [`materials`] has them.
    pub fn of_mesh(
        rest: &TetMesh,
        rest_shape: u64,
        materials: Vec<Material>,
        element: ElementName,
    ) -> Self {
        let message = UploadModel { mesh: mesh_data(rest), materials, element, fixed: Vec::new() };
        Self { rest_shape, hash: ModelHash::of(&message), message: Arc::new(message) }
    }
}

/// Materials of a mesh as they travel: that of the body alone, or one for each region that has elements, in
/// ascending order of the regions' numbers.
pub fn materials(mesh: &TetMesh, regions: &Regions, body: Material) -> Vec<Material> {
    // Constants that no material has are refused by the server, which says why.
    let Ok(elastic) = ElasticMaterial::try_new(body.young, body.poisson) else { return vec![body] };
    let of_region = regions.materials(elastic);
    if of_region.len() == 1 {
        return vec![body];
    }
    let mut has_elements = vec![false; of_region.len()];
    mesh.regions().iter().for_each(|&region| has_elements[region as usize] = true);
    let there = of_region.iter().zip(has_elements).filter(|(_, has_elements)| *has_elements);
    there.map(|(m, _)| Material { young: m.young(), poisson: m.poisson() }).collect()
}

/// Mesh as it travels.
pub fn mesh_data(mesh: &TetMesh) -> MeshData {
    MeshData {
        vertices: mesh.vertices().iter().map(|p| [p.x, p.y, p.z]).collect(),
        tets: mesh.tets().to_vec(),
        regions: mesh.regions().to_vec(),
        mid_edge: mesh.mid_edge_nodes().to_vec(),
    }
}
