//! The error of a contact set to first order, from a second solve for every column
//! (`docs/bound.md`, section 6).

use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use super::base::Base;
use super::rounding::{
    Accurate, Ball, SLACK, UNIT, disturbance, gamma, residual, rounding_of_product, settled,
};
use super::touched::Touched;
use super::verified::Verified;
use crate::solve::front::FrontFactor;
use crate::solve::vectors::norm;

/// What a second solve found out about the columns of `M = [s G  R]`.
///
/// Shapes: k columns.
pub(super) struct Correction {
    /// `‖T x‖`, where `−T x` is what a refined answer adds.
    pub error: Form,
    /// `‖T x‖` where rounding is replaced by fixed disturbances of the stiffness.
    pub expected: Form,
    /// Form of the answer's size `‖M x‖`.
    pub size: Form,
    /// Form of `‖|M| |x|‖`, with absolute values of all entries.
    pub sizes: Form,
    /// Bounds on how far the columns of T are off.
    pub off: Vec<f64>,
    /// Bounds of the residuals of the refined columns.
    pub residuals: Vec<f64>,
    /// Bounds of the columns' norms of what the refined columns change in S.
    pub changes: Vec<f64>,
    /// Bounds of the norms of the columns of C.
    pub lengths: Vec<f64>,
    /// Bound of `‖M X‖`.
    pub moved: f64,
    /// Bound of the residual of the refined columns times X, N/m.
    pub left: f64,
    /// Bound of `‖C X‖`.
    pub corrected: f64,
    /// Bound of `‖I − S X‖` for the changed S.
    pub eta: f64,
    /// Bound on how far the forces of the motions without energy are off, N/m.
    pub moments: f64,
}

/// `‖V x‖` from the products of the columns of V with each other.
pub(super) struct Form {
    gram: DMatrix<f64>,
    norms: Vec<f64>,
    /// What the products have lost, relative to the columns' norms.
    lost: f64,
}

impl Form {
    fn new(columns: &[Vec<f64>]) -> Self {
        let k = columns.len();
        let pairs: Vec<(usize, usize)> =
            (0..k).flat_map(|j| (0..=j).map(move |i| (i, j))).collect();
        let dot = |&(i, j): &(usize, usize)| {
            columns[i].iter().zip(&columns[j]).map(|(a, b)| a * b).sum::<f64>()
        };
        let products: Vec<f64> = pairs.par_iter().map(dot).collect();
        let mut gram = DMatrix::zeros(k, k);
        for (&(i, j), product) in pairs.iter().zip(products) {
            (gram[(i, j)], gram[(j, i)]) = (product, product);
        }
        let rows = columns.first().map_or(0, Vec::len);
        let norms = columns.iter().map(|column| norm(column) * SLACK).collect();
        Self { gram, norms, lost: gamma(rows + 2 * k + 4) * SLACK }
    }

    /// The square as computed, and a bound on how far it is off.
    fn square(&self, x: &DVector<f64>) -> (f64, f64) {
        (x.dot(&(&self.gram * x)), self.lost * Verified::sum(&self.norms, x).powi(2))
    }

    /// Bound from above.
    pub fn at_most(&self, x: &DVector<f64>) -> f64 {
        let (square, off) = self.square(x);
        (square.max(0.0) + off).sqrt() * SLACK
    }

    /// Bound from below.
    pub fn at_least(&self, x: &DVector<f64>) -> f64 {
        let (square, off) = self.square(x);
        (square - off).max(0.0).sqrt() / SLACK
    }

    /// The norm as computed.
    pub fn about(&self, x: &DVector<f64>) -> f64 {
        self.square(x).0.max(0.0).sqrt()
    }
}

/// Columns, forces against the motions, and what both say about S.
struct Part {
    columns: Vec<Vec<f64>>,
    change: Ball,
}

