//! The Delassus operator `W = Bᵀ K B`: a compliance K between corners of the surface, and points that lie
//! between corners.
//!
//! A patch of surface has more points in contact than corners, and each point is a mean of three of them
//! at most. So what costs the square or the cube of a size is done between corners, and points are local.

use faer::linalg::matmul::matmul;
use faer::{Accum, MatMut, MatRef, Par};
use nalgebra::{DMatrix, Matrix3, Vector2, Vector3};

use super::cone::{PointForce, at};

/// A contact point as a mean of corners, and the frame that its force is written in.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PointPlace {
    /// Corners, by their position in the compliance.
    pub corners: [u32; 3],
    /// Weights of the corners; where one is zero its corner does not matter.
    pub weights: [f64; 3],
    /// Normal and two tangents as columns, in the frame of the compliance.
    pub frame: Matrix3<f64>,
    /// What its motion along the normal has besides.
    pub slide: Option<Slide>,
}

/// A part of the motion along the normal that its force does not work on: that of another mean of the same
/// corners along the tangents.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Slide {
    /// Weights of the corners.
    pub weights: [f64; 3],
    /// Share of their motion along either tangent.
    pub share: [f64; 2],
}

/// `W = Bᵀ K B`.
///
/// Shapes: m corners; `compliance` K 3m × 3m, symmetric, positive semidefinite (of a body; between points whose
/// springs are eliminated it is not symmetric); n points. B has a block
/// of weight times frame for each corner and point. Units: m/N. Where a point slides, its row of Bᵀ has that
/// besides, and W is not symmetric.
///
/// Source: Delassus (1917); Jourdan, Alart and Jean (1998).
#[derive(Clone, Debug, PartialEq)]
pub struct Delassus {
    compliance: DMatrix<f64>,
    points: Vec<PointPlace>,
}

/// Why numbers make no contact problem.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ProblemError {
    /// Sizes that do not fit each other.
    #[error(
        "{points} points need {expected} rows, but the operator has {rows} and the motion {motion}"
    )]
    Sizes {
        /// Number of points.
        points: usize,
        /// Rows that the points need: three each.
        expected: usize,
        /// Rows of the operator.
        rows: usize,
        /// Entries of the motion.
        motion: usize,
    },
    /// A point that no force moves along its own normal.
    #[error(
        "contact point {point} has the compliance {compliance:e} m/N along its normal; it must be positive"
    )]
    Rigid {
        /// The point, from 0.
        point: usize,
        /// Its compliance along the normal, m/N.
        compliance: f64,
    },
    /// A number that is not finite.
    #[error("a number of the contact problem is not finite")]
    NotFinite,
}

impl PointPlace {
    /// The point at a corner, in the frame of the compliance.
    pub fn corner(corner: u32) -> Self {
        Self {
            corners: [corner; 3],
            weights: [1.0, 0.0, 0.0],
            frame: Matrix3::identity(),
            slide: None,
        }
    }

    /// Corners that its force or its motion has to do with.
    fn touched(&self) -> impl Iterator<Item = usize> + use<> {
        let slide = self.slide.map_or([0.0; 3], |slide| slide.weights);
        let weights = self.weights.into_iter().zip(slide);
        let corners = self.corners.into_iter().zip(weights);
        corners.filter(|(_, (w, s))| *w != 0.0 || *s != 0.0).map(|(corner, _)| corner as usize)
    }

    /// Corners with a weight.
    pub fn weighted(&self) -> impl Iterator<Item = (usize, f64)> + use<> {
        let corners = self.corners.into_iter().zip(self.weights);
        corners.filter(|(_, weight)| *weight != 0.0).map(|(corner, w)| (corner as usize, w))
    }
}

impl Delassus {
    /// Shapes and units as in [`Delassus`].
    ///
    /// # Errors
    /// [`ProblemError::Sizes`] where the compliance is not square in threes, or a point names a corner
    /// that is not there; [`ProblemError::NotFinite`].
    pub fn try_new(
        compliance: DMatrix<f64>,
        points: Vec<PointPlace>,
    ) -> Result<Self, ProblemError> {
        let rows = compliance.nrows();
        let last = points.iter().flat_map(PointPlace::touched).max();
        let corners = last.map_or(0, |last| last + 1);
        if compliance.ncols() != rows || !rows.is_multiple_of(3) || rows < 3 * corners {
            let (points, expected, motion) = (points.len(), 3 * corners, compliance.ncols());
            return Err(ProblemError::Sizes { points, expected, rows, motion });
        }
        let places = points.iter().flat_map(|p| p.frame.iter().chain(&p.weights));
        if !compliance.iter().chain(places).all(|x| x.is_finite()) {
            return Err(ProblemError::NotFinite);
        }
        Ok(Self { compliance, points })
    }

