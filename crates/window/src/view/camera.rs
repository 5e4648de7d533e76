//! The viewer's eye: turns around a point, zooms, pans, frames what is to be seen.

use nalgebra::{Isometry3, Perspective3, Point2, Point3, UnitQuaternion, Vector3};
use softgrasp_grasp::hand::Handedness;

/// An eye that looks at a point.
///
/// Units: m, rad. Frame: world (Y up, the viewer on the side of +Z).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ViewCamera {
    /// Point at which the eye looks.
    pub target: Point3<f64>,
    /// Distance from the target to the eye.
    pub distance: f64,
    /// Turn of the eye about the world's Y axis; 0 looks along −Z.
    pub yaw: f64,
    /// Angle of the eye above the horizon.
    pub pitch: f64,
}

/// Whole angle of view from bottom to top of the picture, rad.
pub const FIELD_OF_VIEW: f64 = 0.60;
/// Straight up and down are left out: there is no up at the poles.
const PITCH_MAX: f64 = 1.53;
/// Middle of a grasping hand, seen from the object against the fingers' direction.
const HAND_OFF_M: f64 = 0.02;
/// A grasped object is lifted about twice as far.
const LIFTED_M: f64 = 0.016;
/// Radius of the ball around object and hand.
const SEEN_RADIUS_M: f64 = 0.075;
const DISTANCE_RANGE: (f64, f64) = (0.03, 4.0);

impl Default for ViewCamera {
    /// From the front, a little from the right and above: the hand does not hide what it holds.
    fn default() -> Self {
        Self { target: Point3::new(0.0, 0.01, 0.01), distance: 0.46, yaw: -0.75, pitch: 0.32 }
    }
}

impl ViewCamera {
    /// An eye that sees a hand and what it is about to grasp: from where the palm looks, so that the
    /// object shows before the palm, or from the thumb's side where that would be from below.
    ///
    /// Units: m. Frame: world.
    pub fn beside_hand(
        object: Point3<f64>,
        world_from_palm: &Isometry3<f64>,
        hand: Handedness,
    ) -> Self {
        let thumb = if hand == Handedness::Right { -1.0 } else { 1.0 };
        let from_front = world_from_palm.rotation * Vector3::new(0.15 * thumb, 0.22, -0.96);
        let from_thumb = world_from_palm.rotation * Vector3::new(0.80 * thumb, 0.25, -0.55);
        let is_from_below = from_front.y < -0.4 && from_thumb.y > from_front.y;
        let chosen = if is_from_below { from_thumb } else { from_front };
        let towards_eye = (chosen + Vector3::y() * 0.3).normalize();
        let pitch = towards_eye.y.asin().clamp(0.05, 0.75);
        let mut eye = Self { yaw: towards_eye.x.atan2(towards_eye.z), pitch, ..Self::default() };
        // The wrist is on the way from the object against the fingers' direction.
        let towards_wrist = world_from_palm.rotation * -Vector3::y();
        let middle = object + towards_wrist * HAND_OFF_M + Vector3::y() * LIFTED_M;
        eye.frame(middle, SEEN_RADIUS_M);
        eye
    }

    /// The eye at a share of the way to another one, the shorter way around.
    #[must_use]
    pub fn toward(&self, other: &Self, share: f64) -> Self {
        let pi = std::f64::consts::PI;
        let turn = (other.yaw - self.yaw + pi).rem_euclid(2.0 * pi) - pi;
        let mix = |a: f64, b: f64| a + share * (b - a);
        Self {
            target: self.target + (other.target - self.target) * share,
            distance: mix(self.distance, other.distance),
            yaw: self.yaw + share * turn,
            pitch: mix(self.pitch, other.pitch),
        }
    }

    /// Position of the eye, m, world.
    pub fn eye(&self) -> Point3<f64> {
        self.target + self.world_from_eye_rotation() * Vector3::new(0.0, 0.0, self.distance)
    }

    /// Unit directions of the picture's right and up, and from the target to the eye, in the world.
    pub fn axes(&self) -> [Vector3<f64>; 3] {
        let rotation = self.world_from_eye_rotation();
        [rotation * Vector3::x(), rotation * Vector3::y(), rotation * Vector3::z()]
    }

