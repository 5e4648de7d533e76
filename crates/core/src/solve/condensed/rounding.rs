//! Rounding errors by the standard model of floating point, and the slack for sums in a bound.

use crate::fem::Stiffness;
use crate::solve::vectors::norm;

/// Unit roundoff of double precision.
pub(super) const UNIT: f64 = f64::EPSILON / 2.0;
/// What the arithmetic of a bound itself can lose: sums of up to 10⁷ terms without cancellation.
pub(super) const SLACK: f64 = 1.0 + 1e-8;
/// Sizes between which squares and products of four factors neither overflow nor underflow.
pub(super) const SAFE: std::ops::RangeInclusive<f64> = 1e-70..=1e70;

/// `γₙ = n u / (1 − n u)` with the unit roundoff u.
pub(super) fn gamma(n: usize) -> f64 {
    let n = n as f64 * UNIT;
    n / (1.0 - n)
}

/// Bound of a quantity that is `computed` and off by at most `rounding`.
///
/// Where rounding is all there is (up to twice its bound) the result is a multiple of `rounding`
/// alone. That is larger, and does not change with the units, as the rounding errors themselves do.
pub(super) fn settled(computed: f64, rounding: f64) -> f64 {
    match computed <= 2.0 * rounding {
        true => 3.0 * rounding,
        false => computed + rounding,
    }
}

/// Entries of the longest row of `K`.
pub(super) fn longest_row(stiffness: &Stiffness) -> usize {
    let rows = (0..stiffness.node_count()).map(|n| stiffness.pattern().columns(n).len());
    3 * rows.max().unwrap_or(0)
}

/// Bound on how far the computed product `K x` less a load can be off, as a norm.
///
/// Source: Higham, Accuracy and Stability of Numerical Algorithms, (3.12): `|fl(Kx) − Kx| ≤ γₙ |K||x|`
/// with n the longest row; one more term for the load.
pub(super) fn rounding_of_product(stiffness: &Stiffness, x: &[f64]) -> f64 {
    gamma(longest_row(stiffness) + 3) * norm(&stiffness.mul_abs(x)) * SLACK
}

/// Half the largest row sum of `|K − Kᵀ|`: how far a symmetric matrix of entries of `K` can be from
/// its symmetric part. Rounding only, so a multiple of it where it is no more.
///
/// Units: N/m.
pub(super) fn asymmetry(stiffness: &Stiffness, stiffest: f64) -> f64 {
    let pattern = stiffness.pattern();
    let mut sums = vec![0.0f64; 3 * stiffness.node_count()];
    for node in 0..stiffness.node_count() {
        for (column, block) in stiffness.row(node).filter(|(column, _)| *column >= node) {
            let mirrored = pattern.columns(column).binary_search(&(node as u32));
            let blocks = stiffness.row(column).nth(mirrored.unwrap_or(usize::MAX - 1));
            let other = blocks.map_or([0.0; 9], |(_, other)| *other);
            for r in 0..3 {
                for c in 0..3 {
                    let gap = (block[3 * r + c] - other[3 * c + r]).abs();
                    sums[3 * node + r] += gap;
                    if column != node {
                        sums[3 * column + c] += gap;
                    }
                }
            }
        }
    }
    let computed = 0.5 * sums.into_iter().fold(0.0, f64::max) * SLACK;
    settled(computed, 4.0 * UNIT * stiffest)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn computed_rounding_is_replaced_by_its_bound_and_more_is_kept() {
        assert_eq!(settled(0.3, 1.0), settled(1.9, 1.0));
        assert_eq!(settled(10.0, 1.0), 11.0);
        assert!(gamma(50) > 50.0 * UNIT && gamma(50) < 50.1 * UNIT);
    }
}
