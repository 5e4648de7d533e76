//! Bone lengths, radii and joint places of one hand, scaled from hand length and breadth.

use nalgebra::{Point3, Vector3};

/// Right or left hand; the left one is the mirror image of the right one across the palm's Y–Z plane.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Handedness {
    /// Right hand.
    #[default]
    Right,
    /// Left hand.
    Left,
}

impl Handedness {
    /// The word `right` or `left`.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Right => "right",
            Self::Left => "left",
        }
    }

    /// The other hand.
    #[must_use]
    pub const fn other(self) -> Self {
        match self {
            Self::Right => Self::Left,
            Self::Left => Self::Right,
        }
    }
}

/// Dimensions of one of the four fingers.
///
/// Units: m, rad. Frame: palm frame of a right hand (`docs/frames.md`).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FingerDimensions {
    /// Place of the metacarpophalangeal joint.
    pub mcp_in_palm: Point3<f64>,
    /// Direction of the straight finger in the flat hand, from +Y toward the thumb.
    pub fan: f64,
    /// Share of the palm arch angle that this finger's metacarpal follows, 0 to 1.
    pub arch_share: f64,
    /// Lengths of proximal, middle and distal segment; the distal one reaches the end of the pulp.
    pub lengths: [f64; 3],
    /// Radii of the three segments at their thick (lower) end.
    pub radii: [f64; 3],
    /// Radius of the fingertip hemisphere.
    pub tip_radius: f64,
}

/// Dimensions of the thumb.
///
/// Units: m, rad. Frame: palm frame of a right hand (`docs/frames.md`).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ThumbDimensions {
    /// Place of the trapeziometacarpal joint (TMJ).
    pub tmj_in_palm: Point3<f64>,
    /// Angle between the thumb and the line TMJ → index MPJ in the flat hand.
    pub fan: f64,
    /// Turn of the thumb about its own bone: how far the nail looks away from the back of the
    /// hand toward the outside.
    pub roll: f64,
    /// Lengths of metacarpal, proximal and distal segment; the distal one reaches the end of the pulp.
    pub lengths: [f64; 3],
    /// Radii of the three segments at their thick (lower) end.
    pub radii: [f64; 3],
    /// Radius of the fingertip hemisphere.
    pub tip_radius: f64,
}

/// Dimensions of a hand: all that does not change as it moves.
///
/// Units: m. Invariant of [`HandDimensions::scaled`]: all lengths and radii are positive and each
/// distal segment is longer than its tip radius.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HandDimensions {
    /// Right or left hand; the places below are for the right hand and mirrored on use.
    pub handedness: Handedness,
    /// Wrist crease to the tip of the middle finger.
    pub hand_length: f64,
    /// Breadth across the knuckles.
    pub hand_breadth: f64,
    /// Dimensions of the thumb.
    pub thumb: ThumbDimensions,
    /// Dimensions of index, middle, ring and little finger.
    pub fingers: [FingerDimensions; 4],
}

/// Why a hand of this size cannot be built.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum DimensionsError {
    /// Hand length is not a human one.
    #[error("hand length {length_m} m is outside 0.10 to 0.30 m")]
    Length {
        /// Length that was given, m.
        length_m: f64,
    },
    /// Hand breadth is not a human one.
    #[error("hand breadth {breadth_m} m is outside 0.04 to 0.16 m")]
    Breadth {
        /// Breadth that was given, m.
        breadth_m: f64,
    },
    /// The hand is so short and broad that a fingertip would be a ball longer than its bone.
    #[error("hand length {length_m} m is too short for breadth {breadth_m} m")]
    Proportion {
        /// Length that was given, m.
        length_m: f64,
        /// Breadth that was given, m.
        breadth_m: f64,
    },
}

