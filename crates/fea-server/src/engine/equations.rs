//! The equations of a task, checked as a server checks its own, before anything is assembled.

use softgrasp_core::Material;
use softgrasp_core::fem::Element;
use softgrasp_core::mesh::{Bodies, TetMesh};
use softgrasp_core::model::{Known, ModelError};
use softgrasp_core::solve::{KnownDisplacements, Partition, RigidBodies, find_free_motion};
use softgrasp_protocol::Rejected;

use super::task::Task;
use crate::refusal::Refusal;
use crate::request::{check_nodes, element_of, mesh_of, pairs, scatter_forces};

/// Mesh, materials and loads of a task; nothing is assembled.
///
/// Shapes: N nodes. Units: m, Pa, N.
pub struct Equations {
    /// The mesh.
    pub mesh: TetMesh,
    /// Kind of element.
    pub element: Element,
    /// One material for the whole body, or one for each region.
    pub materials: Vec<Material>,
    /// Whether an element uses each node, N.
    pub used: Vec<bool>,
    /// Number of bodies that no element joins.
    pub body_count: usize,
    /// Known displacements of the first case.
    pub known: Known,
    /// Known displacements of the further cases, of the same degrees of freedom.
    pub cases: Vec<Known>,
    /// Forces, 3N, N; empty if there are none.
    pub forces: Vec<f64>,
}

impl Equations {
    /// Checks a task and makes its equations.
    ///
    /// # Errors
    /// The refusal that a server would answer with.
    pub fn of(task: &Task) -> Result<Self, Rejected> {
        Self::made(task).map_err(|refusal| refusal.to_message())
    }

    fn made(task: &Task) -> Result<Self, Refusal> {
        let model = &*task.model;
        let (mesh, materials) = mesh_of(model.mesh.clone(), &model.materials)?;
        let node_count = mesh.node_count();
        check_nodes(&task.question.want, node_count)?;
        let given = pairs(&task.question.known);
        let known = joined(&given, &model.fixed, node_count)?;
        let of_case = |values: &Vec<f64>| {
            let given: Vec<(u32, f64)> =
                given.iter().zip(values).map(|(&(dof, _), &value)| (dof, value)).collect();
            joined(&given, &model.fixed, node_count)
        };
        let cases = task.cases.iter().map(of_case).collect::<Result<Vec<Known>, Refusal>>()?;
        if !task.question.spread.is_empty() {
            let (what, instead) = ("weight and pressure", "give their forces on nodes");
            return Err(Refusal::NotByCluster { what, instead });
        }
        if !task.question.quantity.is_empty() {
            let (what, instead) = ("derivatives", "ask a server with memory for the model");
            return Err(Refusal::NotByCluster { what, instead });
        }
        let forces = scatter_forces((node_count, node_count), &known, &task.question.forces)?;
        let used = mesh.used_nodes();
        let body_count = held_by(&mesh, &used, &known.dofs)?;
        let element = element_of(model.element);
        Ok(Self { mesh, element, materials, used, body_count, known, cases, forces })
    }
}

/// Known displacements of a question and fixed degrees of freedom together; where both name one, the
/// question's value holds.
fn joined(given: &[(u32, f64)], fixed: &[u32], node_count: usize) -> Result<Known, Refusal> {
    let mut named: Vec<u32> = given.iter().map(|known| known.0).collect();
    named.sort_unstable();
    let further = fixed.iter().filter(|dof| named.binary_search(dof).is_err());
    let all: Vec<(u32, f64)> =
        given.iter().copied().chain(further.map(|&dof| (dof, 0.0))).collect();
    if let Some((dof, _)) = all.iter().find(|(dof, _)| *dof as usize >= 3 * node_count) {
        let node = *dof as usize / 3;
        return Err(ModelError::NoSuchNode { node, node_count }.into());
    }
    let known = KnownDisplacements::try_new(all).map_err(ModelError::from)?;
    Ok(Known { dofs: known.dofs().to_vec(), q_known: known.values().to_vec() })
}

/// Makes sure that known degrees of freedom hold every body; the number of bodies.
///
/// # Errors
/// [`ModelError`] that names the body and its motion, or the node.
fn held_by(mesh: &TetMesh, used: &[bool], dofs: &[u32]) -> Result<usize, ModelError> {
    Partition::check(used, dofs)?;
    let bodies = Bodies::from_mesh(mesh);
    let rigid = RigidBodies::new(mesh, &bodies);
    match find_free_motion(mesh, &bodies, &rigid, dofs, &[]) {
        Some(free) => Err(ModelError::Free(free)),
        None => Ok(bodies.count()),
    }
}
