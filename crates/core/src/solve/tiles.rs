//! Dense symmetric positive definite matrices in square tiles: Cholesky factor and inverse.
//!
//! Each tile operation is one sequential faer kernel and tiles are independent rayon tasks, so the
//! arithmetic, and with it every bit, is the same for any number of threads. Only the lower
//! triangle of tiles is kept: n²/2 numbers for a factor.

use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::cholesky::llt::factor::{cholesky_in_place, cholesky_in_place_scratch};
use faer::linalg::matmul::matmul;
use faer::linalg::triangular_inverse::invert_lower_triangular;
use faer::linalg::triangular_solve::{
    solve_lower_triangular_in_place, solve_upper_triangular_in_place,
};
use faer::prelude::*;
use faer::{Accum, Mat, Par};
use rayon::prelude::*;

use super::pivot::NotPositive;

/// Lower triangle of a symmetric matrix, or a lower triangular one, in square tiles.
///
/// Shapes: n × n; tile (i, j), i ≥ j, holds rows `i·side ..` and columns `j·side ..`; the tiles of
/// the last row and column are smaller. Entries above the diagonal inside diagonal tiles are
/// filled for symmetric matrices and zero for triangular ones.
pub(super) struct Tiles {
    n: usize,
    side: usize,
    tiles: Vec<Mat<f64>>,
}

/// Position of tile (i, j) in the list.
const fn at(i: usize, j: usize) -> usize {
    i * (i + 1) / 2 + j
}

/// Row and column of the tile at a position in the list.
fn row_column(position: usize) -> (usize, usize) {
    let mut i = (((8 * position + 1) as f64).sqrt() as usize).saturating_sub(1) / 2;
    while at(i + 1, 0) <= position {
        i += 1;
    }
    (i, position - at(i, 0))
}

impl Tiles {
    /// Zero matrix. The tile side depends on n only, never on the number of threads.
    pub fn zeros(n: usize) -> Self {
        let side = if n < 1200 { 96 } else { 192 };
        let count = n.div_ceil(side);
        let extent = |i: usize| side.min(n - i * side);
        let tiles = (0..count)
            .flat_map(|i| (0..=i).map(move |j| (i, j)))
            .map(|(i, j)| Mat::zeros(extent(i), extent(j)))
            .collect();
        Self { n, side, tiles }
    }

    /// Adds `value` to entry (row, column) if its tile is stored.
    pub fn add(&mut self, row: usize, column: usize, value: f64) {
        let (i, j) = (row / self.side, column / self.side);
        if i >= j {
            self.tiles[at(i, j)][(row % self.side, column % self.side)] += value;
        }
    }

    fn count(&self) -> usize {
        self.n.div_ceil(self.side)
    }

    /// Cholesky factor in place: `A = L Lᵀ`, right-looking by tile columns.
    ///
    /// # Errors
    /// [`NotPositive`] with the row of the first pivot that is not positive.
    pub fn factor(&mut self) -> Result<(), NotPositive> {
        for k in 0..self.count() {
            factor_tile(&mut self.tiles[at(k, k)])
                .map_err(|row| NotPositive { row: k * self.side + row })?;
            // The panel is taken out so that the trailing tiles can read it while they change.
            let mut panel: Vec<Mat<f64>> = (k + 1..self.count())
                .map(|i| std::mem::replace(&mut self.tiles[at(i, k)], Mat::new()))
                .collect();
            let l_kk = self.tiles[at(k, k)].as_ref();
            panel.par_iter_mut().for_each(|tile| {
                solve_lower_triangular_in_place(l_kk, tile.as_mut().transpose_mut(), Par::Seq);
            });
            let first = at(k + 1, 0);
            if let Some(trailing) = self.tiles.get_mut(first..) {
                trailing.par_iter_mut().enumerate().for_each(|(offset, tile)| {
                    let (i, j) = row_column(first + offset);
                    if j > k {
                        let (l_ik, l_jk) = (&panel[i - k - 1], &panel[j - k - 1]);
                        matmul(tile, Accum::Add, l_ik, l_jk.transpose(), -1.0, Par::Seq);
                    }
                });
            }
            for (i, tile) in (k + 1..self.count()).zip(panel) {
                self.tiles[at(i, k)] = tile;
            }
        }
        Ok(())
    }

