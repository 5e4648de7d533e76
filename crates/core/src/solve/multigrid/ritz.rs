//! Eigenvalues of a preconditioned matrix as far as conjugate gradients have seen them.

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

    /// Above all eigenvalues (Gershgorin).
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