    /// Turns the eye around the target.
    ///
    /// Units: rad; a positive `right` turns what is seen to the right.
    pub fn turn(&mut self, right: f64, down: f64) {
        self.yaw = (self.yaw - right).rem_euclid(std::f64::consts::TAU);
        self.pitch = (self.pitch + down).clamp(-PITCH_MAX, PITCH_MAX);
    }

    /// Brings the eye nearer (a positive number of steps) or further away.
    pub fn zoom(&mut self, steps: f64) {
        let factor = 0.9_f64.powf(steps.clamp(-20.0, 20.0));
        self.distance = (self.distance * factor).clamp(DISTANCE_RANGE.0, DISTANCE_RANGE.1);
    }

    /// Moves what is seen by parts of the picture's height, to the right and down.
    pub fn pan(&mut self, right: f64, down: f64) {
        let [x, y, _] = self.axes();
        self.target += (y * down - x * right) * self.height_at_target();
    }

    /// Height of the picture at the target, m.
    pub fn height_at_target(&self) -> f64 {
        2.0 * self.distance * (0.5 * FIELD_OF_VIEW).tan()
    }

    /// Places the eye so that a ball fills the picture well.
    pub fn frame(&mut self, centre: Point3<f64>, radius: f64) {
        self.target = centre;
        let fits = 1.25 * radius / (0.5 * FIELD_OF_VIEW).sin();
        self.distance = fits.clamp(DISTANCE_RANGE.0, DISTANCE_RANGE.1);
    }

    /// Moves the eye away from its target until balls are seen whole in a picture of usual form, at most
    /// to three times the distance.
    ///
    /// Units: m. Frame: world.
    pub fn step_back_for(&mut self, balls: &[(Point3<f64>, f64)]) {
        const ASPECT: f64 = 4.0 / 3.0;
        const SEEN: f64 = 0.92;
        let farthest = 3.0 * self.distance;
        let is_seen = |eye: &Self| {
            let [right, up, _] = eye.axes();
            balls.iter().all(|(centre, radius)| {
                [right, -right, up, -up].iter().all(|way| {
                    let edge = eye.project(&(centre + way * *radius), ASPECT);
                    edge.is_some_and(|(at, _)| at.x.abs() < SEEN * ASPECT && at.y.abs() < SEEN)
                })
            })
        };
        while !is_seen(self) && self.distance < farthest {
            self.distance *= 1.05;
        }
    }

    /// Place of a point of the world in the picture: x from −aspect to aspect, y from −1 (bottom) to
    /// 1, and how far it is from the eye; `None` behind the eye.
    pub fn project(&self, point: &Point3<f64>, aspect: f64) -> Option<(Point2<f64>, f64)> {
        let p = self.eye_from_world() * point;
        if p.z > -1e-9 {
            return None;
        }
        let on_screen = Perspective3::new(aspect, FIELD_OF_VIEW, 1e-3, 10.0).project_point(&p);
        Some((Point2::new(on_screen.x * aspect, on_screen.y), -p.z))
    }

    /// The ray through a place in the picture; see [`ViewCamera::project`]. Its direction has
    /// length 1.
    pub fn ray(&self, place: &Point2<f64>) -> (Point3<f64>, Vector3<f64>) {
        let half = (0.5 * FIELD_OF_VIEW).tan();
        let in_eye = Vector3::new(place.x * half, place.y * half, -1.0);
        (self.eye(), (self.world_from_eye_rotation() * in_eye).normalize())
    }

    fn world_from_eye_rotation(&self) -> UnitQuaternion<f64> {
        UnitQuaternion::from_axis_angle(&Vector3::y_axis(), self.yaw)
            * UnitQuaternion::from_axis_angle(&Vector3::x_axis(), -self.pitch)
    }