    /// `A⁻¹` from the factor of `A`: `L⁻¹` by tile columns, then `L⁻ᵀ L⁻¹`.
    pub fn inverse(self) -> Self {
        let (n, side, count) = (self.n, self.side, self.count());
        let columns: Vec<Vec<Mat<f64>>> =
            (0..count).into_par_iter().map(|j| self.inverse_column(j)).collect();
        drop(self);
        // Tile (k, j) of L⁻¹ is `columns[j][k − j]`.
        let tiles = (0..at(count, 0))
            .into_par_iter()
            .map(|position| {
                let (i, j) = row_column(position);
                let mut sum = Mat::zeros(columns[i][0].ncols(), columns[j][0].ncols());
                for k in i..count {
                    let (w_ki, w_kj) = (&columns[i][k - i], &columns[j][k - j]);
                    matmul(&mut sum, Accum::Add, w_ki.transpose(), w_kj, 1.0, Par::Seq);
                }
                sum
            })
            .collect();
        Self { n, side, tiles }
    }

    /// Tiles j, j + 1, … of column j of `L⁻¹`.
    fn inverse_column(&self, j: usize) -> Vec<Mat<f64>> {
        let l_jj = &self.tiles[at(j, j)];
        let mut first = Mat::zeros(l_jj.nrows(), l_jj.ncols());
        invert_lower_triangular(first.as_mut(), l_jj.as_ref(), Par::Seq);
        let mut column = vec![first];
        for i in j + 1..self.count() {
            let l_ii = &self.tiles[at(i, i)];
            let mut sum = Mat::zeros(l_ii.nrows(), l_jj.ncols());
            for (k, w_kj) in (j..i).zip(&column) {
                matmul(&mut sum, Accum::Add, &self.tiles[at(i, k)], w_kj, -1.0, Par::Seq);
            }
            solve_lower_triangular_in_place(l_ii.as_ref(), sum.as_mut(), Par::Seq);
            column.push(sum);
        }
        column
    }

    /// Solves `L Lᵀ x = b` in place with the factor.
    pub fn solve_in_place(&self, b: &mut [f64]) {
        let count = self.count();
        for i in 0..count {
            let (done, rest) = b.split_at_mut(i * self.side);
            let x_i = &mut rest[..self.tiles[at(i, i)].nrows()];
            for (j, x_j) in done.chunks(self.side).enumerate() {
                multiply_add(x_i, self.tiles[at(i, j)].as_ref(), x_j, -1.0);
            }
            let x_i = MatMut::from_column_major_slice_mut(x_i, self.tiles[at(i, i)].nrows(), 1);
            solve_lower_triangular_in_place(self.tiles[at(i, i)].as_ref(), x_i, Par::Seq);
        }
        for i in (0..count).rev() {
            let (head, done) = b.split_at_mut(((i + 1) * self.side).min(self.n));
            let x_i = &mut head[i * self.side..];
            for (k, x_k) in (i + 1..count).zip(done.chunks(self.side)) {
                multiply_add(x_i, self.tiles[at(k, i)].transpose(), x_k, -1.0);
            }
            let x_i = MatMut::from_column_major_slice_mut(x_i, self.tiles[at(i, i)].nrows(), 1);
            solve_upper_triangular_in_place(self.tiles[at(i, i)].transpose(), x_i, Par::Seq);
        }
    }

