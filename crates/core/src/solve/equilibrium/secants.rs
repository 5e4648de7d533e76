//! What steps and changes of force so far say about the inverse of the tangent.

use std::collections::VecDeque;
use std::sync::Arc;

use crate::solve::vectors::{add_scaled, dot};

/// The newest steps with the changes of force they made: with them the inverse of an older tangent
/// is corrected to that of the present one.
///
/// Source: limited-memory BFGS, Nocedal, Math. Comput. 35 (1980) 773; with a constant factor as the
/// first inverse as in Liu, Bouaziz and Kavan (2017).
#[derive(Clone, Default)]
pub(super) struct Secants {
    /// Older than all pairs, and there as long as no other takes its place.
    pinned: Option<Arc<Pair>>,
    pairs: VecDeque<Arc<Pair>>,
}

struct Pair {
    step: Vec<f64>,
    change: Vec<f64>,
    /// `1 / stepᵀ change`.
    rho: f64,
}

/// Pairs kept.
const PAIRS_MAX: usize = 8;

impl Secants {
    /// Forgets all.
    pub fn clear(&mut self) {
        self.pairs.clear();
        self.pinned = None;
    }

    /// Keeps a pair if it has positive curvature, so that corrections go on going downhill.
    pub fn keep(&mut self, step: Vec<f64>, change: Vec<f64>) {
        let curvature = dot(&step, &change);
        let size = dot(&step, &step).sqrt() * dot(&change, &change).sqrt();
        if curvature <= 1e-10 * size || !curvature.is_finite() {
            return;
        }
        if self.pairs.len() == PAIRS_MAX {
            self.pairs.pop_front();
        }
        self.pairs.push_back(Arc::new(Pair { step, change, rho: 1.0 / curvature }));
    }

    /// Keeps a pair of the present shape beside the others.
    pub fn pin(&mut self, step: Vec<f64>, change: Vec<f64>) {
        let curvature = dot(&step, &change);
        let is_usable = curvature > 0.0 && curvature.is_finite();
        self.pinned = is_usable.then(|| Arc::new(Pair { step, change, rho: 1.0 / curvature }));
    }

    /// The inverse times forces, `inverse` being that of an older tangent.
    pub fn apply(&self, mut r: Vec<f64>, inverse: impl FnOnce(Vec<f64>) -> Vec<f64>) -> Vec<f64> {
        let mut alphas = Vec::with_capacity(self.pairs.len());
        for pair in self.pairs.iter().rev().chain(&self.pinned) {
            let alpha = pair.rho * dot(&pair.step, &r);
            add_scaled(&mut r, -alpha, &pair.change);
            alphas.push(alpha);
        }
        let mut z = inverse(r);
        for (pair, alpha) in self.pinned.iter().chain(&self.pairs).zip(alphas.iter().rev()) {
            let beta = pair.rho * dot(&pair.change, &z);
            add_scaled(&mut z, alpha - beta, &pair.step);
        }
        z
    }

    /// Bytes held.
    pub fn bytes(&self) -> usize {
        self.pairs.iter().map(|pair| 2 * size_of_val(pair.step.as_slice())).sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pairs_of_a_matrix_are_inverted_exactly() {
        // diag(2, 5), from an inverse that knows nothing.
        let mut secants = Secants::default();
        secants.keep(vec![1.0, 0.0], vec![2.0, 0.0]);
        secants.keep(vec![0.0, 1.0], vec![0.0, 5.0]);
        let z = secants.apply(vec![4.0, 10.0], |r| r);
        assert!((z[0] - 2.0).abs() < 1e-14 && (z[1] - 2.0).abs() < 1e-14, "{z:?}");
    }

    #[test]
    fn pairs_without_positive_curvature_are_not_kept() {
        let mut secants = Secants::default();
        secants.keep(vec![1.0, 0.0], vec![-2.0, 0.0]);
        secants.keep(vec![1.0, 0.0], vec![0.0, 1.0]);
        assert_eq!(secants.bytes(), 0);
    }
}
