//! Small meshes and questions about them.

use softgrasp_core::mesh::{BuiltIn, TetMesh, generate};
use softgrasp_protocol::{
    Ask, Body, DofValue, ElementChoice, ElementName, Material, MeshData, MethodName, ModelHash,
    NodeChoice, Question, Request, UploadModel, Want,
};

/// Names of all methods, slowest first.
pub const METHODS: [&str; 10] = [
    "gauss-jordan-plain",
    "gauss-jordan",
    "dense-inverse",
    "dense-cholesky",
    "sparse-cholesky",
    "front",
    "front-mixed",
    "pcg",
    "multigrid",
    "condensed",
];

/// Rubber-like.
pub const MATERIAL: Material = Material { young: 1.0e5, poisson: 0.3 };

/// A built-in object.
///
/// # Panics
/// Outside the numbers of nodes it can have.
pub fn object(shape: BuiltIn, nodes: usize) -> TetMesh {
    generate(shape, nodes).expect("a built-in object of this size")
}

/// A cube.
///
/// # Panics
/// As [`object`].
pub fn cube(nodes: usize) -> TetMesh {
    object(BuiltIn::Cube, nodes)
}

/// A mesh as it travels.
pub fn mesh_data(mesh: &TetMesh) -> MeshData {
    MeshData {
        vertices: mesh.vertices().iter().map(|p| [p.x, p.y, p.z]).collect(),
        tets: mesh.tets().to_vec(),
        regions: mesh.regions().to_vec(),
    }
}

/// Known displacements: the lowest tenth of the object is held, the highest tenth is pushed down
/// and aside by a tenth of the height, more for a larger `push`.
///
/// Units: m.
pub fn squeeze(mesh: &TetMesh, push: f64) -> Vec<DofValue> {
    let (low, high) = mesh.bounds();
    let height = high.y - low.y;
    let mut known = Vec::new();
    for (node, point) in mesh.vertices().iter().enumerate() {
        let part = (point.y - low.y) / height;
        let moved = match part {
            p if p <= 0.1 => [0.0; 3],
            p if p >= 0.9 => [0.02 * push * height, -0.1 * push * height, 0.0],
            _ => continue,
        };
        for (axis, value) in moved.into_iter().enumerate() {
            known.push(DofValue { dof: 3 * node as u32 + axis as u32, value });
        }
    }
    known
}

/// A question for all nodes, with reaction forces.
///
/// # Panics
/// If `method` cannot be a method's name.
pub fn question(known: Vec<DofValue>, method: &str) -> Question {
    Question {
        known,
        method: MethodName::try_new(method).expect("a method's name"),
        want: Want { nodes: NodeChoice::All, reactions: true, ..Want::default() },
        ..Question::default()
    }
}

/// A linear question about a mesh that comes along.
#[derive(Clone, Debug)]
pub struct Once {
    /// Nodes and elements.
    pub mesh: MeshData,
    /// One material, or one for each region.
    pub materials: Vec<Material>,
    /// Which element.
    pub element: ElementChoice,
    /// What is known and asked.
    pub question: Question,
}

impl From<Once> for Ask {
    fn from(once: Once) -> Self {
        let Once { mesh, materials, element, question } = once;
        Self::new(Body { mesh, materials, element }, question)
    }
}

impl From<Once> for Request {
    fn from(once: Once) -> Self {
        Ask::from(once).into()
    }
}

/// One self-contained request: a squeezed object.
pub fn once(mesh: &TetMesh, method: &str) -> Once {
    Once {
        mesh: mesh_data(mesh),
        materials: vec![MATERIAL],
        element: ElementChoice::T4,
        question: question(squeeze(mesh, 1.0), method),
    }
}

/// A model to keep.
pub fn upload(mesh: &TetMesh) -> UploadModel {
    UploadModel {
        mesh: mesh_data(mesh),
        materials: vec![MATERIAL],
        element: ElementName::T4,
        fixed: Vec::new(),
    }
}

/// One frame on a kept model: the object squeezed by `push`.
pub fn frame(mesh: &TetMesh, push: f64, method: &str) -> Ask {
    Ask::new(ModelHash::of(&upload(mesh)), question(squeeze(mesh, push), method))
}
