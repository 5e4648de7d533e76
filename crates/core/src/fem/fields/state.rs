//! Strain, stress and energy inside one element: values at its corners, linear between them.

use super::tensor::{Tensor, plus};
use crate::fem::tet4::Gradients;
use crate::fem::tet10::QUADRATURE;

/// What one element is strained and stressed to.
///
/// Shapes: C is 1 where strain and stress are the same in the whole element, else 4, one for each
/// corner, linear between them. Units: 1, Pa, J, m³.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ElementState<const C: usize> {
    pub strain: [Tensor; C],
    /// Cauchy's.
    pub stress: [Tensor; C],
    /// Stored energy of the whole element.
    pub energy: f64,
    /// Volume at rest.
    pub volume: f64,
    /// μ and κ at small strain.
    pub moduli: (f64, f64),
    /// Largest `|∇N|` of the corners, 1/m: how much a displacement's rounding strains it.
    pub steepest: f64,
}

impl<const C: usize> ElementState<C> {
    pub fn strain_at(&self, corner: usize) -> &Tensor {
        &self.strain[corner % C]
    }

    pub fn stress_at(&self, corner: usize) -> &Tensor {
        &self.stress[corner % C]
    }

    /// Mean over the element.
    pub fn mean_strain(&self) -> Tensor {
        mean(&self.strain)
    }

    /// Mean over the element.
    pub fn mean_stress(&self) -> Tensor {
        mean(&self.stress)
    }
}

fn mean<const C: usize>(at_corners: &[Tensor; C]) -> Tensor {
    at_corners.iter().fold([0.0; 6], |sum, tensor| plus(sum, 1.0 / C as f64, tensor))
}

/// Largest `|∇N|` of an element, 1/m.
pub(crate) fn steepest_of(g: &Gradients) -> f64 {
    g.of_shape.iter().map(|gradient| gradient.norm()).fold(0.0, f64::max)
}

/// Values at the corners of the field that is linear in an element and has the values given at the
/// four points of [`QUADRATURE`], in their order; its mean is theirs.
///
/// Source: with `Lᵢ = near` at point i and `far` elsewhere, the values are
/// `gᵢ = (near − far) cᵢ + far Σ c` and `Σ g = Σ c`.
pub(crate) fn at_corners(at_points: [Tensor; 4]) -> [Tensor; 4] {
    let [near, far, ..] = QUADRATURE[0];
    let sum = at_points.iter().fold([0.0; 6], |sum, tensor| plus(sum, 1.0, tensor));
    at_points.map(|tensor| {
        let own = plus(tensor, -far, &sum);
        own.map(|component| component / (near - far))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn corners_of_a_linear_field_are_found_from_its_quadrature_points() {
        let corners: [Tensor; 4] =
            std::array::from_fn(|i| std::array::from_fn(|k| (1.3 * i as f64 + k as f64).sin()));
        let points = QUADRATURE
            .map(|l| corners.iter().zip(l).fold([0.0; 6], |sum, (corner, l)| plus(sum, l, corner)));
        for (found, corner) in at_corners(points).iter().zip(&corners) {
            assert!(found.iter().zip(corner).all(|(a, b)| (a - b).abs() < 1e-15));
        }
    }
}
