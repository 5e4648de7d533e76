//! The simplified hand of thesis Figure 4.14: cylinders, fingertip spheres, contact points.

use nalgebra::{Isometry3, Point3, Unit, Vector3};

use super::dimensions::HandDimensions;
use super::joints::Finger;
use super::kinematics::{FingerPose, HandPose};
use crate::shape::{Cylinder, Sphere};

/// Colliders of one finger: what the collision search sees of it.
///
/// Units: m. Frame: whichever frame the hand was put into, the world at first.
///
/// Source: thesis section 4.4.1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FingerColliders {
    /// Finger that the colliders belong to.
    pub finger: Finger,
    /// One cylinder per segment, palm to tip; the distal one ends at the tip sphere's centre.
    pub cylinders: [Cylinder; 3],
    /// Fingertip hemisphere as its whole sphere; the other half lies inside the last cylinder.
    pub tip: Sphere,
    /// The one point of the fingertip that is tested against the object's surface (4.10).
    pub contact_point: Point3<f64>,
}

/// Colliders of a hand; the palm is left out, as in the thesis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HandColliders {
    /// Colliders of each finger, thumb to little finger.
    pub fingers: [FingerColliders; 5],
}

impl HandColliders {
    /// Colliders of a hand in one pose, in the world.
    ///
    /// `dimensions` must be those the pose was made with.
    pub fn new(dimensions: &HandDimensions, pose: &HandPose) -> Self {
        let radii = dimensions.segment_radii();
        let tip_radii = dimensions.tip_radii();
        let fingers = pose.fingers.map(|finger| {
            let digit = finger.finger.index();
            finger_colliders(&finger, radii[digit], tip_radii[digit])
        });
        Self { fingers }
    }

    /// These colliders in another frame, for example an object's.
    #[must_use]
    pub fn in_frame(&self, frame_from_world: &Isometry3<f64>) -> Self {
        Self { fingers: self.fingers.map(|finger| finger.in_frame(frame_from_world)) }
    }

    /// Colliders of one finger.
    pub fn finger(&self, finger: Finger) -> &FingerColliders {
        &self.fingers[finger.index()]
    }
}

impl FingerColliders {
    /// These colliders in another frame.
    #[must_use]
    pub fn in_frame(&self, frame_from_world: &Isometry3<f64>) -> Self {
        let m = frame_from_world;
        Self {
            finger: self.finger,
            cylinders: self.cylinders.map(|c| Cylinder {
                base: m * c.base,
                axis: Unit::new_unchecked(m * c.axis.into_inner()),
                ..c
            }),
            tip: Sphere { centre: m * self.tip.centre, ..self.tip },
            contact_point: m * self.contact_point,
        }
    }
}

fn finger_colliders(finger: &FingerPose, radii: [f64; 3], tip_radius: f64) -> FingerColliders {
    let cylinder = |i: usize| {
        let segment = &finger.segments[i];
        // The distal segment ends with the hemisphere.
        let rounded = if i == 2 { tip_radius } else { 0.0 };
        Cylinder {
            base: segment.start(),
            axis: Unit::new_unchecked(segment.world_from_segment * Vector3::y()),
            length: segment.length - rounded,
            radius: radii[i],
        }
    };
    FingerColliders {
        finger: finger.finger,
        cylinders: [cylinder(0), cylinder(1), cylinder(2)],
        tip: Sphere { centre: finger.tip_centre, radius: tip_radius },
        contact_point: finger.contact_point,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::hand::{JointAngles, pose};
    use proptest::prelude::*;

    fn colliders(angles: &JointAngles, world_from_palm: Isometry3<f64>) -> HandColliders {
        let hand = HandDimensions::default();
        HandColliders::new(&hand, &pose(&hand, angles, world_from_palm))
    }

    proptest! {
        #[test]
        fn colliders_join_and_the_contact_point_is_on_the_hemisphere(
            values in prop::array::uniform23(-0.5..1.5f64),
        ) {
            let angles = JointAngles::from_array(&values);
            for finger in colliders(&angles, Isometry3::identity()).fingers {
                let end = |c: &Cylinder| c.base + c.axis.into_inner() * c.length;
                for i in 0..2 {
                    let gap = (end(&finger.cylinders[i]) - finger.cylinders[i + 1].base).norm();
                    prop_assert!(gap < 1e-12);
                }
                prop_assert!((end(&finger.cylinders[2]) - finger.tip.centre).norm() < 1e-12);
                let out = finger.contact_point - finger.tip.centre;
                prop_assert!((out.norm() - finger.tip.radius).abs() < 1e-12);
                // On the outer half of the sphere, so not inside the distal cylinder.
                prop_assert!(out.dot(&finger.cylinders[2].axis) > 0.0);
            }
        }

        #[test]
        fn moving_the_hand_equals_moving_the_colliders(
            values in prop::array::uniform23(-0.5..1.5f64),
            shift in prop::array::uniform3(-2.0..2.0f64),
            turn in prop::array::uniform3(-2.0..2.0f64),
        ) {
            let angles = JointAngles::from_array(&values);
            let motion = Isometry3::new(shift.into(), turn.into());
            let moved_hand = colliders(&angles, motion);
            let moved_colliders = colliders(&angles, Isometry3::identity()).in_frame(&motion);
            for (a, b) in moved_hand.fingers.iter().zip(&moved_colliders.fingers) {
                prop_assert!((a.contact_point - b.contact_point).norm() < 1e-12);
                prop_assert!((a.tip.centre - b.tip.centre).norm() < 1e-12);
                for (c, d) in a.cylinders.iter().zip(&b.cylinders) {
                    prop_assert!((c.base - d.base).norm() < 1e-12);
                    prop_assert!((c.axis.into_inner() - d.axis.into_inner()).norm() < 1e-12);
                    prop_assert_eq!((c.length, c.radius), (d.length, d.radius));
                }
            }
        }
    }

    #[test]
    fn contact_points_of_a_flat_hand_lie_on_the_palm_side() {
        let flat = colliders(&JointAngles::flat(), Isometry3::identity());
        for finger in &flat.fingers[1..] {
            let below = finger.tip.centre.z - finger.contact_point.z;
            assert!((below - finger.tip.radius * std::f64::consts::FRAC_1_SQRT_2).abs() < 1e-12);
        }
        let thumb = flat.finger(Finger::Thumb);
        assert!(thumb.contact_point.z < thumb.tip.centre.z, "pulp toward the palm");
        assert!(thumb.contact_point.x > thumb.tip.centre.x, "pulp toward the fingers");
    }
}
