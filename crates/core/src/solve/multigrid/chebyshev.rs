//! Smoothing by Chebyshev's polynomials in `D⁻¹ A`, `D` the blocks on the diagonal; and the eigenvalues of a
//! preconditioned matrix as far as conjugate gradients have seen them.

use rayon::prelude::*;

use super::block_rows::{BlockRows, NodeMatrix, TASK_ROWS};
use super::small::{dot_blocks, inverse, times};

/// The tridiagonal matrix that the steps of conjugate gradients make of a preconditioned matrix.
///
/// Source: Golub and Van Loan, *Matrix Computations*, 10.2 (the connection with Lanczos 1950).
#[derive(Default)]
pub(super) struct Ritz {
    diagonal: Vec<f64>,
    /// Squares of the numbers beside the diagonal.
    beside: Vec<f64>,
    /// `β / α` of the step before.
    carried: f64,
}

/// Halvings of the interval of an eigenvalue: more digits than anyone looks at.
const HALVINGS: usize = 50;

impl Ritz {
    /// One step: its length `α`, and `β` to the next direction.
    pub fn step(&mut self, alpha: f64, beta: f64) {
        self.diagonal.push(1.0 / alpha + self.carried);
        self.beside.push(beta / (alpha * alpha));
        self.carried = beta / alpha;
    }

    /// Smallest eigenvalue seen; `None` before the first step.
    pub fn smallest(&self) -> Option<f64> {
        let (mut low, mut high) = (0.0, self.bound()?);
        for _ in 0..HALVINGS {
            // Eigenvalues are all positive, and the smallest may be far below the largest.
            let middle = if low > 0.0 { f64::sqrt(low * high) } else { 1e-3 * high };
            match self.count_below(middle) {
                0 => low = middle,
                _ => high = middle,
            }
        }
        Some(high)
    }

    /// Largest eigenvalue seen; `None` before the first step.
    pub fn largest(&self) -> Option<f64> {
        let (mut low, mut high) = (0.0, self.bound()?);
        for _ in 0..HALVINGS {
            let middle = 0.5 * (low + high);
            match self.count_below(middle) == self.diagonal.len() {
                true => high = middle,
                false => low = middle,
            }
        }
        Some(high)
    }

    /// A number above all eigenvalues (Gershgorin).
    fn bound(&self) -> Option<f64> {
        let n = self.diagonal.len();
        let beside = |i: usize| if i + 1 < n { self.beside[i].abs().sqrt() } else { 0.0 };
        let of_row =
            |i: usize| self.diagonal[i].abs() + beside(i) + if i > 0 { beside(i - 1) } else { 0.0 };
        (0..n).map(of_row).reduce(f64::max)
    }

    /// How many eigenvalues are below `x` (Sturm's sequence).
    fn count_below(&self, x: f64) -> usize {
        let (mut count, mut pivot) = (0, 1.0);
        for (i, d) in self.diagonal.iter().enumerate() {
            let before = if i > 0 { self.beside[i - 1] / pivot } else { 0.0 };
            pivot = d - x - before;
            if pivot == 0.0 {
                pivot = f64::MIN_POSITIVE;
            }
            count += usize::from(pivot < 0.0);
        }
        count
    }
}

/// A smoother that takes out the upper part of the spectrum.
///
/// Source: Adams, Brezina, Hu, Tuminaro 2003.
pub(super) struct Chebyshev<const B: usize> {
    inverse_diagonal: Vec<[[f32; B]; B]>,
    /// Largest eigenvalue of `D⁻¹ A`, as estimated.
    largest: f64,
}

/// What is smoothed goes from the largest eigenvalue down to it over this.
const SMOOTHED_DOWN_TO: f64 = 12.0;
/// The largest eigenvalue is estimated from below, by so much at most.
const ESTIMATE_SAFETY: f64 = 1.08;
/// Steps of the estimate.
const ESTIMATE_STEPS: usize = 14;
/// Degree of the polynomial.
const DEGREE: usize = 2;

/// The numbers of one row of W vectors, B unknowns at each node.
type Row<const B: usize, const W: usize> = [[f32; W]; B];

/// What a smoother works on: W vectors, the numbers of one row next to each other.
pub(super) struct Vectors<const B: usize, const W: usize> {
    /// Correction that smoothing has made.
    pub x: Vec<Row<B, W>>,
    /// What is left of the right-hand sides.
    pub r: Vec<Row<B, W>>,
    /// The last step, and room for the next one.
    d: [Vec<Row<B, W>>; 2],
}

