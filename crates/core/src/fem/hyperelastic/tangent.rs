//! The tangent stiffness of a deformed body, assembled or times a vector.

use std::sync::Arc;

use nalgebra::Vector3;
use rayon::prelude::*;

use super::averaged::{Averaging, NodalVolumes};
use super::averaged_volume::volume_slopes;
use super::elements::{Elements, Shape, gradient_of, gradients_at, points_of};
use super::locals::{ELEMENTS_TOGETHER, Locals};
use super::positive_part::positive_part;
use super::principal_tangent::Tangent9;
use super::{Deformed, Moduli, TangentCoefficients};
use crate::fem::assembly::{ROWS_AND_COLUMNS, assemble_rows, for_each_row};
use crate::fem::{Stiffness, StiffnessPattern};

/// Which tangent is asked for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Curvature {
    /// The second derivative of the energy, which may have negative eigenvalues.
    AsItIs,
    /// The sum of the positive parts of every element's: it has none.
    PositivePart,
}

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

impl Elements {
    /// The tangent stiffness of a displacement field, on the pattern of the linear one.
    ///
    /// Shapes: `u` 3N; `pattern` that of the element ([`StiffnessPattern`]). Units: m, N/m.
    ///
    /// # Panics
    /// If pattern or displacements are those of another body.
    pub fn tangent(
        &self,
        pattern: &Arc<StiffnessPattern>,
        u: &[f64],
        curvature: Curvature,
    ) -> Stiffness {
        assert_eq!(u.len(), 3 * self.node_count, "displacements do not fit the body");
        let elastic = |tet, _, deformed: Deformed| {
            let tangent = self.moduli.of(tet).tangent(&deformed);
            PointTangent::new(tangent, deformed, curvature)
        };
        let yielding = |plastic, tet, point, deformed: Deformed| {
            let tangent = self.yielding_tangent(plastic, (tet, point), &deformed, curvature);
            PointTangent::Matrix(Box::new(tangent.map_or_else(Tangent9::zeros, |t| t.matrix())))
        };
        let blocks = match (&self.shape, &self.plastic) {
            (Shape::Linear(_), None) => self.rows::<4>(pattern, u, elastic),
            (Shape::Quadratic(_), None) => self.rows::<10>(pattern, u, elastic),
            (Shape::Linear(_), Some(plastic)) => {
                self.rows::<4>(pattern, u, |tet, point, f| yielding(plastic, tet, point, f))
            }
            (Shape::Quadratic(_), Some(plastic)) => {
                self.rows::<10>(pattern, u, |tet, point, f| yielding(plastic, tet, point, f))
            }
            (Shape::Averaged(locals, averaging), _) => {
                let volumes = self.nodal_volumes(locals, averaging, u);
                let at = |tet, _, deformed: Deformed| {
                    let tangent = self.averaged_tangent(averaging, &volumes, tet, &deformed);
                    PointTangent::new(tangent, deformed, curvature)
                };
                let mut blocks = self.rows::<4>(pattern, u, at);
                self.add_patches(pattern, locals, averaging, &volumes, (u, curvature), &mut blocks);
                blocks
            }
        };
        Stiffness::of_blocks(pattern, blocks)
    }

    fn rows<const K: usize>(
        &self,
        pattern: &StiffnessPattern,
        u: &[f64],
        at: impl Fn(usize, usize, Deformed) -> PointTangent + Sync,
    ) -> Vec<[f64; 9]> {
        let points = points_of::<K>();
        let tangents: Vec<Vec<PointTangent>> =
            self.by_pieces(u, |tet, point, h, piece: &mut Vec<PointTangent>| {
                piece.push(at(tet, point, Deformed::new(h)));
            });
        let tangents = tangents.concat();
        assemble_rows(pattern, |tet, local| {
            let rest = &self.rest[tet];
            let mut row = [[0.0; 9]; K];
            for point in 0..points {
                let gradients = gradients_at::<K>(rest, point);
                let weight = rest.volume / points as f64;
                tangents[points * tet + point].add_row(&gradients, local, weight, &mut row);
            }
            row
        })
    }

