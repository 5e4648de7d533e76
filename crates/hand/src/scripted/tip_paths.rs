//! Paths of the fingertips in the palm's frame while fingers and thumb close: the same for every palm pose, so
//! they are worked out once, with the angles that survive the glove's sensors.

use nalgebra::{Isometry3, Point3};
use softgrasp_grasp::hand::{HandColliders, pose};
use softgrasp_grasp::shape::Sphere;

use super::posture::{Posture, angles};
use crate::hand_setup::HandSetup;

/// Steps from open to closed.
pub(super) const STEPS: usize = 40;
/// Postures of the thumb: rotation and abduction, rad.
const THUMB_ROTATIONS: [f64; 4] = [0.4, 0.7, 1.0, 1.3];
const THUMB_ABDUCTIONS: [f64; 3] = [0.1, 0.4, 0.7];

/// One fingertip at every closure, in the palm frame.
pub(super) type TipPath = Vec<Tip>;

#[derive(Clone, Copy)]
pub(super) struct Tip {
    pub sphere: Sphere,
    pub contact_point: Point3<f64>,
}

pub(super) fn tips(setup: &HandSetup, closure: &[f64; 5], posture: Posture) -> [Tip; 5] {
    let angles = setup.felt(&angles(closure, posture));
    let pose = pose(&setup.dimensions, &angles, Isometry3::identity());
    HandColliders::new(&setup.dimensions, &pose)
        .fingers
        .map(|f| Tip { sphere: f.tip, contact_point: f.contact_point })
}

pub(super) fn closures() -> impl Iterator<Item = f64> {
    (0..=STEPS).map(|step| step as f64 / STEPS as f64)
}

/// Paths of index, middle, ring and little finger, gathered and curled so far.
pub(super) fn finger_paths(setup: &HandSetup, gather: f64, curl: f64) -> [TipPath; 4] {
    let posture = Posture { gather, curl, ..Posture::OPEN };
    let steps: Vec<[Tip; 5]> = closures().map(|s| tips(setup, &[s; 5], posture)).collect();
    std::array::from_fn(|finger| steps.iter().map(|tips| tips[finger + 1]).collect())
}

/// Paths of the thumb in each of its postures.
pub(super) fn thumb_paths(setup: &HandSetup, curl: f64) -> Vec<(Posture, TipPath)> {
    let mut all = Vec::new();
    for thumb_rotation in THUMB_ROTATIONS {
        for thumb_abduction in THUMB_ABDUCTIONS {
            let posture = Posture { thumb_rotation, thumb_abduction, gather: 0.0, curl };
            all.push((posture, closures().map(|s| tips(setup, &[s; 5], posture)[0]).collect()));
        }
    }
    all
}