/// Bone lengths in mm: thumb to little finger; metacarpal (thumb) or proximal, next, distal with
/// the soft pulp added (Buryanov & Kotiuk 2010, X-rays of 66 adults).
const BONES_MM: [[f64; 3]; 5] = [
    [46.22, 31.57, 21.67 + 5.67],
    [39.78, 22.38, 15.82 + 3.84],
    [44.63, 26.33, 17.40 + 3.95],
    [41.37, 25.65, 17.30 + 3.95],
    [32.74, 18.11, 15.96 + 3.73],
];
/// Radii in mm at the lower end of the three segments, then the tip, for breadth 84 mm
/// (Immersive Web emulator's default hand).
const RADII_MM: [[f64; 4]; 5] = [
    [19.4, 12.3, 9.8, 8.8],
    [10.3, 8.5, 7.6, 6.6],
    [11.2, 8.0, 7.6, 6.6],
    [9.9, 7.6, 7.2, 6.2],
    [8.5, 6.8, 6.4, 5.4],
];
/// MPJ of index to little finger: lateral / breadth (+ = away from the thumb), axial / length
/// (Buchholz, Armstrong & Goldstein 1992).
const MCP_SHARES: [[f64; 2]; 4] = [[-0.251, 0.447], [0.0, 0.446], [0.206, 0.409], [0.402, 0.368]];
/// Directions of index to little finger in the flat hand, degrees toward the thumb
/// (GraspDB14 skeleton, MPJ to tip).
const FAN_DEG: [f64; 4] = [7.6, 0.0, -6.2, -15.9];
/// TMJ: lateral / breadth, axial / length, height above the palm plane / breadth (GraspDB14
/// skeleton moved from the wrist joint to the crease 20 mm further on; height from the emulator).
const TMJ_SHARES: [f64; 3] = [-0.321, 0.060, -0.12];
/// Thumb direction in the flat hand, degrees from +Y toward the outside (GraspDB14 skeleton).
const THUMB_FAN_DEG: f64 = 31.0;
/// Nail direction of the relaxed thumb (Immersive Web emulator's relaxed hand).
const THUMB_ROLL_DEG: f64 = 60.0;

const DEFAULT_LENGTH: f64 = 0.185;
const DEFAULT_BREADTH: f64 = 0.084;

impl Default for HandDimensions {
    /// A right hand of length 185 mm and breadth 84 mm, the mean of several surveys of men.
    fn default() -> Self {
        build(DEFAULT_LENGTH, DEFAULT_BREADTH)
    }
}

impl HandDimensions {
    /// A right hand of the given size.
    ///
    /// Lengths along the fingers follow `length_m`, radii and lateral places follow `breadth_m`.
    /// The bone table is stretched as a whole so that the flat middle finger ends at `length_m`
    /// from the wrist crease.
    ///
    /// # Errors
    /// [`DimensionsError`] when a number is not finite or not that of a human hand.
    pub fn scaled(length_m: f64, breadth_m: f64) -> Result<Self, DimensionsError> {
        if !(0.10..=0.30).contains(&length_m) {
            return Err(DimensionsError::Length { length_m });
        }
        if !(0.04..=0.16).contains(&breadth_m) {
            return Err(DimensionsError::Breadth { breadth_m });
        }
        let hand = build(length_m, breadth_m);
        let long_enough = |lengths: &[f64; 3], tip: f64| lengths[2] > tip;
        let fingers_fit = hand.fingers.iter().all(|f| long_enough(&f.lengths, f.tip_radius));
        if !(fingers_fit && long_enough(&hand.thumb.lengths, hand.thumb.tip_radius)) {
            return Err(DimensionsError::Proportion { length_m, breadth_m });
        }
        Ok(hand)
    }

    /// This hand as a left or right one.
    #[must_use]
    pub fn with_handedness(self, handedness: Handedness) -> Self {
        Self { handedness, ..self }
    }

    /// Segment lengths of every digit, thumb first, in m.
    pub fn segment_lengths(&self) -> [[f64; 3]; 5] {
        let [index, middle, ring, little] = self.fingers.map(|f| f.lengths);
        [self.thumb.lengths, index, middle, ring, little]
    }

    /// Segment radii of every digit, thumb first, in m.
    pub fn segment_radii(&self) -> [[f64; 3]; 5] {
        let [index, middle, ring, little] = self.fingers.map(|f| f.radii);
        [self.thumb.radii, index, middle, ring, little]
    }

    /// Fingertip radii, thumb first, in m.
    pub fn tip_radii(&self) -> [f64; 5] {
        let [index, middle, ring, little] = self.fingers.map(|f| f.tip_radius);
        [self.thumb.tip_radius, index, middle, ring, little]
    }
}

