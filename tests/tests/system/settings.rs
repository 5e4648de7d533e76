//! How the objects of these tests are solved.

use glove_client::ask::deformation::Elasticity;
use glove_client::ask::solve_settings::{SolveSettings, Subscription};
use softgrasp_grasp::object::ContactModel;
use softgrasp_protocol::{ElementName, Material, MethodName};

/// A soft fruit of linear elasticity, held by masks; only its surface is asked for.
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
