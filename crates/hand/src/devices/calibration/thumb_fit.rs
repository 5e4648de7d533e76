//! Fits the coupling of the thumb's two sensors to three gestures.

use nalgebra::{Matrix2, Vector2};

use super::checks::check;
use super::linear::Calibration;
use super::thumb::{THUMB_ROOT, ThumbCoupling};

/// Outcome of a fit for the coupling of the thumb's two sensors.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ThumbFit {
    /// No third gesture: not coupled.
    NotShown,
    /// Both gains, both offsets and the coupling are new.
    Coupled,
    /// The three gestures do not tell both sensors apart: not coupled.
    TooAlike,
    /// A sensor is dead or gave no reading: not coupled.
    Unread,
}

/// Angles in rad and mean readings of rotation and abduction in one gesture.
#[derive(Clone, Copy, Debug)]
pub(super) struct ThumbRoot {
    pub(super) angles: [f64; 2],
    pub(super) counts: [Option<f64>; 2],
}

/// Smallest distance of the readings of fist and third gesture from those of the flat hand, counts.
const MIN_COUNTS: f64 = 10.0;
/// Smallest sine of the angle between the directions of these two changes.
const MIN_SINE: f64 = 0.2;

/// Solves for the 2 × 2 matrix that turns the changes of the readings into those of the angles.
///
/// Shapes: flat hand, fist, thumb across. Where it cannot be done the calibration stays as it was.
pub(super) fn fit_thumb(calibration: &mut Calibration, gestures: &[ThumbRoot; 3]) -> ThumbFit {
    if THUMB_ROOT.iter().any(|&sensor| calibration.sensor(sensor).dead) {
        return ThumbFit::Unread;
    }
    let counts = gestures.map(|g| Some(Vector2::new(g.counts[0]?, g.counts[1]?)));
    let [Some(flat), Some(fist), Some(across)] = counts else { return ThumbFit::Unread };
    let (to_fist, to_across) = (fist - flat, across - flat);
    let (a, b) = (to_fist.norm(), to_across.norm());
    let readings = Matrix2::from_columns(&[to_fist, to_across]);
    let told_apart = a.min(b) >= MIN_COUNTS && readings.determinant().abs() >= MIN_SINE * a * b;
    let Some(inverse) = readings.try_inverse().filter(|_| told_apart) else {
        return ThumbFit::TooAlike;
    };
    let angles = gestures.map(|g| Vector2::from(g.angles));
    let gains = Matrix2::from_columns(&[angles[1] - angles[0], angles[2] - angles[0]]) * inverse;
    let Some(back) = gains.try_inverse() else { return ThumbFit::TooAlike };
    let offsets = flat - back * angles[0];
    let mut fitted = calibration.clone();
    for (i, sensor) in THUMB_ROOT.into_iter().enumerate() {
        let line = &mut fitted.sensors[sensor.index()];
        line.offset_counts = offsets[i];
        line.gain_rad_per_count = gains[(i, i)];
    }
    fitted.thumb_coupling = ThumbCoupling {
        rotation_rad_per_abduction_count: gains[(0, 1)],
        abduction_rad_per_rotation_count: gains[(1, 0)],
    };
    if check(&fitted).is_err() {
        return ThumbFit::TooAlike;
    }
    *calibration = fitted;
    ThumbFit::Coupled
}
