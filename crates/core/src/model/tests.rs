//! Tests of the model: known displacements, masks, elements, holds.

use super::*;
use crate::mesh::{BuiltIn, generate};
use crate::solve::Method;

fn cube() -> Model {
    let mesh = generate(BuiltIn::Cube, 64).unwrap();
    let material = Material::try_new(1.0e5, 0.3).unwrap();
    Model::try_new(mesh, Element::Tet4, &[material], vec![5, 3, 4], &mut |_| {}).unwrap()
}

#[test]
fn fixed_dofs_join_the_known_ones_and_yield_to_them() {
    let known = cube().known(vec![(4, 0.5), (0, 0.25)]).unwrap();
    assert_eq!(known.dofs, [0, 3, 4, 5]);
    assert_eq!(known.q_known, [0.25, 0.0, 0.5, 0.0]);
}

#[test]
fn masks_that_do_not_fit_the_mesh_are_named() {
    let one = generate(BuiltIn::Cube, 27).unwrap();
    let moved = one.vertices().iter().map(|p| p + nalgebra::Vector3::new(0.2, 0.0, 0.0));
    let orphan = [nalgebra::Point3::new(9.0, 9.0, 9.0)];
    let vertices = one.vertices().iter().copied().chain(moved).chain(orphan).collect();
    let tets = one.tets().iter().copied().chain(one.tets().iter().map(|t| t.map(|n| n + 27)));
    let two = TetMesh::try_new(vertices, tets.collect(), vec![]).unwrap();
    let material = Material::try_new(1.0e5, 0.3).unwrap();
    let model = Model::try_new(two, Element::Tet4, &[material], vec![], &mut |_| {}).unwrap();
    let error = |nodes: &[u32]| {
        let good = vec![(0, 1.0), (1, 1.0)];
        let bad: Vec<(u32, f64)> = nodes.iter().map(|&n| (n, 1.0)).collect();
        match model.masks([good, bad]) {
            Err(ModelError::Mask { mask: 1, reason }) => reason,
            other => panic!("{other:?}"),
        }
    };
    assert_eq!(error(&[3, 55]), MaskError::NoSuchNode { node: 55, node_count: 55 });
    assert_eq!(error(&[u32::MAX]), MaskError::NoSuchNode { node: u32::MAX, node_count: 55 });
    assert_eq!(error(&[54]), MaskError::Orphan { node: 54 });
    assert_eq!(error(&[26, 27]), MaskError::SeveralBodies { first: 26, second: 27 });
    assert_eq!(error(&[]), MaskError::Empty);
}

#[test]
fn ten_node_elements_answer_at_the_corners_and_are_softer() {
    let material = Material::try_new(1.0e5, 0.3).unwrap();
    let known = [0, 1, 2, 3, 15, 12].map(|n| 3 * n).into_iter().flat_map(|d| d..d + 3);
    let known: Vec<(u32, f64)> = known.map(|d| (d, 0.0)).collect();
    let pulled = |element: Element| {
        let mesh = generate(BuiltIn::Cube, 64).unwrap();
        let model = Model::try_new(mesh, element, &[material], vec![], &mut |_| {}).unwrap();
        let known = model.known(known.clone()).unwrap();
        let factored = model.factor(&known.dofs, Method::Front, &mut |_| {}).unwrap();
        let mut forces = vec![0.0; 3 * model.system_node_count()];
        forces[3 * 63] = 1.0;
        let loads =
            crate::solve::Loads { q_known: &known.q_known, forces: &forces, residual_rel: 0.0 };
        let solution = factored.solve(model.stiffness(), loads, &mut |_| {}).unwrap();
        solution.displacement[3 * 63]
    };
    // More freedom, less energy stored for the same force: the loaded corner gives more.
    assert!(pulled(Element::Tet10) > 1.05 * pulled(Element::Tet4));
}

#[test]
fn body_held_at_two_nodes_is_refused_before_factoring() {
    let error = cube().factor(&[0, 1, 2, 3, 4, 5], Method::SparseCholesky, &mut |stage| {
        panic!("{stage:?} was begun");
    });
    assert!(matches!(error, Err(ModelError::Free(_))));
}
