//! An object that is ready for the hand, and what is done to make one.

use serde::Serialize;
use softgrasp_grasp::object::SoftObject;

use crate::scripted::{GraspPlan, NoGrasp};

/// An object ready for the hand.
pub struct LoadedObject {
    /// Name, size and origin of the object, for reports.
    pub summary: ObjectSummary,
    /// Longest extent that the mesh was brought to, m; `None` where it kept its own.
    pub brought_to_m: Option<f64>,
    /// The object, in its rest shape.
    pub object: SoftObject,
    /// Plan of the hand to grasp the object, or why it cannot.
    pub plan: Result<GraspPlan, NoGrasp>,
}

/// Summary of an object, for reports.
#[derive(Clone, Debug, Serialize)]
pub struct ObjectSummary {
    /// Name of a built-in object, or its file.
    pub name: String,
    /// Number of nodes of the mesh.
    pub nodes: usize,
    /// Number of elements of the mesh.
    pub tets: usize,
    /// Longest extent of the object, m.
    pub size_m: f64,
    /// What was done to the mesh when it was loaded, a note each.
    pub notes: Vec<String>,
}

/// What is being done to make an object ready.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum LoadStage {
    /// The mesh is read and checked, or generated.
    Mesh,
    /// Surface, sphere tree and normals are made.
    Tree,
    /// A good way to grasp it is looked for.
    Plan,
    /// The object is ready.
    Ready,
}

impl LoadStage {
    /// All stages, in order.
    pub const ALL: [Self; 4] = [Self::Mesh, Self::Tree, Self::Plan, Self::Ready];
}