    fn nodal_volumes(&self, locals: &Locals<4>, averaging: &Averaging, u: &[f64]) -> NodalVolumes {
        averaging.average(&self.rest, &self.volume_changes(locals, u))
    }

    /// What an element has of the tangent by itself: its change of shape, and the second derivative
    /// of its volume under the pressure that it carries.
    fn averaged_tangent(
        &self,
        averaging: &Averaging,
        volumes: &NodalVolumes,
        tet: usize,
        deformed: &Deformed,
    ) -> TangentCoefficients {
        let mut tangent = Moduli::without_volume(self.moduli.of(tet)).tangent(deformed);
        let pressure = deformed.j * self.averaged_pressure(averaging, volumes, tet);
        tangent.c += pressure;
        tangent.d -= pressure;
        tangent
    }

    /// Adds `U″(J_a)/V_a g_a g_aᵀ` of every patch.
    fn add_patches(
        &self,
        pattern: &StiffnessPattern,
        locals: &Locals<4>,
        averaging: &Averaging,
        volumes: &NodalVolumes,
        (u, curvature): (&[f64], Curvature),
        blocks: &mut [[f64; 9]],
    ) {
        let patches = self.patch_slopes(locals, averaging, u);
        let stiffness = |patch: usize| {
            let moduli = self.moduli.of(averaging.tets(patch)[0] as usize);
            let bulk = moduli.bulk_of_volume(volumes.j_minus_one[patch]);
            let bulk = if curvature == Curvature::PositivePart { bulk.max(0.0) } else { bulk };
            bulk / averaging.volume(patch)
        };
        let of_node = patches_of_nodes(self.node_count, &patches);
        for_each_row(pattern, blocks, |node, row| {
            let columns = pattern.columns(node);
            for &(patch, own) in &of_node[node] {
                let slopes = &patches[patch as usize];
                let of_own = slopes[own as usize].1 * stiffness(patch as usize);
                for (other, slope) in slopes {
                    let block = &mut row[columns.partition_point(|c| c < other)];
                    for (entry, (r, s)) in block.iter_mut().zip(ROWS_AND_COLUMNS) {
                        *entry += of_own[r] * slope[s];
                    }
                }
            }
        });
    }

    /// `g_a = ∂v_a` of every patch: nodes, ascending, and slopes, m².
    fn patch_slopes(
        &self,
        locals: &Locals<4>,
        averaging: &Averaging,
        u: &[f64],
    ) -> Vec<PatchSlopes> {
        let slopes_of = |patch: usize| {
            let mut nodes: Vec<u32> =
                averaging.tets(patch).iter().flat_map(|&t| locals.tets[t as usize]).collect();
            nodes.sort_unstable();
            nodes.dedup();
            let mut slopes: PatchSlopes =
                nodes.into_iter().map(|n| (n, Vector3::zeros())).collect();
            for &tet in averaging.tets(patch) {
                let of_tet = volume_slopes(self, locals, u, tet as usize);
                for (node, slope) in locals.tets[tet as usize].iter().zip(of_tet) {
                    let at = slopes.partition_point(|(n, _)| n < node);
                    slopes[at].1 += slope * 0.25;
                }
            }
            slopes
        };
        (0..averaging.len()).into_par_iter().with_min_len(64).map(slopes_of).collect()
    }

    /// The tangent times a vector, without assembling it.
    ///
    /// Shapes: `u`, `v` and the result 3N. Units: m, N.
    ///
    /// # Panics
    /// If the vectors do not hold 3N numbers.
    pub fn tangent_times(&self, u: &[f64], v: &[f64]) -> Vec<f64> {
        assert_eq!(v.len(), 3 * self.node_count, "the vector does not fit the body");
        if let Some(plastic) = &self.plastic {
            return self.yielding_tangent_times(plastic, u, v);
        }
        match &self.shape {
            Shape::Linear(locals) => {
                self.times(locals, u, v, |tet, deformed| self.moduli.of(tet).tangent(deformed))
            }
            Shape::Quadratic(locals) => {
                self.times(locals, u, v, |tet, deformed| self.moduli.of(tet).tangent(deformed))
            }
            Shape::Averaged(locals, averaging) => {
                let volumes = self.nodal_volumes(locals, averaging, u);
                let mut product = self.times(locals, u, v, |tet, deformed| {
                    self.averaged_tangent(averaging, &volumes, tet, deformed)
                });
                self.add_patch_products(locals, averaging, &volumes, (u, v), &mut product);
                product
            }
        }
    }

