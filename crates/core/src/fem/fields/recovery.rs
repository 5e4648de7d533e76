//! Fields of elements and of nodes from the states of the elements, and what the two tell of the
//! error.
//!
//! A node has the mean of what the elements around it have at that corner, by their volumes at rest; a
//! mid-edge node of the mesh what they have in the middle of the edge.
//! Between the nodes this *recovered* stress is linear, smooth, and nearer to the truth than that of
//! the elements, so the distance between the two estimates how far the elements are off. At the border
//! of two regions the true stress jumps: there each region recovers its own for the estimate, and the
//! value of the node is the mean over all.
//!
//! Source: Zienkiewicz and Zhu, Int. J. Numer. Meth. Engng 24 (1987) 337.

use rayon::prelude::*;

use super::state::ElementState;
use super::tensor::{Tensor, plus, square, twice_energy};
use super::values::{ElementFields, Fields, NodeFields};
use crate::fem::tet10::EDGES;
use crate::mesh::{Incidence, TetMesh};

/// Recovered values of one node.
#[derive(Clone, Copy)]
struct Recovered {
    strain: Tensor,
    stress: Tensor,
    /// Energy for each unit of volume, J/m³.
    density: f64,
}

const NOTHING: Recovered = Recovered { strain: [0.0; 6], stress: [0.0; 6], density: 0.0 };

/// Roundings of a strain, of four terms of three components each, and to spare.
const ROUNDINGS: f64 = 64.0;

/// Elements and nodes of a mesh whose elements are in some states.
pub(crate) struct Recovery<'a, const C: usize> {
    pub mesh: &'a TetMesh,
    /// Shapes: one per element.
    pub states: Vec<ElementState<C>>,
    /// Largest displacement, m.
    pub largest: f64,
}