impl Correction {
    /// Solves once more for every column, on the current rayon pool; `factor` is that of the base.
    ///
    /// Shapes: `fields` those of G and R, each 3N.
    pub fn new(
        (base, factor): (&Base, &FrontFactor<f64>),
        touched: &Touched,
        verified: &Verified,
        fields: &[&Vec<f64>],
    ) -> Self {
        let (c, k) = (touched.force_count(), fields.len());
        let loads = touched.columns();
        let load = |j: usize| loads.get(j).map_or([].as_slice(), Vec::as_slice);
        let scaled = |j: usize, field: &Vec<f64>| match j < c {
            true => field.iter().map(|x| verified.scale * x).collect(),
            false => field.clone(),
        };
        let columns: Vec<Vec<f64>> = (0..k).map(|j| scaled(j, fields[j])).collect();
        let columns = columns.as_slice();
        let wrong: Vec<Accurate> =
            (0..k).map(|j| residual(&base.stiffness, fields[j], load(j), false)).collect();
        let modes = base.modes.iter();
        let forces: Vec<Accurate> =
            modes.map(|mode| residual(&base.stiffness, &mode.field, &[], true)).collect();
        let corrections = solve(base, factor, wrong.iter().map(|w| &w.value));
        let scale = |j: usize| if j < c { verified.scale } else { 1.0 };
        let residuals = corrections.iter().zip(&wrong).enumerate();
        let residuals =
            residuals.map(|(j, (correction, wrong))| scale(j) * left_over(base, correction, wrong));
        let residuals: Vec<f64> = residuals.collect();
        let corrections: Vec<Vec<f64>> =
            corrections.iter().enumerate().map(|(j, field)| scaled(j, field)).collect();
        let lengths: Vec<f64> = corrections.iter().map(|c| norm(c) * SLACK).collect();
        // The residual of a mode is −Kᵀ R.
        let found =
            Part::new(touched, verified, columns, corrections, forces.iter().map(|f| &f.value));
        let changes: Vec<f64> = (0..k).map(|j| found.change.column_norm(j)).collect();
        let (error, off) = found.first_order(verified, columns, &lengths);
        let disturbed: Vec<Vec<f64>> =
            columns.iter().map(|column| disturbance(&base.stiffness, column)).collect();
        let simulated = solve(base, factor, disturbed.iter());
        let expected = Part::new(touched, verified, columns, simulated, disturbed[c..].iter());
        let (expected, _) = expected.first_order(verified, columns, &lengths);
        let size = Form::new(columns);
        let absolute: Vec<Vec<f64>> =
            columns.iter().map(|c| c.iter().map(|x| x.abs()).collect()).collect();
        let inverse = verified.inverse.column_iter();
        let moved = inverse.map(|x| size.at_most(&x.into_owned()).powi(2)).sum::<f64>().sqrt();
        Self {
            error: Form::new(&error),
            expected: Form::new(&expected),
            sizes: Form::new(&absolute),
            size,
            off,
            left: verified.times_inverse(&residuals),
            residuals,
            moved: moved * SLACK,
            corrected: verified.times_inverse(&lengths),
            eta: (verified.eta + verified.times_inverse(&changes)) * SLACK,
            changes,
            lengths,
            moments: moments(base, &forces),
        }
    }

    /// Bytes that are kept.
    pub fn bytes(k: usize) -> usize {
        8 * (4 * k * k + 8 * k)
    }
}

