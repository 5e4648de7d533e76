//! Scene of every report: an object held and pressed by five fingertips.

use glove_client::ask::model_upload::mesh_data;
use nalgebra::{Point3, Vector3};
use softgrasp_core::fem::Material;
use softgrasp_core::mesh::{BuiltIn, Surface, TetMesh, generate};
use softgrasp_core::model::{Element, Known, Model};
use softgrasp_core::solve::{Loads, Method, Solution};
use softgrasp_protocol::{
    Ask, Body, DofValue, ElementChoice, ElementName, MeshData, MethodName, NodeChoice, Question,
    UploadModel, Want,
};

use crate::report::ReportError;
use crate::stages::{StageTimes, StageWatch};

/// Object with five known nodes: four on top pushed down, one below pushed up.
///
/// Units: m, Pa. Frame: the object's.
#[derive(Clone, Debug)]
pub struct Pressed {
    /// Shape of the object.
    pub shape: BuiltIn,
    /// Mesh of the object.
    pub mesh: TetMesh,
    /// Boundary surface of the mesh.
    pub surface: Surface,
    /// Material of the object.
    pub material: Material,
    /// Known displacements by degree of freedom, m; fifteen of them.
    pub pairs: Vec<(u32, f64)>,
}

/// Young's modulus of soft rubber, Pa.
const YOUNG: f64 = 1.0e5;
const POISSON: f64 = 0.3;

/// Displacement of each fingertip, relative to the object's size, and the point that it touches, relative
/// to half the extents of the bounding box.
pub(crate) const TOUCHES: [([f64; 3], [f64; 3]); 5] = [
    ([-0.5, 1.0, -0.5], [0.002, -0.02, 0.001]),
    ([0.5, 1.0, -0.5], [-0.002, -0.02, 0.001]),
    ([-0.5, 1.0, 0.5], [0.001, -0.015, -0.002]),
    ([0.5, 1.0, 0.5], [-0.001, -0.015, -0.002]),
    ([0.0, -1.0, 0.0], [0.0, 0.02, 0.0]),
];

/// Material of every object.
///
/// # Errors
/// [`ReportError::Material`] if the constants describe none.
pub(crate) fn rubber() -> Result<Material, ReportError> {
    Ok(Material::try_new(YOUNG, POISSON)?)
}

impl Pressed {
    /// Built-in object of about `nodes` nodes, pressed as [`presses`] says.
    ///
    /// # Errors
    /// [`ReportError::Generate`], [`ReportError::Material`].
    pub fn try_new(shape: BuiltIn, nodes: usize) -> Result<Self, ReportError> {
        let mesh = generate(shape, nodes)?;
        let surface = Surface::from_mesh(&mesh);
        let material = rubber()?;
        let pairs = presses(&mesh, &surface);
        Ok(Self { shape, mesh, surface, material, pairs })
    }

    /// Model with its stiffness, and the partition.
    ///
    /// # Errors
    /// [`ReportError::Model`].
    pub fn model(&self) -> Result<(Model, Known), ReportError> {
        let model = Model::try_new(
            self.mesh.clone(),
            Element::Tet4,
            &[self.material],
            Vec::new(),
            &mut |_| {},
        )?;
        let known = model.known(self.pairs.clone())?;
        Ok((model, known))
    }

    /// Whole finite element analysis by one method, from the mesh to the displacements, on the current
    /// rayon pool.
    ///
    /// # Errors
    /// [`ReportError::Model`], [`ReportError::Solve`].
    pub fn analyse(&self, method: Method) -> Result<(StageTimes, Solution), ReportError> {
        let (mesh, pairs) = (self.mesh.clone(), self.pairs.clone());
        let mut watch = StageWatch::start();
        let model = Model::try_new(mesh, Element::Tet4, &[self.material], Vec::new(), &mut |s| {
            watch.begin(s)
        })?;
        watch.end();
        let known = model.known(pairs)?;
        let factored = model.factor(&known.dofs, method, &mut |s| watch.begin(s))?;
        let loads = Loads { q_known: &known.q_known, ..Loads::default() };
        let solution = factored.solve(model.stiffness(), loads, &mut |s| watch.begin(s))?;
        Ok((watch.finish(), solution))
    }

