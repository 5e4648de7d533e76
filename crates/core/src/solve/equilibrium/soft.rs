//! The softest motion that a path has met: where an older factor knows least, and errors hide.

use crate::solve::vectors::dot;

/// A motion among the unknown that keeps the masks, and the change of force that it makes.
///
/// Shapes: n each. Units: of length one; N.
#[derive(Clone)]
pub(super) struct Soft {
    pub motion: Vec<f64>,
    pub force: Vec<f64>,
}

impl Soft {
    /// Stiffness along it, N/m.
    pub fn stiffness(&self) -> f64 {
        dot(&self.motion, &self.force)
    }

    /// How far a residual drives along it, m; nothing where it is not stable.
    pub fn driven(&self, residual: &[f64]) -> f64 {
        let stiffness = self.stiffness();
        if stiffness > 0.0 { dot(&self.motion, residual) / stiffness } else { 0.0 }
    }
}
