//! What corrections know besides an older factor: steps with their changes of force, and the softest motion
//! that a path has met, where the factor knows least and errors hide.

use std::collections::VecDeque;
use std::sync::Arc;

use super::inverse::Inverse;
use super::shape::Shape;
use crate::solve::vectors::{add_scaled, dot, node_max, norm};

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

/// Pairs of step and change of force that are kept.
const PAIRS_MAX: usize = 8;

impl Secants {
    /// Forgets all pairs.
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
    pub fn bytes(&self) -> usize {
        self.pairs.iter().map(|pair| 2 * size_of_val(pair.step.as_slice())).sum()
    }
}

/// A motion of the unknown degrees of freedom that keeps the masks, and the change of force that it
/// makes.
///
/// Shapes: n each. Units: of length one; N.
#[derive(Clone)]
pub(super) struct Soft {
    pub motion: Vec<f64>,
    pub force: Vec<f64>,
}

impl Soft {
    /// A step of inverse iteration from a motion, and the softest mixture of before and after.
    pub fn after(motion: Vec<f64>, shape: &Shape, inverse: &Inverse) -> Option<Self> {
        let rest = vec![0.0; shape.hold.constraint_count()];
        let next = inverse.apply(&shape.hold, motion.clone(), &rest);
        let (before, mut next) = (of_length_one(motion)?, of_length_one(next)?);
        let along = dot(&before, &next);
        next.iter_mut().zip(&before).for_each(|(x, v)| *x -= along * v);
        let a = Self::pushed(before, shape);
        let Some(next) = of_length_one(next) else { return Some(a) };
        let b = Self::pushed(next, shape);
        let (aa, ab, bb) = (a.stiffness(), dot(&a.motion, &b.force), b.stiffness());
        // The mixture cos·a + sin·b of least stiffness.
        let angle = 0.5 * (2.0 * ab).atan2(aa - bb) + std::f64::consts::FRAC_PI_2;
        let (sin, cos) = angle.sin_cos();
        let mix = |a: &[f64], b: &[f64]| -> Vec<f64> {
            a.iter().zip(b).map(|(a, b)| cos * a + sin * b).collect()
        };
        Some(Self { motion: mix(&a.motion, &b.motion), force: mix(&a.force, &b.force) })
    }

    /// A motion and the change of force that it makes at a shape.
    fn pushed(motion: Vec<f64>, shape: &Shape) -> Self {
        let forces = shape.elements.tangent_times(&shape.q, &shape.scattered(&motion));
        let unknown = shape.hold.partition.unknown();
        let force = unknown.iter().map(|&dof| forces[dof as usize]).collect();
        Self { motion, force }
    }

    /// Stiffness along the motion, N/m.
    fn stiffness(&self) -> f64 {
        dot(&self.motion, &self.force)
    }

    /// By how much a residual may leave a displacement off along it, m; 0 where it is not stable.
    pub fn left_off(&self, residual: &[f64]) -> f64 {
        let stiffness = self.stiffness();
        let driven = if stiffness > 0.0 { dot(&self.motion, residual) / stiffness } else { 0.0 };
        (driven * node_max(&self.motion)).abs()
    }
}

fn of_length_one(mut v: Vec<f64>) -> Option<Vec<f64>> {
    let length = norm(&v);
    if !(length > 0.0 && length.is_finite()) {
        return None;
    }
    v.iter_mut().for_each(|x| *x /= length);
    Some(v)
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