impl<const B: usize, const W: usize> Vectors<B, W> {
    pub fn new(rows: usize) -> Self {
        let zeros = || vec![[[0.0; W]; B]; rows];
        Self { x: zeros(), r: zeros(), d: [zeros(), zeros()] }
    }

    /// Makes a step by tasks of rows (`fill(first row, steps)`) and adds it to the correction.
    pub fn take_correction(&mut self, fill: impl Fn(usize, &mut [Row<B, W>]) + Sync) {
        let Self { x, d: [d, _], .. } = self;
        let tasks = d.par_chunks_mut(TASK_ROWS).zip(x.par_chunks_mut(TASK_ROWS));
        tasks.enumerate().for_each(|(task, (d, x))| {
            fill(task * TASK_ROWS, d);
            x.iter_mut().zip(d).for_each(|(x, d)| add(x, d));
        });
    }

    /// The last step, and the residual that it leaves out of account.
    pub fn step_and_residual(&mut self) -> (&[Row<B, W>], &mut [Row<B, W>]) {
        (&self.d[0], &mut self.r)
    }
}

/// `x + d` in the place of `x`.
#[inline(always)]
fn add<const B: usize, const W: usize>(x: &mut Row<B, W>, d: &Row<B, W>) {
    for (x, d) in x.as_flattened_mut().iter_mut().zip(d.as_flattened()) {
        *x += d;
    }
}

/// `x − d` in the place of `x`.
#[inline(always)]
fn subtract<const B: usize, const W: usize>(x: &mut Row<B, W>, d: &Row<B, W>) {
    for (x, d) in x.as_flattened_mut().iter_mut().zip(d.as_flattened()) {
        *x -= d;
    }
}

impl<const B: usize> Chebyshev<B> {
    /// Inverts the diagonal of a matrix and estimates the largest eigenvalue.
    pub fn new(a: &BlockRows<B, B>) -> Self {
        let rows = a.row_count();
        let of_row = |row: usize| {
            let mut own = [[0.0; B]; B];
            a.visit(row, &mut |column, block| {
                if column == row {
                    own = *block;
                }
            });
            inverse(&own).map(|line| line.map(|x| x as f32))
        };
        let inverse_diagonal =
            (0..rows).into_par_iter().with_min_len(TASK_ROWS).map(of_row).collect();
        let mut this = Self { inverse_diagonal, largest: 1.0 };
        this.largest = ESTIMATE_SAFETY * this.estimate(a);
        this
    }
    pub fn bytes(&self) -> usize {
        std::mem::size_of_val(self.inverse_diagonal.as_slice())
    }

    /// Largest eigenvalue of `D⁻¹ A`, nearly from above.
    pub fn largest(&self) -> f64 {
        self.largest
    }

    /// Largest eigenvalue of `D⁻¹ A` that a few steps of conjugate gradients see.
    fn estimate(&self, a: &BlockRows<B, B>) -> f64 {
        let rows = a.row_count();
        // Without pattern, so that no mesh is orthogonal to it.
        let mixed = |i: usize| (7.3 * (i + 1) as f64).sin() as f32;
        let mut r: Vec<[[f32; 1]; B]> = (0..rows)
            .into_par_iter()
            .map(|row| std::array::from_fn(|k| [mixed(B * row + k)]))
            .collect();
        let mut p = vec![[[0.0]; B]; rows];
        let (mut rho, mut beta) = (0.0, 0.0);
        let mut ritz = Ritz::default();
        let mut alpha = 0.0;
        for step in 0..=ESTIMATE_STEPS {
            let z = self.divide(&r);
            let rho_next = dot_blocks(&r, &z);
            if !(rho_next > 0.0 && rho_next.is_finite()) {
                break;
            }
            if step > 0 {
                beta = rho_next / rho;
                ritz.step(alpha, beta);
            }
            rho = rho_next;
            let of_last = beta as f32;
            p.par_iter_mut().with_min_len(TASK_ROWS).zip(&z).for_each(|(p, z)| {
                (0..B).for_each(|k| p[k] = [z[k][0] + of_last * p[k][0]]);
            });
            let mut ap = vec![[[0.0]; B]; rows];
            ap.par_chunks_mut(TASK_ROWS).enumerate().for_each(|(task, ap)| {
                a.products((task * TASK_ROWS, ap.len()), &p, |k, product| ap[k] = product);
            });
            let curvature = dot_blocks(&p, &ap);
            alpha = rho / curvature;
            if !(curvature > 0.0 && alpha.is_finite()) {
                break;
            }
            let length = alpha as f32;
            r.par_iter_mut().with_min_len(TASK_ROWS).zip(&ap).for_each(|(r, ap)| {
                (0..B).for_each(|k| r[k][0] -= length * ap[k][0]);
            });
        }
        ritz.largest().filter(|largest| *largest > 0.0).unwrap_or(1.0)
    }

