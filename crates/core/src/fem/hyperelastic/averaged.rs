//! The averaged volume ratio of t4-anp at any deformation.
//!
//! `J_a = v_a / V_a` with `v_a = ¼ Σ v_e` over the elements of one region around node a. The energy
//! of the change of volume is `Σ_a V_a U(J_a)`; what else an element stores stays with it. An
//! element carries the mean pressure of its corners, `p̄_e = ¼ Σ U′(J_a)`, so the force is
//! `p̄_e ∂v_e` and the tangent `p̄_e ∂²v_e + Σ_a U″(J_a)/V_a g_a g_aᵀ` with `g_a = ∂v_a`: symmetric,
//! and as wide as two elements.
//!
//! Source: Bonet and Burton, Commun. Numer. Meth. Engng 14 (1998) 437, at finite strain.

use rayon::prelude::*;

use crate::fem::elements_around::elements_around;
use crate::fem::tet4::Gradients;
use crate::mesh::TetMesh;

/// Patches: the elements of one region around one node.
///
/// Shapes: P patches.
#[derive(Clone, Debug)]
pub(super) struct Averaging {
    start: Vec<u32>,
    /// Elements of patch p: `tets[start[p] .. start[p + 1]]`, ascending.
    tets: Vec<u32>,
    /// `V_a`, m³.
    volumes: Vec<f64>,
    /// Patch of each corner of each element.
    pub of_corners: Vec<[u32; 4]>,
}

/// What the change of volume is around every node.
pub(super) struct NodalVolumes {
    /// `J_a − 1` of every patch.
    pub j_minus_one: Vec<f64>,
}

impl Averaging {
    /// The patches of a mesh, by node, then by region.
    pub fn new(mesh: &TetMesh, rest: &[Gradients]) -> Self {
        let (around_start, around) = elements_around(mesh.node_count(), mesh.tets());
        let region = |tet: u32| mesh.regions().get(tet as usize).copied().unwrap_or(0);
        let mut of_corners = vec![[0u32; 4]; mesh.tets().len()];
        let (mut start, mut tets, mut volumes) = (vec![0u32], Vec::new(), Vec::new());
        for node in 0..mesh.node_count() {
            let mut here = around[around_start[node]..around_start[node + 1]].to_vec();
            here.sort_by_key(|&tet| (region(tet), tet));
            for patch in here.chunk_by(|&a, &b| region(a) == region(b)) {
                let number = volumes.len() as u32;
                for &tet in patch {
                    for (corner, patch_of) in of_corners[tet as usize].iter_mut().enumerate() {
                        if mesh.tets()[tet as usize][corner] as usize == node {
                            *patch_of = number;
                        }
                    }
                }
                volumes.push(patch.iter().map(|&t| rest[t as usize].volume / 4.0).sum());
                tets.extend_from_slice(patch);
                start.push(tets.len() as u32);
            }
        }
        Self { start, tets, volumes, of_corners }
    }

    /// Patches.
    pub fn len(&self) -> usize {
        self.volumes.len()
    }

    /// Elements of one patch, ascending.
    pub fn tets(&self, patch: usize) -> &[u32] {
        &self.tets[self.start[patch] as usize..self.start[patch + 1] as usize]
    }

    /// `V_a` of one patch, m³.
    pub fn volume(&self, patch: usize) -> f64 {
        self.volumes[patch]
    }

    /// `J_a − 1` from `J_e − 1` of every element.
    pub fn average(&self, rest: &[Gradients], of_tets: &[f64]) -> NodalVolumes {
        let mean = |patch: usize| {
            let weighted = |&t: &u32| rest[t as usize].volume / 4.0 * of_tets[t as usize];
            self.tets(patch).iter().map(weighted).sum::<f64>() / self.volumes[patch]
        };
        let patches = (0..self.len()).into_par_iter().with_min_len(256);
        NodalVolumes { j_minus_one: patches.map(mean).collect() }
    }
}
