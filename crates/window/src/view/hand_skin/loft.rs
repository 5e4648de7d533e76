//! A body drawn along a straight line through oval cross-sections, rounded at its upper end.

use nalgebra::{Isometry3, Point3, Vector3};

/// One cross-section of a [`Loft`]: an oval of two halves, one toward the back and one toward the
/// palm.
///
/// Units: m.
#[derive(Clone, Copy, Debug)]
pub(super) struct Section {
    /// Place of the section on the line.
    pub along: f64,
    /// Half the width.
    pub half_width: f64,
    /// Height toward the back (+Z).
    pub dorsal: f64,
    /// Depth toward the palm (−Z).
    pub palmar: f64,
}

/// Cross-sections along +Y of a frame, joined by smooth curves; beyond the last section the body
/// ends in half an ellipsoid, before the first one likewise.
#[derive(Clone, Debug)]
pub(super) struct Loft {
    /// Frame of the sections in the palm frame, inverted.
    loft_from_palm: Isometry3<f64>,
    sections: Vec<Section>,
    /// Change of each measure along the line at each section.
    slopes: Vec<[f64; 3]>,
    /// Lengths of the half ellipsoids, at the first and at the last section.
    ends: [f64; 2],
}

impl Loft {
    /// `sections` ascend and are two at least; `ends` are the lengths of the half ellipsoids.
    pub fn new(palm_from_loft: &Isometry3<f64>, sections: Vec<Section>, ends: [f64; 2]) -> Self {
        let last = sections.len() - 1;
        let slopes = (0..=last)
            .map(|i| {
                // Level at both ends, where the half ellipsoids begin.
                if i == 0 || i == last {
                    return [0.0; 3];
                }
                let (low, high) = (&sections[i - 1], &sections[i + 1]);
                let run = high.along - low.along;
                let (low, high) = (low.measures(), high.measures());
                [0, 1, 2].map(|k| (high[k] - low[k]) / run)
            })
            .collect();
        Self { loft_from_palm: palm_from_loft.inverse(), sections, slopes, ends }
    }

    /// Signed distance to first order: exact on the surface with its gradient, roughly right
    /// elsewhere.
    ///
    /// Frame: palm.
    pub fn distance(&self, p: &Point3<f64>) -> f64 {
        let q = self.loft_from_palm * p;
        let (first, last) = (self.sections[0].along, self.sections[self.sections.len() - 1].along);
        let [half_width, dorsal, palmar] = self.measures_at(q.y.clamp(first, last));
        let height = if q.z > 0.0 { dorsal } else { palmar };
        let (beyond, end) = match q.y {
            y if y > last => (y - last, self.ends[1]),
            y if y < first => (first - y, self.ends[0]),
            _ => (0.0, 1.0),
        };
        let share = Vector3::new(q.x / half_width, beyond / end, q.z / height);
        let steepness = Vector3::new(share.x / half_width, share.y / end, share.z / height);
        let (k, gradient) = (share.norm(), steepness.norm());
        if gradient < 1e-9 { -half_width.min(height) } else { k * (k - 1.0) / gradient }
    }

    /// Half width, dorsal height and palmar depth at a place between first and last section.
    fn measures_at(&self, along: f64) -> [f64; 3] {
        let upper = self.sections.partition_point(|s| s.along < along);
        let i = upper.clamp(1, self.sections.len() - 1);
        let (low, high) = (&self.sections[i - 1], &self.sections[i]);
        let run = high.along - low.along;
        let t = (along - low.along) / run;
        // Cubic through both sections with the slopes chosen above.
        let (t2, t3) = (t * t, t * t * t);
        let [a, b] = [low.measures(), high.measures()];
        [0, 1, 2].map(|k| {
            a[k] * (2.0 * t3 - 3.0 * t2 + 1.0)
                + b[k] * (3.0 * t2 - 2.0 * t3)
                + self.slopes[i - 1][k] * run * (t3 - 2.0 * t2 + t)
                + self.slopes[i][k] * run * (t3 - t2)
        })
    }
}

impl Section {
    fn measures(&self) -> [f64; 3] {
        [self.half_width, self.dorsal, self.palmar]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn ball_and_tube() -> Loft {
        let section = |along| Section { along, half_width: 0.01, dorsal: 0.01, palmar: 0.01 };
        Loft::new(
            &Isometry3::translation(0.0, 0.02, 0.0),
            vec![section(0.0), section(0.02), section(0.05)],
            [0.01, 0.01],
        )
    }

    proptest! {
        #[test]
        fn loft_of_equal_circles_is_a_capsule(p in prop::array::uniform3(-0.05..0.1f64)) {
            let p = Point3::from(p);
            let nearest = Point3::new(0.0, p.y.clamp(0.02, 0.07), 0.0);
            let expected = (p - nearest).norm() - 0.01;
            // On the axis the gradient vanishes and the distance is a rough one.
            prop_assume!((p - nearest).norm() > 1e-3);
            prop_assert!((ball_and_tube().distance(&p) - expected).abs() < 1e-9);
        }
    }

    #[test]
    fn sections_are_met_exactly() {
        let sections = vec![
            Section { along: 0.0, half_width: 0.01, dorsal: 0.008, palmar: 0.009 },
            Section { along: 0.03, half_width: 0.007, dorsal: 0.006, palmar: 0.008 },
            Section { along: 0.05, half_width: 0.008, dorsal: 0.005, palmar: 0.004 },
        ];
        let loft = Loft::new(&Isometry3::identity(), sections.clone(), [0.01, 0.01]);
        for s in sections {
            for p in
                [[s.half_width, s.along, 0.0], [0.0, s.along, s.dorsal], [0.0, s.along, -s.palmar]]
            {
                assert!(loft.distance(&Point3::from(p)).abs() < 1e-12);
            }
        }
    }
}
