//! How much each vertex of the skin follows each bone.

use nalgebra::Point3;

use super::bind_pose::BindPose;
use super::hand_body::HandBody;
use crate::view::blend::smooth_step;

/// The palm, two metacarpals that cup, three segments for each of five digits.
pub const BONE_COUNT: usize = 18;
/// The palm with the wrist, and the metacarpals of index and middle finger.
pub(super) const PALM: usize = 0;
/// Metacarpals of ring and little finger.
pub(super) const METACARPALS: [usize; 2] = [1, 2];

/// Weights below this are left out: they move nothing that one sees.
const LEAST: f64 = 0.004;

/// Number of the bone of a segment.
pub(super) fn bone_of_segment(digit: usize, segment: usize) -> usize {
    3 + 3 * digit + segment
}

/// For every vertex a short list of bones and their weights.
#[derive(Clone, Debug, Default)]
pub(super) struct BoneWeights {
    /// Where each vertex's list begins; one more entry at the end.
    starts: Vec<u32>,
    bones: Vec<(u8, f32)>,
}

impl BoneWeights {
    /// Weights of places on the skin of a right hand in the bind pose.
    pub fn new(bind: &BindPose, body: &HandBody, places: &[Point3<f64>]) -> Self {
        let mut weights = Self { starts: vec![0], bones: Vec::new() };
        for place in places {
            weights.push(&at_place(bind, body, place));
        }
        weights
    }

    /// Bones and weights of one vertex; the weights sum to 1.
    pub fn of(&self, vertex: usize) -> impl Iterator<Item = (usize, f64)> {
        let range = self.starts[vertex] as usize..self.starts[vertex + 1] as usize;
        self.bones[range].iter().map(|&(bone, weight)| (usize::from(bone), f64::from(weight)))
    }

    /// Appends a vertex; the heaviest bone comes first, because the signs of the others are
    /// chosen after it.
    fn push(&mut self, weights: &[f64; BONE_COUNT]) {
        let mut list: Vec<(u8, f64)> =
            (0u8..).zip(*weights).filter(|&(_, weight)| weight > LEAST).collect();
        list.sort_by(|a, b| b.1.total_cmp(&a.1));
        let sum: f64 = list.iter().map(|entry| entry.1).sum();
        self.bones.extend(list.iter().map(|&(bone, weight)| (bone, (weight / sum) as f32)));
        self.starts.push(u32::try_from(self.bones.len()).expect("a few bones for each vertex"));
    }
}

/// Weights of all bones at one place.
fn at_place(bind: &BindPose, body: &HandBody, place: &Point3<f64>) -> [f64; BONE_COUNT] {
    let mut weights = [0.0; BONE_COUNT];
    let thumb = thumb_share(bind, body, place);
    add_chain(&mut weights, bind, 0, place, thumb);
    let shares = finger_shares(body, bind, place);
    let mut rest = 1.0 - thumb;
    for digit in 1..5 {
        let share = (1.0 - thumb) * shares[digit - 1] * knuckle_ramp(bind, digit, place);
        add_chain(&mut weights, bind, digit, place, share);
        rest -= share;
    }
    for (bone, share) in cupping_shares(bind, place) {
        weights[bone] += rest * share;
    }
    weights
}

/// Shares `weight` out among the three segments of a digit, by place along it.
fn add_chain(
    weights: &mut [f64; BONE_COUNT],
    bind: &BindPose,
    digit: usize,
    place: &Point3<f64>,
    weight: f64,
) {
    let lengths = bind.dimensions.segment_lengths()[digit];
    let radii = bind.dimensions.segment_radii()[digit];
    let along = (bind.palm_from_segment[digit][0].inverse() * place).y;
    // Skin within about a radius of a joint follows both segments: less would fold it on the
    // inner side of a right angle, more would round the knuckle off.
    let beyond = |joint: f64, radius: f64| {
        let half = 1.05 * radius;
        smooth_step(joint - half, joint + half, along)
    };
    let second = beyond(lengths[0], radii[1]);
    let third = beyond(lengths[0] + lengths[1], radii[2]);
    weights[bone_of_segment(digit, 0)] += weight * (1.0 - second);
    weights[bone_of_segment(digit, 1)] += weight * second * (1.0 - third);
    weights[bone_of_segment(digit, 2)] += weight * second * third;
}

