//! How fast the palm of the mouse hand may go and become: a jump of the mouse must neither throw it through
//! the object between two ticks, nor jerk what it holds out of the fingers.

use nalgebra::{Isometry3, Translation3, UnitQuaternion};

/// Fastest motion of the palm, m/s.
pub const SPEED_MAX_M_S: f64 = 1.5;
/// Fastest turn of the palm, rad/s.
pub const TURN_MAX_RAD_S: f64 = 5.0;

/// Largest acceleration of the palm, m/s²: half as much as that of free fall, so that a pinch which holds an
/// object twice over also lifts it.
const ACCELERATION_MAX_M_S2: f64 = 5.0;
/// Distance of a point of the hand from the point about which the palm turns, m.
const ARM_M: f64 = 0.1;

/// Part of the way from one palm pose to another, as far as the palm may go in this time. `speed` is how fast
/// it was before, and then how fast it is.
///
/// Units: s, m/s. Frames: both world from palm.
pub fn limited(
    from: &Isometry3<f64>,
    to: &Isometry3<f64>,
    speed: &mut f64,
    seconds: f64,
) -> Isometry3<f64> {
    let way = to.translation.vector - from.translation.vector;
    let angle = from.rotation.angle_to(&to.rotation);
    let length = way.norm() + ARM_M * angle;
    // It gets faster from where it is, and can stop where it is to be.
    let faster = *speed + ACCELERATION_MAX_M_S2 * seconds;
    let stopping = (2.0 * ACCELERATION_MAX_M_S2 * length).sqrt();
    let share_of = |most: f64, all: f64| if all > most { most / all } else { 1.0 };
    let share = share_of(SPEED_MAX_M_S * seconds, way.norm())
        .min(share_of(TURN_MAX_RAD_S * seconds, angle))
        .min(share_of(faster.min(stopping) * seconds, length));
    *speed = if seconds > 0.0 { share * length / seconds } else { *speed };
    if share >= 1.0 {
        return *to;
    }
    Isometry3::from_parts(
        Translation3::from(from.translation.vector + way * share),
        turned(&from.rotation, &to.rotation, share),
    )
}

/// Part of the turn from one rotation to another; half a turn goes about any axis.
pub fn turned(
    from: &UnitQuaternion<f64>,
    to: &UnitQuaternion<f64>,
    share: f64,
) -> UnitQuaternion<f64> {
    let turn = (to * from.inverse()).scaled_axis();
    UnitQuaternion::from_scaled_axis(turn * share) * from
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Vector3;

    #[test]
    fn palm_gets_faster_and_slower_gently_and_arrives() {
        let to = Isometry3::new(Vector3::new(0.0, 0.06, 0.0), Vector3::new(0.0, 0.3, 0.0));
        let (mut palm, mut speed) = (Isometry3::identity(), 0.0);
        let dt = 1.0 / 60.0;
        let mut steps = 0;
        while palm != to {
            let before = (palm.translation.vector, speed);
            palm = limited(&palm, &to, &mut speed, dt);
            assert!((palm.translation.vector - before.0).norm() <= SPEED_MAX_M_S * dt + 1e-12);
            assert!(
                speed - before.1 <= ACCELERATION_MAX_M_S2 * dt + 1e-9,
                "{speed} after {}",
                before.1
            );
            steps += 1;
            assert!(steps < 60, "it never arrives");
        }
    }
}
