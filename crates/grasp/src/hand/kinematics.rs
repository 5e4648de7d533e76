//! Computes the place of every finger segment from the joint angles.

use nalgebra::{Isometry3, Matrix3, Point3, Rotation3, Translation3, UnitQuaternion, Vector3};

use super::dimensions::{FingerDimensions, HandDimensions, Handedness, ThumbDimensions};
use super::joints::{Finger, FingerAngles, JointAngles, ThumbAngles};

/// Where the contact point sits on the fingertip hemisphere: halfway between straight ahead (+Y)
/// and straight out of the pulp (−Z), as a share of the tip radius on each axis.
const CONTACT_SHARE: f64 = std::f64::consts::FRAC_1_SQRT_2;

/// Pose of one finger segment.
///
/// Units: m. Frame: origin at the lower joint, +Y along the bone, +Z out of the back of the
/// finger.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SegmentPose {
    /// Segment frame in the world.
    pub world_from_segment: Isometry3<f64>,
    /// Length of the segment; the distal one includes the pulp.
    pub length: f64,
}

impl SegmentPose {
    /// Lower joint of the segment, in the world.
    pub fn start(&self) -> Point3<f64> {
        self.world_from_segment * Point3::origin()
    }

    /// Upper joint of the segment, or for the distal one the very end of the pulp, in the world.
    pub fn end(&self) -> Point3<f64> {
        self.world_from_segment * Point3::new(0.0, self.length, 0.0)
    }
}

/// Pose of one finger: its three segments and its tip.
///
/// Units: m. Frame: world. Segments: proximal, middle, distal; for the thumb metacarpal,
/// proximal, distal.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FingerPose {
    /// Finger that the pose belongs to.
    pub finger: Finger,
    /// Segments from the palm to the tip.
    pub segments: [SegmentPose; 3],
    /// Centre of the fingertip hemisphere, one tip radius before the end of the pulp.
    pub tip_centre: Point3<f64>,
    /// The one point of the fingertip that touches objects: on the hemisphere, on the pulp side.
    pub contact_point: Point3<f64>,
}

impl FingerPose {
    /// End of the finger's pulp.
    pub fn tip(&self) -> Point3<f64> {
        self.segments[2].end()
    }
}

/// Pose of the whole hand in the world.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HandPose {
    /// Palm frame in the world (`docs/frames.md`).
    pub world_from_palm: Isometry3<f64>,
    /// Poses of thumb to little finger.
    pub fingers: [FingerPose; 5],
}

impl HandPose {
    /// Pose of one finger of the hand.
    pub fn finger(&self, finger: Finger) -> &FingerPose {
        &self.fingers[finger.index()]
    }

    /// The hand moved as a whole, m, in the world.
    #[must_use]
    pub fn moved(&self, way: &Vector3<f64>) -> Self {
        let moved = |pose: &Isometry3<f64>| Translation3::from(*way) * pose;
        let mut hand = *self;
        hand.world_from_palm = moved(&self.world_from_palm);
        for finger in &mut hand.fingers {
            for segment in &mut finger.segments {
                segment.world_from_segment = moved(&segment.world_from_segment);
            }
            finger.tip_centre += way;
            finger.contact_point += way;
        }
        hand
    }
}

/// Places every segment of the hand.
///
/// Units: m and rad; `angles` must be finite. Frame: `world_from_palm` has its origin at the
/// centre of the wrist crease, +Y along the middle metacarpal toward the fingers, +Z out of the
/// back of the hand. Wrist angles are not used here, see [`forearm_from_palm`].
///
/// Source: thesis section 2.2.2 (joints), Figure 4.14 (fingertip contact point).
pub fn pose(
    dimensions: &HandDimensions,
    angles: &JointAngles,
    world_from_palm: Isometry3<f64>,
) -> HandPose {
    let world_from_segment = Finger::ALL.map(|finger| {
        right_chain(dimensions, angles, finger)
            .map(|chain| world_from_palm * handed(dimensions.handedness, &chain))
    });
    pose_of_segments(dimensions, world_from_palm, &world_from_segment)
}

/// The hand whose segments stand where they are said to, each for itself: a grasp shows segments
/// elsewhere than they were measured.
///
/// Units: m. Frame: world.
pub fn pose_of_segments(
    dimensions: &HandDimensions,
    world_from_palm: Isometry3<f64>,
    world_from_segment: &[[Isometry3<f64>; 3]; 5],
) -> HandPose {
    let lengths = dimensions.segment_lengths();
    let tip_radii = dimensions.tip_radii();
    let fingers = Finger::ALL.map(|finger| {
        let digit = finger.index();
        let segments = std::array::from_fn(|i| SegmentPose {
            world_from_segment: world_from_segment[digit][i],
            length: lengths[digit][i],
        });
        let world_from_distal = world_from_segment[digit][2];
        FingerPose {
            finger,
            segments,
            tip_centre: world_from_distal * tip_centre_in_distal(lengths[digit], tip_radii[digit]),
            contact_point: world_from_distal * contact_in_distal(lengths[digit], tip_radii[digit]),
        }
    });
    HandPose { world_from_palm, fingers }
}

/// Palm frame in the forearm frame, for a tracker receiver that sits on the forearm.
///
/// Frame: both have their origin at the centre of the wrist crease and coincide when the wrist is
/// straight. The wrist bends first, then deviates, as its two sensors are mounted.
pub fn forearm_from_palm(angles: &JointAngles, handedness: Handedness) -> Isometry3<f64> {
    let rotation = about_x(-angles.wrist_pitch) * about_z(angles.wrist_yaw);
    handed(handedness, &Isometry3::from_parts(Translation3::identity(), rotation))
}

