//! An object that is ready for the hand, and what is done to make one.

use serde::Serialize;
use softgrasp_grasp::object::SoftObject;

use crate::scripted::{GraspPlan, NoGrasp};

/// An object ready for the hand.
pub struct LoadedObject {
    /// What it is, for reports.
    pub summary: ObjectSummary,
    /// Longest extent that the mesh was brought to, m; `None` where it kept its own.
    pub brought_to_m: Option<f64>,
    /// The object, at rest.
    pub object: SoftObject,
    /// How the hand grasps it, or why it cannot.
    pub plan: Result<GraspPlan, NoGrasp>,
}

/// What was grasped.
#[derive(Clone, Debug, Serialize)]
pub struct ObjectSummary {
    /// Name or file.
    pub name: String,
    /// Nodes.
    pub nodes: usize,
    /// Elements.
    pub tets: usize,
    /// Longest extent, m.
    pub size_m: f64,
    /// What was done to it.
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
    /// It is there.
    Ready,
}

impl LoadStage {
    /// All of them, in order.
    pub const ALL: [Self; 4] = [Self::Mesh, Self::Tree, Self::Plan, Self::Ready];
}
