//! The quadratic (ten-node) tetrahedron with straight edges, and its shape functions.
//!
//! Barycentric coordinates `L = (L₁ … L₄)` are the shape functions (3.8) of the linear
//! tetrahedron. As the edges are straight, the gradients of `L` are those of [`tet4`] and constant,
//! and everything here is a polynomial in `L` whose integral is known. As in [`tet4`] the
//! stiffness is written twice: [`element_stiffness`] as quadrature of `Bᵀ D B`,
//! [`stiffness_row`] in closed form, which assembly uses. A test holds them together. Curved
//! edges are worked out at four points ([`super::tet10_points`]).

use nalgebra::{Matrix3, Point3, SMatrix, Vector3};

use super::tet4::Gradients;
use super::{Material, tet4};

/// Corners (from 0) of the edge of local nodes 4 … 9: edges 12, 23, 13, 14, 24, 34.
pub const EDGES: [[usize; 2]; 6] = [[0, 1], [1, 2], [0, 2], [0, 3], [1, 3], [2, 3]];

/// Local nodes of the same element with the other orientation, corners 3 and 4 exchanged; applied
/// twice it is the same list again. Files count the other volume positive than (3.23).
pub const MIRRORED: [usize; 10] = [0, 1, 3, 2, 4, 8, 7, 6, 5, 9];

/// Strain–displacement matrix `B`, 6 × 30.
pub type StrainDisplacement = SMatrix<f64, 6, 30>;
/// Element stiffness `kᵉ`, 30 × 30, ordered `x1 y1 z1 x2 … z10`.
pub type ElementStiffness = SMatrix<f64, 30, 30>;

const NEAR: f64 = 0.585_410_196_624_968_5;
const FAR: f64 = 0.138_196_601_125_010_5;

/// Barycentric coordinates of the four quadrature points, each of weight `V_e / 4`; exact for
/// polynomials of degree two, so for `Bᵀ D B` with straight edges.
///
/// Source: Hammer, Marlowe and Stroud (1956): `(5 + 3√5) / 20` and three times `(5 − √5) / 20`.
pub const QUADRATURE: [[f64; 4]; 4] =
    [[NEAR, FAR, FAR, FAR], [FAR, NEAR, FAR, FAR], [FAR, FAR, NEAR, FAR], [FAR, FAR, FAR, NEAR]];

/// Shape functions: `Nᵢ = Lᵢ (2Lᵢ − 1)` at corners, `N_ij = 4 Lᵢ Lⱼ` on edges.
///
/// Shapes: `l` barycentric, sum 1; result in the order of the nodes.
pub fn shape_functions(l: [f64; 4]) -> [f64; 10] {
    let [c1, c2, c3, c4] = l.map(|x| x * (2.0 * x - 1.0));
    let [e1, e2, e3, e4, e5, e6] = EDGES.map(|[i, j]| 4.0 * l[i] * l[j]);
    [c1, c2, c3, c4, e1, e2, e3, e4, e5, e6]
}

/// Gradients of the shape functions at one point: `∇Nᵢ = (4Lᵢ − 1) ∇Lᵢ`,
/// `∇N_ij = 4 (Lᵢ ∇Lⱼ + Lⱼ ∇Lᵢ)`.
///
/// Shapes: `l` barycentric; 10 vectors. Units: 1/m.
pub fn shape_gradients(g: &Gradients, l: [f64; 4]) -> [Vector3<f64>; 10] {
    let mut gradients = [Vector3::zeros(); 10];
    let (at_corners, on_edges) = gradients.split_at_mut(4);
    for (i, gradient) in at_corners.iter_mut().enumerate() {
        *gradient = g.of_shape[i] * (4.0 * l[i] - 1.0);
    }
    for (gradient, [i, j]) in on_edges.iter_mut().zip(EDGES) {
        *gradient = (g.of_shape[j] * l[i] + g.of_shape[i] * l[j]) * 4.0;
    }
    gradients
}

/// Strain–displacement matrix `B` at one point, so that `ε = B q`; strain order
/// `x y z yz zx xy`.
///
/// Shapes: `l` barycentric; 6 × 30. Units: 1/m.
///
/// Source: thesis (3.30), with ten shape functions for four.
pub fn strain_displacement(g: &Gradients, l: [f64; 4]) -> StrainDisplacement {
    let mut b = StrainDisplacement::zeros();
    for (a, gradient) in shape_gradients(g, l).iter().enumerate() {
        let c = 3 * a;
        b[(0, c)] = gradient.x;
        b[(1, c + 1)] = gradient.y;
        b[(2, c + 2)] = gradient.z;
        b[(3, c + 1)] = gradient.z;
        b[(3, c + 2)] = gradient.y;
        b[(4, c)] = gradient.z;
        b[(4, c + 2)] = gradient.x;
        b[(5, c)] = gradient.y;
        b[(5, c + 1)] = gradient.x;
    }
    b
}

