//! Rigid motions that can be averaged: dual quaternions (Kavan, Collins, Žára, O'Sullivan 2008).
//!
//! The average of two turns about a joint is a turn about that joint. So a bent finger keeps its
//! thickness, which the average of two matrices would not do.

use nalgebra::{Isometry3, Quaternion, Vector3};

/// A rigid motion, or a weighted sum of some.
#[derive(Clone, Copy, Debug)]
pub(super) struct RigidMotion {
    /// Quaternion of the turn.
    real: Quaternion<f64>,
    /// Half of the shift times the turn.
    dual: Quaternion<f64>,
}

impl RigidMotion {
    /// The motion of an isometry.
    pub fn new(motion: &Isometry3<f64>) -> Self {
        let real = *motion.rotation.quaternion();
        let shift = Quaternion::from_imag(motion.translation.vector);
        Self { real, dual: shift * real * 0.5 }
    }

    /// The eight numbers of the dual quaternion, x, y, z, w of either part.
    pub fn numbers(&self) -> [f32; 8] {
        let (real, dual) = (&self.real.coords, &self.dual.coords);
        std::array::from_fn(|i| if i < 4 { real[i] } else { dual[i - 4] } as f32)
    }

    /// Weighted average of some motions; the weights sum to 1.
    pub fn blend(motions: &[Self], weights: impl Iterator<Item = (usize, f64)>) -> Self {
        let zero = Quaternion::new(0.0, 0.0, 0.0, 0.0);
        let mut sum = Self { real: zero, dual: zero };
        for (motion, weight) in weights {
            let motion = &motions[motion];
            // A quaternion and its negative are one turn; take the nearer to what is there.
            let weight = if motion.real.dot(&sum.real) < 0.0 { -weight } else { weight };
            sum.real += motion.real * weight;
            sum.dual += motion.dual * weight;
        }
        let length = sum.real.norm();
        Self { real: sum.real / length, dual: sum.dual / length }
    }

    /// A point after the motion.
    pub fn move_point(&self, point: &Vector3<f64>) -> Vector3<f64> {
        let (turn, w) = (self.real.imag(), self.real.w);
        let shift = self.dual.imag() * w - turn * self.dual.w + turn.cross(&self.dual.imag());
        self.turn(point) + shift * 2.0
    }

    /// A direction after the motion, which turns it only.
    pub fn turn(&self, direction: &Vector3<f64>) -> Vector3<f64> {
        let turn = self.real.imag();
        direction + turn.cross(&(turn.cross(direction) + direction * self.real.w)) * 2.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Point3;
    use proptest::prelude::*;

    fn any_isometry() -> impl Strategy<Value = Isometry3<f64>> {
        let triple = || prop::array::uniform3(-2.0..2.0f64);
        (triple(), triple()).prop_map(|(shift, turn)| Isometry3::new(shift.into(), turn.into()))
    }

    proptest! {
        #[test]
        fn one_motion_moves_as_its_isometry(
            motion in any_isometry(), p in prop::array::uniform3(-1.0..1.0f64),
        ) {
            let p = Vector3::from(p);
            let dual = RigidMotion::blend(&[RigidMotion::new(&motion)], [(0, 1.0)].into_iter());
            prop_assert!((dual.move_point(&p) - (motion * Point3::from(p)).coords).norm() < 1e-12);
            prop_assert!((dual.turn(&p) - motion * p).norm() < 1e-12);
        }

        #[test]
        fn half_way_between_two_turns_about_a_joint_the_joint_stays(
            joint in prop::array::uniform3(-1.0..1.0f64), angle in 0.0..2.5f64, share in 0.0..1.0f64,
        ) {
            let joint = Vector3::from(joint);
            let there = Isometry3::translation(joint.x, joint.y, joint.z);
            let bent = there * Isometry3::rotation(Vector3::x() * angle) * there.inverse();
            let motions = [RigidMotion::new(&Isometry3::identity()), RigidMotion::new(&bent)];
            let half = RigidMotion::blend(&motions, [(0, 1.0 - share), (1, share)].into_iter());
            prop_assert!((half.move_point(&joint) - joint).norm() < 1e-12);
        }
    }
}
