//! Turns forces, weight and pressure of a question into what the core takes.

use std::collections::BTreeMap;

use nalgebra::Vector3;
use softgrasp_core::model::{Known, Model, ModelError};
use softgrasp_protocol::{Question, SpreadLoads};

use super::checks::{check_forces, check_nodes, scatter_forces};
use crate::refusal::Refusal;
use crate::store::{FrameLoads, UnitKey};

/// Most nodes whose forces are answered by columns of their own, so that other forces on them cost no solve;
/// more of them are one load, which is solved for again where it changes.
const NODES_BY_COLUMNS: usize = 8;
/// Most pressures that are loads of their own, so that other values of them cost no solve.
const PRESSURES_BY_COLUMNS: usize = 8;

/// Forces by degree of freedom of the system, those of weight and pressure among them, N; empty if nothing
/// acts. All nodes that the question names are checked; called before a factor is made, which is the costly
/// part.
///
/// # Errors
/// [`Refusal`] that names the node.
pub(crate) fn checked_forces(
    model: &Model,
    known: &Known,
    question: &Question,
) -> Result<Vec<f64>, Refusal> {
    let node_count = model.mesh().node_count();
    check_nodes(&question.want, node_count)?;
    let nodes = (node_count, model.system_node_count());
    let mut forces = scatter_forces(nodes, known, &question.forces)?;
    let SpreadLoads { gravity, densities, pressures } = &question.spread;
    let body = model.spread_loads();
    let mut add = |more: Vec<f64>| match forces.is_empty() {
        true => forces = more,
        false => forces.iter_mut().zip(more).for_each(|(sum, f)| *sum += f),
    };
    if !densities.is_empty() {
        add(body.weight(densities, Vector3::from(*gravity)).map_err(ModelError::from)?);
    }
    for on in pressures {
        add(body.pressure(&on.triangles, on.pressure).map_err(ModelError::from)?);
    }
    Ok(forces)
}

/// Checks the nodes that a frame question names, and the forces on them. Weight and pressure are checked where
/// they are made.
///
/// # Errors
/// [`Refusal`] that names the node.
pub(crate) fn check_frame(
    model: &Model,
    known: &Known,
    question: &Question,
) -> Result<(), Refusal> {
    let node_count = model.mesh().node_count();
    check_nodes(&question.want, node_count)?;
    check_forces(node_count, known, &question.forces)
}

/// Loads of a frame question, as unit loads and their amounts; `None` if nothing acts.
///
/// # Errors
/// [`Refusal`] that names the node or the number.
pub(crate) fn frame_loads(
    model: &Model,
    known: &Known,
    question: &Question,
) -> Result<Option<FrameLoads>, Refusal> {
    if question.forces.is_empty() && question.spread.is_empty() {
        return Ok(None);
    }
    check_forces(model.mesh().node_count(), known, &question.forces)?;
    let mut loads = FrameLoads::default();
    let mut by_node: BTreeMap<u32, [f64; 3]> = BTreeMap::new();
    for force in &question.forces {
        by_node.entry(force.dof / 3).or_default()[force.dof as usize % 3] += force.value;
    }
    let by_dof = by_node.iter().flat_map(|(node, force)| {
        (0..3).zip(force).map(move |(axis, value)| (*node, axis, *value))
    });
    if by_node.len() <= NODES_BY_COLUMNS {
        by_dof.for_each(|(node, axis, value)| loads.add(UnitKey::Node { node, axis }, value));
    } else {
        let acting = by_dof.filter(|(_, _, value)| *value != 0.0);
        let forces = acting.map(|(node, axis, value)| (3 * node + axis as u32, value)).collect();
        loads.add(UnitKey::Forces(forces), 1.0);
    }
    add_spread(&mut loads, model, &question.spread)?;
    Ok(Some(loads))
}

fn add_spread(loads: &mut FrameLoads, model: &Model, spread: &SpreadLoads) -> Result<(), Refusal> {
    let SpreadLoads { gravity, densities, pressures } = spread;
    let body = model.spread_loads();
    if !densities.is_empty() {
        body.check_weight(densities, Vector3::from(*gravity)).map_err(ModelError::from)?;
        for (axis, amount) in gravity.iter().enumerate() {
            loads.add(UnitKey::Weight { densities: densities.clone(), axis }, *amount);
        }
    }
    for on in pressures {
        body.check_pressure(on.pressure).map_err(ModelError::from)?;
    }
    if pressures.len() <= PRESSURES_BY_COLUMNS {
        for on in pressures {
            loads.add(UnitKey::Pressures(vec![(1.0, on.triangles.clone())]), on.pressure);
        }
    } else {
        let all = pressures.iter().map(|on| (on.pressure, on.triangles.clone())).collect();
        loads.add(UnitKey::Pressures(all), 1.0);
    }
    Ok(())
}