    fn divide(&self, r: &[[[f32; 1]; B]]) -> Vec<[[f32; 1]; B]> {
        let pairs = self.inverse_diagonal.par_iter().with_min_len(TASK_ROWS).zip(r);
        pairs.map(|(inverse, r)| times(inverse, r)).collect()
    }

    /// Improves `x`, whose residual is `r`, which follows only if `finish`.
    pub fn smooth<const W: usize>(&self, a: &BlockRows<B, B>, v: &mut Vectors<B, W>, finish: bool) {
        let smallest = self.largest / SMOOTHED_DOWN_TO;
        let middle = 0.5 * (self.largest + smallest);
        let half = 0.5 * (self.largest - smallest);
        let sigma = middle / half;
        let mut rho = 1.0 / sigma;
        let Vectors { x, r, d: [d, next] } = v;
        let by = (1.0 / middle) as f32;
        let steps = d.par_iter_mut().with_min_len(TASK_ROWS).zip(x.par_iter_mut());
        steps.zip(self.inverse_diagonal.par_iter().zip(r.par_iter())).for_each(
            |((d, x), (inverse, r))| {
                *d = times(inverse, r).map(|step| step.map(|step| by * step));
                add(x, d);
            },
        );
        for _ in 1..DEGREE {
            let rho_next = 1.0 / (2.0 * sigma - rho);
            let (of_last, of_force) = ((rho * rho_next) as f32, (2.0 * rho_next / half) as f32);
            rho = rho_next;
            self.turn(a, (&d[..], &mut next[..]), (&mut x[..], &mut r[..]), (of_last, of_force));
            std::mem::swap(d, next);
        }
        if finish {
            subtract_product(a, d, r);
        }
    }

    /// One more step: `r − A d`, then `next = of_last d + of_force D⁻¹ r`, then `x + next`.
    fn turn<const W: usize>(
        &self,
        a: &BlockRows<B, B>,
        (d, next): (&[Row<B, W>], &mut [Row<B, W>]),
        (x, r): (&mut [Row<B, W>], &mut [Row<B, W>]),
        (of_last, of_force): (f32, f32),
    ) {
        let out = next.par_chunks_mut(TASK_ROWS).zip(x.par_chunks_mut(TASK_ROWS));
        out.zip(r.par_chunks_mut(TASK_ROWS)).enumerate().for_each(|(task, ((next, x), r))| {
            let first = task * TASK_ROWS;
            a.products((first, next.len()), d, |row, product| {
                subtract(&mut r[row], &product);
                let force = times(&self.inverse_diagonal[first + row], &r[row]);
                let ours = next[row].as_flattened_mut().iter_mut();
                let theirs = d[first + row].as_flattened().iter().zip(force.as_flattened());
                for (next, (d, force)) in ours.zip(theirs) {
                    *next = of_last * d + of_force * force;
                }
                add(&mut x[row], &next[row]);
            });
        });
    }
}

/// `r − A d` in the place of `r`.
pub(super) fn subtract_product<const R: usize, const C: usize, const W: usize>(
    a: &BlockRows<R, C>,
    d: &[[[f32; W]; C]],
    r: &mut [[[f32; W]; R]],
) {
    r.par_chunks_mut(TASK_ROWS).enumerate().for_each(|(task, r)| {
        a.products((task * TASK_ROWS, r.len()), d, |row, product| subtract(&mut r[row], &product));
    });
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Conjugate gradients on a diagonal matrix see its eigenvalues once they are through.
    #[test]
    fn extreme_eigenvalues_of_a_diagonal_are_found() {
        let a = [0.01, 0.4, 1.0, 2.5, 7.0];
        let mut ritz = Ritz::default();
        assert_eq!(ritz.smallest(), None);
        let (mut r, mut p) = ([1.0; 5], [1.0; 5]);
        for _ in 0..5 {
            let rho: f64 = r.iter().map(|r| r * r).sum();
            let curvature: f64 = a.iter().zip(&p).map(|(a, p)| a * p * p).sum();
            let alpha = rho / curvature;
            (0..5).for_each(|i| r[i] -= alpha * a[i] * p[i]);
            let beta = r.iter().map(|r| r * r).sum::<f64>() / rho;
            (0..5).for_each(|i| p[i] = r[i] + beta * p[i]);
            ritz.step(alpha, beta);
        }
        assert!((ritz.smallest().unwrap() / 0.01 - 1.0).abs() < 1e-6);
        assert!((ritz.largest().unwrap() / 7.0 - 1.0).abs() < 1e-9);
    }
}
