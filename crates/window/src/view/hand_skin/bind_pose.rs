//! The pose in which the skin is made: straight, slightly spread fingers, the thumb half way.

use nalgebra::{Isometry3, Point3};
use softgrasp_grasp::hand::{HandDimensions, Handedness, JointAngles, pose};

/// Radians by which index, ring and little finger are spread beyond the flat hand, so that the
/// surfaces of neighbours do not touch.
const SPREAD: [f64; 3] = [0.10, -0.07, -0.09];
/// Thumb rotation and abduction of the bind pose, rad: the middle of their ranges, so that skin
/// is sheared little at either end.
const THUMB: [f64; 2] = [0.55, 0.10];

/// Segment frames of the bind pose, and the sizes the skin is made for.
///
/// Units: m. Frame: palm.
#[derive(Clone, Debug)]
pub(super) struct BindPose {
    /// Dimensions of the hand; right or left as the frames below.
    pub dimensions: HandDimensions,
    /// Frames of all segments.
    pub palm_from_segment: [[Isometry3<f64>; 3]; 5],
}

impl BindPose {
    /// The bind pose of a right or left hand.
    pub fn new(dimensions: &HandDimensions) -> Self {
        let posed = pose(dimensions, &bind_angles(), Isometry3::identity());
        Self {
            dimensions: *dimensions,
            palm_from_segment: posed.fingers.map(|f| f.segments.map(|s| s.world_from_segment)),
        }
    }

    /// The bind pose of the right hand of the same sizes.
    pub fn right(dimensions: &HandDimensions) -> Self {
        Self::new(&dimensions.with_handedness(Handedness::Right))
    }

    /// How much larger this hand is than the default one: across (from the breadth) and along
    /// (from the length).
    pub fn scales(&self) -> [f64; 2] {
        let default = HandDimensions::default();
        [
            self.dimensions.hand_breadth / default.hand_breadth,
            self.dimensions.hand_length / default.hand_length,
        ]
    }

    /// A place of the default hand, in mm, on this hand, in m.
    pub fn place(&self, x_mm: f64, y_mm: f64, z_mm: f64) -> Point3<f64> {
        let [across, along] = self.scales();
        Point3::new(x_mm * across, y_mm * along, z_mm * across) * 1e-3
    }

    /// A radius of the default hand, in mm, on this hand, in m.
    pub fn radius(&self, mm: f64) -> f64 {
        1e-3 * mm * self.scales()[0]
    }

    /// Lower joint of a digit in the palm frame: MPJ, for the thumb TMJ.
    pub fn root(&self, digit: usize) -> Point3<f64> {
        self.palm_from_segment[digit][0] * Point3::origin()
    }
}

/// Joint angles of the bind pose.
pub(super) fn bind_angles() -> JointAngles {
    let mut angles = JointAngles::flat();
    [angles.index.abduction, angles.ring.abduction, angles.little.abduction] = SPREAD;
    [angles.thumb.rotation, angles.thumb.abduction] = THUMB;
    angles
}
