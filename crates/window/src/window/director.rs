//! What the window shows by itself as long as the person chooses nothing: an eye that sees thumb and
//! fingers, and the colours of strain while a script or the person squeezes.

use std::sync::Arc;
use std::time::{Duration, Instant};

use softgrasp_grasp::grasp::StateName;

use crate::view::camera::ViewCamera;
use crate::view::eye_search::eye_on_squeeze;
use crate::view::frame::{HandView, ViewFrame};
use crate::view::shading::Shading;

/// What is left to the window.
pub struct Director {
    /// The person chose where the eye is.
    eye_is_chosen: bool,
    /// The person chose what the colours show.
    shading_is_chosen: bool,
    /// The squeeze that the eye was placed for.
    placed_for: Option<Arc<HandView>>,
    glide: Option<Glide>,
}

/// An eye on its way.
struct Glide {
    from: ViewCamera,
    to: ViewCamera,
    since: Instant,
}

/// Time that an eye takes for its way.
const GLIDE: Duration = Duration::from_millis(1200);
/// Strain needs all nodes of an answer: of a larger mesh they take too long to send.
const COLOURED_NODES_MAX: usize = 20_000;

impl Director {
    /// A director that is left what the person has not chosen.
    pub fn new(eye_is_chosen: bool, shading_is_chosen: bool) -> Self {
        Self { eye_is_chosen, shading_is_chosen, placed_for: None, glide: None }
    }

    /// From now on the person moves the eye.
    pub fn eye_is_chosen(&mut self) {
        (self.eye_is_chosen, self.glide) = (true, None);
    }

    /// From now on the person says what the colours show.
    pub fn shading_is_chosen(&mut self) {
        self.shading_is_chosen = true;
    }

    /// Whether the eye is left to the window.
    pub fn has_eye(&self) -> bool {
        !self.eye_is_chosen
    }

    /// The eye for a frame, where it is to be another one than now: at once for the first squeeze,
    /// gently for later ones.
    pub fn eye(&mut self, frame: &ViewFrame, now: ViewCamera, at: Instant) -> Option<ViewCamera> {
        if self.eye_is_chosen {
            return None;
        }
        if let Some(squeezing) = &frame.acts.squeezing
            && self.placed_for.as_ref().is_none_or(|before| !Arc::ptr_eq(before, squeezing))
        {
            let object = &frame.object;
            let to = eye_on_squeeze(&object.rest, &object.world_from_object, squeezing);
            if self.placed_for.replace(Arc::clone(squeezing)).is_none() {
                return Some(to);
            }
            self.glide = Some(Glide { from: now, to, since: at });
        }
        let Glide { from, to, since } = self.glide.as_ref()?;
        let t = at.saturating_duration_since(*since).as_secs_f64() / GLIDE.as_secs_f64();
        let t = t.min(1.0);
        let eye = from.toward(to, t * t * (3.0 - 2.0 * t));
        if t >= 1.0 {
            self.glide = None;
        }
        Some(eye)
    }

    /// What the colours of a frame show, where that is left to the window; `is_directed` if a script
    /// or the mouse moves the hand.
    pub fn shading(&self, frame: &ViewFrame, is_directed: bool) -> Option<Shading> {
        let squeezed = frame.grasp.state == Some(StateName::Deforming);
        let shading = if squeezed { Shading::Strain } else { Shading::Plain };
        (self.directs_colours(frame) && is_directed).then_some(shading)
    }

    /// Whether answers are to hold the nodes inside because strain will be shown.
    pub fn directs_colours(&self, frame: &ViewFrame) -> bool {
        !self.shading_is_chosen && frame.object.rest.mesh().node_count() <= COLOURED_NODES_MAX
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::Isometry3;
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
        let (mut director, start) = (Director::new(false, false), Instant::now());
        let (mut frame, camera) = (frame(1), ViewCamera::default());
        assert!(director.eye(&frame, camera, start).is_none(), "there is no plan yet");
        frame.acts.squeezing = squeezing(0.0);
        let first = director.eye(&frame, camera, start).unwrap();
        assert!(director.eye(&frame, first, start).is_none(), "it is there at once");
        frame.acts.squeezing = squeezing(0.05);
        assert_eq!(director.eye(&frame, first, start), Some(first), "it sets out gently");
        let there = director.eye(&frame, first, start + GLIDE).unwrap();
        assert!(there != first && director.eye(&frame, there, start + GLIDE).is_none());
        director.eye_is_chosen();
        frame.acts.squeezing = squeezing(-0.05);
        assert!(director.eye(&frame, there, start).is_none());
    }

    #[test]
    fn squeeze_of_a_script_has_the_colours_of_strain_unless_the_person_chose_others() {
        let (mut director, mut frame) = (Director::new(false, false), frame(1));
        assert_eq!(director.shading(&frame, true), Some(Shading::Plain));
        frame.grasp.state = Some(StateName::Deforming);
        assert_eq!(director.shading(&frame, true), Some(Shading::Strain));
        assert_eq!(director.shading(&frame, false), None);
        director.shading_is_chosen();
        assert_eq!(director.shading(&frame, true), None);
    }
}