/// Contact point in the distal segment's frame.
pub(super) fn contact_in_distal(lengths: [f64; 3], tip_radius: f64) -> Point3<f64> {
    let offset = tip_radius * CONTACT_SHARE;
    tip_centre_in_distal(lengths, tip_radius) + Vector3::new(0.0, offset, -offset)
}

/// Centre of the fingertip hemisphere in the distal segment's frame.
fn tip_centre_in_distal(lengths: [f64; 3], tip_radius: f64) -> Point3<f64> {
    Point3::new(0.0, lengths[2] - tip_radius, 0.0)
}

/// The three segment frames of one digit of a right hand, in its palm frame.
pub(super) fn right_chain(
    dimensions: &HandDimensions,
    angles: &JointAngles,
    finger: Finger,
) -> [Isometry3<f64>; 3] {
    match (finger, angles.finger(finger)) {
        (Finger::Thumb, _) | (_, None) => {
            let root = thumb_root(&dimensions.thumb, &dimensions.fingers[0]);
            thumb_chain(&dimensions.thumb, &root, &angles.thumb)
        }
        (_, Some(finger_angles)) => {
            let finger_dimensions = &dimensions.fingers[finger.index() - 1];
            finger_chain(finger_dimensions, finger_angles, angles.palm_arch)
        }
    }
}

/// Proximal, middle and distal frame: arch, fan and abduction about Z, then three flexions.
fn finger_chain(
    dimensions: &FingerDimensions,
    angles: &FingerAngles,
    palm_arch: f64,
) -> [Isometry3<f64>; 3] {
    // Cupping turns the ulnar metacarpals about the middle one, which is the palm's Y axis.
    let arch = about_y(palm_arch * dimensions.arch_share);
    let base = Translation3::from(arch * dimensions.mcp_in_palm.coords);
    let turn = arch * about_z(dimensions.fan + angles.abduction) * about_x(-angles.mcp_flexion);
    let proximal = Isometry3::from_parts(base, turn);
    let middle = proximal * hinge(dimensions.lengths[0], angles.pip_flexion);
    let distal = middle * hinge(dimensions.lengths[1], angles.dip_flexion);
    [proximal, middle, distal]
}

/// The thumb's fixed frame: X from the TMJ to the index MPJ, Z as near the palm's Z as can be.
pub(super) fn thumb_root(thumb: &ThumbDimensions, index: &FingerDimensions) -> Isometry3<f64> {
    let x = (index.mcp_in_palm - thumb.tmj_in_palm).normalize();
    let y = Vector3::z().cross(&x).normalize();
    let axes = Rotation3::from_matrix_unchecked(Matrix3::from_columns(&[x, y, x.cross(&y)]));
    Isometry3::from_parts(
        Translation3::from(thumb.tmj_in_palm.coords),
        UnitQuaternion::from_rotation_matrix(&axes),
    )
}

/// Metacarpal, proximal and distal frame: rotation about X of the root, abduction about Z, then
/// the fixed roll about the bone and two flexions (the order of the glove vendor's own model).
fn thumb_chain(
    dimensions: &ThumbDimensions,
    root: &Isometry3<f64>,
    angles: &ThumbAngles,
) -> [Isometry3<f64>; 3] {
    let swing = about_x(-angles.rotation) * about_z(dimensions.fan + angles.abduction);
    // The root's X is the bone direction at zero fan; a segment's bone is its Y.
    let bone = about_z(-std::f64::consts::FRAC_PI_2) * about_y(-dimensions.roll);
    let metacarpal = root * (swing * bone);
    let proximal = metacarpal * hinge(dimensions.lengths[0], angles.mcp_flexion);
    let distal = proximal * hinge(dimensions.lengths[1], angles.ip_flexion);
    [metacarpal, proximal, distal]
}

/// Next segment's frame: along the bone, then flexion toward the palm (−Z).
fn hinge(length: f64, flexion: f64) -> Isometry3<f64> {
    Isometry3::from_parts(Translation3::new(0.0, length, 0.0), about_x(-flexion))
}

/// A right hand's frame as it is, a left hand's as its mirror image across the Y–Z plane.
fn handed(handedness: Handedness, right: &Isometry3<f64>) -> Isometry3<f64> {
    match handedness {
        Handedness::Right => *right,
        Handedness::Left => {
            let (t, q) = (right.translation.vector, right.rotation.quaternion());
            let mirrored = nalgebra::Quaternion::new(q.w, q.i, -q.j, -q.k);
            Isometry3::from_parts(
                Translation3::new(-t.x, t.y, t.z),
                UnitQuaternion::new_unchecked(mirrored),
            )
        }
    }
}

pub(super) fn about_x(angle: f64) -> UnitQuaternion<f64> {
    UnitQuaternion::from_axis_angle(&Vector3::x_axis(), angle)
}

fn about_y(angle: f64) -> UnitQuaternion<f64> {
    UnitQuaternion::from_axis_angle(&Vector3::y_axis(), angle)
}

fn about_z(angle: f64) -> UnitQuaternion<f64> {
    UnitQuaternion::from_axis_angle(&Vector3::z_axis(), angle)
}

#[cfg(test)]
#[path = "kinematics_tests.rs"]
mod tests;
