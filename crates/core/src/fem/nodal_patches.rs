//! Averaged nodal pressure: linear tetrahedra that do not lock on nearly incompressible material.
//!
//! A linear tetrahedron has one volume change, and there are more tetrahedra than nodes can serve:
//! as Poisson's ratio nears 0.5 each of them wants its volume back and nothing moves. Here the
//! volume change is averaged around every node, `θ_a = Σ V_e/4 · div u_e / V_a` over the elements
//! at node a, and the pressure `κ θ_a` belongs to the node: as many conditions as nodes. The change
//! of shape, the deviator e of the strain, stays with the elements.
//!
//! Energy: `½ Σ_e V_e 2μ e:e + ½ Σ_a V_a κ θ_a²`. A field of constant strain has the energy and the
//! forces of (3.32), so the patch test holds. An average is nowhere stiffer than what it averages.
//! Averaging λ θ and leaving 2μ ε:ε with the elements was tried too and is a sixth further off.
//!
//! Elements of different regions are averaged apart: at an interface the pressure jumps.
//!
//! Source: Bonet and Burton, Commun. Numer. Meth. Engng 14 (1998) 437.

use nalgebra::Vector3;
use rayon::prelude::*;

use super::tet4;
use crate::mesh::{Incidence, TetMesh};

/// The elements of one region around one node, and what they make of the volume there.
///
/// Shapes: P patches; patch p holds nodes `start[p] .. start[p + 1]`, ascending.
#[derive(Clone, Debug)]
pub struct NodalPatches {
    start: Vec<usize>,
    nodes: Vec<u32>,
    /// `∂θ/∂u` of every node of a patch, 1/m.
    gradients: Vec<Vector3<f64>>,
    /// Volume `V_a` of the patch at rest, m³.
    volumes: Vec<f64>,
    /// An element of the patch, which knows its material.
    tets: Vec<u32>,
    /// Patches that node n is in: `of_node[of_node_start[n] .. of_node_start[n + 1]]`, ascending.
    of_node_start: Vec<usize>,
    of_node: Vec<u32>,
}

/// One patch: its nodes, their gradients and its volume.
#[derive(Clone, Copy, Debug)]
pub(super) struct NodalPatch<'a> {
    /// Its nodes, ascending.
    pub nodes: &'a [u32],
    /// `∂θ/∂u` of each, 1/m.
    pub gradients: &'a [Vector3<f64>],
    /// Volume `V_a` of the patch at rest, m³.
    pub volume: f64,
    /// One of its elements.
    pub tet: usize,
}

/// A patch while it is made.
struct Made {
    nodes: Vec<u32>,
    gradients: Vec<Vector3<f64>>,
    volume: f64,
    tet: u32,
}

impl NodalPatches {
    /// The patches of a mesh, by node, then by region.
    ///
    /// Units: mesh m.
    ///
    /// Source: Bonet and Burton 1998, see the module.
    pub fn new(mesh: &TetMesh) -> Self {
        let gradients_of_tets = tet4::gradients_of(mesh.tets().len(), |t| mesh.corners(t));
        let around = Incidence::new(mesh.node_count(), mesh.tets());
        let at_node = |node: u32| patches_of(mesh, &gradients_of_tets, around.tets(node));
        let made: Vec<Made> =
            (0..mesh.node_count() as u32).into_par_iter().flat_map_iter(at_node).collect();
        let mut start = vec![0];
        let (mut nodes, mut gradients) = (Vec::new(), Vec::new());
        let mut patches: Vec<Vec<u32>> = vec![Vec::new(); mesh.node_count()];
        for (patch, made) in made.iter().enumerate() {
            made.nodes.iter().for_each(|&n| patches[n as usize].push(patch as u32));
            nodes.extend_from_slice(&made.nodes);
            gradients.extend_from_slice(&made.gradients);
            start.push(nodes.len());
        }
        let mut of_node_start = vec![0];
        for of_node in &patches {
            of_node_start.push(of_node_start.last().map_or(0, |s| s + of_node.len()));
        }
        Self {
            start,
            nodes,
            gradients,
            volumes: made.iter().map(|m| m.volume).collect(),
            tets: made.iter().map(|m| m.tet).collect(),
            of_node_start,
            of_node: patches.concat(),
        }
    }

    /// Patches that a node is in, ascending.
    pub(super) fn of_node(&self, node: usize) -> impl Iterator<Item = NodalPatch<'_>> {
        let range = self.of_node_start[node]..self.of_node_start[node + 1];
        self.of_node[range].iter().map(|&patch| {
            let patch = patch as usize;
            let members = self.start[patch]..self.start[patch + 1];
            NodalPatch {
                nodes: &self.nodes[members.clone()],
                gradients: &self.gradients[members],
                volume: self.volumes[patch],
                tet: self.tets[patch] as usize,
            }
        })
    }
}

/// The patches at one node from the elements around it, one for each region.
fn patches_of(mesh: &TetMesh, gradients: &[tet4::Gradients], tets: &[u32]) -> Vec<Made> {
    let region = |tet: u32| mesh.regions().get(tet as usize).copied().unwrap_or(0);
    let mut regions: Vec<u32> = tets.iter().map(|&t| region(t)).collect();
    regions.sort_unstable();
    regions.dedup();
    let of_region = |wanted: u32| {
        let tets: Vec<u32> = tets.iter().copied().filter(|&t| region(t) == wanted).collect();
        patch(mesh, gradients, &tets)
    };
    regions.into_iter().map(of_region).collect()
}

fn patch(mesh: &TetMesh, gradients_of_tets: &[tet4::Gradients], tets: &[u32]) -> Made {
    let corners_of = |tet: &u32| mesh.tets()[*tet as usize];
    let mut nodes: Vec<u32> = tets.iter().flat_map(corners_of).collect();
    nodes.sort_unstable();
    nodes.dedup();
    let mut gradients = vec![Vector3::zeros(); nodes.len()];
    let mut volume = 0.0;
    for tet in tets {
        let g = &gradients_of_tets[*tet as usize];
        volume += g.volume / 4.0;
        for (node, of_shape) in corners_of(tet).into_iter().zip(g.of_shape) {
            gradients[nodes.partition_point(|&n| n < node)] += of_shape * (g.volume / 4.0);
        }
    }
    gradients.iter_mut().for_each(|g| *g /= volume);
    Made { nodes, gradients, volume, tet: tets.first().copied().unwrap_or(0) }
}

#[cfg(test)]
mod tests;
