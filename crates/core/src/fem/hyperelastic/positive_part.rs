//! The positive part of a tangent: what is left when directions of negative curvature are cut off.

use nalgebra::Matrix3;

use super::principal_tangent::{PAIRS, PrincipalTangent, Tangent9};
use super::{Deformed, TangentCoefficients};

/// Positive part of a tangent, as a 9 × 9 matrix: eigenvalues below zero become zero.
///
/// With `F = U Σ Vᵀ` the eigenvalues of flips and twists are `a ± d/(σᵢ σⱼ)`.
///
/// Shapes: 9 × 9 over `dF` column by column. Units: Pa.
///
/// Source: that of the eigenvalues in principal axes, for [`TangentCoefficients`].
pub fn positive_part(tangent: &TangentCoefficients, point: &Deformed) -> Tangent9 {
    let svd = point.f.svd(true, true);
    let (Some(u), Some(v_transposed)) = (svd.u, svd.v_t) else { return Tangent9::zeros() };
    let s = svd.singular_values;
    let TangentCoefficients { a, b, c, d } = *tangent;
    // J > 0, so U and V mirror both or neither.
    let stretches = Matrix3::from_fn(|i, k| {
        let same = if i == k { a + d / (s[i] * s[i]) } else { 0.0 };
        same + b * (s[i] / s[k] + s[k] / s[i]) + c / (s[i] * s[k])
    });
    let coupling = PAIRS.map(|(i, k)| d / (s[i] * s[k]));
    let principal = PrincipalTangent {
        left: u,
        right: v_transposed.transpose(),
        stretches,
        flips: coupling.map(|coupling| a + coupling),
        twists: coupling.map(|coupling| a - coupling),
    };
    principal.positive_part().matrix()
}
