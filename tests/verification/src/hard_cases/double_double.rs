//! Sums of two doubles, and a dense factor made of them, for exact answers of hard cases.

use std::ops::{Add, Div, Mul, Neg, Sub};

use softgrasp_core::fem::Stiffness;
use softgrasp_core::solve::Partition;

use softgrasp_bench::reference::{two_product, two_sum};

/// Number of about 32 digits: `.0` the rounded value, `.1` the part that rounding lost.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct DoubleDouble(pub f64, pub f64);

impl Add for DoubleDouble {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        let (sum, rest) = two_sum(self.0, other.0);
        let (low, lower) = two_sum(self.1, other.1);
        let (sum, rest) = two_sum(sum, rest + low);
        let (sum, rest) = two_sum(sum, rest + lower);
        Self(sum, rest)
    }
}

impl Neg for DoubleDouble {
    type Output = Self;

    fn neg(self) -> Self {
        Self(-self.0, -self.1)
    }
}

impl Sub for DoubleDouble {
    type Output = Self;

    fn sub(self, other: Self) -> Self {
        self + -other
    }
}

impl Mul for DoubleDouble {
    type Output = Self;

    fn mul(self, other: Self) -> Self {
        let (product, rest) = two_product(self.0, other.0);
        let (product, rest) = two_sum(product, rest + (self.0 * other.1 + self.1 * other.0));
        Self(product, rest)
    }
}

impl Div for DoubleDouble {
    type Output = Self;

    fn div(self, other: Self) -> Self {
        let first = self.0 / other.0;
        let left = self - other * Self(first, 0.0);
        let second = left.0 / other.0;
        let left = left - other * Self(second, 0.0);
        Self(first, 0.0) + Self(second, 0.0) + Self(left.0 / other.0, 0.0)
    }
}

/// Solution of `K11 Q_u = −K12 Q_k` by a dense LDLᵀ factor in sums of two doubles, for all degrees of
/// freedom; `None` if a pivot vanishes.
///
/// Shapes: `q_known` one for each known degree of freedom; the result 3N.
///
/// Source: thesis (3.43a).
pub(super) fn solve_dense(
    stiffness: &Stiffness,
    partition: &Partition,
    q_known: &[f64],
) -> Option<Vec<f64>> {
    let n = partition.unknown().len();
    let mut place = vec![None; partition.dof_count()];
    let mut displacement = vec![0.0; partition.dof_count()];
    for (row, &dof) in partition.unknown().iter().enumerate() {
        place[dof as usize] = Some(row);
    }
    for (&dof, &value) in partition.known().iter().zip(q_known) {
        displacement[dof as usize] = value;
    }
    let mut rows = vec![vec![DoubleDouble::default(); n]; n];
    let mut right = vec![DoubleDouble::default(); n];
    for (row, &dof) in partition.unknown().iter().enumerate() {
        let (node, axis) = (dof as usize / 3, dof as usize % 3);
        for (column, block) in stiffness.row(node) {
            for other in 0..3 {
                let k = DoubleDouble(block[3 * axis + other], 0.0);
                let at = 3 * column + other;
                match place[at] {
                    Some(place) => rows[row][place] = k,
                    None => right[row] = right[row] - k * DoubleDouble(displacement[at], 0.0),
                }
            }
        }
    }
    let x = eliminate(rows, right)?;
    for (&dof, x) in partition.unknown().iter().zip(x) {
        displacement[dof as usize] = x.0 + x.1;
    }
    Some(displacement)
}

/// Solves a symmetric system that is positive definite, or nearly so.
fn eliminate(
    mut rows: Vec<Vec<DoubleDouble>>,
    mut right: Vec<DoubleDouble>,
) -> Option<Vec<DoubleDouble>> {
    let n = right.len();
    for k in 0..n {
        let (done, below) = rows.split_at_mut(k + 1);
        let pivot_row = &done[k];
        let pivot = pivot_row[k];
        if pivot.0 == 0.0 || !pivot.0.is_finite() {
            return None;
        }
        for (i, row) in below.iter_mut().enumerate() {
            let i = k + 1 + i;
            // The upper triangle holds the row below, too.
            let entry = pivot_row[i];
            if entry.0 == 0.0 {
                continue;
            }
            let factor = entry / pivot;
            for (j, entry) in row.iter_mut().enumerate().skip(i) {
                *entry = *entry - factor * pivot_row[j];
            }
            right[i] = right[i] - factor * right[k];
        }
    }
    for k in (0..n).rev() {
        let known = (k + 1..n).map(|j| rows[k][j] * right[j]);
        let sum = known.fold(right[k], |sum, term| sum - term);
        right[k] = sum / rows[k][k];
    }
    Some(right)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_third_times_three_is_one_to_thirty_digits() {
        let (one, three) = (DoubleDouble(1.0, 0.0), DoubleDouble(3.0, 0.0));
        let rest = one / three * three - one;
        assert!(rest.0.abs() < 1e-30, "{rest:?}");
        let root = DoubleDouble(2f64.sqrt(), 0.0);
        assert_eq!(
            (root * root - DoubleDouble(2.0, 0.0)).0,
            2f64.sqrt().mul_add(2f64.sqrt(), -2.0)
        );
    }

    /// The Hilbert matrix of order ten has the condition 10¹³.
    #[test]
    fn hilbert_system_is_solved_to_the_last_bits() {
        let n = 10;
        let one = DoubleDouble(1.0, 0.0);
        let entry = |i: usize, j: usize| one / DoubleDouble((i + j + 1) as f64, 0.0);
        let rows: Vec<Vec<_>> = (0..n).map(|i| (0..n).map(|j| entry(i, j)).collect()).collect();
        let sum = |row: &Vec<DoubleDouble>| row.iter().fold(DoubleDouble(0.0, 0.0), |s, x| s + *x);
        let right = rows.iter().map(sum).collect();
        let x = eliminate(rows, right).unwrap();
        assert!(x.iter().all(|x| (*x - one).0.abs() < 1e-16), "{x:?}");
        assert!(eliminate(vec![vec![DoubleDouble(0.0, 0.0)]], vec![one]).is_none());
    }
}
