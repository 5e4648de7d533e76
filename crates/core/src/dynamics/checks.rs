//! What a step is asked with: numbers in their ranges, names of what is there, and a mass.

use super::bodies::MovingBody;
use super::features::Candidate;
use super::rigid_motion::MassProperties;
use super::settings::{StepError, StepSettings};
use super::state::ObjectState;
use crate::solve::condensed::FreeBody;

/// Looks at the numbers of settings, bodies and state.
///
/// # Errors
/// [`StepError::Setting`] naming the number, [`StepError::NotFinite`].
pub(super) fn check(
    settings: &StepSettings,
    bodies: &[MovingBody],
    state: &ObjectState,
) -> Result<(), StepError> {
    let setting = |what, value, expected| Err(StepError::Setting { what, value, expected });
    if !(settings.seconds > 0.0 && settings.seconds.is_finite()) {
        return setting("the length of the step", settings.seconds, "a positive number of seconds");
    }
    if !(settings.viscosity >= 0.0 && settings.viscosity.is_finite()) {
        return setting("the viscosity", settings.viscosity, "a number of seconds, at least 0");
    }
    for body in bodies {
        if !(body.friction >= 0.0 && body.friction.is_finite()) {
            return setting("the friction of a body", body.friction, "a number, at least 0");
        }
        if !(body.compliance >= 0.0 && body.compliance.is_finite()) {
            return setting("the compliance of a body", body.compliance, "m/N, at least 0");
        }
    }
    let poses = bodies.iter().flat_map(|b| [b.world_from_body_start, b.world_from_body_end]);
    let poses_are_finite = poses.into_iter().all(|pose| {
        pose.translation.vector.iter().chain(pose.rotation.coords.iter()).all(|x| x.is_finite())
    });
    let is_weight_finite = settings.gravity.iter().all(|x| x.is_finite());
    match state.is_finite() && poses_are_finite && is_weight_finite {
        true => Ok(()),
        false => Err(StepError::NotFinite),
    }
}

/// Looks whether the candidates name triangles and bodies that are there.
///
/// # Errors
/// [`StepError::Candidate`].
pub(super) fn check_names(
    candidates: &[Candidate],
    (triangles, bodies): (usize, usize),
) -> Result<(), StepError> {
    let is_there =
        |c: &Candidate| (c.triangle as usize) < triangles && usize::from(c.body) < bodies;
    match candidates.iter().position(|named| !is_there(named)) {
        None => Ok(()),
        Some(candidate) => {
            let Candidate { triangle, body } = candidates[candidate];
            Err(StepError::Candidate { candidate, triangle, triangles, body, bodies })
        }
    }
}

/// Looks whether the state names nodes that are there.
///
/// # Errors
/// [`StepError::Node`].
pub(super) fn check_nodes(state: &ObjectState, node_count: usize) -> Result<(), StepError> {
    let held = state.contacts.iter().flat_map(|contact| contact.nodes);
    let mut named = state.forces.iter().map(|(node, _)| *node).chain(held);
    match named.find(|node| *node as usize >= node_count) {
        Some(node) => Err(StepError::Node { node, node_count }),
        None => Ok(()),
    }
}

/// Mass and inertia of the object.
///
/// # Errors
/// [`StepError::Setting`] for a density that gives none.
pub(super) fn mass_of(
    body: &FreeBody,
    settings: &StepSettings,
) -> Result<MassProperties, StepError> {
    let (what, value) = ("the density", settings.density);
    let expected = "a positive number of kg/m³";
    MassProperties::of(body, value).ok_or(StepError::Setting { what, value, expected })
}