/// The table values at one size, unchecked.
fn build(length: f64, breadth: f64) -> HandDimensions {
    // The bone table alone would end 10 mm short of a 185 mm hand: it comes from smaller hands.
    let middle_finger_mm: f64 = BONES_MM[2].iter().sum();
    let bone_scale = length * (1.0 - MCP_SHARES[1][1]) / middle_finger_mm;
    let radius_scale = 1e-3 * breadth / DEFAULT_BREADTH;
    let lengths = |digit: usize| BONES_MM[digit].map(|mm| mm * bone_scale);
    let radii = |digit: usize| {
        let [lower, middle, upper, tip] = RADII_MM[digit].map(|mm| mm * radius_scale);
        ([lower, middle, upper], tip)
    };
    let finger = |i: usize| {
        let (radii, tip_radius) = radii(i + 1);
        FingerDimensions {
            mcp_in_palm: Point3::new(MCP_SHARES[i][0] * breadth, MCP_SHARES[i][1] * length, 0.0),
            fan: FAN_DEG[i].to_radians(),
            arch_share: [0.0, 0.0, 0.5, 1.0][i],
            lengths: lengths(i + 1),
            radii,
            tip_radius,
        }
    };
    let fingers = [finger(0), finger(1), finger(2), finger(3)];
    let [lateral, axial, height] = TMJ_SHARES;
    let tmj_in_palm = Point3::new(lateral * breadth, axial * length, height * breadth);
    let (thumb_radii, thumb_tip_radius) = radii(0);
    let thumb = ThumbDimensions {
        tmj_in_palm,
        fan: thumb_fan(&(fingers[0].mcp_in_palm - tmj_in_palm)),
        roll: THUMB_ROLL_DEG.to_radians(),
        lengths: lengths(0),
        radii: thumb_radii,
        tip_radius: thumb_tip_radius,
    };
    HandDimensions {
        handedness: Handedness::Right,
        hand_length: length,
        hand_breadth: breadth,
        thumb,
        fingers,
    }
}

/// Angle between the flat thumb and the line to the index MPJ, both seen from above the palm.
fn thumb_fan(tmj_to_index: &Vector3<f64>) -> f64 {
    THUMB_FAN_DEG.to_radians() - (-tmj_to_index.x).atan2(tmj_to_index.y)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn default_mcp_places_are_those_of_the_suggested_model() {
        let hand = HandDimensions::default();
        let expected_mm = [(-21.0, 83.0), (0.0, 83.0), (17.0, 76.0), (34.0, 68.0)];
        for (finger, (x, y)) in hand.fingers.iter().zip(expected_mm) {
            assert!((1e3 * finger.mcp_in_palm.x - x).abs() < 0.6);
            assert!((1e3 * finger.mcp_in_palm.y - y).abs() < 0.6);
        }
    }

    #[test]
    fn default_radii_are_the_table_in_metres() {
        let hand = HandDimensions::default();
        assert!((hand.fingers[1].radii[0] - 0.0112).abs() < 1e-12);
        assert!((hand.thumb.tip_radius - 0.0088).abs() < 1e-12);
    }

    #[test]
    fn default_finger_segments_agree_with_the_buchholz_scaling() {
        // Independent survey: proximal, middle and distal segment as shares of hand length.
        let shares = [[0.245, 0.143, 0.097], [0.266, 0.170, 0.108], [0.244, 0.165, 0.107]];
        let hand = HandDimensions::default();
        for (finger, shares) in hand.fingers.iter().zip(shares) {
            let total: f64 = finger.lengths.iter().sum();
            let expected: f64 = shares.iter().sum::<f64>() * hand.hand_length;
            assert!((total / expected - 1.0).abs() < 0.06, "{total} against {expected}");
        }
    }

    #[test]
    fn sizes_that_are_not_human_are_refused() {
        for length in [0.0, -0.1, 0.31, f64::NAN, f64::INFINITY] {
            assert!(matches!(
                HandDimensions::scaled(length, 0.084),
                Err(DimensionsError::Length { .. })
            ));
        }
        assert!(matches!(HandDimensions::scaled(0.185, 0.0), Err(DimensionsError::Breadth { .. })));
        assert!(matches!(
            HandDimensions::scaled(0.10, 0.16),
            Err(DimensionsError::Proportion { .. })
        ));
    }

    proptest! {
        #[test]
        fn every_accepted_hand_is_positive_and_tapers(
            length in 0.10..0.30f64, breadth in 0.04..0.16f64,
        ) {
            let Ok(hand) = HandDimensions::scaled(length, breadth) else { return Ok(()) };
            for (digit, lengths) in hand.segment_lengths().into_iter().enumerate() {
                let radii = hand.segment_radii()[digit];
                let tip = hand.tip_radii()[digit];
                prop_assert!(lengths.iter().all(|&l| l > 0.0));
                prop_assert!(radii[0] >= radii[1] && radii[1] >= radii[2] && radii[2] >= tip);
                prop_assert!(tip > 0.0 && lengths[2] > tip);
            }
        }
    }
}
