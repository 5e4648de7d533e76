//! Dense symmetric positive definite matrices in square tiles: Cholesky factor and inverse.
//!
//! Each tile operation is one sequential faer kernel and tiles are independent rayon tasks, so the
//! arithmetic, and with it every bit, is the same for any number of threads. Only the lower
//! triangle of tiles is kept: n²/2 numbers for a factor or an inverse.

use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::cholesky::llt::factor::{cholesky_in_place, cholesky_in_place_scratch};
use faer::linalg::matmul::matmul;
use faer::linalg::matmul::triangular::{self, BlockStructure};
use faer::linalg::triangular_inverse::invert_lower_triangular;
use faer::linalg::triangular_solve::{
    solve_lower_triangular_in_place, solve_upper_triangular_in_place,
};
use faer::prelude::*;
use faer::{Accum, Mat, Par};
use rayon::prelude::*;

use super::k11::NotPositive;

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
        let side = match n {
            0..800 => 64,
            800..1600 => 96,
            _ => 192,
        };
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
    pub fn bytes(&self) -> usize {
        self.tiles.iter().map(|tile| size_of::<f64>() * tile.nrows() * tile.ncols()).sum()
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
            panel.par_iter_mut().with_max_len(1).for_each(|tile| {
                solve_lower_triangular_in_place(l_kk, tile.as_mut().transpose_mut(), Par::Seq);
            });
            let trailing: Vec<_> = self.iter_mut().filter(|&(_, j, _)| j > k).collect();
            trailing.into_par_iter().with_max_len(1).for_each(|(i, j, tile)| {
                let (l_ik, l_jk) = (&panel[i - k - 1], &panel[j - k - 1]);
                matmul(tile, Accum::Add, l_ik, l_jk.transpose(), -1.0, Par::Seq);
            });
            for (i, tile) in (k + 1..self.count()).zip(panel) {
                self.tiles[at(i, k)] = tile;
            }
        }
        Ok(())
    }

    /// `A⁻¹` in place, by one symmetric sweep per tile column: n³ operations in equal pieces.
    ///
    /// With D the columns swept and U the others, the tiles of U × U hold the Schur complement of
    /// D, those of D × D the inverse of `A_DD` and those of U × D `A_UD A_DD⁻¹`. A sweep of column
    /// k, with `P` the inverse of tile (k, k) and `W_i` tile (i, k) or, for i < k, (k, i)
    /// transposed, takes `W_i P W_jᵀ` off tile (i, j), or adds it in D × D.
    ///
    /// # Errors
    /// [`NotPositive`] with the row of the first pivot that is not positive; the pivots are those
    /// of the Cholesky factor.
    ///
    /// Source: Goodnight, "A tutorial on the SWEEP operator" (1979), with tiles for numbers.
    pub fn invert(&mut self) -> Result<(), NotPositive> {
        // What the tiles of column k were before its sweep.
        let mut before = vec![Mat::zeros(self.side, self.side); self.count().saturating_sub(1)];
        let side = self.side;
        let fails = |k: usize| move |row: usize| NotPositive { row: k * side + row };
        if let Some(first) = self.tiles.first_mut() {
            invert_tile(first).map_err(fails(0))?;
        }
        for k in 0..self.count() {
            let (mut column, mut others, mut next) = (Vec::new(), Vec::new(), None);
            for (i, j, tile) in self.iter_mut() {
                match (i == k, j == k) {
                    (false, false) if i == k + 1 && j == k + 1 => next = Some(tile),
                    (false, false) => others.push((i, j, tile)),
                    _ => column.push((i, j, tile)),
                }
            }
            let (_, _, inverse) = column.remove(k);
            multiply_column((k, inverse), &mut column, &mut before);
            // `W_i P` (its negative for i < k) and `W_jᵀ`.
            let left = |i: usize| match i < k {
                true => column[i].2.transpose(),
                false => column[i - 1].2.as_ref(),
            };
            let right = |j: usize| match j < k {
                true => before[j].get(..inverse.nrows(), ..),
                false => {
                    before[j - 1].get(..column[j - 1].2.nrows(), ..inverse.nrows()).transpose()
                }
            };
            // The next inverse is on the way of everything after it, so it is made beside the rest.
            let (inverted, ()) = rayon::join(
                || match next {
                    Some(tile) => {
                        subtract_symmetric(tile, left(k + 1), right(k + 1));
                        invert_tile(tile)
                    }
                    None => Ok(()),
                },
                || {
                    others.into_par_iter().with_max_len(1).for_each(|(i, j, tile)| match i == j {
                        true => subtract_symmetric(tile, left(i), right(j)),
                        false => {
                            matmul(tile, Accum::Add, left(i), right(j), -1.0, Par::Seq);
                        }
                    });
                },
            );
            inverted.map_err(fails(k + 1))?;
        }
        for (_, _, tile) in self.iter_mut().filter(|&(i, j, _)| i == j) {
            mirror(tile);
        }
        Ok(())
    }

    /// All tiles with their coordinates.
    fn iter_mut(&mut self) -> impl Iterator<Item = (usize, usize, &mut Mat<f64>)> {
        self.tiles.iter_mut().enumerate().map(|(position, tile)| {
            let (i, j) = row_column(position);
            (i, j, tile)
        })
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

/// Inverts a diagonal tile through its Cholesky factor; `Err` is the failing row.
fn invert_tile(tile: &mut Mat<f64>) -> Result<(), usize> {
    factor_tile(tile)?;
    let mut w = Mat::zeros(tile.nrows(), tile.nrows());
    invert_lower_triangular(w.as_mut(), tile.as_ref(), Par::Seq);
    let (lower, upper) = (BlockStructure::TriangularLower, BlockStructure::TriangularUpper);
    let (accum, transposed) = (Accum::Replace, w.transpose());
    triangular::matmul(&mut *tile, lower, accum, transposed, upper, &w, lower, 1.0, Par::Seq);
    mirror(tile);
    Ok(())
}

/// Multiplies the tiles of column k by the inverse of its own tile, with a minus sign left of it; keeps
/// what they were before.
fn multiply_column(
    (k, inverse): (usize, &Mat<f64>),
    column: &mut [(usize, usize, &mut Mat<f64>)],
    before: &mut [Mat<f64>],
) {
    column.par_iter_mut().zip(before).with_max_len(1).for_each(|((_, j, tile), before)| {
        let mut before = before.submatrix_mut(0, 0, tile.nrows(), tile.ncols());
        before.copy_from(&**tile);
        match *j < k {
            true => matmul(tile, Accum::Replace, inverse, before, -1.0, Par::Seq),
            false => matmul(tile, Accum::Replace, before, inverse, 1.0, Par::Seq),
        }
    });
}

/// `tile −= left · right` in the lower triangle, where the product is symmetric.
fn subtract_symmetric(tile: &mut Mat<f64>, left: MatRef<'_, f64>, right: MatRef<'_, f64>) {
    let (lower, whole) = (BlockStructure::TriangularLower, BlockStructure::Rectangular);
    triangular::matmul(&mut *tile, lower, Accum::Add, left, whole, right, whole, -1.0, Par::Seq);
}

/// Copies the lower triangle to the upper one.
fn mirror(tile: &mut Mat<f64>) {
    for j in 0..tile.ncols() {
        for i in 0..j {
            tile[(i, j)] = tile[(j, i)];
        }
    }
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
        for n in [1, 2, 63, 64, 65, 192, 200, 801, 900] {
            let a = definite(n);
            let x: Vec<f64> = (0..n).map(|i| (i as f64 * 0.7).sin()).collect();
            let b: Vec<f64> =
                a.iter().map(|row| row.iter().zip(&x).map(|(a, x)| a * x).sum()).collect();
            let mut factor = tiles_of(&a);
            factor.factor().unwrap();
            let mut solved = b.clone();
            factor.solve_in_place(&mut solved);
            let mut inverse = tiles_of(&a);
            inverse.invert().unwrap();
            let inverted = inverse.mul(&b);
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
        assert_eq!(tiles_of(&a).factor(), Err(NotPositive { row: 120 }));
        assert_eq!(tiles_of(&a).invert(), Err(NotPositive { row: 120 }));
        a[120][120] = f64::NAN;
        assert!(tiles_of(&a).factor().is_err());
        assert!(tiles_of(&a).invert().is_err());
    }

    #[test]
    fn positions_and_tile_coordinates_are_inverse() {
        for position in 0..5000 {
            let (i, j) = row_column(position);
            assert!(j <= i && at(i, j) == position);
        }
    }
}
