//! What the ticks of a grasp by contact hand over to the force: where the hand is, and the newest small
//! system.

use std::time::Instant;

use nalgebra::{DMatrix, Isometry3, Point3, Vector3};
use softgrasp_force::{ForceReport, Renderer, SmallContact, SmallSystem, SystemError, Target};
use softgrasp_grasp::hand::HAND_BODIES;
use softgrasp_protocol::SmallSystem as SmallSystemMessage;

/// Force of a grasp, rendered beside the ticks.
pub(crate) struct FeltHand {
    renderer: Renderer,
    /// Whether an answer with contacts was handed over since the object was last put somewhere.
    presses: bool,
    /// Reason why the last small system was of no use.
    unused: Option<SystemError>,
}

/// Number of bodies of a step before those of a second hand: the table, then the hand that feels.
const BODIES: usize = 1 + HAND_BODIES;
/// Segments of a finger.
const SEGMENTS: usize = 3;
/// Number of fingers.
const FINGERS: usize = 5;

impl FeltHand {
    /// Hands over to a renderer from now on.
    pub(crate) fn new(renderer: Renderer) -> Self {
        Self { renderer, presses: false, unused: None }
    }

    /// Hands the hand over: poses of all bodies now, world from body: the table, the hand that feels, and
    /// the other hand where there is one.
    pub(crate) fn hand(&self, world_from_bodies: Vec<Isometry3<f64>>) {
        self.renderer.newest().hand(world_from_bodies, Instant::now());
    }

    /// Hands the small system of an answer over. `world_from_bodies` are the poses of all bodies that the
    /// step ended with, and `asked_at` is when they were there.
    pub(crate) fn answer(
        &mut self,
        system: &SmallSystemMessage,
        world_from_bodies: &[Isometry3<f64>],
        asked_at: Instant,
    ) {
        let pose = |body: usize| world_from_bodies.get(body);
        match small_system(system, self.renderer.target(), pose) {
            Ok(system) => {
                self.presses = !system.is_empty();
                self.renderer.newest().answer(system, asked_at);
            }
            Err(error) => {
                tracing::debug!(%error, "no force of this answer");
                self.unused = Some(error);
            }
        }
    }

    /// Says that nothing presses any more, because the object was put elsewhere.
    pub(crate) fn let_go(&mut self) {
        if std::mem::take(&mut self.presses) {
            self.renderer.newest().answer(SmallSystem::empty(), Instant::now());
        }
    }

    /// Says whether the server is there.
    pub(crate) fn server(&self, is_lost: bool) {
        self.renderer.newest().server(is_lost);
    }

    /// Ends the force and tells of it.
    pub(crate) fn finish(self) -> ForceReport {
        let report = self.renderer.finish();
        let unused = self.unused.map(|error| format!("an answer was of no use: {error}"));
        ForceReport { device_failed: report.device_failed.clone().or(unused), ..report }
    }
}

/// The small system of an answer, with the ports of a device.
fn small_system<'p>(
    system: &SmallSystemMessage,
    target: &Target,
    pose: impl Fn(usize) -> Option<&'p Isometry3<f64>>,
) -> Result<SmallSystem, SystemError> {
    let contacts = system.contacts.iter().enumerate().map(|(contact, message)| {
        let body = message.body as usize;
        // A body that the step did not have.
        let world_from_body = pose(body).ok_or(SystemError::Contact { contact })?;
        let place = Point3::from(message.place);
        Ok(SmallContact {
            body: message.body,
            port: finger_of(body).and_then(|finger| target.port_of(finger)),
            place_in_body: world_from_body.inverse_transform_point(&place),
            place,
            normal: Vector3::from(message.normal),
            force: Vector3::from(message.force),
            friction: message.friction,
        })
    });
    let contacts = contacts.collect::<Result<Vec<_>, _>>()?;
    let rows = 3 * contacts.len();
    if system.compliance.len() != rows * rows {
        let (contacts, expected) = (contacts.len(), rows);
        return Err(SystemError::Sizes { contacts, expected, rows: system.compliance.len() });
    }
    SmallSystem::try_new(contacts, DMatrix::from_row_slice(rows, rows, &system.compliance))
}

/// Finger of a body of a step, thumb first, with the palm as the one after the little finger; `None` for
/// the table and for the other hand, which does not feel.
fn finger_of(body: usize) -> Option<usize> {
    let of_hand = body.checked_sub(1).filter(|_| body < BODIES)?;
    Some((of_hand / SEGMENTS).min(FINGERS))
}

#[cfg(test)]
mod tests {
    use softgrasp_protocol::BodyContact;

    use super::*;

    #[test]
    fn bodies_of_a_step_belong_to_fingers() {
        assert_eq!(finger_of(0), None, "the table");
        assert_eq!([1, 3, 4, 15].map(finger_of), [Some(0), Some(0), Some(1), Some(4)]);
        assert_eq!(finger_of(16), Some(5), "the palm");
        assert_eq!(finger_of(BODIES), None, "the other hand");
    }

    #[test]
    fn small_system_that_names_a_body_that_is_not_there_is_refused() {
        let target: Target = "record:f.csv".parse().unwrap();
        let still = Isometry3::translation(0.0, 0.1, 0.0);
        let contact = BodyContact {
            body: 1,
            place: [0.0, 0.11, 0.0],
            normal: [0.0, 1.0, 0.0],
            force: [0.0, 1.0, 0.0],
            friction: 0.8,
        };
        let compliance = vec![1e-3, 0.0, 0.0, 0.0, 1e-3, 0.0, 0.0, 0.0, 1e-3];
        let message = SmallSystemMessage { contacts: vec![contact], compliance };
        let known = |body| (body < 2).then_some(&still);
        let system = small_system(&message, &target, known).unwrap();
        assert_eq!(system.contacts()[0].port, Some(0));
        assert!((system.contacts()[0].place_in_body.y - 0.01).abs() < 1e-12);
        let unknown = |body| (body < 1).then_some(&still);
        let refused = small_system(&message, &target, unknown);
        assert_eq!(refused, Err(SystemError::Contact { contact: 0 }));
        let short = SmallSystemMessage { compliance: vec![1.0], ..message };
        assert!(matches!(small_system(&short, &target, known), Err(SystemError::Sizes { .. })));
    }
}
