//! The state of every element by linear elasticity, from the displacements.

use nalgebra::{Matrix3, Vector3};
use rayon::prelude::*;

use super::state::{ElementState, at_corners, steepest_of};
use super::tensor::{Tensor, square, tensor_of, with_pressure};
use crate::fem::tet4::Gradients;
use crate::fem::{Material, QuadraticMesh, dof, tet4};
use crate::mesh::{Incidence, TetMesh};

/// Materials by region.
#[derive(Clone, Copy)]
pub(crate) struct Materials<'a> {
    /// One, or one for each region label.
    pub by_region: &'a [Material],
    /// Label of each element; not looked at where there is one material.
    pub regions: &'a [u32],
}

impl Materials<'_> {
    /// μ and κ of an element.
    fn moduli_of(&self, tet: usize) -> (f64, f64) {
        let material = match self.by_region {
            [only] => only,
            several => &several[self.regions[tet] as usize],
        };
        (material.shear_modulus(), material.bulk_modulus())
    }
}

/// Linear tetrahedra: one strain in each.
///
/// Shapes: `u` 3N. Units: m.
///
/// Source: thesis (3.28), (3.12).
pub(crate) fn states_of_tet4(
    mesh: &TetMesh,
    materials: Materials<'_>,
    u: &[f64],
) -> Vec<ElementState<1>> {
    let state = |tet: usize| {
        let g = tet4::gradients(&mesh.corners(tet));
        let moduli = materials.moduli_of(tet);
        let strain = strain_of(&g, &from_corner(&mesh.tets()[tet], u));
        let energy = g.volume * density(&strain, moduli);
        let stress = [stress_of(&strain, moduli)];
        let (volume, steepest) = (g.volume, steepest_of(&g));
        ElementState { strain: [strain], stress, energy, volume, moduli, steepest }
    };
    (0..mesh.tets().len()).into_par_iter().with_min_len(256).map(state).collect()
}

/// Linear tetrahedra whose pressure is averaged around nodes: the change of shape is the element's,
/// the pressure is `κ θ_a` at corner a and linear between.
///
/// Shapes: `u` 3N. Units: m.
///
/// Source: Bonet and Burton 1998, as in [`crate::fem::NodalPatches`].
pub(crate) fn states_of_averaged(
    mesh: &TetMesh,
    materials: Materials<'_>,
    u: &[f64],
) -> Vec<ElementState<4>> {
    let thetas = averaged_changes(mesh, u);
    let region = |tet: usize| mesh.regions().get(tet).copied().unwrap_or(0);
    let state = |tet: usize| {
        let g = tet4::gradients(&mesh.corners(tet));
        let (mu, kappa) = materials.moduli_of(tet);
        let strain = strain_of(&g, &from_corner(&mesh.tets()[tet], u));
        let mean = (strain[0] + strain[1] + strain[2]) / 3.0;
        let deviator = with_pressure(strain, -mean);
        let theta = mesh.tets()[tet].map(|node| {
            let own = thetas[node as usize].iter().find(|(of, _)| *of == region(tet));
            own.map_or(3.0 * mean, |(_, theta)| *theta)
        });
        let of_shape = deviator.map(|component| 2.0 * mu * component);
        let of_volume: f64 = theta.iter().map(|theta| 0.125 * kappa * theta * theta).sum();
        ElementState {
            strain: [strain; 4],
            stress: theta.map(|theta| with_pressure(of_shape, kappa * theta)),
            energy: g.volume * (mu * square(&deviator) + of_volume),
            volume: g.volume,
            moduli: (mu, kappa),
            steepest: steepest_of(&g),
        }
    };
    (0..mesh.tets().len()).into_par_iter().with_min_len(256).map(state).collect()
}

