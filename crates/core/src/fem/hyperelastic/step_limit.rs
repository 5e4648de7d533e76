//! How far a step may go before an element turns inside out.

use nalgebra::Matrix3;
use rayon::prelude::*;

use super::body::{Body, gradient_of, points_of};
use super::connectivity::{ELEMENTS_TOGETHER, Locals};
use super::deformed::cofactor;

/// Share of the way to the first element without volume that a step may go.
const SHARE: f64 = 0.9;

/// Largest share, at most 1, of a step that leaves every element its volume, point by point.
pub(super) fn one_by_one<const K: usize>(
    body: &Body,
    locals: &Locals<K>,
    u: &[f64],
    step: &[f64],
) -> f64 {
    let pieces = locals.tets.par_chunks(ELEMENTS_TOGETHER).enumerate();
    let limits: Vec<f64> = pieces
        .map(|(piece, tets)| {
            let mut least = 1.0f64;
            for (i, nodes) in tets.iter().enumerate() {
                let tet = piece * ELEMENTS_TOGETHER + i;
                for point in 0..points_of::<K>() {
                    let gradients = body.gradients_at::<K>(tet, point);
                    let f = gradient_of(nodes, &gradients, u) + Matrix3::identity();
                    let df = gradient_of(nodes, &gradients, step);
                    least = least.min(limit_of(volume_cubic(&f, &df)));
                }
            }
            least
        })
        .collect();
    limits.into_iter().fold(1.0, f64::min)
}

/// Coefficients of `det(F + t dF)`, constant first.
fn volume_cubic(f: &Matrix3<f64>, df: &Matrix3<f64>) -> [f64; 4] {
    [f.determinant(), cofactor(f).dot(df), f.dot(&cofactor(df)), df.determinant()]
}

/// Share of a step, at most 1, that leaves an element its volume.
#[inline(always)]
pub(super) fn limit_of([c0, c1, c2, c3]: [f64; 4]) -> f64 {
    // The linear, square and cubic parts together cannot use the volume up.
    if c0 > (c1.abs() + (c2.abs() + c3.abs() * END) * END) * END {
        return 1.0;
    }
    first_root([c0, c1, c2, c3]).map_or(1.0, |root| (SHARE * root).min(1.0))
}

/// Where a step of which [`SHARE`] is all of it would end.
const END: f64 = 1.0 / SHARE;

/// Smallest root in (0, 1/0.9] of a cubic that is positive at 0; `None` if it stays positive.
fn first_root(cubic: [f64; 4]) -> Option<f64> {
    let [c0, c1, c2, c3] = cubic;
    let value = |t: f64| c0 + t * (c1 + t * (c2 + t * c3));
    // Between its turning points a cubic goes one way.
    let mut ends = [END; 3];
    let (b, root) = (2.0 * c2, (4.0 * c2 * c2 - 12.0 * c1 * c3).max(0.0).sqrt());
    let q = -0.5 * (b + root.copysign(b));
    let turns = [q / (3.0 * c3), c1 / q];
    for (place, turn) in ends.iter_mut().zip(turns) {
        if turn > 0.0 && turn < END {
            *place = turn;
        }
    }
    ends.sort_unstable_by(f64::total_cmp);
    let mut low = 0.0;
    for high in ends {
        // A NaN ends the step at once.
        if value(high) <= 0.0 || value(high).is_nan() {
            return Some(bisected(value, low, high));
        }
        low = high;
    }
    None
}

/// The place between a positive and a not positive value, from below.
fn bisected(value: impl Fn(f64) -> f64, mut low: f64, mut high: f64) -> f64 {
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if value(middle) > 0.0 {
            low = middle;
        } else {
            high = middle;
        }
    }
    low
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn first_root_is_the_first_that_sampling_finds(
            h in prop::array::uniform9(-0.5..0.5f64), d in prop::array::uniform9(-3.0..3.0f64),
        ) {
            let f = Matrix3::from_row_slice(&h) + Matrix3::identity();
            prop_assume!(f.determinant() > 0.05);
            let df = Matrix3::from_row_slice(&d);
            let found = first_root(volume_cubic(&f, &df));
            let samples = 20_000;
            let time = |i: i32| f64::from(i) / f64::from(samples) / SHARE;
            let sampled = (1..=samples).find(|&i| (f + df * time(i)).determinant() <= 0.0);
            match (found, sampled) {
                (Some(root), Some(i)) => prop_assert!(root <= time(i) && root > time(i - 2)),
                // Roots that touch zero between two samples.
                (Some(root), None) => {
                    prop_assert!((f + df * root).determinant() < 1e-6);
                }
                (None, Some(_)) => prop_assert!(false, "a root was missed"),
                (None, None) => {}
            }
        }
    }

    #[test]
    fn steps_that_flatten_are_cut_and_others_are_not() {
        let flatten = Matrix3::from_diagonal(&nalgebra::Vector3::new(-2.0, 0.0, 0.0));
        let root = first_root(volume_cubic(&Matrix3::identity(), &flatten)).unwrap();
        assert!((root - 0.5).abs() < 1e-12);
        assert_eq!(first_root(volume_cubic(&Matrix3::identity(), &Matrix3::zeros())), None);
    }
}
