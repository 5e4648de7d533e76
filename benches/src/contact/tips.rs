//! Fingertips that touch an object, and the question of each contact model about them.

use glove_client::ask::model_upload::mesh_data;
use nalgebra::Point3;
use softgrasp_core::contact::SurfaceStars;
use softgrasp_core::fem::Material;
use softgrasp_core::mesh::{BuiltIn, Surface, TetMesh, generate};
use softgrasp_core::model::{Element, Model};
use softgrasp_grasp::object::ContactModel;
use softgrasp_protocol::{
    DofValue, ElementName, FieldSet, Masks, MethodName, NodeChoice, Precision, Question,
    UploadModel, Want,
};

use crate::report::ReportError;
use crate::scene::Pressed;

/// Object, nodes that fingertips of one radius touch, and fixed degrees of freedom.
///
/// Units: m, Pa. Frame: the object's.
pub struct Tips {
    pub mesh: TetMesh,
    pub surface: Surface,
    stars: SurfaceStars,
    pub material: Material,
    pub fixed: Vec<u32>,
    pub touches: Vec<(u32, [f64; 3])>,
}

/// A fingertip's radius, m.
pub const RADIUS: f64 = 0.008;
/// Depth of the press by one fingertip, m.
pub const DEPTH: f64 = 1e-3;
/// Young's modulus of a soft fruit, Pa; Poisson's ratio is so small that elements do not lock.
pub const YOUNG: f64 = 2.0e4;
pub const POISSON: f64 = 0.3;

impl Tips {
    /// Cube with its bottom fixed, and one fingertip in the middle of its top.
    pub fn press(nodes: usize) -> Result<Self, ReportError> {
        let mesh = generate(BuiltIn::Cube, nodes)?;
        let (low, high) = mesh.bounds();
        let bottom = |p: &Point3<f64>| p.y < low.y + 1e-9 * (high.y - low.y);
        let held = (0u32..).zip(mesh.vertices()).filter(|(_, p)| bottom(p)).map(|(n, _)| n);
        let fixed = held.flat_map(|n| 3 * n..3 * n + 3).collect();
        let middle = nalgebra::center(&low, &high);
        let top = Point3::new(middle.x, high.y, middle.z);
        let distance = |n: &u32| (mesh.vertices()[*n as usize] - top).norm_squared();
        let every = 0..mesh.node_count() as u32;
        let tip = every.min_by(|a, b| distance(a).total_cmp(&distance(b))).unwrap_or(0);
        let material = Material::try_new(YOUNG, POISSON)?;
        Ok(Self::new(mesh, material, fixed, vec![(tip, [0.0, -DEPTH, 0.0])]))
    }

    /// The free cube of the frame report, with five fingertips.
    pub fn grip(nodes: usize) -> Result<Self, ReportError> {
        let scene = Pressed::try_new(BuiltIn::Cube, nodes)?;
        let touch = |three: &[(u32, f64)]| match three {
            [(dof, x), (_, y), (_, z)] => Some((dof / 3, [*x, *y, *z])),
            _ => None,
        };
        let touches = scene.pairs.chunks(3).filter_map(touch).collect();
        Ok(Self::new(scene.mesh, scene.material, Vec::new(), touches))
    }

    fn new(
        mesh: TetMesh,
        material: Material,
        fixed: Vec<u32>,
        touches: Vec<(u32, [f64; 3])>,
    ) -> Self {
        let surface = Surface::from_mesh(&mesh);
        let stars = SurfaceStars::new(&surface, mesh.node_count());
        Self { mesh, surface, stars, material, fixed, touches }
    }

    /// Model for a server to keep.
    pub fn upload(&self) -> UploadModel {
        let mesh = mesh_data(&self.mesh);
        let (young, poisson) = (self.material.young(), self.material.poisson());
        let materials = vec![softgrasp_protocol::Material { young, poisson }];
        UploadModel { mesh, materials, element: ElementName::T4, fixed: self.fixed.clone() }
    }

    /// Model in this process.
    pub fn model(&self) -> Result<Model, ReportError> {
        let (mesh, fixed) = (self.mesh.clone(), self.fixed.clone());
        Ok(Model::try_new(mesh, Element::Tet4, &[self.material], fixed, &mut |_| {})?)
    }

    /// Question by a contact model, with the displacements of the tips times `scale`.
    pub fn question(&self, contact: ContactModel, scale: f64, want: Want) -> Question {
        let mut question = Question { method: MethodName::auto(), want, ..Question::default() };
        match contact {
            // Fingers that press with friction prescribe no displacement.
            ContactModel::Friction => {}
            ContactModel::Vertex => {
                let touches = self.touches.iter();
                question.known = touches.flat_map(|&(n, u)| at_node(n, u, scale)).collect();
            }
            ContactModel::Patch => {
                let nodes = self.surface.nodes.iter();
                let held = nodes.filter_map(|&n| self.nearest_tip(n).map(|u| (n, u)));
                question.known = held.flat_map(|(n, u)| at_node(n, u, scale)).collect();
            }
            ContactModel::Mask => {
                let mut masks = Masks::default();
                for &(node, _) in &self.touches {
                    let vertices = self.mesh.vertices();
                    let mask = self.stars.tip_mask(vertices, &self.surface, node, RADIUS);
                    masks.push(mask.entries());
                }
                question.masks = masks;
                let scaled = self.touches.iter().map(|touch| touch.1.map(|u| scale * u));
                question.mask_displacements = scaled.collect();
            }
        }
        question
    }

    /// Displacement of the nearest fingertip that covers a node, m.
    fn nearest_tip(&self, node: u32) -> Option<[f64; 3]> {
        let at = |n: u32| self.mesh.vertices()[n as usize];
        let distance = |touch: &&(u32, [f64; 3])| (at(node) - at(touch.0)).norm();
        let covering = self.touches.iter().filter(|t| distance(t) <= RADIUS);
        covering.min_by(|a, b| distance(a).total_cmp(&distance(b))).map(|touch| touch.1)
    }

    /// Results that a frame question wants: surface displacements only.
    pub fn want_surface(&self) -> Want {
        let nodes = NodeChoice::Nodes(self.surface.nodes.clone());
        Want { nodes, reactions: false, ..Want::default() }
    }
}

fn at_node(node: u32, u: [f64; 3], scale: f64) -> impl Iterator<Item = DofValue> {
    (0u32..).zip(u).map(move |(axis, u)| DofValue { dof: 3 * node + axis, value: scale * u })
}

/// All results: displacements of all nodes, and forces.
pub const WANT_ALL: Want = Want {
    nodes: NodeChoice::All,
    reactions: true,
    precision: Precision::F64,
    fields: FieldSet::NONE,
};
