//! Height and width of a tube along its length, measured on its surface.

use std::f64::consts::{FRAC_PI_2, PI};

use nalgebra::Point3;

/// A tube along X: how far it reaches in Y and Z, place by place.
///
/// Units: m. Frame: the object's, at rest.
#[derive(Clone)]
pub(super) struct TubeProfile {
    /// Ends of the tube along X.
    pub(super) low: f64,
    pub(super) high: f64,
    /// Middle of the tube across.
    centre: [f64; 2],
    /// Half height, half width, evenly spaced from end to end.
    slices: Vec<[f64; 2]>,
}

/// A place on a tube.
pub(super) struct TubePlace {
    /// From the nozzle's end to the crimp's, 0 to 1.
    pub(super) along: f64,
    /// Quarter turns around, since the front began: 0 to 2 is the front, 2 to 4 the back.
    pub(super) quarters: f64,
    /// Half height and half width of the tube there, m.
    pub(super) half_extents: [f64; 2],
}

impl TubeProfile {
    /// Measures a tube on points of its surface.
    pub(super) fn new(points: &[Point3<f64>]) -> Self {
        let range = |d: usize| {
            points.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), p| {
                (low.min(p[d]), high.max(p[d]))
            })
        };
        let ((low, high), y, z) = (range(0), range(1), range(2));
        let centre = [(y.0 + y.1) / 2.0, (z.0 + z.1) / 2.0];
        let mut slices = vec![[0f64; 2]; SLICES];
        for p in points {
            let at = ((p.x - low) / (high - low) * (SLICES - 1) as f64).round() as usize;
            let slice = &mut slices[at.min(SLICES - 1)];
            for d in 0..2 {
                slice[d] = slice[d].max((p[d + 1] - centre[d]).abs());
            }
        }
        // A slice without points is as its neighbour towards the nozzle.
        for i in 1..SLICES {
            if slices[i] == [0.0; 2] {
                slices[i] = slices[i - 1];
            }
        }
        Self { low, high, centre, slices }
    }

    /// Half height and half width at a place along X, averaged over the neighbouring slices.
    pub(super) fn half_extents(&self, x: f64) -> [f64; 2] {
        let at = self.fraction(x) * (SLICES - 1) as f64;
        let mut sum = [0.0; 2];
        let mut weight_sum = 0.0;
        let first = (at as usize).saturating_sub(1);
        for (i, slice) in self.slices.iter().enumerate().skip(first).take(4) {
            let weight = (1.0 - (i as f64 - at).abs() / 2.0).max(0.0);
            weight_sum += weight;
            for d in 0..2 {
                sum[d] += weight * slice[d];
            }
        }
        sum.map(|s| (s / weight_sum).max(1e-6))
    }

    /// Place of a point on the tube.
    pub(super) fn place(&self, p: &Point3<f64>) -> TubePlace {
        let half_extents = self.half_extents(p.x);
        let [height, width] = half_extents;
        let angle = ((p.y - self.centre[0]) / height).atan2((p.z - self.centre[1]) / width);
        let quarters = ((angle - FRONT_BEGINS) / FRAC_PI_2).rem_euclid(4.0);
        TubePlace { along: self.fraction(p.x), quarters, half_extents }
    }

    fn fraction(&self, x: f64) -> f64 {
        ((x - self.low) / (self.high - self.low).max(f64::MIN_POSITIVE)).clamp(0.0, 1.0)
    }
}

const SLICES: usize = 48;
/// Angle, from +Z towards +Y, at which the front begins: its middle is 36° up, so that it is
/// read from the front and from above.
const FRONT_BEGINS: f64 = -0.3 * PI;
