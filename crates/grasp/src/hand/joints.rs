//! Names of the fingers and the angles of every joint the glove can feel.

/// One digit of the hand, in the order of the glove and of the wire.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Finger {
    /// Thumb.
    Thumb,
    /// Index finger.
    Index,
    /// Middle finger.
    Middle,
    /// Ring finger.
    Ring,
    /// Little finger.
    Little,
}

impl Finger {
    /// All five digits, thumb first.
    pub const ALL: [Self; 5] = [Self::Thumb, Self::Index, Self::Middle, Self::Ring, Self::Little];

    /// Position in [`Finger::ALL`] and in every array with one entry per finger.
    pub const fn index(self) -> usize {
        self as usize
    }

    /// Whether this is one of the three fingers whose common touch attaches the object.
    ///
    /// Source: thesis 4.5.2.
    pub const fn attaches(self) -> bool {
        matches!(self, Self::Index | Self::Middle | Self::Ring)
    }
}

impl std::fmt::Display for Finger {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(["thumb", "index", "middle", "ring", "little"][self.index()])
    }
}

/// Joint angles of one of the four fingers.
///
/// Units: rad. Signs are anatomical, so they are the same for a left and a right hand.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct FingerAngles {
    /// Metacarpophalangeal joint (MPJ), positive = bending toward the palm.
    pub mcp_flexion: f64,
    /// Proximal interphalangeal joint (PIJ), positive = bending toward the palm.
    pub pip_flexion: f64,
    /// Distal interphalangeal joint (DIJ), positive = bending toward the palm.
    pub dip_flexion: f64,
    /// Sideways angle at the MPJ against the metacarpal, positive = toward the thumb.
    pub abduction: f64,
}

/// Joint angles of the thumb.
///
/// Units: rad. Signs are anatomical, so they are the same for a left and a right hand.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ThumbAngles {
    /// Trapeziometacarpal (TMJ) rotation about the line to the index MPJ, positive = swinging in
    /// front of the palm toward the little finger; 0 = beside the flat palm.
    pub rotation: f64,
    /// Angle between thumb and index metacarpal less its flat-hand value, positive = away from
    /// the index finger.
    pub abduction: f64,
    /// Metacarpophalangeal joint (MPJ), positive = bending toward the pulp.
    pub mcp_flexion: f64,
    /// Interphalangeal joint (IJ), positive = bending toward the pulp.
    pub ip_flexion: f64,
}

/// Every joint angle of one hand; all zero is the flat hand.
///
/// Units: rad. Flexion is positive when it bends toward the palm, abduction and wrist yaw when
/// they turn toward the thumb side. A vendor's opposite sign is undone where its bytes are read.
///
/// Source: thesis section 2.2.2 (which joints the glove has sensors for).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct JointAngles {
    /// Joint angles of the thumb.
    pub thumb: ThumbAngles,
    /// Joint angles of the index finger.
    pub index: FingerAngles,
    /// Joint angles of the middle finger.
    pub middle: FingerAngles,
    /// Joint angles of the ring finger.
    pub ring: FingerAngles,
    /// Joint angles of the little finger.
    pub little: FingerAngles,
    /// Cupping of the palm at the little finger's side, positive = toward the palm.
    pub palm_arch: f64,
    /// Wrist flexion, positive = toward the palm.
    pub wrist_pitch: f64,
    /// Wrist deviation, positive = toward the thumb (radial).
    pub wrist_yaw: f64,
}

/// Number of angles in [`JointAngles`].
pub const ANGLE_COUNT: usize = 23;

/// Names of the joint angles, in the order of [`JointAngles::to_array`].
pub const ANGLE_NAMES: [&str; ANGLE_COUNT] = [
    "thumb rotation",
    "thumb mpj",
    "thumb ij",
    "thumb abduction",
    "index mpj",
    "index pij",
    "index dij",
    "index abduction",
    "middle mpj",
    "middle pij",
    "middle dij",
    "middle abduction",
    "ring mpj",
    "ring pij",
    "ring dij",
    "ring abduction",
    "little mpj",
    "little pij",
    "little dij",
    "little abduction",
    "palm arch",
    "wrist pitch",
    "wrist yaw",
];

impl JointAngles {
    /// The flat hand: fingers straight and in line with their metacarpals.
    pub const fn flat() -> Self {
        let finger =
            FingerAngles { mcp_flexion: 0.0, pip_flexion: 0.0, dip_flexion: 0.0, abduction: 0.0 };
        let thumb =
            ThumbAngles { rotation: 0.0, abduction: 0.0, mcp_flexion: 0.0, ip_flexion: 0.0 };
        Self {
            thumb,
            index: finger,
            middle: finger,
            ring: finger,
            little: finger,
            palm_arch: 0.0,
            wrist_pitch: 0.0,
            wrist_yaw: 0.0,
        }
    }

