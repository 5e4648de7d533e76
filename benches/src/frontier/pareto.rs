//! Finds the answers that no other answer beats in both time and error.

/// Marks the answers that no other one beats: one that is faster, with an error at most `same` times as
/// large.
///
/// Shapes: (time, error) pairs; one mark each. `same` ≥ 1: errors within this factor of each other
/// count as equal. Pairs that are not finite are never marked.
pub(super) fn marks(answers: &[(f64, f64)], same: f64) -> Vec<bool> {
    let beats = |other: &(f64, f64), one: &(f64, f64)| {
        let is_better = other.0 < one.0 || (other.0 == one.0 && other.1 < one.1);
        is_better && other.1 <= same * one.1
    };
    let is_one = |a: &(f64, f64)| a.0.is_finite() && a.1.is_finite();
    answers
        .iter()
        .map(|one| is_one(one) && !answers.iter().any(|other| is_one(other) && beats(other, one)))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn the_corner_points_of_a_staircase_are_marked() {
        let answers = [(1.0, 1e-3), (2.0, 1e-6), (3.0, 1e-6), (4.0, 1e-9), (5.0, 1e-3)];
        assert_eq!(marks(&answers, 1.0), [true, true, false, true, false]);
        // 9e-7 is not worth another second if a factor of two is the same.
        assert_eq!(marks(&[(2.0, 1e-6), (3.0, 9e-7)], 2.0), [true, false]);
        assert_eq!(marks(&[(1.0, f64::NAN), (2.0, 1.0)], 1.0), [false, true]);
    }

    proptest! {
        #[test]
        fn whatever_is_not_marked_is_beaten_by_something_marked(
            answers in proptest::collection::vec((1u8..40, 1u8..40), 1..30),
        ) {
            let answers: Vec<_> =
                answers.into_iter().map(|(t, e)| (f64::from(t), f64::from(e))).collect();
            let marked = marks(&answers, 1.0);
            for (one, is_marked) in answers.iter().zip(&marked) {
                let dominates = |(other, m): (&(f64, f64), &bool)| {
                    *m && other.0 <= one.0 && other.1 <= one.1 && other != one
                };
                prop_assert_eq!(!is_marked, answers.iter().zip(&marked).any(dominates));
            }
        }
    }
}
