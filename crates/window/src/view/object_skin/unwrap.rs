//! How a rest shape is spread out flat, so that a picture can be put on it.

use std::f64::consts::FRAC_PI_2;

use nalgebra::{Point3, Vector3};

use super::tube_profile::{TubePlace, TubeProfile};

/// A way to spread a surface; each drawn triangle lies in one chart.
///
/// Charts of one surface overlap a little at their rims, so no picture ends at a seam.
pub(super) enum Unwrap {
    /// Upper and lower half as two discs side by side, for what is round about its centre.
    Discs {
        /// Point where all rays start. Units: m.
        centre: Point3<f64>,
    },
    /// Front and back of a tube, one above the other.
    Sides(TubeProfile),
    /// Each face of a box fills the whole picture.
    Faces {
        /// Lower and upper corner of the box. Units: m.
        low: Point3<f64>,
        high: Point3<f64>,
    },
    /// The surface has no picture.
    Nothing,
}

impl Unwrap {
    /// Chart of a triangle, told by its middle and its normal.
    pub(super) fn chart(&self, middle: &Point3<f64>, normal: &Vector3<f64>) -> u8 {
        match self {
            Self::Discs { centre } => u8::from(middle.y < centre.y),
            Self::Sides(profile) => u8::from(profile.place(middle).quarters >= 2.0),
            Self::Faces { .. } => normal.iamax() as u8,
            Self::Nothing => 0,
        }
    }

    /// Place of a point in the picture, both coordinates 0 to 1.
    pub(super) fn place(&self, chart: u8, p: &Point3<f64>) -> [f64; 2] {
        match self {
            Self::Discs { centre } => {
                let ray = p - centre;
                let up = if chart == 0 { ray.y } else { -ray.y };
                let across = ray.x.hypot(ray.z);
                // What a triangle has beyond the overlap ends at the rim of the picture.
                let reach = (DISC_RIM * across.atan2(up) / FRAC_PI_2).min(0.5) / across.max(1e-12);
                let left = if chart == 0 { 0.25 } else { 0.75 };
                [left + 0.5 * reach * ray.x, 0.5 + reach * ray.z]
            }
            Self::Sides(profile) => {
                let TubePlace { along, quarters, .. } = profile.place(p);
                // Quarter turns from the middle of the chart, −2 to 2.
                let middle = if chart == 0 { 1.0 } else { 3.0 };
                let from_middle = (quarters - middle + 2.0).rem_euclid(4.0) - 2.0;
                let from_middle = from_middle.clamp(-1.0 / SIDE_RIM, 1.0 / SIDE_RIM);
                let row = if chart == 0 { 0.25 } else { 0.75 };
                [along, row - 0.25 * SIDE_RIM * from_middle]
            }
            Self::Faces { low, high } => {
                let size = high - low;
                let (a, b) = [(2, 1), (0, 2), (0, 1)][usize::from(chart % 3)];
                let part = |d: usize| ((p[d] - low[d]) / size[d]).clamp(0.0, 1.0);
                [part(a), 1.0 - part(b)]
            }
            Self::Nothing => [0.0, 0.0],
        }
    }
}

/// Where the equator lies in its disc; the rest is overlap. Units: sides of the disc's square.
const DISC_RIM: f64 = 0.4;
/// Where a side of a tube ends in its half of the picture; the rest is overlap.
const SIDE_RIM: f64 = 0.85;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn discs_are_laid_out_by_angle_and_agree_along_the_equator() {
        let discs = Unwrap::Discs { centre: Point3::new(0.0, 0.01, 0.0) };
        let top = discs.place(0, &Point3::new(0.0, 0.04, 0.0));
        assert_eq!(top, [0.25, 0.5]);
        let side = Point3::new(0.03, 0.01, 0.0);
        let (upper, lower) = (discs.place(0, &side), discs.place(1, &side));
        assert!((upper[0] - (0.25 + 0.2)).abs() < 1e-12 && (upper[1] - 0.5).abs() < 1e-12);
        assert!((lower[0] - (0.75 + 0.2)).abs() < 1e-12 && (lower[1] - 0.5).abs() < 1e-12);
        assert_eq!(discs.chart(&side, &Vector3::x()), 0);
    }
}
