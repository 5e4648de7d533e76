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

/// Material similar to soft rubber.
pub const MATERIAL: Material = Material { young: 1.0e5, poisson: 0.3 };

/// Mesh of a built-in object.
///
/// # Panics
/// If the object cannot have this number of nodes.
pub fn object(shape: BuiltIn, nodes: usize) -> TetMesh {
    generate(shape, nodes).expect("a built-in object of this size")
}

/// Mesh of a cube.
///
/// # Panics
/// If a cube cannot have this number of nodes.
pub fn cube(nodes: usize) -> TetMesh {
    object(BuiltIn::Cube, nodes)
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

/// Known displacements: the lowest tenth of the object is held, the highest tenth is pushed down and
/// aside by a tenth of the height times `push`.
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

/// Question about all nodes, with reaction forces.
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

/// Linear question about a mesh that comes along.
#[derive(Clone, Debug)]
pub struct Once {
    /// Nodes and elements of the mesh.
    pub mesh: MeshData,
    /// One material, or one for each region.
    pub materials: Vec<Material>,
    /// Kind of element, or the choice of it left to the server.
    pub element: ElementChoice,
    /// Known displacements and wanted results.
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

/// Request with its own mesh: a squeezed object.
pub fn once(mesh: &TetMesh, method: &str) -> Once {
    Once {
        mesh: mesh_data(mesh),
        materials: vec![MATERIAL],
        element: ElementChoice::T4,
        question: question(squeeze(mesh, 1.0), method),
    }
}

/// Model to be kept.
pub fn upload(mesh: &TetMesh) -> UploadModel {
    UploadModel {
        mesh: mesh_data(mesh),
        materials: vec![MATERIAL],
        element: ElementName::T4,
        fixed: Vec::new(),
    }
}

/// Frame question about a kept model: the object squeezed by `push`.
pub fn frame(mesh: &TetMesh, push: f64, method: &str) -> Ask {
    Ask::new(ModelHash::of(&upload(mesh)), question(squeeze(mesh, push), method))
}
