//! What the window shows by itself as long as the person chooses nothing: an eye that sees thumb and
//! fingers, and the colours of strain while a script or the person squeezes.

use std::time::Instant;

use softgrasp_grasp::grasp::StateName;

use crate::view::camera::ViewCamera;
use crate::view::directed_eye::DirectedEye;
use crate::view::frame::ViewFrame;
use crate::view::shading::Shading;

/// Chooses the eye and the colours that the person leaves to the window.
pub struct Director {
    eye: DirectedEye,
    /// The person chose what the colours show.
    shading_is_chosen: bool,
    begun: Instant,
}

/// Part of the picture's height by which the scene is seen lower: the bar and what is told lie above it.
const UNDER_CARDS: f64 = 0.07;
/// Strain needs all nodes of an answer: of a larger mesh they take too long to send.
const COLOURED_NODES_MAX: usize = 20_000;

impl Director {
    /// A director for what the person has not chosen.
    pub fn new(eye_is_chosen: bool, shading_is_chosen: bool) -> Self {
        let eye = DirectedEye::new(eye_is_chosen).lowered(UNDER_CARDS);
        Self { eye, shading_is_chosen, begun: Instant::now() }
    }

    /// Gives the eye to the person, who moves it from now on.
    pub fn eye_is_chosen(&mut self) {
        self.eye.is_chosen();
    }

    /// Gives the choice of the colours to the person from now on.
    pub fn shading_is_chosen(&mut self) {
        self.shading_is_chosen = true;
    }

    /// Whether the eye is left to the window.
    pub fn has_eye(&self) -> bool {
        self.eye.is_directed()
    }

    /// The eye for a tick, where it is to be another one than now.
    pub fn eye(&mut self, frame: &ViewFrame, now: ViewCamera) -> Option<ViewCamera> {
        self.eye.eye(frame, now, self.begun.elapsed().as_secs_f64())
    }

    /// What the colours show in a tick, where that is left to the window; `is_directed` if a script
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
    use super::*;
    use crate::view::frame::samples::frame;

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