    fn eye_from_world(&self) -> Isometry3<f64> {
        Isometry3::from_parts(self.eye().into(), self.world_from_eye_rotation()).inverse()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn ray_through_a_projected_point_meets_the_point(
            yaw in -3.0..3.0f64, pitch in -1.5..1.5f64, distance in 0.05..2.0f64,
            offset in prop::array::uniform3(-0.02..0.02f64),
        ) {
            let camera = ViewCamera { yaw, pitch, distance, ..ViewCamera::default() };
            let point = camera.target + Vector3::from(offset);
            let (place, depth) = camera.project(&point, 1.6).unwrap();
            let (eye, direction) = camera.ray(&place);
            let along = (point - eye).dot(&direction);
            prop_assert!((eye + direction * along - point).norm() < 1e-9);
            prop_assert!(depth > 0.0 && along >= depth - 1e-9);
        }

        #[test]
        fn framed_ball_is_seen_whole(
            centre in prop::array::uniform3(-0.5..0.5f64), radius in 0.02..0.3f64,
            yaw in -3.0..3.0f64, pitch in -1.5..1.5f64, towards in prop::array::uniform3(-1.0..1.0f64),
        ) {
            let mut camera = ViewCamera { yaw, pitch, ..ViewCamera::default() };
            camera.frame(centre.into(), radius);
            let Some(towards) = Vector3::from(towards).try_normalize(1e-3) else { return Ok(()) };
            let on_ball = Point3::from(centre) + towards * radius;
            let (place, _) = camera.project(&on_ball, 1.0).unwrap();
            prop_assert!(place.x.abs() < 1.0 && place.y.abs() < 1.0);
        }
    }

    #[test]
    fn dragging_to_the_right_moves_what_is_seen_to_the_right() {
        let mut camera = ViewCamera::default();
        let front = camera.eye() + (camera.target - camera.eye()) * 0.5;
        camera.turn(0.2, 0.0);
        assert!(camera.project(&front, 1.0).unwrap().0.x > 0.0);
        let mut panned = ViewCamera::default();
        panned.pan(0.1, 0.0);
        let (place, _) = panned.project(&ViewCamera::default().target, 1.0).unwrap();
        assert!(place.x > 0.0 && place.y.abs() < 1e-9);
    }

    #[test]
    fn eye_beside_a_hand_is_above_the_ground_and_never_behind_the_palm() {
        for turn in [[0.0, 0.0, 0.0], [0.4, 1.0, -0.2], [0.0, 2.5, 0.3], [1.5, 0.0, 0.0]] {
            let palm = Isometry3::new(Vector3::zeros(), Vector3::from(turn));
            for hand in [Handedness::Right, Handedness::Left] {
                let camera = ViewCamera::beside_hand(Point3::origin(), &palm, hand);
                assert!(camera.pitch > 0.0, "{turn:?}");
                let back = palm.rotation * Vector3::z();
                let [.., towards_eye] = camera.axes();
                // A palm that looks straight down is seen from its side at best.
                assert!(towards_eye.dot(&back) < 0.75, "{turn:?}, {hand:?}");
            }
        }
    }

    #[test]
    fn eye_that_goes_elsewhere_takes_the_shorter_way_around() {
        let from = ViewCamera { yaw: 3.0, ..ViewCamera::default() };
        let to = ViewCamera { yaw: -3.0, pitch: 0.6, ..from };
        let half = from.toward(&to, 0.5);
        assert!((half.yaw.sin()).abs() < 1e-12 && half.yaw.cos() < 0.0, "{half:?}");
        let there = from.toward(&to, 1.0);
        assert!((there.eye() - to.eye()).norm() < 1e-12);
    }

    #[test]
    fn zoom_stays_within_its_range_and_poles_are_not_passed() {
        let mut camera = ViewCamera::default();
        for _ in 0..50 {
            camera.zoom(15.0);
            camera.turn(0.0, 1.0);
        }
        assert!(camera.distance >= DISTANCE_RANGE.0 && camera.pitch < 1.54);
        camera.zoom(f64::MAX);
        camera.zoom(-1e9);
        assert!(camera.distance.is_finite());
    }

    #[test]
    fn eye_steps_back_until_all_balls_are_seen_and_stays_where_they_are() {
        let mut eye = ViewCamera::default();
        let before = eye;
        eye.step_back_for(&[(eye.target, 1e-3)]);
        assert_eq!(eye, before, "it sees that one already");
        let [right, ..] = eye.axes();
        let aside = eye.target + 0.3 * right;
        eye.step_back_for(&[(aside, 0.02)]);
        assert!(eye.distance > before.distance && eye.distance <= 3.2 * before.distance);
        let (seen, _) = eye.project(&aside, 4.0 / 3.0).unwrap();
        assert!(seen.x.abs() < 4.0 / 3.0, "{seen}");
        assert_eq!((eye.target, eye.yaw), (before.target, before.yaw));
    }
}
