//! The eye that is left to the window: it stands where it sees most of the squeeze, and goes along where
//! the object is carried.

use std::sync::Arc;

use nalgebra::Point3;

use super::camera::ViewCamera;
use super::eye_search::eye_on_squeeze;
use super::frame::{HandView, ObjectView, ViewFrame};

/// The eye, until the person moves it.
#[derive(Default)]
pub struct DirectedEye {
    is_chosen: bool,
    /// Part of the picture's height by which all is seen lower, because something lies over its top.
    lowered: f64,
    placed: Option<PlacedEye>,
    glide: Option<Glide>,
}

/// An eye that was placed for a squeeze, while the object was somewhere.
struct PlacedEye {
    squeezing: Arc<HandView>,
    eye: ViewCamera,
    /// Middle of the object: in its own frame, and in the world when the eye was placed.
    in_object: Point3<f64>,
    in_world: Point3<f64>,
}

/// An eye on its way to another place.
struct Glide {
    from: ViewCamera,
    since_s: f64,
}

/// Time that an eye takes for its way, s.
const GLIDE_S: f64 = 1.2;
/// An object that is carried less far is seen to move, m; beyond that the eye goes along.
const STAYS_M: f64 = 0.012;

impl DirectedEye {
    /// A directed eye; it is left to the window unless the person chose one.
    pub fn new(is_chosen: bool) -> Self {
        Self { is_chosen, ..Self::default() }
    }

    /// Lets the eye see everything lower by a part of the picture's height: something lies over its top.
    #[must_use]
    pub fn lowered(self, lowered: f64) -> Self {
        Self { lowered, ..self }
    }

    /// Gives the eye to the person, who moves it from now on.
    pub fn is_chosen(&mut self) {
        self.is_chosen = true;
    }

    /// Whether the eye is left to the window.
    pub fn is_directed(&self) -> bool {
        !self.is_chosen
    }

    /// The eye for a tick, where it is to be another one than `now`: at once for the first squeeze,
    /// gently for later ones, and with the object where that is carried.
    ///
    /// Units: `now_s` s on the clock of who looks.
    pub fn eye(&mut self, frame: &ViewFrame, now: ViewCamera, now_s: f64) -> Option<ViewCamera> {
        if self.is_chosen {
            return None;
        }
        if let Some(squeezing) = &frame.acts.squeezing
            && self.placed.as_ref().is_none_or(|eye| !Arc::ptr_eq(&eye.squeezing, squeezing))
        {
            let placed = PlacedEye::on(frame, squeezing, self.lowered);
            let is_first = self.placed.replace(placed).is_none();
            self.glide = (!is_first).then_some(Glide { from: now, since_s: now_s });
        }
        let to = self.placed.as_ref()?.carried_with(frame.aimed());
        let share = self.glide.as_ref().map_or(1.0, |glide| (now_s - glide.since_s) / GLIDE_S);
        let eye = match &self.glide {
            Some(Glide { from, .. }) if share < 1.0 => {
                let share = share.max(0.0);
                from.toward(&to, share * share * (3.0 - 2.0 * share))
            }
            _ => {
                self.glide = None;
                to
            }
        };
        (eye != now).then_some(eye)
    }
}

impl PlacedEye {
    fn on(frame: &ViewFrame, squeezing: &Arc<HandView>, lowered: f64) -> Self {
        let object = frame.aimed();
        let in_object = object.rest.centre();
        let others = frame.objects().filter(|other| other.number != object.number);
        let others: Vec<_> = others.map(ObjectView::ball).collect();
        let pose = &object.world_from_object;
        let mut eye = eye_on_squeeze(&object.rest, pose, squeezing, &others);
        eye.step_back_for(&others);
        eye.pan(0.0, lowered);
        Self {
            squeezing: Arc::clone(squeezing),
            eye,
            in_object,
            in_world: object.world_from_object * in_object,
        }
    }

    /// This eye, moved along with the object to where that is now.
    fn carried_with(&self, object: &ObjectView) -> ViewCamera {
        let way = object.world_from_object * self.in_object - self.in_world;
        let beyond = (1.0 - STAYS_M / way.norm().max(STAYS_M)).max(0.0);
        ViewCamera { target: self.eye.target + beyond * way, ..self.eye }
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::{Isometry3, Vector3};
    use softgrasp_grasp::hand::{HandDimensions, JointAngles, pose};

    use super::*;
    use crate::view::frame::samples::frame;

    fn squeezing(x_m: f64) -> Option<Arc<HandView>> {
        let dimensions = HandDimensions::default();
        let palm = Isometry3::translation(x_m, 0.0, 0.1);
        let pose = pose(&dimensions, &JointAngles::flat(), palm);
        Some(Arc::new(HandView::of_pose(dimensions, &pose)))
    }

    #[test]
    fn eye_goes_to_each_squeeze_until_the_person_moves_it() {
        let mut directed = DirectedEye::new(false);
        let (mut frame, camera) = (frame(1), ViewCamera::default());
        assert!(directed.eye(&frame, camera, 0.0).is_none(), "there is no plan yet");
        frame.acts.squeezing = squeezing(0.0);
        let first = directed.eye(&frame, camera, 0.0).unwrap();
        assert!(directed.eye(&frame, first, 0.0).is_none(), "it is there at once");
        frame.acts.squeezing = squeezing(0.05);
        assert_eq!(directed.eye(&frame, first, 0.0), None, "it sets out gently");
        let half = directed.eye(&frame, first, 0.5 * GLIDE_S).unwrap();
        let there = directed.eye(&frame, half, GLIDE_S).unwrap();
        assert!(there != first && directed.eye(&frame, there, GLIDE_S).is_none());
        directed.is_chosen();
        frame.acts.squeezing = squeezing(-0.05);
        // A glide that was begun would be seen in its course only.
        for now_s in [9.0, 9.0 + 0.5 * GLIDE_S, 9.0 + 2.0 * GLIDE_S] {
            assert!(directed.eye(&frame, there, now_s).is_none(), "it is the person's");
        }
    }

    #[test]
    fn lifted_object_does_not_rise_to_the_edge_of_the_picture_behind_the_hint() {
        let mut directed = DirectedEye::new(false);
        let mut frame = frame(1);
        frame.acts.squeezing = squeezing(0.0);
        let mut camera = directed.eye(&frame, ViewCamera::default(), 0.0).unwrap();
        let height_in_picture = |camera: &ViewCamera, frame: &ViewFrame| {
            let middle = frame.object.world_from_object * frame.object.rest.centre();
            camera.project(&middle, 4.0 / 3.0).unwrap().0.y
        };
        let lay = height_in_picture(&camera, &frame);
        let mut before = camera;
        // As the story lifts it, then as far as a person may.
        for mm in 0..400 {
            let carried = Vector3::new(0.0, 1e-3 * f64::from(mm), 0.0);
            frame.object.world_from_object =
                Isometry3::from_parts(carried.into(), Default::default());
            camera = directed.eye(&frame, camera, 0.02 * f64::from(mm)).unwrap_or(camera);
            let rose = height_in_picture(&camera, &frame) - lay;
            assert!(rose < 0.25, "lifted by {mm} mm it is {rose} half heights higher");
            let jump = (camera.eye() - before.eye()).norm();
            assert!(jump < 1.5e-3, "the eye jumps by {jump} m");
            before = camera;
        }
        assert!(camera.target.y > 0.3);
        frame.object.world_from_object = Isometry3::identity();
        camera = directed.eye(&frame, camera, 9.0).unwrap();
        assert_eq!(height_in_picture(&camera, &frame), lay, "back with the object");
    }
}
