//! How fast the palm of the mouse hand may go: a jump of the mouse must not throw it through the
//! object between two ticks.

use nalgebra::{Isometry3, Translation3, UnitQuaternion};

/// Fastest motion of the palm, m/s.
pub const SPEED_MAX_M_S: f64 = 1.5;
/// Fastest turn of the palm, rad/s.
pub const TURN_MAX_RAD_S: f64 = 5.0;

/// Part of the way from one palm pose to another, as far as the palm may go in this time.
///
/// Units: s. Frames: both world from palm.
pub fn limited(from: &Isometry3<f64>, to: &Isometry3<f64>, seconds: f64) -> Isometry3<f64> {
    let way = to.translation.vector - from.translation.vector;
    let angle = from.rotation.angle_to(&to.rotation);
    let share_of = |most: f64, all: f64| if all > most { most / all } else { 1.0 };
    let share = share_of(SPEED_MAX_M_S * seconds, way.norm())
        .min(share_of(TURN_MAX_RAD_S * seconds, angle));
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
