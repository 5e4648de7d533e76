//! The linear (four-node) tetrahedron, formula by formula as in thesis section 3.3.2.
//!
//! The same stiffness is written twice on purpose: [`element_stiffness`] is (3.32) as printed,
//! [`stiffness_block`] is one 3 × 3 block of it in closed form, which assembly uses because it
//! needs no 6 × 12 matrices. A test holds them together.

use nalgebra::{Matrix3, Point3, SMatrix, Vector3};
use rayon::prelude::*;

use super::Material;

/// Strain–displacement matrix `B`, 6 × 12.
pub type StrainDisplacement = SMatrix<f64, 6, 12>;
/// Element stiffness `kᵉ`, 12 × 12, ordered `x1 y1 z1 x2 … z4`.
pub type ElementStiffness = SMatrix<f64, 12, 12>;

/// Shape functions at local coordinates: `N₁ = ξ, N₂ = η, N₃ = ζ, N₄ = 1 − ξ − η − ζ`.
///
/// Source: thesis (3.8).
pub fn shape_functions(xi: f64, eta: f64, zeta: f64) -> [f64; 4] {
    [xi, eta, zeta, 1.0 - xi - eta - zeta]
}

/// Jacobian `J`: row i is corner i − corner 4.
///
/// Shapes: 3 × 3. Units: those of the corners.
///
/// Source: thesis (3.23).
pub fn jacobian(corners: &[Point3<f64>; 4]) -> Matrix3<f64> {
    let [c1, c2, c3, c4] = corners;
    Matrix3::from_rows(&[(c1 - c4).transpose(), (c2 - c4).transpose(), (c3 - c4).transpose()])
}

/// Inverse of the Jacobian, `A = J⁻¹`, by cofactors.
///
/// Shapes: `j` 3 × 3 with positive determinant; result 3 × 3.
///
/// Source: thesis (3.25). As printed there the entries are cofactors of `J` with row i of `J`
/// written `x_i4 y_i4 z_i4`; column i of `A` is the cross product of the other two rows of `J`.
pub fn jacobian_inverse(j: &Matrix3<f64>) -> Matrix3<f64> {
    let (r1, r2, r3) = (j.row(0).transpose(), j.row(1).transpose(), j.row(2).transpose());
    let det = r1.dot(&r2.cross(&r3));
    Matrix3::from_columns(&[r2.cross(&r3), r3.cross(&r1), r1.cross(&r2)]) / det
}

/// Gradients of the four shape functions and the volume of the element.
///
/// Shapes: 4 vectors. Units: 1/m and m³.
///
/// Source: columns of `A` (3.25) and `−Ã` (3.28); volume (3.33).
#[derive(Clone, Copy, Debug, Default)]
pub struct Gradients {
    /// `∇N₁ … ∇N₄`.
    pub of_shape: [Vector3<f64>; 4],
    /// `V_e = |det J| / 6`.
    pub volume: f64,
}

/// Gradients of the shape functions of one element.
///
/// Units: corners m.
///
/// Source: thesis (3.23)–(3.28), (3.33).
pub fn gradients(corners: &[Point3<f64>; 4]) -> Gradients {
    let j = jacobian(corners);
    let a = jacobian_inverse(&j);
    let (g1, g2, g3) =
        (a.column(0).into_owned(), a.column(1).into_owned(), a.column(2).into_owned());
    let g4 = -(g1 + g2 + g3);
    Gradients { of_shape: [g1, g2, g3, g4], volume: j.determinant().abs() / 6.0 }
}

/// [`gradients`] of all elements of a mesh, in parallel.
pub(super) fn gradients_of(
    tet_count: usize,
    corners: impl Fn(usize) -> [Point3<f64>; 4] + Sync,
) -> Vec<Gradients> {
    (0..tet_count).into_par_iter().map(|tet| gradients(&corners(tet))).collect()
}