    /// A closed fist with the thumb over the fingers: the second gesture of a calibration.
    ///
    /// The angles are what most adults reach without force, inside the active ranges of the
    /// KINE-ADL study; wrist straight, no abduction.
    pub const fn fist() -> Self {
        let finger = FingerAngles {
            mcp_flexion: 1.31,
            pip_flexion: 1.66,
            dip_flexion: 1.05,
            abduction: 0.0,
        };
        let thumb =
            ThumbAngles { rotation: 0.87, abduction: -0.17, mcp_flexion: 0.52, ip_flexion: 0.87 };
        Self {
            thumb,
            index: finger,
            middle: finger,
            ring: finger,
            little: finger,
            palm_arch: 0.26,
            wrist_pitch: 0.0,
            wrist_yaw: 0.0,
        }
    }

    /// Angles of one of the four fingers, `None` for the thumb.
    pub const fn finger(&self, finger: Finger) -> Option<&FingerAngles> {
        match finger {
            Finger::Thumb => None,
            Finger::Index => Some(&self.index),
            Finger::Middle => Some(&self.middle),
            Finger::Ring => Some(&self.ring),
            Finger::Little => Some(&self.little),
        }
    }

    /// The angles as an array, in the slot order of the glove's own tables.
    ///
    /// Shapes: thumb rotation, MPJ, IJ, abduction; index, middle, ring, little each MPJ, PIJ,
    /// DIJ, abduction; palm arch, wrist pitch, wrist yaw.
    pub fn to_array(&self) -> [f64; ANGLE_COUNT] {
        let t = &self.thumb;
        let mut array = [0.0; ANGLE_COUNT];
        array[..4].copy_from_slice(&[t.rotation, t.mcp_flexion, t.ip_flexion, t.abduction]);
        for (i, f) in [&self.index, &self.middle, &self.ring, &self.little].into_iter().enumerate()
        {
            let slots = [f.mcp_flexion, f.pip_flexion, f.dip_flexion, f.abduction];
            array[4 + 4 * i..8 + 4 * i].copy_from_slice(&slots);
        }
        array[20..].copy_from_slice(&[self.palm_arch, self.wrist_pitch, self.wrist_yaw]);
        array
    }

    /// The joint angles of an array in the order of [`JointAngles::to_array`].
    pub fn from_array(a: &[f64; ANGLE_COUNT]) -> Self {
        let finger = |i: usize| FingerAngles {
            mcp_flexion: a[i],
            pip_flexion: a[i + 1],
            dip_flexion: a[i + 2],
            abduction: a[i + 3],
        };
        Self {
            thumb: ThumbAngles {
                rotation: a[0],
                mcp_flexion: a[1],
                ip_flexion: a[2],
                abduction: a[3],
            },
            index: finger(4),
            middle: finger(8),
            ring: finger(12),
            little: finger(16),
            palm_arch: a[20],
            wrist_pitch: a[21],
            wrist_yaw: a[22],
        }
    }

    /// Joint angles between those of `self` (`t` = 0) and of `other` (`t` = 1), each linear in `t`.
    pub fn lerp(&self, other: &Self, t: f64) -> Self {
        let (from, to) = (self.to_array(), other.to_array());
        let mut between = [0.0; ANGLE_COUNT];
        for i in 0..ANGLE_COUNT {
            between[i] = from[i] + (to[i] - from[i]) * t;
        }
        Self::from_array(&between)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn index_is_the_position_in_all() {
        for (i, finger) in Finger::ALL.into_iter().enumerate() {
            assert_eq!(finger.index(), i);
        }
    }

    #[test]
    fn array_and_struct_agree_in_every_slot() {
        let mut array = [0.0; ANGLE_COUNT];
        for (i, value) in array.iter_mut().enumerate() {
            *value = i as f64;
        }
        let angles = JointAngles::from_array(&array);
        assert_eq!(angles.to_array(), array);
        assert_eq!(angles.thumb.abduction, 3.0);
        assert_eq!(angles.index.dip_flexion, 6.0);
        assert_eq!(angles.ring.abduction, 15.0);
        assert_eq!(angles.wrist_yaw, 22.0);
    }

    #[test]
    fn halfway_between_flat_and_fist_is_half_a_fist() {
        let half = JointAngles::flat().lerp(&JointAngles::fist(), 0.5);
        assert_eq!(half.index.pip_flexion, 0.83);
        assert_eq!(JointAngles::flat().lerp(&JointAngles::fist(), 1.0), JointAngles::fist());
    }

    #[test]
    fn thumb_has_no_finger_angles() {
        assert!(JointAngles::fist().finger(Finger::Thumb).is_none());
        assert_eq!(JointAngles::fist().finger(Finger::Ring).unwrap().dip_flexion, 1.05);
    }
}
