//! Tests of the bound: units, single precision, repeated nodes, a held body that nothing touches.

use std::sync::Arc;

use nalgebra::Point3;

use super::tests::{Shape, cube, pushes, touched};
use super::*;
use crate::fem::{Material, StiffnessPattern, assemble};
use crate::mesh::{Bodies, TetMesh};
use crate::solve::RigidBodies;

/// The same shape in other units of length and with another modulus.
fn scaled(mesh: &TetMesh, length: f64, young: f64, poisson: f64, fixed: &[u32]) -> Shape {
    let vertices: Vec<Point3<f64>> = mesh.vertices().iter().map(|p| p * length).collect();
    let mesh = TetMesh::try_new(vertices, mesh.tets().to_vec(), vec![]).unwrap();
    let pattern = Arc::new(StiffnessPattern::new(&mesh));
    let material = Material::try_new(young, poisson).unwrap();
    let stiffness = Arc::new(assemble(&pattern, &mesh, &[material]).unwrap());
    let bodies = Bodies::from_mesh(&mesh);
    let rigid = RigidBodies::new(&mesh, &bodies);
    let (mesh_of, bodies, rigid) = (&mesh, &bodies, &rigid);
    let body = BaseOf { mesh: mesh_of, bodies, rigid, stiffness: &stiffness };
    let base = Base::try_new(body, fixed, None, &mut |_| {}).unwrap();
    Shape { mesh, stiffness, base, columns: Columns::new(1 << 30) }
}

/// Bound from the residuals, and the one after a second solve.
fn bounds_at(
    shape: &Shape,
    nodes: &[u32],
    length: f64,
    wanted: &[u32],
    delivery: Delivery,
) -> [f64; 2] {
    assert!(shape.base.prove_eigenvalue_min().is_some());
    let dofs = touched(nodes);
    let mut set =
        ContactSet::try_new(&shape.base, &shape.columns, &Touched::of_dofs(&dofs)).unwrap();
    set.want(&shape.base, wanted);
    let q: Vec<f64> = pushes(dofs.len()).iter().map(|q| q * length).collect();
    let answer = set.solve(&q).unwrap();
    let delivered = set.wanted_displacements(&answer);
    let bound = |set: &ContactSet| {
        set.certify(&shape.base, &q, &answer, &delivered, delivery).error_bound_rel.unwrap()
    };
    let plain = bound(&set);
    set.refine(&shape.base);
    [plain, bound(&set)]
}

#[test]
fn frame_that_touches_nothing_on_a_held_body_does_not_panic_and_is_at_rest() {
    let shape = Shape::new(cube(64), 0.3, &touched(&[0, 1, 4, 16]));
    let mut set = ContactSet::try_new(&shape.base, &shape.columns, &Touched::of_dofs(&[])).unwrap();
    set.want(&shape.base, &[63, 5]);
    let answer = set.solve(&[]).unwrap();
    assert_eq!(set.wanted_displacements(&answer), [[0.0; 3]; 2]);
}

#[test]
fn bound_does_not_depend_on_the_units_of_length_and_modulus() {
    let mesh = cube(64);
    let (nodes, wanted) = ([20, 35, 50, 63], [63, 7]);
    let units = [(1e-6, 1e5), (1e6, 1e5), (1.0, 1e-3), (1.0, 1e12), (3e3, 7e9), (0.01, 3.0)];
    for (fixed, poisson) in [(vec![], 0.3), (touched(&[0, 1, 4, 16]), 0.3), (vec![], 0.49)] {
        let at = |length, young| {
            let shape = scaled(&mesh, length, young, poisson, &fixed);
            bounds_at(&shape, &nodes, length, &wanted, Delivery::Double)
        };
        let first = at(1.0, 1e5);
        for (length, young) in units {
            for (bound, first) in at(length, young).into_iter().zip(first) {
                let off = (bound / first - 1.0).abs();
                assert!(off <= 1e-6, "{length:e} m, {young:e} Pa: {bound:e} against {first:e}");
            }
        }
        assert!(first[1] < 0.1 * first[0], "{first:?}: a second solve is of no use");
    }
}

#[test]
fn repeated_nodes_do_not_shrink_the_bound() {
    for fixed in [vec![], touched(&[0, 1, 4, 16])] {
        let shape = Shape::new(cube(64), 0.3, &fixed);
        for delivery in [Delivery::Double, Delivery::Single] {
            let nodes: &[u32] = if fixed.is_empty() { &[20, 35, 50, 63] } else { &[20, 35] };
            let of = |wanted: &[u32]| bounds_at(&shape, nodes, 1.0, wanted, delivery);
            assert_eq!(of(&[7]), of(&[7; 500]));
        }
    }
}

#[test]
fn bound_counts_the_rounding_to_single_precision() {
    let shape = Shape::new(cube(64), 0.3, &touched(&[0, 1, 4, 16]));
    let dofs = touched(&[20, 63]);
    let mut set =
        ContactSet::try_new(&shape.base, &shape.columns, &Touched::of_dofs(&dofs)).unwrap();
    shape.base.prove_eigenvalue_min();
    set.want(&shape.base, &(0..64).collect::<Vec<u32>>());
    let q = pushes(dofs.len());
    let answer = set.solve(&q).unwrap();
    let delivered = set.wanted_displacements(&answer);
    let largest = delivered.iter().flatten().fold(0.0f64, |m, u| m.max(u.abs()));
    let single = delivered.as_flattened().iter().map(|u| f64::from((u / largest) as f32) * largest);
    let pairs = single.zip(delivered.as_flattened());
    let error = pairs.map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt();
    let size = delivered.as_flattened().iter().map(|u| u * u).sum::<f64>().sqrt();
    let of = |delivery| {
        set.certify(&shape.base, &q, &answer, &delivered, delivery).error_bound_rel.unwrap()
    };
    let (single, double) = (of(Delivery::Single), of(Delivery::Double));
    assert!(double < error / size && error / size < single && single < 1e-7, "{double} {single}");
}
