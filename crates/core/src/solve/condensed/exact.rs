//! Products of the stiffness and a field, computed in twice the working precision.

use rayon::prelude::*;

use super::rounding::{SLACK, UNIT, gamma, longest_row};
use crate::fem::Stiffness;
use crate::solve::vectors::norm;

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

#[cfg(test)]
mod tests {
    use super::*;

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
}
