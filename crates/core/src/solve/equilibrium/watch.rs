//! Follows the softest motion of a path, and teaches corrections its true stiffness.

use super::path::Path;
use super::soft::Soft;
use crate::solve::vectors::{dot, node_max, norm};

impl Path {
    /// Follows the softest motion, once in a frame, and teaches corrections the true stiffness along
    /// it. It begins at what a residual drives.
    pub(super) fn watch_soft(&mut self, residual: &[f64]) {
        if self.is_soft_watched {
            return;
        }
        self.is_soft_watched = true;
        self.follow_soft(residual);
        if let Some(soft) = &self.soft {
            self.secants.pin(soft.motion.clone(), soft.force.clone());
        }
    }

    /// By how much a residual may leave a displacement off along the softest motion, m.
    pub(super) fn left_along_soft(&self, residual: &[f64]) -> f64 {
        let along = |soft: &Soft| (soft.driven(residual) * node_max(&soft.motion)).abs();
        self.soft.as_ref().map_or(0.0, along)
    }

    /// A step of inverse iteration, and the softest mixture of before and after.
    fn follow_soft(&mut self, residual: &[f64]) {
        let hold = std::sync::Arc::clone(&self.hold);
        let Some(inverse) = &self.inverse else { return };
        let rest = vec![0.0; hold.constraint_count()];
        let before = self.soft.take().map_or_else(|| residual.to_vec(), |soft| soft.motion);
        self.counts.linear_solves += 1;
        let next = inverse.apply(&hold, before.clone(), &rest);
        let (Some(before), Some(mut next)) = (of_length_one(before), of_length_one(next)) else {
            return;
        };
        let along = dot(&before, &next);
        next.iter_mut().zip(&before).for_each(|(x, v)| *x -= along * v);
        let a = self.pushed(before);
        let Some(next) = of_length_one(next) else {
            self.soft = Some(a);
            return;
        };
        let b = self.pushed(next);
        let (aa, ab, bb) = (a.stiffness(), dot(&a.motion, &b.force), b.stiffness());
        // The mixture cos·a + sin·b of least stiffness.
        let angle = 0.5 * (2.0 * ab).atan2(aa - bb) + std::f64::consts::FRAC_PI_2;
        let (sin, cos) = angle.sin_cos();
        let mix = |a: &[f64], b: &[f64]| -> Vec<f64> {
            a.iter().zip(b).map(|(a, b)| cos * a + sin * b).collect()
        };
        self.soft =
            Some(Soft { motion: mix(&a.motion, &b.motion), force: mix(&a.force, &b.force) });
    }

    /// A motion and the change of force that it makes at the present shape.
    fn pushed(&self, motion: Vec<f64>) -> Soft {
        let mut full = vec![0.0; self.q.len()];
        self.hold.partition.scatter_unknown(&motion, &mut full);
        let forces = self.elements.tangent_times(&self.q, &full);
        let force = self.hold.partition.unknown().iter().map(|&dof| forces[dof as usize]).collect();
        Soft { motion, force }
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
