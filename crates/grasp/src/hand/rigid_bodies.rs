//! The hand as rigid bodies that press on objects with friction: a capsule for every segment and for
//! every metacarpal of the palm.

use nalgebra::{Isometry3, Point3, Translation3, UnitQuaternion, Vector3};
use softgrasp_core::rigid_body::RigidShape;

use super::dimensions::HandDimensions;
use super::joints::Finger;
use super::kinematics::HandPose;

/// Bodies of a hand: three segments of five fingers, thumb first and from the palm outward, and four
/// metacarpals, index first.
pub const HAND_BODIES: usize = 3 * 5 + 4;

/// One rigid body of the hand.
///
/// Units: m. Frames: the capsule lies along z of the body, its middle at the origin.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HandBody {
    /// Finger that it belongs to; `None` for the palm.
    pub finger: Option<Finger>,
    /// Radius of the capsule.
    pub radius: f64,
    /// Length of its segment, between the centres of the two half balls.
    pub length: f64,
    /// Pose in the world.
    pub world_from_body: Isometry3<f64>,
}

impl HandBody {
    /// Shape of the body.
    pub fn shape(&self) -> RigidShape {
        RigidShape::Capsule { radius: self.radius, length: self.length }
    }

    /// Centres of the two half balls it ends with.
    ///
    /// Units: m. Frame: world.
    pub fn ends(&self) -> [Point3<f64>; 2] {
        [-0.5, 0.5].map(|share| self.world_from_body * Point3::new(0.0, 0.0, share * self.length))
    }

    /// Distance of a point of the world from the body's surface, below 0 inside, m.
    pub fn distance(&self, point: &Point3<f64>) -> f64 {
        self.shape().distance(&self.world_from_body.inverse_transform_point(point)).distance
    }
}

/// Distance of the nearest of some points from the bodies of a hand, below 0 where one is inside, m;
/// infinite where there are no points.
///
/// Frame: world.
pub fn clearance(
    bodies: &[HandBody; HAND_BODIES],
    points: impl Iterator<Item = Point3<f64>>,
) -> f64 {
    let nearest = |point: Point3<f64>| {
        bodies.iter().map(|body| body.distance(&point)).fold(f64::INFINITY, f64::min)
    };
    points.map(nearest).fold(f64::INFINITY, f64::min)
}

/// The hand raised as a whole until none of its bodies is below a table, as a hand is by a real one; the
/// same hand where none is.
///
/// Units: `table_y` m. Frame: world, y up.
pub fn above_table(dimensions: &HandDimensions, hand: &HandPose, table_y: f64) -> HandPose {
    let bodies = hand_bodies(dimensions, hand);
    let lowest = bodies.iter().flat_map(|body| body.ends().map(|end| end.y - body.radius));
    let depth = lowest.fold(f64::INFINITY, f64::min) - table_y;
    match depth < 0.0 {
        true => hand.moved(&Vector3::new(0.0, -depth, 0.0)),
        false => *hand,
    }
}

/// Radius of the capsules of the palm over the breadth of the hand: half the thickness of a palm.
const PALM_RADIUS_SHARE: f64 = 0.13;
/// The metacarpals come together at the wrist: there they are so far apart, over their distance at the
/// knuckles.
const WRIST_SHARE: f64 = 0.5;
/// A metacarpal's capsule begins this share of the way from the wrist to the knuckle.
const WRIST_START: f64 = 0.15;

/// Rigid bodies of a hand in one pose.
///
/// A segment's radius is the mean of its two ends, the distal one has the fingertip's and ends with its
/// hemisphere.
///
/// Units: m. Frame: world. `dimensions` must be those that the pose was made with.
pub fn hand_bodies(dimensions: &HandDimensions, pose: &HandPose) -> [HandBody; HAND_BODIES] {
    let (radii, tip_radii) = (dimensions.segment_radii(), dimensions.tip_radii());
    let palm_radius = PALM_RADIUS_SHARE * dimensions.hand_breadth;
    std::array::from_fn(|position| {
        if let Some(digit) = position.checked_sub(15) {
            let knuckle = pose.fingers[digit + 1].segments[0].start();
            let in_palm = pose.world_from_palm.inverse_transform_point(&knuckle);
            let wrist = Point3::new(WRIST_SHARE * in_palm.x, 0.0, in_palm.z);
            let start = pose.world_from_palm
                * Point3::from(wrist.coords.lerp(&in_palm.coords, WRIST_START));
            return capsule(None, start, knuckle, palm_radius);
        }
        let (digit, segment) = (position / 3, position % 3);
        let finger = &pose.fingers[digit];
        let start = finger.segments[segment].start();
        let (end, radius) = match segment {
            2 => (finger.tip_centre, tip_radii[digit]),
            _ => {
                let mean = 0.5 * (radii[digit][segment] + radii[digit][segment + 1]);
                (finger.segments[segment].end(), mean)
            }
        };
        capsule(Some(finger.finger), start, end, radius)
    })
}