impl<const C: usize> Recovery<'_, C> {
    /// Fields of elements and nodes; with `is_judged` the estimate of the error too.
    pub fn fields(&self, is_judged: bool) -> Fields {
        let Self { mesh, states, .. } = self;
        let around = self.incidence();
        let of_node = |node: usize| around.tets(node as u32);
        let recovered: Vec<Recovered> = (0..mesh.node_count())
            .into_par_iter()
            .with_min_len(256)
            .map(|node| self.recovered(node, of_node(node).iter().copied()))
            .collect();
        let mut fields = Fields {
            elements: ElementFields {
                strain: states.iter().map(ElementState::mean_strain).collect(),
                stress: states.iter().map(ElementState::mean_stress).collect(),
                energy: states.iter().map(|state| state.energy).collect(),
                stress_error: Vec::new(),
            },
            nodes: NodeFields {
                strain: recovered.iter().map(|node| node.strain).collect(),
                stress: recovered.iter().map(|node| node.stress).collect(),
                energy_density: recovered.iter().map(|node| node.density).collect(),
                stress_error: Vec::new(),
            },
            energy: states.iter().map(|state| state.energy).sum(),
            error_rel: None,
        };
        if is_judged {
            self.judge(&mut fields, of_node);
        }
        fields
    }

    /// Elements around every node, around mid-edge nodes of the mesh too.
    fn incidence(&self) -> Incidence {
        let (mesh, node_count) = (self.mesh, self.mesh.node_count());
        if mesh.mid_edge_nodes().is_empty() {
            return Incidence::new(node_count, mesh.tets());
        }
        let both = mesh.tets().iter().zip(mesh.mid_edge_nodes());
        let nodes: Vec<[u32; 10]> = both
            .map(|(corners, middles)| {
                std::array::from_fn(|i| if i < 4 { corners[i] } else { middles[i - 4] })
            })
            .collect();
        Incidence::new(node_count, &nodes)
    }

    /// Mean of what some elements have at a node, by their volumes.
    fn recovered(&self, node: usize, tets: impl Iterator<Item = u32>) -> Recovered {
        let (mut sum, mut volume) = (NOTHING, 0.0);
        for tet in tets.map(|tet| tet as usize) {
            let state = &self.states[tet];
            match self.ends(tet, node) {
                [a, b] if a == b => {
                    sum.strain = plus(sum.strain, state.volume, state.strain_at(a));
                    sum.stress = plus(sum.stress, state.volume, state.stress_at(a));
                }
                // In the middle of an edge a linear field is the mean of its ends.
                ends => {
                    for corner in ends {
                        let half = 0.5 * state.volume;
                        sum.strain = plus(sum.strain, half, state.strain_at(corner));
                        sum.stress = plus(sum.stress, half, state.stress_at(corner));
                    }
                }
            }
            sum.density += state.energy;
            volume += state.volume;
        }
        if volume == 0.0 {
            return NOTHING;
        }
        Recovered {
            strain: sum.strain.map(|component| component / volume),
            stress: sum.stress.map(|component| component / volume),
            density: sum.density / volume,
        }
    }

    /// The corner of an element that a node is, twice, or the ends of the edge that it is in the middle of.
    fn ends(&self, tet: usize, node: usize) -> [usize; 2] {
        let is_it = |&n: &u32| n as usize == node;
        if let Some(corner) = self.mesh.tets()[tet].iter().position(is_it) {
            return [corner; 2];
        }
        let middles = self.mesh.mid_edge_nodes().get(tet);
        let edge = middles.and_then(|middles| middles.iter().position(is_it));
        edge.map_or([0; 2], |edge| EDGES[edge])
    }

    /// Estimates how far the stress of every element is off.
    fn judge<'b>(&self, fields: &mut Fields, of_node: impl Fn(usize) -> &'b [u32] + Sync) {
        let Self { mesh, states, .. } = self;
        let region = |tet: u32| mesh.regions().get(tet as usize).copied().unwrap_or(0);
        let recovered = &fields.nodes.stress;
        // Only a node at the border of two regions has more than one stress.
        let by_region = |node: u32, tet: usize| -> Tensor {
            let (around, own) = (of_node(node as usize), region(tet as u32));
            match around.iter().all(|&other| region(other) == own) {
                true => recovered[node as usize],
                false => {
                    let of_own = around.iter().copied().filter(|&other| region(other) == own);
                    self.recovered(node as usize, of_own).stress
                }
            }
        };
        let error = |(tet, state): (usize, &ElementState<C>)| -> (f64, f64) {
            let corners = mesh.tets()[tet];
            let differences: [Tensor; 4] = std::array::from_fn(|corner| {
                plus(by_region(corners[corner], tet), -1.0, state.stress_at(corner))
            });
            let twice = mean_product(&differences, |d| twice_energy(d, state.moduli));
            (state.volume * twice, mean_product(&differences, square).sqrt())
        };
        let errors: Vec<(f64, f64)> =
            states.par_iter().enumerate().with_min_len(256).map(error).collect();
        let of_error: f64 = errors.iter().map(|(energy, _)| energy).sum();
        let of_answer = 2.0 * fields.energy;
        fields.error_rel = Some(match of_answer + of_error <= self.energy_of_rounding() {
            true => 0.0,
            false => (of_error / (of_answer + of_error)).sqrt(),
        });
        fields.elements.stress_error = errors.iter().map(|(_, stress)| *stress).collect();
        let mean = |node: usize| {
            let weights = |&tet: &u32| states[tet as usize].volume;
            let volume: f64 = of_node(node).iter().map(weights).sum();
            let sum: f64 =
                of_node(node).iter().map(|tet| weights(tet) * errors[*tet as usize].1).sum();
            if volume > 0.0 { sum / volume } else { 0.0 }
        };
        fields.nodes.stress_error =
            (0..mesh.node_count()).into_par_iter().with_min_len(256).map(mean).collect();
    }

    /// Twice the energy that rounding alone can make of the displacements, J.
    fn energy_of_rounding(&self) -> f64 {
        let of_state = |state: &ElementState<C>| {
            let strain = ROUNDINGS * f64::EPSILON * self.largest * state.steepest;
            let (mu, kappa) = state.moduli;
            state.volume * (kappa + 4.0 / 3.0 * mu) * strain * strain
        };
        self.states.iter().map(of_state).sum()
    }
}

/// Mean over a tetrahedron of a square of a field that is linear between its corners:
/// `∫ N_a N_b dV = V (1 + δ_ab) / 20`.
fn mean_product(at_corners: &[Tensor; 4], square: impl Fn(&Tensor) -> f64) -> f64 {
    let sum = at_corners.iter().fold([0.0; 6], |sum, tensor| plus(sum, 1.0, tensor));
    (at_corners.iter().map(&square).sum::<f64>() + square(&sum)) / 20.0
}