/// Stiffness of one element by four-point quadrature, `kᵉ = Σ_q (V_e / 4) B_qᵀ D B_q`.
///
/// Shapes: 30 × 30. Units: corners m, `D` Pa, result N/m.
///
/// Source: thesis (3.32) before `B` is taken out of the integral, points of [`QUADRATURE`].
pub fn element_stiffness(corners: &[Point3<f64>; 4], material: &Material) -> ElementStiffness {
    let g = tet4::gradients(corners);
    let mut k = ElementStiffness::zeros();
    for l in QUADRATURE {
        let b = strain_displacement(&g, l);
        k += b.transpose() * (material.d() * b) * (g.volume / 4.0);
    }
    k
}

/// The ten blocks of row node `a` of [`element_stiffness`] in closed form, row-major.
///
/// Every gradient is a sum of `∇L₁ … ∇L₄` with weights `4Lᵢ − 1` or `4Lᵢ`, so every block is the
/// sum of blocks of the linear tetrahedron with the mean products of those weights.
///
/// Shapes: `a` < 10; ten times 3 × 3. Units: λ, μ Pa; result N/m.
///
/// Source: thesis (3.32) multiplied out for the isotropic `D` of (3.15) by
/// [`tet4::stiffness_block`]; means from `∫ Lᵢ Lⱼ dV = V_e (1 + δᵢⱼ) / 20`.
pub fn stiffness_row(g: &Gradients, a: usize, lambda: f64, mu: f64) -> [[f64; 9]; 10] {
    let linear_row = |i| {
        let mut blocks = [[0.0; 9]; 4];
        for (j, block) in blocks.iter_mut().enumerate() {
            *block = tet4::stiffness_block(g, i, j, lambda, mu);
        }
        blocks
    };
    let mut row = [[0.0; 9]; 10];
    let (at_corners, on_edges) = row.split_at_mut(4);
    if a < 4 {
        let (of_a, weight) = (linear_row(a), REDUCED[a]);
        for (b, block) in at_corners.iter_mut().enumerate() {
            *block = combined([(weight[b], &of_a[b])]);
        }
        for (block, [k, l]) in on_edges.iter_mut().zip(EDGES) {
            *block = combined([(weight[k], &of_a[l]), (weight[l], &of_a[k])]);
        }
    } else {
        // ∇N_a = 4Lᵢ ∇Lⱼ + 4Lⱼ ∇Lᵢ.
        let [i, j] = EDGES[a - 4];
        let (of_i, of_j) = (linear_row(i), linear_row(j));
        for (b, block) in at_corners.iter_mut().enumerate() {
            *block = combined([(REDUCED[i][b], &of_j[b]), (REDUCED[j][b], &of_i[b])]);
        }
        let (with_i, with_j) = (PRODUCT[i], PRODUCT[j]);
        for (block, [k, l]) in on_edges.iter_mut().zip(EDGES) {
            *block = combined([
                (with_i[k], &of_j[l]),
                (with_i[l], &of_j[k]),
                (with_j[k], &of_i[l]),
                (with_j[l], &of_i[k]),
            ]);
        }
    }
    row
}

/// Means of `4Lᵢ · 4Lⱼ` over an element, from `∫ Lᵢ Lⱼ dV = V_e (1 + δᵢⱼ) / 20`.
const PRODUCT: [[f64; 4]; 4] =
    [[1.6, 0.8, 0.8, 0.8], [0.8, 1.6, 0.8, 0.8], [0.8, 0.8, 1.6, 0.8], [0.8, 0.8, 0.8, 1.6]];

/// Means of `(4Lᵢ − 1) · 4Lⱼ`, and of `(4Lᵢ − 1)(4Lⱼ − 1)`: the mean of `4Lᵢ − 1` is zero.
const REDUCED: [[f64; 4]; 4] = [
    [0.6, -0.2, -0.2, -0.2],
    [-0.2, 0.6, -0.2, -0.2],
    [-0.2, -0.2, 0.6, -0.2],
    [-0.2, -0.2, -0.2, 0.6],
];

/// Weighted sum of blocks.
fn combined<const T: usize>(terms: [(f64, &[f64; 9]); T]) -> [f64; 9] {
    let mut sum = [0.0; 9];
    for (weight, block) in terms {
        for (entry, term) in sum.iter_mut().zip(block) {
            *entry += weight * term;
        }
    }
    sum
}

/// Displacement gradient `H = Σ u_a ∇N_aᵀ` at one point of an element.
///
/// Shapes: `u` 10 vectors, `l` barycentric; 3 × 3. Units: m; result 1.
///
/// Source: thesis (3.28), with ten shape functions for four.
pub fn displacement_gradient(g: &Gradients, u: &[Vector3<f64>; 10], l: [f64; 4]) -> Matrix3<f64> {
    u.iter()
        .zip(shape_gradients(g, l))
        .fold(Matrix3::zeros(), |h, (u_a, gradient)| h + u_a * gradient.transpose())
}

#[cfg(test)]
pub(crate) mod tests;
