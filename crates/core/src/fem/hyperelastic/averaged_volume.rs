//! The averaged volume ratio of t4-anp at any deformation.
//!
//! `J_a = v_a / V_a` with `v_a = ¼ Σ v_e` over the elements of one region around node a. The energy
//! of the change of volume is `Σ_a V_a U(J_a)`; what else an element stores stays with it. An
//! element carries the mean pressure of its corners, `p̄_e = ¼ Σ U′(J_a)`, so the force is
//! `p̄_e ∂v_e` and the tangent `p̄_e ∂²v_e + Σ_a U″(J_a)/V_a g_a g_aᵀ` with `g_a = ∂v_a`: symmetric,
//! and as wide as two elements.
//!
//! Source: Bonet and Burton, Commun. Numer. Meth. Engng 14 (1998) 437, at finite strain.

use nalgebra::{Matrix3, Vector3};
use rayon::prelude::*;

use super::body::{Body, Evaluated, gradient_of};
use super::connectivity::{Averaging, Locals};
use super::deformed::cofactor;
use super::principal::Curvature;
use super::{Deformed, Moduli, TangentCoefficients};
use crate::fem::StiffnessPattern;
use crate::fem::assembly::{ROWS_AND_COLUMNS, for_each_row};

/// The averaged volume ratio of a body of t4-anp at one displacement field, and what it does to
/// energy, forces and tangent.
pub(super) struct AveragedVolume<'a> {
    body: &'a Body,
    locals: &'a Locals<4>,
    averaging: &'a Averaging,
    u: &'a [f64],
    /// `J_a − 1` of every patch.
    j_minus_one: Vec<f64>,
}

/// Nodes of a patch, ascending, with the slopes of its volume.
type PatchSlopes = Vec<(u32, Vector3<f64>)>;

impl<'a> AveragedVolume<'a> {
    /// Of a displacement field.
    ///
    /// Shapes: `u` 3N. Units: m.
    pub fn new(
        body: &'a Body,
        (locals, averaging): (&'a Locals<4>, &'a Averaging),
        u: &'a [f64],
    ) -> Self {
        let tets = locals.tets.par_iter().enumerate().with_min_len(256);
        let of_tets: Vec<f64> = tets
            .map(|(tet, nodes)| {
                let h = gradient_of(nodes, &body.gradients_at::<4>(tet, 0), u);
                Deformed::new(&h).j_minus_one
            })
            .collect();
        let j_minus_one = averaging.average(&body.rest, &of_tets);
        Self { body, locals, averaging, u, j_minus_one }
    }

    /// `U′(J_a)` averaged over the corners of an element, Pa.
    fn pressure(&self, tet: usize) -> f64 {
        let moduli = self.body.moduli.of(tet);
        let of_patch = |&p: &u32| moduli.pressure_of_volume(self.j_minus_one[p as usize]);
        0.25 * self.averaging.of_corners[tet].iter().map(of_patch).sum::<f64>()
    }

    /// `J_a − 1` of the patches at the four corners of an element.
    pub fn changes_at_corners(&self, tet: usize) -> [f64; 4] {
        self.averaging.of_corners[tet].map(|patch| self.j_minus_one[patch as usize])
    }

    /// Moduli of a patch, whose elements are all of one region.
    fn moduli(&self, patch: usize) -> Moduli {
        self.body.moduli.of(self.averaging.tets(patch)[0] as usize)
    }

    /// `U″(J_a)` of a patch, Pa.
    fn bulk(&self, patch: usize) -> f64 {
        self.moduli(patch).bulk_of_volume(self.j_minus_one[patch])
    }

    /// `∂v_e/∂u` of the four corners of an element: `V_e cof(F) ∇N_a`, m².
    #[inline]
    fn slopes(&self, tet: usize) -> [Vector3<f64>; 4] {
        let gradients = self.body.gradients_at::<4>(tet, 0);
        let f = gradient_of(&self.locals.tets[tet], &gradients, self.u) + Matrix3::identity();
        let cofactor = cofactor(&f) * self.body.rest[tet].volume;
        gradients.map(|gradient| cofactor * gradient)
    }