    /// Request to a server with mesh, material, partition and known displacements in one (thesis 5.1.1).
    pub fn whole_request(&self, method: Method) -> Ask {
        let (mesh, materials) = self.on_the_wire();
        let question = self.question(method.name(), 1.0, NodeChoice::All);
        Ask::new(Body { mesh, materials, element: ElementChoice::T4 }, question)
    }

    /// Model for a server to keep.
    pub fn upload(&self) -> UploadModel {
        let (mesh, materials) = self.on_the_wire();
        UploadModel { mesh, materials, element: ElementName::T4, fixed: Vec::new() }
    }

    /// Partition and known displacements, these times `scale`.
    pub fn question(&self, method: &str, scale: f64, nodes: NodeChoice) -> Question {
        let known = self.pairs.iter().map(|&(dof, u)| DofValue { dof, value: scale * u });
        let method = MethodName::try_new(method);
        Question {
            known: known.collect(),
            method: method.expect("the names of all methods can be sent"),
            want: Want { nodes, reactions: false, ..Want::default() },
            ..Question::default()
        }
    }

    fn on_the_wire(&self) -> (MeshData, Vec<softgrasp_protocol::Material>) {
        let mesh = mesh_data(&self.mesh);
        let (young, poisson) = (self.material.young(), self.material.poisson());
        (mesh, vec![softgrasp_protocol::Material { young, poisson }])
    }

    /// Number of unknown degrees of freedom.
    pub fn unknown_dofs(&self) -> usize {
        (3 * self.mesh.node_count()).saturating_sub(self.pairs.len())
    }
}

/// Known displacements of five fingertips on any object, by degree of freedom, ascending.
///
/// Each fingertip takes the nearest surface node that no other has; on a surface of fewer than five nodes
/// there are fewer fingertips. Units: m.
pub fn presses(mesh: &TetMesh, surface: &Surface) -> Vec<(u32, f64)> {
    let (low, high) = mesh.bounds();
    let (centre, half) = (nalgebra::center(&low, &high), (high - low) / 2.0);
    let mut taken: Vec<u32> = Vec::new();
    let mut pairs = Vec::new();
    for (place, push) in TOUCHES {
        let place = centre + half.component_mul(&Vector3::from(place));
        let Some(node) = nearest(mesh, surface, &place, &taken) else { continue };
        taken.push(node);
        pairs.extend((0..3).zip(push).map(|(axis, u)| (3 * node + axis, u * mesh.size())));
    }
    pairs.sort_by_key(|&(dof, _)| dof);
    pairs
}

/// Surface node nearest to a position, those in `taken` left out.
pub(crate) fn nearest(
    mesh: &TetMesh,
    surface: &Surface,
    place: &Point3<f64>,
    taken: &[u32],
) -> Option<u32> {
    let distance = |node: u32| (mesh.vertices()[node as usize] - place).norm_squared();
    let free = surface.nodes.iter().copied().filter(|n| !taken.contains(n));
    free.min_by(|&a, &b| distance(a).total_cmp(&distance(b)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_object_is_held_at_five_different_surface_nodes() {
        for shape in BuiltIn::ALL {
            let scene = Pressed::try_new(shape, 100).unwrap();
            let mut nodes: Vec<u32> = scene.pairs.iter().map(|p| p.0 / 3).collect();
            nodes.dedup();
            assert_eq!(nodes.len(), 5, "{shape}");
            assert!(nodes.iter().all(|n| scene.surface.nodes.binary_search(n).is_ok()), "{shape}");
            let (_, solution) = scene.analyse(Method::SparseCholesky).unwrap();
            assert!(solution.residual_rel < 1e-12, "{shape}");
        }
    }
}
