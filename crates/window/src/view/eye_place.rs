//! When the eye is put where the hand hides least.

use nalgebra::Vector3;

use super::camera::ViewCamera;
use super::frame::ViewFrame;

/// Whether and when the eye is still to be placed beside the hand.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum EyePlace {
    /// The eye is placed; from now on the person moves it.
    Taken,
    /// The eye is placed as soon as there is a hand.
    AtOnce,
    /// The eye is placed as soon as the hand has gone to another object and rests there.
    AtRest {
        /// Number of rest shapes seen before the other object.
        rest_shapes: u64,
        /// Position of the palm in the tick before, m, world frame.
        palm_before: Option<Vector3<f64>>,
        /// Whether the hand has moved since the other object appeared.
        has_moved: bool,
    },
}

/// Distance below which a palm rests from one tick to the next that is seen, m.
const REST_M: f64 = 5e-4;

impl EyePlace {
    /// Places the eye anew when the object of this tick has been replaced.
    pub fn after(frame: &ViewFrame) -> Self {
        let rest_shapes = frame.aimed().rest_shapes;
        Self::AtRest { rest_shapes, palm_before: None, has_moved: false }
    }

    /// The eye for a tick, if the eye is to be placed then; once.
    pub fn eye(&mut self, frame: &ViewFrame) -> Option<ViewCamera> {
        let palm = frame.hand.as_ref()?.world_from_palm.translation.vector;
        match self {
            Self::Taken => return None,
            Self::AtOnce => {}
            Self::AtRest { rest_shapes, palm_before, has_moved } => {
                if frame.aimed().rest_shapes == *rest_shapes {
                    return None;
                }
                let before = palm_before.replace(palm)?;
                let moves = (palm - before).norm() >= REST_M;
                *has_moved |= moves;
                if moves || !*has_moved {
                    return None;
                }
            }
        }
        *self = Self::Taken;
        frame.eye_beside_hand()
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::Isometry3;
    use softgrasp_grasp::hand::{HandDimensions, JointAngles, pose};

    use super::*;
    use crate::view::frame::HandView;
    use crate::view::frame::samples::frame;

    fn seen(rest_shapes: u64, x_m: f64) -> ViewFrame {
        let mut frame = frame(1);
        let (dimensions, palm) = (HandDimensions::default(), Isometry3::translation(x_m, 0.1, 0.2));
        let hand = pose(&dimensions, &JointAngles::flat(), palm);
        frame.hand = Some(HandView::of_pose(dimensions, &hand));
        frame.object.rest_shapes = rest_shapes;
        frame
    }

    #[test]
    fn first_hand_places_the_eye_once() {
        let mut place = EyePlace::AtOnce;
        assert_eq!(place.eye(&frame(0)), None, "there is no hand yet");
        assert!(place.eye(&seen(1, 0.0)).is_some());
        assert_eq!(place.eye(&seen(1, 0.0)), None);
    }

    #[test]
    fn eye_follows_the_hand_to_another_object_and_waits_until_it_rests_there() {
        let mut place = EyePlace::after(&seen(1, 0.0));
        for (rest_shapes, x_m) in [(1, 0.0), (1, 0.0), (2, 0.0), (2, 0.0), (2, 0.1), (2, 0.2)] {
            assert_eq!(place.eye(&seen(rest_shapes, x_m)), None);
        }
        assert_eq!(place.eye(&seen(2, 0.2)), seen(2, 0.2).eye_beside_hand());
        assert_eq!(place, EyePlace::Taken);
    }
}
