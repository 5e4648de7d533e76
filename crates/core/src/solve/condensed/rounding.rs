//! The arithmetic of bounds: rounding errors by the standard model of floating point, products in twice
//! the working precision, and small matrices with a bound on the error of each entry.

use nalgebra::DMatrix;
use rayon::prelude::*;

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

/// A vector whose rows are rounded once, and a bound on the norm of what else was lost.
#[derive(Clone, Debug)]
pub(super) struct Accurate {
    pub value: Vec<f64>,
    pub lost: f64,
}

/// `f − K x`, or `f − Kᵀ x` where `is_transposed`, all rows.
///
/// Shapes: `load` degrees of freedom and forces, each once; `x` and the result 3N.
///
/// Source: Ogita, Rump, Oishi, Accurate sum and dot product (2005), algorithm 5.3 and (5.8):
/// off by at most `u |value| + γₙ² |K||x|`, of which `lost` is the second part.
pub(super) fn residual(
    stiffness: &Stiffness,
    x: &[f64],
    load: &[(u32, f64)],
    is_transposed: bool,
) -> Accurate {
    let mut force = vec![0.0; x.len()];
    load.iter().for_each(|&(dof, f)| force[dof as usize] = f);
    let mut value = vec![0.0; x.len()];
    value.par_chunks_exact_mut(3).enumerate().with_min_len(64).for_each(|(node, out)| {
        let mut sums = [0, 1, 2].map(|r| (force[3 * node + r], 0.0));
        for (column, block) in stiffness.row(node) {
            let block = match is_transposed {
                true => transposed(stiffness, column, node),
                false => *block,
            };
            let x = &x[3 * column..][..3];
            for (r, (high, low)) in sums.iter_mut().enumerate() {
                for (k, x) in block[3 * r..][..3].iter().zip(x) {
                    let (product, rest) = two_product(-k, *x);
                    let (sum, lost) = two_sum(*high, product);
                    *high = sum;
                    *low += lost + rest;
                }
            }
        }
        out.iter_mut().zip(sums).for_each(|(out, (high, low))| *out = high + low);
    });
    let terms = gamma(2 * longest_row(stiffness) + 4);
    // |Kᵀ| is |K| but for rounding, which the factor 2 covers.
    let lost = 2.0 * terms * terms * norm(&stiffness.mul_abs(x)) * SLACK;
    Accurate { value, lost }
}

/// The block that stands mirrored to (`node`, `column`), transposed.
fn transposed(stiffness: &Stiffness, column: usize, node: usize) -> [f64; 9] {
    let at = stiffness.pattern().columns(column).binary_search(&(node as u32));
    let mirrored = at.ok().and_then(|at| stiffness.row(column).nth(at));
    mirrored.map_or([0.0; 9], |(_, b)| [b[0], b[3], b[6], b[1], b[4], b[7], b[2], b[5], b[8]])
}

/// `u (s ∘ K) x` with a sign for every pair of degrees of freedom that does not depend on the
/// order of the pair: what rounding errors of one unit in every entry of `K` could do, always the
/// same ones.
///
/// Shapes: 3N. Units: those of `K x`.
pub(super) fn disturbance(stiffness: &Stiffness, x: &[f64]) -> Vec<f64> {
    let mut value = vec![0.0; x.len()];
    value.par_chunks_exact_mut(3).enumerate().with_min_len(64).for_each(|(node, out)| {
        for (column, block) in stiffness.row(node) {
            for (r, out) in out.iter_mut().enumerate() {
                for c in 0..3 {
                    let sign = sign_of(3 * node + r, 3 * column + c);
                    *out += UNIT * sign * block[3 * r + c] * x[3 * column + c];
                }
            }
        }
    });
    value
}

fn sign_of(i: usize, j: usize) -> f64 {
    let pair = ((i.min(j) as u64) << 32) ^ i.max(j) as u64;
    // Murmur's finaliser: every bit of the pair reaches every bit of the result.
    let mut mixed = (pair ^ (pair >> 33)).wrapping_mul(0xff51_afd7_ed55_8ccd);
    mixed = (mixed ^ (mixed >> 33)).wrapping_mul(0xc4ce_b9fe_1a85_ec53);
    if (mixed ^ (mixed >> 33)) & 1 == 0 { 1.0 } else { -1.0 }
}

/// Sum of products as if computed in twice the working precision, and a bound on how far it is off.
///
/// Source: Ogita, Rump, Oishi, Accurate sum and dot product (2005), algorithm 5.3 and (5.8).
pub(super) fn accurate_dot(pairs: impl Iterator<Item = (f64, f64)>) -> (f64, f64) {
    let (mut high, mut low, mut sizes, mut count) = (0.0, 0.0, 0.0, 0);
    for (a, b) in pairs {
        let (product, rest) = two_product(a, b);
        let (sum, lost) = two_sum(high, product);
        high = sum;
        low += lost + rest;
        sizes += (a * b).abs();
        count += 1;
    }
    let value: f64 = high + low;
    let terms = gamma(count + 1);
    (value, (UNIT * value.abs() + terms * terms * sizes) * SLACK)
}