/// Strain–displacement matrix `B`, so that `ε = B q`; strain order `x y z yz zx xy`.
///
/// Shapes: 6 × 12. Units: 1/m.
///
/// Source: thesis (3.30).
pub fn strain_displacement(corners: &[Point3<f64>; 4]) -> StrainDisplacement {
    let mut b = StrainDisplacement::zeros();
    for (i, g) in gradients(corners).of_shape.iter().enumerate() {
        let c = 3 * i;
        b[(0, c)] = g.x;
        b[(1, c + 1)] = g.y;
        b[(2, c + 2)] = g.z;
        b[(3, c + 1)] = g.z;
        b[(3, c + 2)] = g.y;
        b[(4, c)] = g.z;
        b[(4, c + 2)] = g.x;
        b[(5, c)] = g.y;
        b[(5, c + 1)] = g.x;
    }
    b
}

/// Stiffness of one element, `kᵉ = V_e Bᵀ D B`.
///
/// Shapes: 12 × 12. Units: corners m, `D` Pa, result N/m.
///
/// Source: thesis (3.32), (3.33).
pub fn element_stiffness(corners: &[Point3<f64>; 4], material: &Material) -> ElementStiffness {
    let b = strain_displacement(corners);
    let volume = gradients(corners).volume;
    b.transpose() * material.d() * b * volume
}

