//! The four quadrature points of a ten-node element at rest, with straight or curved edges.

use nalgebra::{Matrix3, Point3, Vector3};

use super::tet4::{self, Gradients};
use super::tet10::{QUADRATURE, shape_gradients};

/// What an element at rest is at the points of [`QUADRATURE`].
///
/// Units: m³, 1/m.
#[derive(Clone, Debug)]
pub struct Points {
    /// Volume of the element, by these points.
    pub volume: f64,
    /// Share of the volume that every point stands for; their sum is 1.
    pub shares: [f64; 4],
    /// Gradients of the ten shape functions at every point.
    pub gradients: [[Vector3<f64>; 10]; 4],
}

/// The element whose barycentric coordinates are its coordinates: gradients by `L₁ L₂ L₃`, with
/// `L₄ = 1 − L₁ − L₂ − L₃`.
const UNIT: Gradients = Gradients {
    of_shape: [
        Vector3::new(1.0, 0.0, 0.0),
        Vector3::new(0.0, 1.0, 0.0),
        Vector3::new(0.0, 0.0, 1.0),
        Vector3::new(-1.0, -1.0, -1.0),
    ],
    volume: 1.0 / 6.0,
};

impl Points {
    /// Of an element with straight edges and mid-edge nodes in their middles.
    pub fn straight(g: &Gradients) -> Self {
        let gradients = QUADRATURE.map(|l| shape_gradients(g, l));
        Self { volume: g.volume, shares: [0.25; 4], gradients }
    }

    /// Of an element whose ten nodes are anywhere, `x = Σ N_a x_a` (isoparametric): the gradients in
    /// space are `J⁻¹` times those by `L₁ L₂ L₃`, and a point stands for `det J / 24`.
    ///
    /// Shapes: `nodes` in the order of the element. Units: m. No determinant of [`jacobians`] may be
    /// zero.
    ///
    /// Source: thesis (3.23)–(3.28), with ten shape functions for four.
    pub fn curved(nodes: &[Point3<f64>; 10]) -> Self {
        let mut weights = [0.0; 4];
        let gradients = std::array::from_fn(|point| {
            let by_l = shape_gradients(&UNIT, QUADRATURE[point]);
            let j = jacobian(nodes, &by_l);
            weights[point] = j.determinant() / 24.0;
            let inverse = tet4::jacobian_inverse(&j);
            by_l.map(|gradient| inverse * gradient)
        });
        let volume: f64 = weights.iter().sum();
        Self { volume, shares: weights.map(|weight| weight / volume), gradients }
    }

    /// Displacement gradients `H = Σ u_a ∇N_aᵀ` at the points.
    ///
    /// Units: m; result 1.
    ///
    /// Source: thesis (3.28), with ten shape functions for four.
    pub fn displacement_gradients(&self, u: &[Vector3<f64>; 10]) -> [Matrix3<f64>; 4] {
        self.gradients.map(|gradients| {
            let terms = u.iter().zip(gradients);
            terms.fold(Matrix3::zeros(), |h, (u_a, gradient)| h + u_a * gradient.transpose())
        })
    }

    /// The ten blocks of row node `a` of the stiffness `kᵉ = Σ w_q B_qᵀ D B_q`, row-major.
    ///
    /// Shapes: `a` < 10; ten times 3 × 3. Units: λ, μ Pa; result N/m.
    ///
    /// Source: thesis (3.32) before `B` is taken out of the integral, for the isotropic `D` of (3.15).
    pub fn stiffness_row(&self, a: usize, lambda: f64, mu: f64) -> [[f64; 9]; 10] {
        let mut row = [[0.0; 9]; 10];
        for (gradients, share) in self.gradients.iter().zip(self.shares) {
            let weight = self.volume * share;
            let (l, m) = (gradients[a] * (lambda * weight), gradients[a] * (mu * weight));
            for (block, other) in row.iter_mut().zip(gradients) {
                let diagonal = m.dot(other);
                for r in 0..3 {
                    for c in 0..3 {
                        block[3 * r + c] += l[r] * other[c] + other[r] * m[c];
                    }
                    block[4 * r] += diagonal;
                }
            }
        }
        row
    }
}

/// Determinants of the Jacobian `J` at the points, six times a volume where edges are straight; an
/// element that is curved so far that it folds has one that is not positive.
///
/// Shapes: `nodes` in the order of the element. Units: m; result m³.
///
/// Source: thesis (3.23), with ten shape functions for four.
pub fn jacobians(nodes: &[Point3<f64>; 10]) -> [f64; 4] {
    QUADRATURE.map(|l| jacobian(nodes, &shape_gradients(&UNIT, l)).determinant())
}

/// `J = Σ ∂N_a/∂L x_aᵀ`: row i is how the place changes with `L_i`.
fn jacobian(nodes: &[Point3<f64>; 10], by_l: &[Vector3<f64>; 10]) -> Matrix3<f64> {
    // The gradients add up to zero: from one corner on, nothing is lost to where the element lies.
    let arms = nodes.iter().map(|node| node - nodes[0]);
    by_l.iter().zip(arms).fold(Matrix3::zeros(), |j, (slope, arm)| j + slope * arm.transpose())
}
