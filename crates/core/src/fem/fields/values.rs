//! Fields of elements and nodes: strain, stress, energy, estimate of the error.

use super::tensor::Tensor;

/// Fields of a displacement field.
///
/// Shapes: M elements, N nodes of the mesh (mid-edge nodes that were made have none). Units: strain 1, stress Pa,
/// energy J. Frame: that of the mesh.
///
/// By linear elasticity strain is the small strain `½ (H + Hᵀ)`. At large deformation strain is Green's,
/// `½ (FᵀF − I)`, in the axes of the mesh at rest, and stress is Cauchy's, force on the deformed area, in
/// the axes of space. An element of `t4-anp` has the pressure that the nodes around it give it, so that
/// its stress is the one whose forces the equations balance.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Fields {
    /// Of every element, mean over it.
    pub elements: ElementFields,
    /// Of every node, mean over the elements around it by their volumes at rest; zero where there is
    /// none. At the border of two regions, where stress jumps, it is the mean of both.
    pub nodes: NodeFields,
    /// Stored energy of the whole body, J.
    pub energy: f64,
    /// Estimated error of the stress in the energy norm over the energy norm of the stress,
    /// `‖σ* − σ‖ / √(‖σ‖² + ‖σ* − σ‖²)`; none where it was not asked for. Of `t4-anp` it sees the change
    /// of shape only.
    pub error_rel: Option<f64>,
}

/// Fields of elements.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ElementFields {
    /// Strain.
    pub strain: Vec<Tensor>,
    /// Cauchy's stress, Pa.
    pub stress: Vec<Tensor>,
    /// Stored energy of the element, J.
    pub energy: Vec<f64>,
    /// Estimated error of the stress, Pa: root of the mean of `(σ* − σ):(σ* − σ)` over the element;
    /// empty where it was not asked for.
    pub stress_error: Vec<f64>,
}

/// Fields of nodes.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct NodeFields {
    /// Strain.
    pub strain: Vec<Tensor>,
    /// Cauchy's stress, Pa.
    pub stress: Vec<Tensor>,
    /// Stored energy for each unit of volume at rest, J/m³.
    pub energy_density: Vec<f64>,
    /// Estimated error of the stress, Pa: mean of that of the elements; empty where it was not asked
    /// for.
    pub stress_error: Vec<f64>,
}
