//! What the object is made of and how its displacements are solved for.

use softgrasp_protocol::{ElementName, Material, MethodName};

use crate::contact_model::ContactModel;

/// What the object is made of and how it is to be solved.
#[derive(Clone, Debug, PartialEq)]
pub struct SolveSettings {
    /// Its material.
    pub material: Material,
    /// Element of the model.
    pub element: ElementName,
    /// Method asked for.
    pub method: MethodName,
    /// What a fingertip holds.
    pub contact: ContactModel,
    /// Nodes whose displacements each tick asks for.
    pub subscription: Subscription,
}

/// Nodes whose displacements each tick asks for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Subscription {
    /// What is seen and touched; the inside is asked for when a shape is to be kept.
    Surface,
    /// Every node: the whole object is written down.
    Whole,
}