    /// Number of points.
    pub fn point_count(&self) -> usize {
        self.points.len()
    }

    /// Rows of the compliance: three for each corner.
    pub(super) fn corner_rows(&self) -> usize {
        self.compliance.nrows()
    }

    pub(super) fn compliance(&self) -> &DMatrix<f64> {
        &self.compliance
    }

    /// How a point yields to its own force, 3 × 3, m/N.
    pub(super) fn own(&self, point: usize) -> Matrix3<f64> {
        let place = &self.points[point];
        let mut own = Matrix3::zeros();
        for (row, of_row) in place.weighted() {
            for (column, of_column) in place.weighted() {
                let k = self.compliance.fixed_view::<3, 3>(3 * row, 3 * column);
                own += of_row * of_column * k;
            }
        }
        place.frame.transpose() * own * place.frame
    }

    /// Forces of points as forces at corners: `B λ`.
    ///
    /// Shapes: `lambda` 3n, result 3m. Units: N.
    fn spread(&self, lambda: &[f64]) -> Vec<f64> {
        let mut y = vec![0.0; self.corner_rows()];
        for (place, force) in self.points.iter().zip(lambda.chunks_exact(3)) {
            // Open points have no force, and most of a margin is open.
            if force.iter().any(|f| *f != 0.0) {
                let force = place.frame * Vector3::from_column_slice(force);
                for (corner, weight) in place.weighted() {
                    (0..3).for_each(|axis| y[3 * corner + axis] += weight * force[axis]);
                }
            }
        }
        y
    }

    /// Motion of one point by those of the corners: its rows of `Bᵀ v`.
    pub(super) fn motion_of(&self, point: usize, v: &[f64]) -> PointForce {
        let place = &self.points[point];
        let mut moved = Vector3::zeros();
        for (corner, weight) in place.weighted() {
            moved += weight * at(v, corner);
        }
        let mut moved = place.frame.tr_mul(&moved);
        if let Some(slide) = place.slide {
            let corners = place.corners.iter().zip(slide.weights).filter(|(_, w)| *w != 0.0);
            let of_corner = |(&corner, weight): (&u32, f64)| weight * at(v, corner as usize);
            let slid = place.frame.tr_mul(&corners.map(of_corner).sum::<Vector3<f64>>());
            moved.x += slide.share[0] * slid.y + slide.share[1] * slid.z;
        }
        moved
    }

    /// Motions of the corners under forces at the points: `K B λ`.
    ///
    /// Shapes: `lambda` 3n, result 3m. Units: N, m.
    pub(super) fn moved_corners(&self, lambda: &[f64]) -> Vec<f64> {
        self.moved_by(&self.compliance, lambda)
    }

    /// Motions of the corners under forces at the points if the corners had another compliance.
    ///
    /// Shapes: `compliance` 3m × 3m, `lambda` 3n, result 3m. Units: m/N, N, m.
    pub(super) fn moved_by(&self, compliance: &DMatrix<f64>, lambda: &[f64]) -> Vec<f64> {
        let (rows, spread) = (self.corner_rows(), self.spread(lambda));
        let mut v = vec![0.0; rows];
        matmul(
            MatMut::from_column_major_slice_mut(&mut v, rows, 1),
            Accum::Replace,
            MatRef::from_column_major_slice(compliance.as_slice(), rows, rows),
            MatRef::from_column_major_slice(&spread, rows, 1),
            1.0,
            Par::Seq,
        );
        v
    }

    /// `W λ`.
    ///
    /// Shapes: `lambda` and result 3n. Units: N, m.
    pub(super) fn apply(&self, lambda: &[f64]) -> Vec<f64> {
        let v = self.moved_corners(lambda);
        (0..self.point_count()).flat_map(|i| <[f64; 3]>::from(self.motion_of(i, &v))).collect()
    }

