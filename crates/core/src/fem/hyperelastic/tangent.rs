//! The tangent stiffness of a deformed body, assembled or times a vector.

use std::sync::Arc;

use nalgebra::{Matrix3, Vector3};

use super::averaged_volume::AveragedVolume;
use super::body::{At, Body, Shape, gradient_of, points_of};
use super::connectivity::Locals;
use super::principal::{Curvature, PAIRS, PrincipalTangent, Tangent9};
use super::yielding::Yielding;
use super::{Deformed, TangentCoefficients};
use crate::fem::assembly::{ROWS_AND_COLUMNS, assemble_rows};
use crate::fem::{Stiffness, StiffnessPattern};

/// The tangent at one point of an element.
#[derive(Clone)]
#[allow(clippy::large_enum_variant, reason = "all points have the same one, mostly the large")]
enum PointTangent {
    Closed(TangentCoefficients, Deformed),
    Matrix(Box<Tangent9>),
}

impl PointTangent {
    fn new(coefficients: TangentCoefficients, deformed: Deformed, curvature: Curvature) -> Self {
        match curvature {
            Curvature::AsItIs => Self::Closed(coefficients, deformed),
            Curvature::PositivePart => {
                Self::Matrix(Box::new(positive_part(&coefficients, &deformed)))
            }
        }
    }

    /// Adds `weight` times the blocks (`local`, every node) to a row.
    fn add_row<const K: usize>(
        &self,
        gradients: &[Vector3<f64>; K],
        local: usize,
        weight: f64,
        row: &mut [[f64; 9]; K],
    ) {
        let own = &gradients[local];
        match self {
            Self::Closed(c, deformed) => {
                let (f, g) = (&deformed.f, &deformed.f_inverse_transposed);
                let (f_own, g_own) = (f * own * weight, g * own * weight);
                let along = f_own * c.b + g_own * c.c;
                let (a, b, d) = (c.a * weight, c.b, c.d);
                for (gradient, block) in gradients.iter().zip(row) {
                    let (f_other, g_other) = (f * gradient, g * gradient);
                    let diagonal = a * own.dot(gradient);
                    for (entry, (r, s)) in block.iter_mut().zip(ROWS_AND_COLUMNS) {
                        *entry += along[r] * g_other[s]
                            + g_own[r] * (b * f_other[s])
                            + d * g_other[r] * g_own[s];
                    }
                    (0..3).for_each(|r| block[4 * r] += diagonal);
                }
            }
            Self::Matrix(tangent) => {
                for (gradient, block) in gradients.iter().zip(row) {
                    for (entry, (r, s)) in block.iter_mut().zip(ROWS_AND_COLUMNS) {
                        let mut sum = 0.0;
                        for (alpha, of_own) in own.iter().enumerate() {
                            for (beta, of_other) in gradient.iter().enumerate() {
                                sum += tangent[(3 * alpha + r, 3 * beta + s)] * of_own * of_other;
                            }
                        }
                        *entry += weight * sum;
                    }
                }
            }
        }
    }
}

/// The tangent stiffness of a displacement field; see [`super::Elements::tangent`].
pub(super) fn assembled(
    body: &Body,
    yielding: Option<&Yielding<'_>>,
    pattern: &Arc<StiffnessPattern>,
    u: &[f64],
    curvature: Curvature,
) -> Stiffness {
    let of_point = |tet, point, deformed: Deformed| match yielding {
        None => PointTangent::new(body.moduli.of(tet).tangent(&deformed), deformed, curvature),
        Some(yielding) => {
            let tangent = yielding.tangent((tet, point), &deformed, curvature);
            PointTangent::Matrix(Box::new(tangent.map_or_else(Tangent9::zeros, |t| t.matrix())))
        }
    };
    let blocks = match &body.shape {
        Shape::Linear(_) => rows::<4>(body, pattern, u, of_point),
        Shape::Quadratic(_) => rows::<10>(body, pattern, u, of_point),
        Shape::Averaged(locals, averaging) => {
            let volume = AveragedVolume::new(body, (locals, averaging), u);
            let of_point = |tet, _, deformed: Deformed| {
                PointTangent::new(volume.tangent(tet, &deformed), deformed, curvature)
            };
            let mut blocks = rows::<4>(body, pattern, u, of_point);
            volume.add_patches(pattern, curvature, &mut blocks);
            blocks
        }
    };
    Stiffness::of_blocks(pattern, blocks)
}

fn rows<const K: usize>(
    body: &Body,
    pattern: &StiffnessPattern,
    u: &[f64],
    at: impl Fn(usize, usize, Deformed) -> PointTangent + Sync,
) -> Vec<[f64; 9]> {
    let points = points_of::<K>();
    let tangents: Vec<Vec<PointTangent>> =
        body.by_pieces(u, |tet, point, h, piece: &mut Vec<PointTangent>| {
            piece.push(at(tet, point, Deformed::new(h)));
        });
    let tangents = tangents.concat();
    assemble_rows(pattern, |tet, local| {
        let mut row = [[0.0; 9]; K];
        for point in 0..points {
            let gradients = body.gradients_at::<K>(tet, point);
            let weight = body.rest[tet].volume * body.share_of::<K>(tet, point);
            tangents[points * tet + point].add_row(&gradients, local, weight, &mut row);
        }
        row
    })
}

/// The tangent of an elastic body times a vector; see [`super::Elements::tangent_times`].
pub(super) fn times(body: &Body, u: &[f64], v: &[f64]) -> Vec<f64> {
    let own = |tet: usize, deformed: &Deformed| body.moduli.of(tet).tangent(deformed);
    match &body.shape {
        Shape::Linear(locals) => times_of(body, locals, (u, v), own),
        Shape::Quadratic(locals) => times_of(body, locals, (u, v), own),
        Shape::Averaged(locals, averaging) => {
            let volume = AveragedVolume::new(body, (locals, averaging), u);
            let mut product =
                times_of(body, locals, (u, v), |tet, deformed| volume.tangent(tet, deformed));
            volume.add_products(v, &mut product);
            product
        }
    }
}

fn times_of<const K: usize>(
    body: &Body,
    locals: &Locals<K>,
    (u, v): (&[f64], &[f64]),
    tangent: impl Fn(usize, &Deformed) -> TangentCoefficients + Sync,
) -> Vec<f64> {
    let stress = |at: At, gradients: &[Vector3<f64>; K], deformed: &Deformed, (): &mut ()| {
        let df = gradient_of(&locals.tets[at.tet], gradients, v);
        tangent(at.tet, deformed).apply(deformed, &df)
    };
    body.forces_of(locals, u, stress).1
}

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
