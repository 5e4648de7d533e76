//! What a drag of the mouse moves: the view, the object, or the hand.

use nalgebra::{Point2, Unit, UnitQuaternion, Vector2, Vector3};
use softgrasp_hand::mouse::MouseInput;

use crate::view::camera::ViewCamera;
use crate::view::control::Control;
use crate::view::frame::ViewFrame;
use crate::view::pointer::{PointedAt, pointed_at};

/// Thing that a drag of the mouse moves.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Grip {
    /// The view turns.
    View,
    /// The view is shifted.
    Pan,
    /// The object turns.
    Object,
    /// The hand moves, or turns with Shift.
    Hand,
}

impl Grip {
    /// What a drag that begins at a place moves, where the mouse moves a hand.
    ///
    /// Units: pixels from the upper left.
    pub fn at(
        frame: &ViewFrame,
        camera: &ViewCamera,
        at: Vector2<f64>,
        size: Vector2<f64>,
    ) -> Self {
        let half = 0.5 * size.y.max(1.0);
        let place = Point2::new((at.x - 0.5 * size.x) / half, (0.5 * size.y - at.y) / half);
        let (origin, direction) = camera.ray(&place);
        match pointed_at(frame, &origin, &direction) {
            PointedAt::Hand => Self::Hand,
            PointedAt::Object if frame.can_be_turned() => Self::Object,
            PointedAt::Object | PointedAt::Nothing => Self::View,
        }
    }
}

/// The drag that is going on.
#[derive(Default)]
pub struct Grips {
    now: Option<Grip>,
}

/// Turn of a drag over the height of the window, rad.
const TURN: f64 = 4.0;

impl Grips {
    /// Begins a drag that moves this.
    pub fn begin(&mut self, grip: Grip) {
        self.now = Some(grip);
    }

    /// Ends the drag.
    pub fn end(&mut self) {
        self.now = None;
    }

    /// Moves the camera by a drag, or returns what is to be asked of the ticks.
    ///
    /// Units: `by` in heights of the window, to the right and down.
    pub fn drag(&self, camera: &mut ViewCamera, by: Vector2<f64>, shift: bool) -> Option<Control> {
        let [right, up, _] = camera.axes();
        match self.now? {
            Grip::View => {
                camera.turn(TURN * by.x, TURN * by.y);
                None
            }
            Grip::Pan => {
                camera.pan(by.x, by.y);
                None
            }
            Grip::Object => turn(&right, &up, by).map(Control::TurnObject),
            Grip::Hand if shift => {
                turn(&right, &up, by).map(|by| Control::Mouse(MouseInput::Turn(by)))
            }
            Grip::Hand => {
                let moved = (right * by.x - up * by.y) * camera.height_at_target();
                Some(Control::Mouse(MouseInput::Move(moved)))
            }
        }
    }
}

/// The rotation that rolls something under the pointer along with it.
fn turn(right: &Vector3<f64>, up: &Vector3<f64>, by: Vector2<f64>) -> Option<UnitQuaternion<f64>> {
    let axis = Unit::try_new(up * by.x + right * by.y, 1e-9)?;
    Some(UnitQuaternion::from_axis_angle(&axis, TURN * by.norm()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn front_of_a_dragged_object_follows_the_pointer() {
        let mut camera = ViewCamera::default();
        let [right, up, towards_eye] = camera.axes();
        let mut grips = Grips::default();
        grips.begin(Grip::Object);
        let by = Vector2::new(0.02, 0.01);
        let Some(Control::TurnObject(turned)) = grips.drag(&mut camera, by, false) else {
            panic!("the object is not turned")
        };
        let moved = turned * towards_eye - towards_eye;
        assert!(moved.dot(&right) > 0.0 && moved.dot(&up) < 0.0);
        assert!((moved.dot(&right) / -moved.dot(&up) - 2.0).abs() < 0.05);
        grips.end();
        assert!(grips.drag(&mut camera, by, false).is_none());
    }
}
