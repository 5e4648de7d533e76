//! The softest motion that a path has met: where an older factor knows least, and errors hide.

use super::inverse::Inverse;
use super::shape::Shape;
use crate::solve::vectors::{dot, node_max, norm};

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

    /// Stiffness along it, N/m.
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
