//! How the scripted hand is set, and the joint angles of a hand whose fingers have closed so far.

use softgrasp_grasp::hand::{Finger, FingerAngles, JointAngles, ThumbAngles};

/// How the hand is set before the fingers close.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Posture {
    /// Thumb rotation across the palm, rad.
    pub thumb_rotation: f64,
    /// Thumb abduction away from the palm, rad.
    pub thumb_abduction: f64,
    /// How far the fingers are brought together, 0 fanned out to 1 side by side.
    pub gather: f64,
    /// How far the outer joints bend with the knuckles: 1 as fingers curl into a fist, less for fingers
    /// that stay long and point down at what lies low.
    pub curl: f64,
}

impl Posture {
    /// Posture of the open hand.
    pub const OPEN: Self =
        Self { thumb_rotation: 0.1, thumb_abduction: 0.6, gather: 0.0, curl: 1.0 };

    /// Part of the way to another posture.
    #[must_use]
    pub fn toward(&self, other: &Self, share: f64) -> Self {
        let mix = |a: f64, b: f64| a + share * (b - a);
        Self {
            thumb_rotation: mix(self.thumb_rotation, other.thumb_rotation),
            thumb_abduction: mix(self.thumb_abduction, other.thumb_abduction),
            gather: mix(self.gather, other.gather),
            curl: mix(self.curl, other.curl),
        }
    }
}

/// Joint angles of a hand whose fingers have closed by `closure` (0 open, 1 closed), thumb first.
pub fn angles(closure: &[f64; 5], posture: Posture) -> JointAngles {
    let finger = |finger: Finger, gathered: f64| {
        let s = closure[finger.index()];
        FingerAngles {
            mcp_flexion: 0.05 + 1.35 * s,
            pip_flexion: 0.10 + 1.45 * posture.curl * s,
            dip_flexion: 0.05 + 0.75 * posture.curl * s,
            abduction: gathered * posture.gather,
        }
    };
    let s = closure[0];
    JointAngles {
        thumb: ThumbAngles {
            rotation: posture.thumb_rotation,
            abduction: posture.thumb_abduction * (1.0 - s),
            mcp_flexion: 0.7 * s,
            ip_flexion: 0.9 * posture.curl * s,
        },
        index: finger(Finger::Index, -0.16),
        middle: finger(Finger::Middle, 0.0),
        ring: finger(Finger::Ring, 0.10),
        little: finger(Finger::Little, 0.30),
        ..JointAngles::flat()
    }
}