impl Part {
    /// Shapes: `forces` one of 3N per mode: `−Kᵀ` times it.
    fn new<'a>(
        touched: &Touched,
        verified: &Verified,
        columns: &[Vec<f64>],
        corrections: Vec<Vec<f64>>,
        forces: impl Iterator<Item = &'a Vec<f64>>,
    ) -> Self {
        let (c, k) = (touched.force_count(), columns.len());
        let mut middle = DMatrix::zeros(k, k);
        let mut radius = DMatrix::zeros(k, k);
        let means = gamma(touched.longest() + 3);
        for (j, correction) in corrections.iter().enumerate() {
            for i in 0..c {
                middle[(i, j)] = touched.mean(i, correction);
                radius[(i, j)] = touched.mean_of_sizes(i, correction) * means * SLACK;
            }
        }
        for (i, force) in forces.enumerate() {
            let lost = gamma(force.len() + 4) * norm(force) / verified.scale * SLACK;
            for (j, (column, correction)) in columns.iter().zip(&corrections).enumerate() {
                let both = column.iter().zip(correction).zip(force);
                let along: f64 = both.map(|((m, c), f)| (m + c) * f).sum();
                middle[(c + i, j)] = along / verified.scale;
                radius[(c + i, j)] = lost * (norm(column) + norm(correction));
            }
        }
        Self { columns: corrections, change: Ball { middle, radius } }
    }

    /// `T = M X Δ − C`, and bounds on how far its columns are off.
    ///
    /// Shapes: `lengths` bounds of the norms of the columns of C.
    fn first_order(
        mut self,
        verified: &Verified,
        columns: &[Vec<f64>],
        lengths: &[f64],
    ) -> (Vec<Vec<f64>>, Vec<f64>) {
        let k = columns.len();
        let mixed = Ball::exact(verified.inverse.clone()).times(&self.change);
        self.columns.par_iter_mut().enumerate().for_each(|(j, correction)| {
            correction.iter_mut().for_each(|c| *c = -*c);
            for (i, column) in columns.iter().enumerate() {
                let amount = mixed.middle[(i, j)];
                correction.iter_mut().zip(column).for_each(|(c, m)| *c += amount * m);
            }
        });
        let terms = gamma(k + 8);
        let off = (0..k).map(|j| {
            let of = |i: usize| {
                verified.norms[i] * (mixed.radius[(i, j)] + terms * mixed.middle[(i, j)].abs())
            };
            ((0..k).map(of).sum::<f64>() + terms * lengths[j]) * SLACK
        });
        let off = off.collect();
        (self.columns, off)
    }
}

/// Bound of the residual of a column less its correction, over the rows of `K_B`.
fn left_over(base: &Base, correction: &[f64], wrong: &Accurate) -> f64 {
    let left = norm_of_unknown(base, &wrong.value, &base.stiffness.mul(correction));
    let rounded = UNIT * norm_of_unknown(base, &wrong.value, &vec![0.0; wrong.value.len()]);
    let rounding = rounding_of_product(&base.stiffness, correction) + wrong.lost + rounded;
    settled(left, rounding) * SLACK
}

/// Bound on how far the forces `Kᵀ R D` of the modes are off.
fn moments(base: &Base, forces: &[Accurate]) -> f64 {
    let Some(rigid) = &base.rigid else { return 0.0 };
    let off = |f: &Accurate| f.lost + UNIT * norm(&f.value);
    let columns = rigid.to_orthonormal.column_iter();
    let of_column = |d: nalgebra::DVectorView<'_, f64>| {
        forces.iter().zip(d.iter()).map(|(f, d)| off(f) * d.abs()).sum::<f64>()
    };
    columns.map(|d| of_column(d).powi(2)).sum::<f64>().sqrt() * SLACK
}

/// `K_B⁻¹` of some loads, 3N each; rows that are held count nothing.
fn solve<'a>(
    base: &Base,
    factor: &FrontFactor<f64>,
    loads: impl Iterator<Item = &'a Vec<f64>>,
) -> Vec<Vec<f64>> {
    let unknown = base.partition.unknown();
    let mut right: Vec<f64> =
        loads.flat_map(|load| unknown.iter().map(|&dof| load[dof as usize])).collect();
    let count = right.len() / unknown.len().max(1);
    factor.solve_in_place(&mut right, count);
    let field = |solved: &[f64]| {
        let mut field = vec![0.0; base.dof_count()];
        unknown.iter().zip(solved).for_each(|(&dof, x)| field[dof as usize] = *x);
        field
    };
    right.chunks(unknown.len().max(1)).map(field).collect()
}

/// `‖a − b‖` over the rows of `K_B`.
fn norm_of_unknown(base: &Base, a: &[f64], b: &[f64]) -> f64 {
    let rows = base.partition.unknown().iter().map(|&dof| a[dof as usize] - b[dof as usize]);
    norm(&rows.collect::<Vec<f64>>())
}