/// The capsule between two points.
fn capsule(finger: Option<Finger>, start: Point3<f64>, end: Point3<f64>, radius: f64) -> HandBody {
    let along = end - start;
    let middle = nalgebra::center(&start, &end);
    let turn = UnitQuaternion::rotation_between(&Vector3::z(), &along)
        // Opposite directions: half a turn about any axis across.
        .unwrap_or_else(|| {
            UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI)
        });
    HandBody {
        finger,
        radius,
        length: along.norm(),
        world_from_body: Isometry3::from_parts(Translation3::from(middle.coords), turn),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::hand::{HandColliders, Handedness, JointAngles, pose};

    #[test]
    fn bodies_lie_on_the_segments_and_the_fingertips_end_where_the_colliders_do() {
        let hand = HandDimensions::default();
        for closed in [0.0, 0.6, 1.2] {
            let angles = JointAngles::from_array(&[closed; 23]);
            let world_from_palm =
                Isometry3::new(Vector3::new(0.1, 0.2, -0.3), Vector3::y() * closed);
            let pose = pose(&hand, &angles, world_from_palm);
            let bodies = hand_bodies(&hand, &pose);
            let colliders = HandColliders::new(&hand, &pose);
            for (digit, finger) in colliders.fingers.iter().enumerate() {
                let tip = &bodies[3 * digit + 2];
                assert!(tip.distance(&finger.contact_point).abs() < 1e-9, "digit {digit}");
                for segment in 0..3 {
                    let body = &bodies[3 * digit + segment];
                    assert_eq!(body.finger, Some(finger.finger));
                    let start = pose.fingers[digit].segments[segment].start();
                    assert!(body.distance(&start) < 0.0);
                    assert!((body.ends()[0] - start).norm() < 1e-9);
                }
            }
            assert!(bodies[15..].iter().all(|body| body.finger.is_none()));
        }
    }

    #[test]
    fn bodies_of_a_left_hand_are_the_mirror_image_of_those_of_a_right_one() {
        let right = HandDimensions::default();
        let left = right.with_handedness(Handedness::Left);
        for closed in [0.0, 0.6, 1.2] {
            let angles = JointAngles::from_array(&[closed; 23]);
            let (shift, turn) = (Vector3::new(0.1, 0.2, -0.3), Vector3::new(0.3, closed, -0.7));
            // Of a turn, the mirror keeps the part about its own axis and turns the others round.
            let over = |v: Vector3<f64>| Vector3::new(-v.x, v.y, v.z);
            let turned_over = Vector3::new(turn.x, -turn.y, -turn.z);
            let of_right = hand_bodies(&right, &pose(&right, &angles, Isometry3::new(shift, turn)));
            let palm = Isometry3::new(over(shift), turned_over);
            let of_left = hand_bodies(&left, &pose(&left, &angles, palm));
            for (a, b) in of_right.iter().zip(&of_left) {
                assert_eq!((a.finger, a.radius), (b.finger, b.radius));
                for (end, other) in a.ends().iter().zip(&b.ends()) {
                    assert!((over(end.coords) - other.coords).norm() < 1e-15, "{end} and {other}");
                }
            }
        }
    }

    #[test]
    fn palm_is_solid_between_wrist_and_knuckles() {
        let hand = HandDimensions::default();
        let pose = pose(&hand, &JointAngles::flat(), Isometry3::identity());
        let bodies = hand_bodies(&hand, &pose);
        for (x, y) in [(0.0, 0.03), (-0.01, 0.07), (0.02, 0.06)] {
            let point = Point3::new(x, y, 0.0);
            let inside = bodies[15..].iter().any(|body| body.distance(&point) < 0.0);
            assert!(inside, "({x}, {y}) is in no body of the palm");
            assert!(clearance(&bodies, std::iter::once(point)) < 0.0);
        }
    }

    #[test]
    fn hand_above_a_table_stays_and_one_in_it_is_raised_until_it_touches() {
        let hand = HandDimensions::default();
        let lowest = |pose: &HandPose| {
            let bodies = hand_bodies(&hand, pose);
            let of = |body: &HandBody| body.ends().map(|end| end.y - body.radius);
            bodies.iter().flat_map(of).fold(f64::INFINITY, f64::min)
        };
        for (height, turn) in [(0.3, 0.4), (0.02, -1.3), (-0.1, 2.0)] {
            let palm = Isometry3::new(Vector3::new(0.1, height, 0.0), Vector3::x() * turn);
            let pose = pose(&hand, &JointAngles::from_array(&[0.5; 23]), palm);
            let table_y = 0.01;
            let held = above_table(&hand, &pose, table_y);
            if lowest(&pose) >= table_y {
                assert_eq!(held, pose);
                continue;
            }
            assert!((lowest(&held) - table_y).abs() < 1e-12, "{height} m");
            let way = held.world_from_palm.translation.vector - palm.translation.vector;
            assert!(way.xz().norm() < 1e-15, "straight up");
            for (now, before) in held.fingers.iter().zip(&pose.fingers) {
                assert!((now.tip() - before.tip() - way).norm() < 1e-12);
                assert!((now.contact_point - before.contact_point - way).norm() < 1e-12);
            }
        }
    }
}
