//! Meshes, materials and solves that several tests share.

use std::sync::Arc;

use nalgebra::{Point3, Vector3};

use crate::fem::{
    Material, QuadraticMesh, Stiffness, StiffnessPattern, assemble, assemble_quadratic, dof,
};
use crate::mesh::{BuiltIn, TetMesh, generate};
use crate::solve::{Factored, Loads, Method, Partition, Solution};

/// Half the edge of the built-in cube, m.
pub(super) const HALF: f64 = 0.03;

/// The built-in cube with `cells`³ boxes, inner nodes moved by up to a tenth of a box.
pub(super) fn irregular_cube(cells: usize) -> TetMesh {
    let mesh = generate(BuiltIn::Cube, (cells + 1).pow(3)).unwrap();
    let step = 2.0 * HALF / cells as f64;
    let mut vertices = mesh.vertices().to_vec();
    for (n, p) in (1i32..).zip(&mut vertices) {
        if !on_cube_surface(p) {
            let wiggle = |s: f64| 0.1 * step * (s * f64::from(n)).sin();
            *p += Vector3::new(wiggle(1.3), wiggle(2.1), wiggle(3.7));
        }
    }
    mesh.with_vertices(vertices).unwrap()
}

pub(super) fn on_cube_surface(p: &Point3<f64>) -> bool {
    p.coords.amax() > HALF * (1.0 - 1e-9)
}

pub(super) fn material(poisson: f64) -> Material {
    Material::try_new(1.0e5, poisson).unwrap()
}

pub(super) fn stiffness_four(mesh: &TetMesh, poisson: f64) -> Stiffness {
    assemble(&Arc::new(StiffnessPattern::new(mesh)), mesh, &[material(poisson)]).unwrap()
}

pub(super) fn stiffness_ten(mesh: &QuadraticMesh, poisson: f64) -> Stiffness {
    let pattern = Arc::new(StiffnessPattern::quadratic(mesh));
    assemble_quadratic(&pattern, mesh, &[material(poisson)]).unwrap()
}

/// Solves for given displacements of whole nodes, and forces (empty or 3N).
pub(super) fn solve(
    stiffness: &Stiffness,
    used: &[bool],
    known: &[(usize, Vector3<f64>)],
    forces: &[f64],
    method: Method,
) -> Solution {
    let mut known = known.to_vec();
    known.sort_by_key(|k| k.0);
    let dofs: Vec<u32> =
        known.iter().flat_map(|k| [0, 1, 2].map(|axis| dof(k.0, axis) as u32)).collect();
    let q_known: Vec<f64> = known.iter().flat_map(|k| <[f64; 3]>::from(k.1)).collect();
    let partition = Partition::try_new(used, &dofs).unwrap();
    let factored = Factored::try_new(stiffness, partition, method, &mut |_| {}).unwrap();
    factored
        .solve(stiffness, Loads { q_known: &q_known, forces, residual_rel: 0.0 }, &mut |_| {})
        .unwrap()
}

/// Displacement of one node.
pub(super) fn at(displacement: &[f64], node: usize) -> Vector3<f64> {
    Vector3::from_column_slice(&displacement[dof(node, 0)..dof(node, 0) + 3])
}