    /// `S = B diag(H) Bᵀ`, and then `I + K S`: what couples corners if every point answers a motion by a
    /// force.
    ///
    /// Shapes: `answers` n blocks 3 × 3, N/m.
    pub(super) fn coupled(&self, answers: &[Matrix3<f64>]) -> DMatrix<f64> {
        let rows = self.corner_rows();
        let mut coupled = DMatrix::identity(rows, rows);
        let mut s = BlockColumns::new(rows / 3);
        for (place, answer) in self.points.iter().zip(answers) {
            let turned = place.frame * answer * place.frame.transpose();
            for (row, of_row) in place.weighted() {
                for (column, of_column) in place.weighted() {
                    s.add(row, column, of_row * of_column * turned);
                }
            }
            if let Some(slide) = place.slide {
                // Answers to the motion along the normal only.
                let tangents = place.frame.fixed_columns::<2>(1) * Vector2::from(slide.share);
                let turned = place.frame * answer.column(0) * tangents.transpose();
                for (row, of_row) in place.weighted() {
                    for (&column, of_column) in place.corners.iter().zip(slide.weights) {
                        s.add(row, column as usize, of_row * of_column * turned);
                    }
                }
            }
        }
        let arch = pulp::Arch::new();
        let k = self.compliance.as_slice();
        for (to, blocks) in coupled.as_mut_slice().chunks_exact_mut(3 * rows).zip(&s.0) {
            for (row, block) in blocks {
                let from = &k[3 * row * rows..3 * (row + 1) * rows];
                let block: [Vector3<f64>; 3] = std::array::from_fn(|k| block.column(k).into());
                arch.dispatch(AddProducts { from, by: &block, to });
            }
        }
        coupled
    }

    /// `Mᵀ K F` for two matrices of few entries: how far the columns of M go by the forces of those of F.
    ///
    /// Shapes: `motions` a columns and `forces` b columns of 3m rows, each a list of corners and their parts;
    /// result a × b.
    pub(super) fn between(
        &self,
        motions: &[CornerColumn],
        forces: &[CornerColumn],
    ) -> DMatrix<f64> {
        // K of a body is symmetric: its product with M is that of the transposed, transposed.
        products(&transposed(&products(&self.compliance, motions)), forces)
    }

    /// What a force of a point is at its corners: B of the point times it.
    pub(super) fn force_column(&self, point: usize, force: &PointForce) -> CornerColumn {
        let place = &self.points[point];
        let along = place.frame * force;
        place.weighted().map(|(corner, weight)| (corner, weight * along)).collect()
    }

    /// What the motion of a point along its normal, 0, or a tangent, 1 or 2, is of those of its corners.
    pub(super) fn motion_row(&self, point: usize, axis: usize) -> CornerColumn {
        let mut unit = PointForce::zeros();
        unit[axis] = 1.0;
        let mut row = self.force_column(point, &unit);
        let place = &self.points[point];
        if let Some(slide) = place.slide.filter(|_| axis == 0) {
            let along = place.frame.fixed_columns::<2>(1) * Vector2::from(slide.share);
            let corners = place.corners.iter().zip(slide.weights).filter(|(_, w)| *w != 0.0);
            row.extend(corners.map(|(&corner, weight)| (corner as usize, weight * along)));
        }
        row
    }

    /// The operator of some points alone, between their own corners.
    pub(super) fn of_points(&self, points: &[usize]) -> Self {
        let of = |&point: &usize| self.points[point].touched();
        let mut corners: Vec<usize> = points.iter().flat_map(of).collect();
        corners.sort_unstable();
        corners.dedup();
        let mut position = vec![0u32; self.corner_rows() / 3];
        corners.iter().enumerate().for_each(|(at, &corner)| position[corner] = at as u32);
        let renamed = |&point: &usize| {
            let mut place = self.points[point];
            let slides = |k: usize| place.slide.is_some_and(|slide| slide.weights[k] != 0.0);
            place.corners = std::array::from_fn(|k| match place.weights[k] != 0.0 || slides(k) {
                true => position[place.corners[k] as usize],
                false => 0,
            });
            place
        };
        let points = points.iter().map(renamed).collect();
        Self { compliance: self.compliance_between(&corners), points }
    }

