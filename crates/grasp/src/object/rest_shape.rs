//! The shape an object returns to when nothing holds it, with all that is worked out from it once.

use std::sync::Arc;

use nalgebra::{Point3, Vector3};
use softgrasp_core::contact::{Mask, SurfaceStars};
use softgrasp_core::mesh::{Inversion, MeshError, Surface, TetMesh};

use super::regions::Regions;
use crate::sphere_tree::{SphereTree, TreeError, vertex_normals};

/// A mesh at rest: its boundary surface, sphere tree and vertex normals.
///
/// Nothing of it changes, so that threads beside the ticks can read it.
/// Units: m. Frame: the object's own.
pub struct RestShape {
    mesh: TetMesh,
    surface: Surface,
    stars: SurfaceStars,
    tree: SphereTree,
    normals: Vec<Vector3<f64>>,
    regions: Arc<Regions>,
}

/// Why an object cannot be touched, or a shape not be kept.
#[derive(Debug, thiserror::Error)]
pub enum ObjectError {
    /// The surface gives no tree or no normals.
    #[error("the object's surface cannot be searched: {0}")]
    Tree(#[from] TreeError),
    /// The shape's vertices make no mesh any more.
    #[error("the shape cannot be kept: {0}; let go and grasp again")]
    Shape(#[from] MeshError),
    /// The shape has elements that are turned inside out.
    #[error("the shape cannot be kept: {0}; open the hand a little and keep it then")]
    Inverted(Inversion),
    /// The answer is for another mesh.
    #[error("the answer holds {got} displacements, {expected} nodes were asked for")]
    Count {
        /// Number of displacements in the answer.
        got: usize,
        /// Number of nodes of the object, or of its surface.
        expected: usize,
    },
}

impl RestShape {
    /// The rest shape that a mesh describes; it can be touched at mid-edge nodes too.
    ///
    /// # Errors
    /// [`ObjectError::Tree`].
    pub fn try_new(mesh: TetMesh) -> Result<Self, ObjectError> {
        let surface = Surface::with_mid_edge_nodes(&mesh);
        let stars = SurfaceStars::new(&surface, mesh.node_count());
        let tree = SphereTree::try_build(mesh.vertices(), &surface.nodes)?;
        let mut normals = Vec::new();
        vertex_normals(mesh.vertices(), &surface.triangles, &mut normals)?;
        let regions = Arc::default();
        Ok(Self { mesh, surface, stars, tree, normals, regions })
    }

    /// The rest shape that a deformed shape of this object makes (thesis 4.6, 6.1.2).
    ///
    /// Shapes: `vertices` one per node.
    ///
    /// # Errors
    /// [`ObjectError::Inverted`] if elements would be turned inside out, [`ObjectError::Shape`] and
    /// [`ObjectError::Tree`] for vertices that make no mesh.
    pub fn kept(&self, vertices: Vec<Point3<f64>>) -> Result<Self, ObjectError> {
        self.check(&vertices)?;
        let kept = Self::try_new(self.mesh.with_vertices(vertices)?)?;
        Ok(Self { regions: Arc::clone(&self.regions), ..kept })
    }

    /// The same rest shape, whose regions have names and materials of their own.
    pub fn with_regions(self, regions: Regions) -> Self {
        Self { regions: Arc::new(regions), ..self }
    }

    /// Names and materials of the regions of the mesh.
    pub fn regions(&self) -> &Regions {
        &self.regions
    }

    /// Checks whether a deformed shape could become the rest shape.
    ///
    /// # Errors
    /// [`ObjectError::Inverted`] says which elements are turned inside out and how far.
    pub fn check(&self, vertices: &[Point3<f64>]) -> Result<(), ObjectError> {
        Inversion::of(&self.mesh, vertices).map_or(Ok(()), |i| Err(ObjectError::Inverted(i)))
    }

    /// The mesh at rest.
    pub fn mesh(&self) -> &TetMesh {
        &self.mesh
    }

    /// Boundary surface: triangles and nodes.
    pub fn surface(&self) -> &Surface {
        &self.surface
    }

    /// Sphere tree over the nodes of the boundary surface.
    pub fn tree(&self) -> &SphereTree {
        &self.tree
    }

    /// Vertex normals of the surface, by node.
    pub fn normals(&self) -> &[Vector3<f64>] {
        &self.normals
    }

    /// Surface triangles around each node.
    pub fn stars(&self) -> &SurfaceStars {
        &self.stars
    }

    /// Mask of a tip that touches a node of the surface.
    ///
    /// Units: m.
    pub fn tip_mask(&self, node: u32, radius: f64) -> Mask {
        self.stars.tip_mask(self.mesh.vertices(), &self.surface, node, radius)
    }

    /// Centre of the box around the object.
    pub fn centre(&self) -> Point3<f64> {
        let (low, high) = self.mesh.bounds();
        nalgebra::center(&low, &high)
    }

    /// Height of the object's lowest point, m: the height of the table that it lies on.
    pub fn bottom(&self) -> f64 {
        self.mesh.bounds().0.y
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use softgrasp_core::mesh::{BuiltIn, generate};

    #[test]
    fn shape_with_an_element_inside_out_is_not_kept() {
        let rest = RestShape::try_new(generate(BuiltIn::Cube, 64).unwrap()).unwrap();
        let mut vertices = rest.mesh().vertices().to_vec();
        vertices[0] += Vector3::new(0.5, 0.5, 0.5);
        let refused = rest.check(&vertices).unwrap_err();
        let ObjectError::Inverted(inversion) = &refused else { panic!("{refused}") };
        assert!(inversion.volume_rel_min < 0.0 && inversion.count > 0);
        assert!(refused.to_string().contains("open the hand"), "{refused}");
        assert!(rest.kept(vertices).is_err());
    }
}
