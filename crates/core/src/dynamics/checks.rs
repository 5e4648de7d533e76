//! Looks whether a step names what is there and whether its numbers are numbers.

use super::features::Candidate;
use super::rigid_motion::MassProperties;
use super::state::ObjectState;
use super::step::{ContactStep, StepError};

impl ContactStep<'_> {
    /// Mass and inertia of the object, once everything has been seen to be in order.
    ///
    /// # Errors
    /// [`StepError`] naming what is not.
    pub(super) fn check(&self, state: &ObjectState) -> Result<MassProperties, StepError> {
        let settings = &self.settings;
        let setting = |what, value, expected| Err(StepError::Setting { what, value, expected });
        if !(settings.seconds > 0.0 && settings.seconds.is_finite()) {
            return setting(
                "the length of the step",
                settings.seconds,
                "a positive number of seconds",
            );
        }
        if !(settings.viscosity >= 0.0 && settings.viscosity.is_finite()) {
            return setting("the viscosity", settings.viscosity, "a number of seconds, at least 0");
        }
        for body in self.bodies {
            if !(body.friction >= 0.0 && body.friction.is_finite()) {
                return setting("the friction of a body", body.friction, "a number, at least 0");
            }
            if !(body.compliance >= 0.0 && body.compliance.is_finite()) {
                return setting("the compliance of a body", body.compliance, "m/N, at least 0");
            }
        }
        let poses =
            self.bodies.iter().flat_map(|b| [b.world_from_body_start, b.world_from_body_end]);
        let poses_are_finite = poses.into_iter().all(|pose| {
            pose.translation.vector.iter().chain(pose.rotation.coords.iter()).all(|x| x.is_finite())
        });
        if !state.is_finite()
            || !poses_are_finite
            || !settings.gravity.iter().all(|x| x.is_finite())
        {
            return Err(StepError::NotFinite);
        }
        for (candidate, named) in self.candidates.iter().enumerate() {
            let Candidate { triangle, body } = *named;
            let (triangles, bodies) = (self.triangles.len(), self.bodies.len());
            if triangle as usize >= triangles || usize::from(body) >= bodies {
                return Err(StepError::Candidate { candidate, triangle, triangles, body, bodies });
            }
        }
        let node_count = self.vertices.len();
        let held = state.contacts.iter().flat_map(|contact| contact.nodes);
        let mut named = state.forces.iter().map(|(node, _)| *node).chain(held);
        if let Some(node) = named.find(|node| *node as usize >= node_count) {
            return Err(StepError::Node { node, node_count });
        }
        MassProperties::of(self.elasticity.body, settings.density).map_or_else(
            || setting("the density", settings.density, "a positive number of kg/m³"),
            Ok,
        )
    }
}