/// From 0 in the palm to 1 on the finger; the palm's side needs a longer way than the back,
/// because it is further from the joint.
fn knuckle_ramp(bind: &BindPose, digit: usize, place: &Point3<f64>) -> f64 {
    let q = bind.palm_from_segment[digit][0].inverse() * place;
    let mm = bind.radius(1.0);
    let palmar = smooth_step(6.0 * mm, -10.0 * mm, q.z);
    let low = -9.0 - 5.0 * palmar;
    let high = 10.0 + 9.0 * palmar;
    smooth_step(low * mm, high * mm, q.y)
}

/// How the part of the hand beyond the knuckles is shared among the four fingers: by distance to
/// their surfaces, so that a web follows both its fingers and the rest of a finger only itself.
fn finger_shares(body: &HandBody, bind: &BindPose, place: &Point3<f64>) -> [f64; 4] {
    let width = bind.radius(1.6);
    let distances = [1, 2, 3, 4].map(|digit: usize| body.digits[digit].distance(place));
    let nearest = distances.iter().copied().fold(f64::INFINITY, f64::min);
    let shares = distances.map(|d| ((-(d - nearest) / width).exp() - 0.03).max(0.0));
    let sum: f64 = shares.iter().sum();
    shares.map(|share| share / sum)
}

/// How much a place follows the thumb's bones instead of the palm's.
fn thumb_share(bind: &BindPose, body: &HandBody, place: &Point3<f64>) -> f64 {
    let along = (bind.palm_from_segment[0][0].inverse() * place).y;
    let length = bind.dimensions.thumb.lengths[0];
    let width = bind.radius(6.0);
    let thumb = body.palm.thenar_distance(place).min(body.digits[0].distance(place));
    let fingers = [1, 2, 3, 4].map(|digit: usize| body.digits[digit].distance(place));
    let others = fingers.into_iter().fold(body.palm.metacarpal_distance(place), f64::min);
    let nearer = 1.0 / (1.0 + ((thumb - others) / width).exp());
    // The exponential never ends: cut its tail, so that the thumb does not pull at fingers.
    let nearer = ((nearer - 0.02) / 0.96).clamp(0.0, 1.0);
    nearer * smooth_step(-0.10 * length, 0.60 * length, along)
}

/// How the palm is shared among its fixed part and the metacarpals of ring and little finger.
fn cupping_shares(bind: &BindPose, place: &Point3<f64>) -> [(usize, f64); 3] {
    let knuckles = [2, 3, 4].map(|digit| bind.root(digit));
    let [middle, ring, little] = knuckles.map(|knuckle| knuckle.x);
    let away_from_wrist = smooth_step(0.1 * knuckles[1].y, 0.8 * knuckles[1].y, place.y);
    let to_ring = ((place.x - middle) / (ring - middle)).clamp(0.0, 1.0);
    let to_little = ((place.x - ring) / (little - ring)).clamp(0.0, 1.0);
    let ring_share = away_from_wrist * to_ring * (1.0 - to_little);
    let little_share = away_from_wrist * to_little;
    [
        (PALM, 1.0 - ring_share - little_share),
        (METACARPALS[0], ring_share),
        (METACARPALS[1], little_share),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use softgrasp_grasp::hand::HandDimensions;

    proptest! {
        #[test]
        fn weights_are_shares_of_one(p in prop::array::uniform3(-0.1..0.2f64)) {
            let bind = BindPose::right(&HandDimensions::default());
            let body = HandBody::new(&bind);
            let place = Point3::from(p);
            let all = at_place(&bind, &body, &place);
            prop_assert!((all.iter().sum::<f64>() - 1.0).abs() < 1e-12);
            prop_assert!(all.iter().all(|w| (-1e-15..=1.0 + 1e-12).contains(w)));
            let kept = BoneWeights::new(&bind, &body, &[place]);
            prop_assert!((kept.of(0).map(|(_, w)| w).sum::<f64>() - 1.0).abs() < 1e-6);
        }
    }

    #[test]
    fn a_fingertip_follows_its_distal_segment_only_and_the_wrist_the_palm_only() {
        let bind = BindPose::right(&HandDimensions::default());
        let body = HandBody::new(&bind);
        for digit in 0..5 {
            let length = bind.dimensions.segment_lengths()[digit][2];
            let tip = bind.palm_from_segment[digit][2] * Point3::new(0.0, length, 0.0);
            let weights = BoneWeights::new(&bind, &body, &[tip]);
            assert_eq!(weights.of(0).collect::<Vec<_>>(), [(bone_of_segment(digit, 2), 1.0)]);
        }
        let wrist = BoneWeights::new(&bind, &body, &[Point3::new(0.03, -0.02, 0.0)]);
        assert_eq!(wrist.of(0).collect::<Vec<_>>(), [(PALM, 1.0)]);
    }
}