/// `θ_a`, the change of volume around every node: of each region at it the mean over its elements by
/// their volumes.
fn averaged_changes(mesh: &TetMesh, u: &[f64]) -> Vec<Vec<(u32, f64)>> {
    let of_tet = |tet: usize| {
        let g = tet4::gradients(&mesh.corners(tet));
        let strain = strain_of(&g, &from_corner(&mesh.tets()[tet], u));
        (g.volume, strain[0] + strain[1] + strain[2])
    };
    let tets = (0..mesh.tets().len()).into_par_iter().with_min_len(256);
    let changes: Vec<(f64, f64)> = tets.map(of_tet).collect();
    let around = Incidence::new(mesh.node_count(), mesh.tets());
    let of_node = |node: usize| -> Vec<(u32, f64)> {
        let mut here = around.tets(node as u32).to_vec();
        let region = |tet: u32| mesh.regions().get(tet as usize).copied().unwrap_or(0);
        here.sort_by_key(|&tet| (region(tet), tet));
        let mean = |tets: &[u32]| {
            let volume: f64 = tets.iter().map(|&tet| changes[tet as usize].0).sum();
            let of_tets = tets.iter().map(|&tet| changes[tet as usize]);
            (region(tets[0]), of_tets.map(|(v, theta)| v * theta).sum::<f64>() / volume)
        };
        here.chunk_by(|&a, &b| region(a) == region(b)).map(mean).collect()
    };
    (0..mesh.node_count()).into_par_iter().with_min_len(256).map(of_node).collect()
}

/// Ten-node tetrahedra: strain linear in each, exact at the four points of quadrature.
///
/// Shapes: `u` 3 per node of `mesh`. Units: m.
///
/// Source: thesis (3.28) with ten shape functions for four.
pub(crate) fn states_of_tet10(
    mesh: &QuadraticMesh,
    materials: Materials<'_>,
    u: &[f64],
) -> Vec<ElementState<4>> {
    let state = |tet: usize| {
        let (points, moduli) = (mesh.points(tet), materials.moduli_of(tet));
        let own = from_corner(&mesh.tets()[tet], u);
        let strain = points.displacement_gradients(&own).map(|h| tensor_of(&h));
        let densities = strain.iter().zip(points.shares);
        let energy = densities.map(|(strain, share)| share * density(strain, moduli)).sum::<f64>();
        let strain = at_corners(strain);
        ElementState {
            strain,
            stress: strain.map(|strain| stress_of(&strain, moduli)),
            energy: points.volume * energy,
            volume: points.volume,
            moduli,
            steepest: steepest_of(&tet4::gradients(&mesh.corners(tet))),
        }
    };
    (0..mesh.tets().len()).into_par_iter().with_min_len(256).map(state).collect()
}

fn at(u: &[f64], node: u32) -> Vector3<f64> {
    let at = dof(node as usize, 0);
    Vector3::new(u[at], u[at + 1], u[at + 2])
}

/// Displacements of an element's nodes, less that of its first corner: the gradients add up to zero,
/// and so nothing is lost to a motion that the nodes have in common.
fn from_corner<const K: usize>(nodes: &[u32; K], u: &[f64]) -> [Vector3<f64>; K] {
    let own = at(u, nodes[0]);
    nodes.map(|node| at(u, node) - own)
}

fn strain_of(g: &Gradients, u: &[Vector3<f64>; 4]) -> Tensor {
    let terms = u.iter().zip(&g.of_shape);
    let h = terms.fold(Matrix3::zeros(), |h, (u, gradient)| h + u * gradient.transpose());
    tensor_of(&h)
}

/// `σ = 2μ e + κ θ I`.
fn stress_of(strain: &Tensor, (mu, kappa): (f64, f64)) -> Tensor {
    let theta = strain[0] + strain[1] + strain[2];
    let of_shape = with_pressure(*strain, -theta / 3.0).map(|component| 2.0 * mu * component);
    with_pressure(of_shape, kappa * theta)
}

/// Energy for each unit of volume, `μ e:e + κ/2 θ²`.
fn density(strain: &Tensor, (mu, kappa): (f64, f64)) -> f64 {
    let theta = strain[0] + strain[1] + strain[2];
    mu * square(&with_pressure(*strain, -theta / 3.0)) + 0.5 * kappa * theta * theta
}