/// Rounded sum and what rounding lost (Knuth).
fn two_sum(a: f64, b: f64) -> (f64, f64) {
    let sum = a + b;
    let b_seen = sum - a;
    (sum, (a - (sum - b_seen)) + (b - b_seen))
}

/// Rounded product and what rounding lost (Dekker): a fused multiply-add is a slow call where the
/// processor is not known to have one.
fn two_product(a: f64, b: f64) -> (f64, f64) {
    let product = a * b;
    let ((a1, a2), (b1, b2)) = (split(a), split(b));
    (product, a2 * b2 - (((product - a1 * b1) - a2 * b1) - a1 * b2))
}

/// Two halves of 26 bits.
fn split(a: f64) -> (f64, f64) {
    let shifted = 134_217_729.0 * a;
    let high = shifted - (shifted - a);
    (high, a - high)
}

/// All matrices whose entries are within `radius` of those of `middle`.
///
/// Source: midpoint-radius arithmetic, Rump, Fast and parallel interval arithmetic (1999); the order
/// of summation does not matter, and a fused multiply-add only loses less.
#[derive(Clone, Debug)]
pub(super) struct Ball {
    pub middle: DMatrix<f64>,
    pub radius: DMatrix<f64>,
}

impl Ball {
    /// A matrix that is known exactly.
    pub fn exact(middle: DMatrix<f64>) -> Self {
        let radius = DMatrix::zeros(middle.nrows(), middle.ncols());
        Self { middle, radius }
    }

    /// The product of any two members, and the rounding of computing it.
    pub fn times(&self, other: &Self) -> Self {
        let middle = &self.middle * &other.middle;
        let (a, b) = (self.middle.abs(), other.middle.abs());
        let terms = gamma(self.middle.ncols() + 1);
        let wide = &b + &other.radius;
        let radius = (&a * &b) * terms + &a * &other.radius + &self.radius * wide;
        Self { middle, radius: radius * SLACK }
    }

    /// Transposes of all members.
    pub fn transposed(&self) -> Self {
        Self { middle: self.middle.transpose(), radius: self.radius.transpose() }
    }

    /// Bound of the Frobenius norm, and so of the spectral norm, of every member.
    pub fn norm(&self) -> f64 {
        (self.middle.norm() + self.radius.norm()) * SLACK
    }

    /// Bound of the norm of one column of every member.
    pub fn column_norm(&self, j: usize) -> f64 {
        (self.middle.column(j).norm() + self.radius.column(j).norm()) * SLACK
    }

    /// Bound of `‖I − A‖` for every member A; made of the radius where rounding is all there is.
    pub fn distance_from_identity(&self) -> f64 {
        let gap = DMatrix::identity(self.middle.nrows(), self.middle.ncols()) - &self.middle;
        let rounding = self.radius.norm() + gamma(2) * self.middle.norm();
        settled(gap.norm(), rounding) * SLACK
    }
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

    #[test]
    fn sums_and_products_lose_nothing() {
        for i in 0..1000 {
            let (a, b) = ((1.1 * f64::from(i)).sin() * 1e5, (1.7 * f64::from(i)).cos() / 3.0);
            let (product, rest) = two_product(a, b);
            assert_eq!((product, rest), (a * b, a.mul_add(b, -(a * b))));
            let (sum, lost) = two_sum(a, b);
            assert_eq!(sum, a + b);
            assert_eq!(lost, b - (sum - a));
        }
        assert_eq!(sign_of(3, 9), sign_of(9, 3));
        let signs: f64 = (0..1000).map(|i| sign_of(i, 17)).sum();
        assert!(signs.abs() < 100.0, "{signs}");
    }

    #[test]
    fn product_of_members_is_a_member_of_the_product() {
        let entry = |seed: usize| move |i: usize, j: usize| ((7 * i + 3 * j + seed) as f64).sin();
        let a = Ball {
            middle: DMatrix::from_fn(4, 5, entry(1)),
            radius: DMatrix::from_element(4, 5, 1e-3),
        };
        let b = Ball {
            middle: DMatrix::from_fn(5, 3, entry(2)),
            radius: DMatrix::from_element(5, 3, 2e-3),
        };
        let product = a.times(&b);
        for (s, t) in [(1.0, 1.0), (-1.0, 1.0), (1.0, -1.0)] {
            let member = (&a.middle + &a.radius * s) * (&b.middle + &b.radius * t);
            let off = (member - &product.middle).abs() - &product.radius;
            assert!(off.max() <= 0.0, "{off}");
        }
        let third = DMatrix::from_element(1, 1, 1.0 / 3.0);
        let one = Ball::exact(third.clone()).times(&Ball::exact(third.map(|x| 1.0 / x)));
        assert!(one.distance_from_identity() > 0.0 && one.distance_from_identity() < 1e-14);
    }
}
