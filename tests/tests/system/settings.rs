//! Objects of these tests, and the settings of their solves.

use glove_client::ask::solve_settings::Elasticity;
use glove_client::ask::solve_settings::{SolveSettings, Subscription};
use softgrasp_core::mesh::{BuiltIn, TetMesh, generate};
use softgrasp_grasp::object::ContactModel;
use softgrasp_protocol::{ElementName, Material, MethodName};

/// Settings for a soft fruit of linear elasticity, held by masks; only its surface is asked for.
pub fn linear_settings() -> SolveSettings {
    SolveSettings {
        material: Material { young: 2.0e4, poisson: 0.4 },
        element: ElementName::T4,
        method: MethodName::auto(),
        contact: ContactModel::Mask,
        subscription: Subscription::Surface,
        elasticity: Elasticity::LINEAR,
        max_error: None,
    }
}

/// Built-in object with this longest extent, m.
pub fn sized(shape: BuiltIn, nodes: usize, size_m: f64) -> TetMesh {
    let mesh = generate(shape, nodes).unwrap();
    let scaled = mesh.vertices().iter().map(|p| p * (size_m / mesh.size())).collect();
    mesh.with_vertices(scaled).unwrap()
}
