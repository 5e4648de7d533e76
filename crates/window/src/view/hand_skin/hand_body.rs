//! The whole hand as one signed distance.

use nalgebra::{Isometry3, Point3, Vector3};

use super::bind_pose::BindPose;
use super::loft::{Loft, Section};
use super::palm_body::PalmBody;
use super::round_cone::smooth_union;

/// A right hand in the bind pose.
///
/// Units: m. Frame: palm.
#[derive(Clone, Debug)]
pub(super) struct HandBody {
    /// Everything of the hand but the digits.
    pub palm: PalmBody,
    /// Bodies of thumb to little finger.
    pub digits: [Loft; 5],
    /// One millimetre of the default hand.
    mm: f64,
}

impl HandBody {
    /// The body of a right hand.
    pub fn new(bind: &BindPose) -> Self {
        Self {
            palm: PalmBody::new(bind),
            digits: [0, 1, 2, 3, 4].map(|digit| digit_loft(bind, digit)),
            mm: bind.radius(1.0),
        }
    }

    /// Signed distance, negative inside; to first order near the surface.
    pub fn distance(&self, p: &Point3<f64>) -> f64 {
        let palm = self.palm.distance(p);
        let thumb = smooth_union(self.digits[0].distance(p), palm, 8.0 * self.mm);
        let mut nearest = smooth_union(thumb, self.palm.sleeve_distance(p), 4.0 * self.mm);
        for loft in &self.digits[1..] {
            // Each finger flows into the palm; its neighbour is joined by a narrow fillet only,
            // which softens the groove before the web and leaves the spread fingers apart.
            let finger = smooth_union(loft.distance(p), palm, 6.0 * self.mm);
            nearest = smooth_union(nearest, finger, 2.5 * self.mm);
        }
        nearest
    }

    /// Distance and its gradient, by central differences.
    pub fn distance_and_gradient(&self, p: &Point3<f64>) -> (f64, Vector3<f64>) {
        let step = 0.05 * self.mm;
        let mut gradient = Vector3::zeros();
        let mut sum = 0.0;
        for axis in 0..3 {
            let mut shift = Vector3::zeros();
            shift[axis] = step;
            let (up, down) = (self.distance(&(p + shift)), self.distance(&(p - shift)));
            gradient[axis] = (up - down) / (2.0 * step);
            sum += up + down;
        }
        (sum / 6.0, gradient)
    }
}

/// Shares of the radii at the joints from which the sections of a finger are made: place between
/// lower joint (0) and upper joint (1) of a segment, half width, dorsal and palmar.
type Shares = [f64; 4];

/// Sections of the proximal, the middle and the distal segment. The joints are wider and flatter
/// than the shafts, the pads between the creases hang down, the nail's bed is flat.
const FINGER: [&[Shares]; 3] = [
    &[
        [0.0, 1.0, 0.98, 1.0],
        [0.25, 1.01, 0.98, 1.08],
        [0.55, 1.08, 0.98, 1.18],
        [0.87, 1.14, 1.04, 1.14],
    ],
    &[
        [0.01, 1.18, 1.09, 1.02],
        [0.20, 1.14, 1.03, 1.14],
        [0.52, 1.10, 0.97, 1.18],
        [0.80, 1.13, 0.99, 1.13],
    ],
    &[[0.02, 1.17, 1.00, 1.01], [0.24, 1.15, 0.95, 1.08], [0.46, 1.15, 0.92, 1.09]],
];
const THUMB: [&[Shares]; 3] = [
    &[[0.62, 0.90, 0.86, 0.86], [0.84, 0.96, 0.92, 0.92]],
    &[
        [0.02, 1.00, 0.95, 0.98],
        [0.30, 0.98, 0.92, 1.04],
        [0.55, 1.02, 0.92, 1.13],
        [0.84, 1.12, 1.00, 1.08],
    ],
    &[[0.04, 1.17, 1.02, 1.06], [0.30, 1.20, 0.95, 1.09], [0.48, 1.21, 0.89, 1.10]],
];
/// Half width, dorsal and palmar at the centre of the fingertip ball, as shares of its radius.
const TIP: [f64; 3] = [1.12, 0.90, 1.11];

/// One digit, straight, along its first segment.
fn digit_loft(bind: &BindPose, digit: usize) -> Loft {
    let lengths = bind.dimensions.segment_lengths()[digit];
    let radii = bind.dimensions.segment_radii()[digit];
    let tip_radius = bind.dimensions.tip_radii()[digit];
    let tables = if digit == 0 { THUMB } else { FINGER };
    // The ball of the thumb is the palm's; its loft begins with the radius at the MPJ.
    let lower = if digit == 0 { [radii[1], radii[1], radii[2]] } else { radii };
    let upper = [radii[1], radii[2], tip_radius];
    let tip_centre = lengths.iter().sum::<f64>() - tip_radius;
    let mut sections = Vec::new();
    let mut start = 0.0;
    for segment in 0..3 {
        for &[share, half_width, dorsal, palmar] in tables[segment] {
            let radius = lower[segment] + (upper[segment] - lower[segment]) * share;
            sections.push(Section {
                along: start + share * lengths[segment],
                half_width: half_width * radius,
                dorsal: dorsal * radius,
                palmar: palmar * radius,
            });
        }
        start += lengths[segment];
    }
    // On a short and broad hand the ball begins before the last sections.
    sections.retain(|section| section.along < tip_centre - 0.2 * tip_radius);
    let [half_width, dorsal, palmar] = TIP.map(|share| share * tip_radius);
    sections.push(Section { along: tip_centre, half_width, dorsal, palmar });
    let frame: &Isometry3<f64> = &bind.palm_from_segment[digit][0];
    Loft::new(frame, sections, [lower[0], tip_radius * 1.03])
}
