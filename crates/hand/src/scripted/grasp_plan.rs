//! A plan to grasp an object: the palm, the posture, how far each finger closes, and whether the hand has
//! room for that beside object and table.

use nalgebra::{Isometry3, Point3, Vector3};
use softgrasp_grasp::hand::{Finger, HandBody, HandPose, clearance, hand_bodies, pose};
use softgrasp_grasp::object::RestShape;

use super::approach::{BACK_OFF, PalmPath};
use super::posture::{Posture, angles};
use crate::hand_setup::HandSetup;

/// A palm pose and how far each finger closes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GraspPlan {
    /// Pose of the palm, relative to the object, while the hand holds it.
    pub path: PalmPath,
    /// Posture of the hand before its fingers close.
    pub posture: Posture,
    /// Closure (0 open, 1 closed) of each finger when the palm has come to its pose, thumb first: a hand that
    /// reaches for a thing which lies low comes half closed, to stay above the table.
    pub reach: [f64; 5],
    /// Closure at which each tip touches.
    pub touch: [f64; 5],
    /// Closure at which each tip has moved on by the depth asked for.
    pub press: [f64; 5],
    /// Whether friction can be expected to hold the object: the line between thumb and fingers lies within the
    /// cones of friction of a dry skin, and the object is thicker than the tip of the thumb. Not looked at
    /// where a grasp without friction was wished for.
    pub holds_by_friction: bool,
}

impl GraspPlan {
    /// The hand as it squeezes an object that is centred at a point of the world.
    pub fn squeezing(&self, setup: &HandSetup, centre: Point3<f64>) -> HandPose {
        let angles = setup.felt(&angles(&self.press, self.posture));
        pose(&setup.dimensions, &angles, self.path.world_from_palm(centre))
    }

    /// This plan, relative to another point of the object than its centre; `shift` leads from the centre
    /// to it.
    ///
    /// Units: m. Frame: world.
    #[must_use]
    pub fn about(mut self, shift: Vector3<f64>) -> Self {
        let path = &mut self.path;
        path.object_in_palm += path.world_from_palm_rotation.inverse() * shift;
        self
    }

    /// The palm, the closures and the posture of a hand that has come so far: 0 away from the object, 1 there.
    fn coming(&self, progress: f64) -> (PalmPath, [f64; 5], Posture) {
        let path = self.path.backed_off(BACK_OFF * (1.0 - progress));
        (
            path,
            self.reach.map(|reach| progress * reach),
            Posture::OPEN.toward(&self.posture, progress),
        )
    }

    /// Whether the hand is outside of the object on the last part of its way, when it has come, and when it
    /// nearly touches.
    pub(super) fn has_room(&self, setup: &HandSetup, object: &RestShape) -> bool {
        let vertices = object.mesh().vertices();
        let surface = || object.surface().nodes.iter().map(|&node| vertices[node as usize]);
        let nearly = (self.path, self.touch.map(|touch| NEARLY * touch), self.posture);
        let moments = COMING.iter().map(|&progress| self.coming(progress)).chain([nearly]);
        moments.into_iter().all(|(path, closure, posture)| {
            let angles = setup.felt(&angles(&closure, posture));
            let palm = path.world_from_palm(object.centre());
            let hand = pose(&setup.dimensions, &angles, palm);
            clearance(&hand_bodies(&setup.dimensions, &hand), surface()) > -ROOM
        })
    }

    /// Whether the hand stays above a table while it reaches, touches and presses.
    pub(super) fn is_above(&self, setup: &HandSetup, centre: Point3<f64>, table_y: f64) -> bool {
        let halfway = std::array::from_fn(|digit| 0.5 * (self.reach[digit] + self.touch[digit]));
        let closed = [halfway, self.touch, self.press];
        let coming = [0.0, 0.5, 1.0].map(|progress| self.coming(progress));
        let moments = coming.into_iter().chain(closed.map(|c| (self.path, c, self.posture)));
        moments.into_iter().all(|(path, closure, posture)| {
            let angles = setup.felt(&angles(&closure, posture));
            let hand = pose(&setup.dimensions, &angles, path.world_from_palm(centre));
            let bodies = hand_bodies(&setup.dimensions, &hand);
            is_over(&outline(&bodies), &Isometry3::identity(), table_y + TABLE_CLEARANCE)
        })
    }
}

/// Room between the hand and the table, m.
const TABLE_CLEARANCE: f64 = 1e-3;
/// Parts of its way at which a hand that comes must be clear of the object.
const COMING: [f64; 5] = [0.6, 0.75, 0.85, 0.93, 1.0];
/// A hand that nearly touches has closed by this share.
const NEARLY: f64 = 0.85;
/// Depth in the object that is no collision of a hand that does not touch yet, m.
const ROOM: f64 = 1e-3;

/// Ends of the capsules of a hand without its thumb, in the palm frame, and their radii.
///
/// Shapes: `closure` of all fingers, 0 open, 1 closed.
pub(super) fn outline_without_thumb(
    setup: &HandSetup,
    posture: Posture,
    closure: f64,
) -> Vec<(Point3<f64>, f64)> {
    let angles = setup.felt(&angles(&[closure; 5], posture));
    let hand = pose(&setup.dimensions, &angles, Isometry3::identity());
    let bodies = hand_bodies(&setup.dimensions, &hand);
    let without_thumb = bodies.iter().filter(|body| body.finger != Some(Finger::Thumb));
    outline(without_thumb)
}

/// Ends of capsules, world, and their radii.
fn outline<'a>(bodies: impl IntoIterator<Item = &'a HandBody>) -> Vec<(Point3<f64>, f64)> {
    let ends = bodies.into_iter().flat_map(|body| body.ends().map(|end| (end, body.radius)));
    ends.collect()
}

/// Whether an outline is above a table.
pub(super) fn is_over(
    outline: &[(Point3<f64>, f64)],
    world_from_palm: &Isometry3<f64>,
    table_y: f64,
) -> bool {
    outline.iter().all(|(end, radius)| (world_from_palm * end).y - radius > table_y)
}