    /// Adds the forces of a pressure in every element.
    fn add_forces(&self, pressure_of: impl Fn(usize) -> f64 + Sync, forces: &mut [f64]) {
        let mut parts = Vec::new();
        self.locals.for_each(&mut parts, |tet, parts, (): &mut ()| {
            let pressure = pressure_of(tet);
            *parts = self.slopes(tet).map(|slope| (slope * pressure).into());
        });
        let sums = self.locals.gather(&parts);
        forces.iter_mut().zip(sums).for_each(|(f, sum)| *f += sum);
    }

    /// Adds energy and forces of the averaged change of volume.
    pub fn add_to(&self, evaluated: &mut Evaluated) {
        self.add_forces(|tet| self.pressure(tet), &mut evaluated.forces);
        let energy = |patch: usize| {
            let of_volume = self.moduli(patch).energy_of_volume(self.j_minus_one[patch]);
            self.averaging.volume(patch) * of_volume
        };
        evaluated.energy += (0..self.averaging.len()).map(energy).sum::<f64>();
    }

    /// What an element has of the tangent by itself: its change of shape, and the second derivative
    /// of its volume under the pressure that it carries.
    pub fn tangent(&self, tet: usize, deformed: &Deformed) -> TangentCoefficients {
        let mut tangent = Moduli::without_volume(self.body.moduli.of(tet)).tangent(deformed);
        let pressure = deformed.j * self.pressure(tet);
        tangent.c += pressure;
        tangent.d -= pressure;
        tangent
    }

    /// Adds `U″(J_a)/V_a g_a g_aᵀ` of every patch.
    pub fn add_patches(
        &self,
        pattern: &StiffnessPattern,
        curvature: Curvature,
        blocks: &mut [[f64; 9]],
    ) {
        let patches = self.patch_slopes();
        let stiffness = |patch: usize| {
            let bulk = self.bulk(patch);
            let bulk = if curvature == Curvature::PositivePart { bulk.max(0.0) } else { bulk };
            bulk / self.averaging.volume(patch)
        };
        let of_node = patches_of_nodes(self.body.node_count, &patches);
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
    fn patch_slopes(&self) -> Vec<PatchSlopes> {
        let Self { locals, averaging, .. } = self;
        let slopes_of = |patch: usize| {
            let mut nodes: Vec<u32> =
                averaging.tets(patch).iter().flat_map(|&t| locals.tets[t as usize]).collect();
            nodes.sort_unstable();
            nodes.dedup();
            let mut slopes: PatchSlopes =
                nodes.into_iter().map(|n| (n, Vector3::zeros())).collect();
            for &tet in averaging.tets(patch) {
                let of_tet = self.slopes(tet as usize);
                for (node, slope) in locals.tets[tet as usize].iter().zip(of_tet) {
                    let at = slopes.partition_point(|(n, _)| n < node);
                    slopes[at].1 += slope * 0.25;
                }
            }
            slopes
        };
        (0..averaging.len()).into_par_iter().with_min_len(64).map(slopes_of).collect()
    }

    /// Adds what the changes of the averaged pressures have of the tangent times a vector.
    pub fn add_products(&self, v: &[f64], product: &mut [f64]) {
        let Self { locals, averaging, .. } = self;
        // dv_e of every element, then the change of pressure of every patch.
        let change_of = |tet: usize| -> f64 {
            let slopes = self.slopes(tet);
            let moved = locals.tets[tet].iter().zip(slopes);
            moved
                .map(|(&n, slope)| {
                    let at = 3 * n as usize;
                    slope.dot(&Vector3::new(v[at], v[at + 1], v[at + 2]))
                })
                .sum()
        };
        let tets = (0..locals.tets.len()).into_par_iter().with_min_len(256);
        let changes: Vec<f64> = tets.map(change_of).collect();
        let pressures: Vec<f64> = (0..averaging.len())
            .map(|patch| {
                let tets = averaging.tets(patch);
                let change: f64 = tets.iter().map(|&t| changes[t as usize] / 4.0).sum();
                self.bulk(patch) * change / averaging.volume(patch)
            })
            .collect();
        let of_corner = |&patch: &u32| pressures[patch as usize];
        let pressure_of =
            |tet: usize| 0.25 * averaging.of_corners[tet].iter().map(of_corner).sum::<f64>();
        self.add_forces(pressure_of, product);
    }
}

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
