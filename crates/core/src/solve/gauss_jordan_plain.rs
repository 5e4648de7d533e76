//! Gauss–Jordan elimination pivot by pivot as in the thesis's Appendix A, rows in parallel.

use rayon::prelude::*;

use super::pivot::NotPositive;

/// Inverts a symmetric positive definite matrix in place by Gauss–Jordan elimination without
/// pivoting; the inner loop over rows runs on the current rayon pool with the same bits for any
/// number of threads.
///
/// The thesis eliminates in two n × n matrices side by side (Figure A.2). Column i of the first is
/// a unit vector once it is eliminated, and column i of the second is one until then, so both are
/// kept in one n × n array; the arithmetic is that of (A.1) and (A.2) without the multiplications
/// by known zeros and ones.
///
/// Shapes: `a` n × n, row-major. Units: N/m in, m/N out.
///
/// # Errors
/// [`NotPositive`] with the row of the first pivot that is not positive.
///
/// Source: thesis Figure A.1, (A.1), (A.2).
pub(super) fn invert(a: &mut [f64], n: usize) -> Result<(), NotPositive> {
    let mut pivot_row = vec![0.0; n];
    for i in 0..n {
        let pivot = a[i * n + i];
        if !(pivot > 0.0 && pivot.is_finite()) {
            return Err(NotPositive { row: i });
        }
        let row_i = &mut a[i * n..(i + 1) * n];
        row_i[i] = 1.0;
        for x in row_i.iter_mut() {
            *x /= pivot;
        }
        pivot_row.copy_from_slice(row_i);
        a.par_chunks_exact_mut(n).enumerate().with_min_len(16).for_each(|(k, row_k)| {
            if k == i {
                return;
            }
            let factor = row_k[i];
            row_k[i] = 0.0;
            for (x, p) in row_k.iter_mut().zip(&pivot_row) {
                *x -= factor * p;
            }
        });
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// Figure A.1 letter by letter: two matrices, all columns.
    fn invert_as_printed(global: &mut [Vec<f64>]) -> Vec<Vec<f64>> {
        let n = global.len();
        let mut inverse = vec![vec![0.0; n]; n];
        for (i, row) in inverse.iter_mut().enumerate() {
            row[i] = 1.0;
        }
        for i in 0..n {
            let pivot = global[i][i];
            for j in 0..n {
                global[i][j] /= pivot;
                inverse[i][j] /= pivot;
            }
            for k in (0..n).filter(|&k| k != i) {
                let factor = global[k][i];
                for j in 0..n {
                    global[k][j] -= factor * global[i][j];
                    inverse[k][j] -= factor * inverse[i][j];
                }
            }
        }
        inverse
    }

    proptest! {
        #[test]
        fn one_array_gives_the_numbers_of_the_printed_two(seed in prop::collection::vec(-1.0..1.0f64, 49)) {
            let n = 7;
            let mut a = vec![0.0; n * n];
            for i in 0..n {
                for j in 0..n {
                    a[i * n + j] = (0..n).map(|k| seed[i * n + k] * seed[j * n + k]).sum::<f64>()
                        + if i == j { 1.0 } else { 0.0 };
                }
            }
            let mut rows: Vec<Vec<f64>> = a.chunks(n).map(<[f64]>::to_vec).collect();
            let printed = invert_as_printed(&mut rows);
            invert(&mut a, n).unwrap();
            // Equal, not close: the left-out operations are exact.
            prop_assert_eq!(a, printed.concat());
        }
    }

    #[test]
    fn indefinite_matrix_is_refused_at_its_pivot() {
        let mut a = vec![1.0, 2.0, 2.0, 1.0];
        assert_eq!(invert(&mut a, 2), Err(NotPositive { row: 1 }));
    }
}
