//! The nodes that an element has: corners, and of ten-node elements the nodes in the middles of the edges.

use softgrasp_core::fem::{QuadraticMesh, QuadraticMeshError};
use softgrasp_core::mesh::{MeshError, TetMesh};
use softgrasp_protocol::ElementName;

/// A mesh that cannot have the nodes of an element.
#[derive(Debug, thiserror::Error)]
pub enum ElementNodesError {
    /// Mid-edge nodes that do not fit together, or too many of them.
    #[error(transparent)]
    MidNodes(#[from] QuadraticMeshError),
    /// The nodes make no mesh.
    #[error(transparent)]
    Mesh(#[from] MeshError),
}

/// The mesh with the nodes that the element has: mid-edge nodes of its own go where the element has none;
/// those that it lacks are made halfway between corners, and come after its own nodes.
///
/// # Errors
/// [`ElementNodesError`].
pub fn with_nodes_of(mesh: TetMesh, element: ElementName) -> Result<TetMesh, ElementNodesError> {
    match element {
        ElementName::T10 if mesh.mid_edge_nodes().is_empty() => {
            Ok(QuadraticMesh::try_new(&mesh)?.to_mesh()?)
        }
        ElementName::T10 => Ok(mesh),
        ElementName::T4 | ElementName::T4Anp => Ok(mesh.without_mid_edge_nodes()),
    }
}