    /// Product of a symmetric matrix and a vector, tile rows in parallel.
    pub fn mul(&self, x: &[f64]) -> Vec<f64> {
        let mut y = vec![0.0; self.n];
        y.par_chunks_mut(self.side).enumerate().for_each(|(i, y_i)| {
            for (j, x_j) in x.chunks(self.side).enumerate() {
                match j <= i {
                    true => multiply_add(y_i, self.tiles[at(i, j)].as_ref(), x_j, 1.0),
                    false => multiply_add(y_i, self.tiles[at(j, i)].transpose(), x_j, 1.0),
                }
            }
        });
        y
    }
}

/// `y += alpha · A x`.
fn multiply_add(y: &mut [f64], a: MatRef<'_, f64>, x: &[f64], alpha: f64) {
    let y_count = y.len();
    let y = MatMut::from_column_major_slice_mut(y, y_count, 1);
    let x = MatRef::from_column_major_slice(x, x.len(), 1);
    matmul(y, Accum::Add, a, x, alpha, Par::Seq);
}

/// Factors a diagonal tile and clears what is above its diagonal; `Err` is the failing row.
fn factor_tile(tile: &mut Mat<f64>) -> Result<(), usize> {
    let n = tile.nrows();
    let params = faer::Spec::default();
    let mut memory = MemBuffer::new(cholesky_in_place_scratch::<f64>(n, Par::Seq, params));
    let stack = MemStack::new(&mut memory);
    cholesky_in_place(tile.as_mut(), Default::default(), Par::Seq, stack, params).map_err(
        |error| match error {
            faer::linalg::cholesky::llt::factor::LltError::NonPositivePivot { index } => index,
        },
    )?;
    for j in 0..n {
        // faer lets a NaN pivot through; the comparison below does not.
        if !(tile[(j, j)] > 0.0 && tile[(j, j)].is_finite()) {
            return Err(j);
        }
        for i in 0..j {
            tile[(i, j)] = 0.0;
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A positive definite matrix with entries from a fixed recurrence.
    fn definite(n: usize) -> Vec<Vec<f64>> {
        let mut state = 1u64;
        let mut next = || {
            state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            (state >> 33) as f64 / (1u64 << 31) as f64 - 0.5
        };
        let mut a = vec![vec![0.0; n]; n];
        for i in 0..n {
            for j in 0..i {
                a[i][j] = next();
                a[j][i] = a[i][j];
            }
            a[i][i] = n as f64;
        }
        a
    }

    fn tiles_of(a: &[Vec<f64>]) -> Tiles {
        let mut tiles = Tiles::zeros(a.len());
        for (i, row) in a.iter().enumerate() {
            for (j, &value) in row.iter().enumerate() {
                tiles.add(i, j, value);
            }
        }
        tiles
    }

    #[test]
    fn factor_and_inverse_solve_at_sizes_around_the_tile_side() {
        for n in [1, 2, 95, 96, 97, 192, 200, 300] {
            let a = definite(n);
            let x: Vec<f64> = (0..n).map(|i| (i as f64 * 0.7).sin()).collect();
            let b: Vec<f64> =
                a.iter().map(|row| row.iter().zip(&x).map(|(a, x)| a * x).sum()).collect();
            let mut factor = tiles_of(&a);
            factor.factor().unwrap();
            let mut solved = b.clone();
            factor.solve_in_place(&mut solved);
            let inverted = factor.inverse().mul(&b);
            for i in 0..n {
                assert!((solved[i] - x[i]).abs() < 1e-12, "factor, n {n}, row {i}");
                assert!((inverted[i] - x[i]).abs() < 1e-12, "inverse, n {n}, row {i}");
            }
        }
    }

    #[test]
    fn failing_pivot_is_named_in_the_numbering_of_the_matrix() {
        let mut a = definite(150);
        a[120][120] = -1.0;
        let error = tiles_of(&a).factor().unwrap_err();
        assert_eq!(error, NotPositive { row: 120 });
        a[120][120] = f64::NAN;
        assert!(tiles_of(&a).factor().is_err());
    }

    #[test]
    fn positions_and_tile_coordinates_are_inverse() {
        for position in 0..5000 {
            let (i, j) = row_column(position);
            assert!(j <= i && at(i, j) == position);
        }
    }
}