    fn times<const K: usize>(
        &self,
        locals: &Locals<K>,
        u: &[f64],
        v: &[f64],
        at: impl Fn(usize, &Deformed) -> TangentCoefficients + Sync,
    ) -> Vec<f64> {
        let mut forces = Vec::new();
        let points = points_of::<K>();
        locals.for_each(&mut forces, |tet, forces, (): &mut ()| {
            let (nodes, rest) = (&locals.tets[tet], &self.rest[tet]);
            *forces = [[0.0; 3]; K];
            for point in 0..points {
                let gradients = gradients_at::<K>(rest, point);
                let deformed = Deformed::new(&gradient_of(nodes, &gradients, u));
                let df = gradient_of(nodes, &gradients, v);
                let stress =
                    at(tet, &deformed).apply(&deformed, &df) * (rest.volume / points as f64);
                for (force, gradient) in forces.iter_mut().zip(&gradients) {
                    let f = stress * gradient;
                    force.iter_mut().zip(f.iter()).for_each(|(sum, f)| *sum += f);
                }
            }
        });
        locals.gather(&forces)
    }

    fn add_patch_products(
        &self,
        locals: &Locals<4>,
        averaging: &Averaging,
        volumes: &NodalVolumes,
        (u, v): (&[f64], &[f64]),
        product: &mut [f64],
    ) {
        // dv_e of every element, then the change of pressure of every patch.
        let changes: Vec<Vec<f64>> = self.by_elements(locals, |tet| {
            let slopes = volume_slopes(self, locals, u, tet);
            let moved = locals.tets[tet].iter().zip(slopes);
            moved
                .map(|(&n, slope)| {
                    let at = 3 * n as usize;
                    slope.dot(&Vector3::new(v[at], v[at + 1], v[at + 2]))
                })
                .sum()
        });
        let changes = changes.concat();
        let pressures: Vec<f64> = (0..averaging.len())
            .map(|patch| {
                let tets = averaging.tets(patch);
                let bulk =
                    self.moduli.of(tets[0] as usize).bulk_of_volume(volumes.j_minus_one[patch]);
                let change: f64 = tets.iter().map(|&t| changes[t as usize] / 4.0).sum();
                bulk * change / averaging.volume(patch)
            })
            .collect();
        let mut forces = Vec::new();
        locals.for_each(&mut forces, |tet, forces, (): &mut ()| {
            let corners = &averaging.of_corners[tet];
            let pressure = 0.25 * corners.iter().map(|&p| pressures[p as usize]).sum::<f64>();
            let slopes = volume_slopes(self, locals, u, tet);
            *forces = slopes.map(|slope| (slope * pressure).into());
        });
        let sums = locals.gather(&forces);
        product.iter_mut().zip(sums).for_each(|(f, sum)| *f += sum);
    }

    fn by_elements(
        &self,
        locals: &Locals<4>,
        of_tet: impl Fn(usize) -> f64 + Sync,
    ) -> Vec<Vec<f64>> {
        let pieces = locals.tets.par_chunks(ELEMENTS_TOGETHER).enumerate();
        pieces
            .map(|(piece, tets)| {
                let first = piece * ELEMENTS_TOGETHER;
                (first..first + tets.len()).map(&of_tet).collect()
            })
            .collect()
    }
}

/// Nodes of a patch, ascending, with the slopes of its volume.
type PatchSlopes = Vec<(u32, Vector3<f64>)>;

/// For every node the patches that it is in and its place there, in the order of the patches.
fn patches_of_nodes(node_count: usize, patches: &[PatchSlopes]) -> Vec<Vec<(u32, u32)>> {
    let mut of_node = vec![Vec::new(); node_count];
    for (patch, slopes) in patches.iter().enumerate() {
        for (place, (node, _)) in slopes.iter().enumerate() {
            of_node[*node as usize].push((patch as u32, place as u32));
        }
    }
    of_node
}