    /// The compliance between some corners, ascending.
    fn compliance_between(&self, corners: &[usize]) -> DMatrix<f64> {
        let (rows, all) = (3 * corners.len(), self.corner_rows());
        let mut between = Vec::with_capacity(rows * rows);
        for &corner in corners {
            for column in self.compliance.as_slice()[3 * corner * all..].chunks_exact(all).take(3) {
                let of_corner = |&row: &usize| &column[3 * row..3 * row + 3];
                corners.iter().for_each(|row| between.extend_from_slice(of_corner(row)));
            }
        }
        DMatrix::from_vec(rows, rows, between)
    }

    /// W as a matrix, 3n × 3n.
    pub fn to_matrix(&self) -> DMatrix<f64> {
        let n = 3 * self.point_count();
        let mut w = DMatrix::zeros(n, n);
        let mut unit = vec![0.0; n];
        for column in 0..n {
            unit[column] = 1.0;
            w.column_mut(column).copy_from_slice(&self.apply(&unit));
            unit[column] = 0.0;
        }
        w
    }
}

/// A column with few entries: corners, and what it has at their three rows.
pub(super) type CornerColumn = Vec<(usize, Vector3<f64>)>;

/// A matrix times columns of few entries.
fn products(matrix: &DMatrix<f64>, columns: &[CornerColumn]) -> DMatrix<f64> {
    let rows = matrix.nrows();
    let mut made = DMatrix::zeros(rows, columns.len());
    if rows == 0 {
        return made;
    }
    let arch = pulp::Arch::new();
    for (to, column) in made.as_mut_slice().chunks_exact_mut(rows).zip(columns) {
        for (corner, by) in column {
            let from = &matrix.as_slice()[3 * corner * rows..3 * (corner + 1) * rows];
            arch.dispatch(AddProducts { from, by: std::slice::from_ref(by), to });
        }
    }
    made
}

/// A matrix transposed by tiles, which lie in the fastest memory as they are read and as they are written.
fn transposed(matrix: &DMatrix<f64>) -> DMatrix<f64> {
    const TILE: usize = 8;
    let (rows, columns) = matrix.shape();
    let (from, mut made) = (matrix.as_slice(), vec![0.0; rows * columns]);
    for first_column in (0..columns).step_by(TILE) {
        for first_row in (0..rows).step_by(TILE) {
            for column in first_column..columns.min(first_column + TILE) {
                for row in first_row..rows.min(first_row + TILE) {
                    made[row * columns + column] = from[column * rows + row];
                }
            }
        }
    }
    DMatrix::from_vec(columns, rows, made)
}

/// A sparse matrix of blocks by columns, in the order in which they come.
struct BlockColumns(Vec<Vec<(usize, Matrix3<f64>)>>);

impl BlockColumns {
    fn new(columns: usize) -> Self {
        Self(vec![Vec::new(); columns])
    }

    fn add(&mut self, row: usize, column: usize, block: Matrix3<f64>) {
        let column = &mut self.0[column];
        match column.iter_mut().find(|(at, _)| *at == row) {
            Some((_, sum)) => *sum += block,
            None => column.push((row, block)),
        }
    }
}

/// Adds three columns, times the numbers of a vector, to a column; so for each of some vectors and columns.
struct AddProducts<'a> {
    from: &'a [f64],
    by: &'a [Vector3<f64>],
    to: &'a mut [f64],
}

impl pulp::WithSimd for AddProducts<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, simd: S) {
        let rows = self.from.len() / 3;
        let (x, yz) = self.from.split_at(rows);
        let (y, z) = yz.split_at(rows);
        let (x, x_tail) = S::as_simd_f64s(x);
        let (y, y_tail) = S::as_simd_f64s(y);
        let (z, z_tail) = S::as_simd_f64s(z);
        for (by, to) in self.by.iter().zip(self.to.chunks_exact_mut(rows)) {
            let (sx, sy, sz) =
                (simd.splat_f64s(by.x), simd.splat_f64s(by.y), simd.splat_f64s(by.z));
            let (to, tail) = S::as_mut_simd_f64s(to);
            for (((to, x), y), z) in to.iter_mut().zip(x).zip(y).zip(z) {
                let sum = simd.mul_add_f64s(*x, sx, *to);
                let sum = simd.mul_add_f64s(*y, sy, sum);
                *to = simd.mul_add_f64s(*z, sz, sum);
            }
            for (((to, x), y), z) in tail.iter_mut().zip(x_tail).zip(y_tail).zip(z_tail) {
                *to += x * by.x + y * by.y + z * by.z;
            }
        }
    }
}
