//! A gentle way of the palm from one place to another around the object that it faces.

use nalgebra::{Isometry3, Point3};

use super::speed::{SPEED_MAX_M_S, TURN_MAX_RAD_S, turned};
use crate::scripted::{PalmPath, Posture};

/// A way that has been begun.
#[derive(Clone, Copy, Debug)]
pub struct Glide {
    from: Station,
    to: Station,
    /// Centre of the object in the world, m.
    centre: Point3<f64>,
    lasts_s: f64,
    at_s: f64,
}

/// Palm and posture at one end of a way.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Station {
    /// Pose of the palm, relative to the object.
    pub path: PalmPath,
    /// Posture of the hand before its fingers close.
    pub posture: Posture,
}

/// Shortest duration of a way, s.
const LASTS_MIN_S: f64 = 0.7;
/// Largest speed on a way over its mean speed.
const PEAK: f64 = 1.5;

impl Glide {
    /// A way that begins now.
    pub fn new(from: Station, to: Station, centre: Point3<f64>) -> Self {
        let angle = from.path.world_from_palm_rotation.angle_to(&to.path.world_from_palm_rotation);
        let arm = from.path.object_in_palm.norm().max(to.path.object_in_palm.norm());
        let length = (to.path.object_in_palm - from.path.object_in_palm).norm() + angle * arm;
        let lasts_s = (PEAK * length / SPEED_MAX_M_S).max(PEAK * angle / TURN_MAX_RAD_S);
        Self { from, to, centre, lasts_s: lasts_s.max(LASTS_MIN_S), at_s: 0.0 }
    }

    /// Moves on by a time; returns whether the end of the way is reached.
    ///
    /// Units: s.
    pub fn advance(&mut self, seconds: f64) -> bool {
        self.at_s = (self.at_s + seconds).min(self.lasts_s);
        self.at_s >= self.lasts_s
    }

    /// Pose of the palm in the world now.
    pub fn world_from_palm(&self) -> Isometry3<f64> {
        let (from, to, share) = (&self.from.path, &self.to.path, self.share());
        let path = PalmPath {
            world_from_palm_rotation: turned(
                &from.world_from_palm_rotation,
                &to.world_from_palm_rotation,
                share,
            ),
            object_in_palm: from.object_in_palm.lerp(&to.object_in_palm, share),
        };
        path.world_from_palm(self.centre)
    }

    /// Posture of the hand now.
    pub fn posture(&self) -> Posture {
        self.from.posture.toward(&self.to.posture, self.share())
    }

    fn share(&self) -> f64 {
        let t = self.at_s / self.lasts_s;
        t * t * (3.0 - 2.0 * t)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{UnitQuaternion, Vector3};
    use proptest::prelude::*;

    fn path(turn: [f64; 3], place: [f64; 3]) -> PalmPath {
        PalmPath {
            world_from_palm_rotation: UnitQuaternion::from_scaled_axis(Vector3::from(turn)),
            object_in_palm: Vector3::from(place),
        }
    }

    proptest! {
        #[test]
        fn palm_goes_from_end_to_end_and_never_faster_than_it_may(
            from in (prop::array::uniform3(-3.0..3.0_f64), prop::array::uniform3(-0.2..0.2_f64)),
            to in (prop::array::uniform3(-3.0..3.0_f64), prop::array::uniform3(-0.2..0.2_f64)),
        ) {
            let (from, to) = (path(from.0, from.1), path(to.0, to.1));
            let centre = Point3::new(0.1, -0.05, 0.02);
            let station = |path| Station { path, posture: Posture::OPEN };
            let mut glide = Glide::new(station(from), station(to), centre);
            let start = from.world_from_palm(centre);
            prop_assert!((glide.world_from_palm().inverse() * start).translation.vector.norm() < 1e-9);
            let step = 1.0 / 60.0;
            loop {
                let before = glide.world_from_palm();
                let arrived = glide.advance(step);
                let now = glide.world_from_palm();
                let way = (now.translation.vector - before.translation.vector).norm();
                prop_assert!(way <= SPEED_MAX_M_S * step * 1.001, "{way} m in a tick");
                prop_assert!(now.rotation.angle_to(&before.rotation) <= TURN_MAX_RAD_S * step * 1.001);
                if arrived {
                    break;
                }
            }
            let end = to.world_from_palm(centre);
            prop_assert!((glide.world_from_palm().inverse() * end).translation.vector.norm() < 1e-9);
        }
    }
}