/// Block (row node `i`, column node `j`) of [`element_stiffness`] in closed form:
/// `V (λ gᵢ gⱼᵀ + μ gⱼ gᵢᵀ + μ (gᵢ·gⱼ) I)`, row-major.
///
/// Shapes: 3 × 3 as 9 numbers. Units: N/m.
///
/// Source: thesis (3.32) multiplied out for the isotropic `D` of (3.15).
pub fn stiffness_block(g: &Gradients, i: usize, j: usize, lambda: f64, mu: f64) -> [f64; 9] {
    let (gi, gj) = (&g.of_shape[i], &g.of_shape[j]);
    let (l, m) = (lambda * g.volume, mu * g.volume);
    let diagonal = m * gi.dot(gj);
    let mut block = [0.0; 9];
    for r in 0..3 {
        for c in 0..3 {
            block[3 * r + c] = l * gi[r] * gj[c] + m * gj[r] * gi[c];
        }
        block[4 * r] += diagonal;
    }
    block
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::SVector;
    use proptest::prelude::*;

    fn unit_corners() -> [Point3<f64>; 4] {
        [
            Point3::new(1.0, 0.0, 0.0),
            Point3::new(0.0, 1.0, 0.0),
            Point3::new(0.0, 0.0, 1.0),
            Point3::origin(),
        ]
    }

    #[test]
    fn jacobian_inverse_is_the_inverse() {
        let corners = [
            Point3::new(1.0, 0.2, 0.1),
            Point3::new(0.3, 1.4, -0.2),
            Point3::new(0.1, 0.2, 0.9),
            Point3::new(-0.1, 0.1, 0.05),
        ];
        let j = jacobian(&corners);
        assert!((j * jacobian_inverse(&j) - Matrix3::identity()).amax() < 1e-14);
    }

    /// For E = 1, ν = 0 on the unit tetrahedron, D = diag(1, 1, 1, ½, ½, ½), V = 1/6, and the
    /// gradients are the axes and −(1, 1, 1). By hand: row x1 couples x1 1/6, y1 0,
    /// x2 0, y2 0, x4 −1/6; row y1 (shear xy only: γ = ∂v/∂x) couples y1 1/12, x2 1/12,
    /// y4 −1/12, x4 −1/12; row x4: x4 (1 + ½ + ½)/6 = 1/3, y4 ½/6 = 1/12.
    #[test]
    fn stiffness_of_unit_tetrahedron_equals_hand_calculation() {
        let k = element_stiffness(&unit_corners(), &Material::try_new(1.0, 0.0).unwrap());
        let expected = [
            (0, 0, 1.0 / 6.0),
            (0, 1, 0.0),
            (0, 3, 0.0),
            (0, 4, 0.0),
            (0, 9, -1.0 / 6.0),
            (1, 1, 1.0 / 12.0),
            (1, 3, 1.0 / 12.0),
            (1, 9, -1.0 / 12.0),
            (1, 10, -1.0 / 12.0),
            (9, 9, 1.0 / 3.0),
            (9, 10, 1.0 / 12.0),
        ];
        for (row, column, value) in expected {
            assert!((k[(row, column)] - value).abs() < 1e-15, "k[{row},{column}] is not {value}");
        }
    }

    /// With ν = 0.25 and E = 2.5: λ = μ = 1, so kᵉ[x1,x1] = V (λ + 2μ) = ½ and
    /// kᵉ[x1,y2] = V λ = 1/6, kᵉ[y1,x2] = V μ = 1/6.
    #[test]
    fn stiffness_with_equal_lame_parameters_equals_hand_calculation() {
        let k = element_stiffness(&unit_corners(), &Material::try_new(2.5, 0.25).unwrap());
        assert!((k[(0, 0)] - 0.5).abs() < 1e-15);
        assert!((k[(0, 4)] - 1.0 / 6.0).abs() < 1e-15);
        assert!((k[(1, 3)] - 1.0 / 6.0).abs() < 1e-15);
    }

    #[test]
    fn shape_functions_sum_to_one_and_pick_their_corner() {
        assert_eq!(shape_functions(1.0, 0.0, 0.0), [1.0, 0.0, 0.0, 0.0]);
        assert_eq!(shape_functions(0.0, 0.0, 0.0), [0.0, 0.0, 0.0, 1.0]);
        assert!((shape_functions(0.2, 0.3, 0.1).iter().sum::<f64>() - 1.0).abs() < 1e-15);
    }

    fn corners() -> impl Strategy<Value = [Point3<f64>; 4]> {
        prop::array::uniform4(prop::array::uniform3(-1.0..1.0f64))
            .prop_map(|c| c.map(Point3::from))
            .prop_filter("too flat", |c| crate::mesh::signed_volume(c) > 1e-3)
    }

    proptest! {
        #[test]
        fn blocks_in_closed_form_equal_the_printed_product(c in corners(), nu in 0.0..0.49f64) {
            let material = Material::try_new(1.0e5, nu).unwrap();
            let k = element_stiffness(&c, &material);
            let g = gradients(&c);
            for i in 0..4 {
                for j in 0..4 {
                    let b = stiffness_block(&g, i, j, material.lame_lambda(), material.shear_modulus());
                    for r in 0..3 {
                        for s in 0..3 {
                            let difference = (b[3 * r + s] - k[(3 * i + r, 3 * j + s)]).abs();
                            prop_assert!(difference <= 1e-12 * k.amax());
                        }
                    }
                }
            }
        }

        #[test]
        fn rigid_motion_gives_zero_force(c in corners(), t in prop::array::uniform3(-1.0..1.0f64),
                                         w in prop::array::uniform3(-1.0..1.0f64)) {
            let k = element_stiffness(&c, &Material::try_new(1.0, 0.3).unwrap());
            let (t, w) = (Vector3::from(t), Vector3::from(w));
            let mut q = SVector::<f64, 12>::zeros();
            for (i, corner) in c.iter().enumerate() {
                q.fixed_rows_mut::<3>(3 * i).copy_from(&(t + w.cross(&corner.coords)));
            }
            prop_assert!((k * q).amax() <= 1e-13 * k.amax());
        }

        #[test]
        fn element_stiffness_has_exactly_six_zero_eigenvalues(c in corners()) {
            let k = element_stiffness(&c, &Material::try_new(1.0, 0.3).unwrap());
            let mut values: Vec<f64> = k.symmetric_eigenvalues().iter().copied().collect();
            values.sort_by(f64::total_cmp);
            let largest = values[11];
            prop_assert!(values[..6].iter().all(|v| v.abs() <= 1e-12 * largest));
            prop_assert!(values[6] > 1e-9 * largest);
        }
    }
}
