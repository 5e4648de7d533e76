//! Tests of the recovered fields: patch test, bending with a known answer, refinement, rounding.

use nalgebra::{Point3, Rotation3, Vector3};
use proptest::prelude::*;

use super::{OtherNodeCount, StressRecovery, Tensor, deviator, mean_square};
use crate::fem::{Element, Material};
use crate::mesh::{BuiltIn, Surface, TetMesh, generate};
use crate::model::Model;
use crate::solve::{Loads, Method};

const YOUNG: f64 = 2.0e4;
const POISSON: f64 = 0.4;

fn material() -> Material {
    Material::try_new(YOUNG, POISSON).unwrap()
}

fn recovery(mesh: &TetMesh) -> StressRecovery {
    StressRecovery::new(mesh, &[material()])
}

fn field(mesh: &TetMesh, map: impl Fn(&Point3<f64>) -> Vector3<f64>) -> Vec<[f64; 3]> {
    mesh.vertices().iter().map(|p| map(p).into()).collect()
}

/// Strain, von Mises stress, error at the nodes and error of the whole.
fn all_of(mesh: &TetMesh, u: &[[f64; 3]]) -> (Vec<f64>, Vec<f64>, Vec<f64>, f64) {
    let (mut strain, mut stress, mut error) = (vec![7.0; 3], Vec::new(), Vec::new());
    let mut recovery = recovery(mesh);
    recovery.principal_strain(u, &mut strain).unwrap();
    recovery.von_mises(u, &mut stress).unwrap();
    let of_whole = recovery.error(u, &mut error).unwrap();
    (strain, stress, error, of_whole)
}

fn assert_all_near(values: &[f64], expected: f64, tolerance: f64) {
    for value in values {
        assert!((value - expected).abs() <= tolerance, "{value} is not {expected}");
    }
}

#[test]
fn uniaxial_tension_has_its_strain_and_its_stress_everywhere_and_no_error() {
    let mesh = generate(BuiltIn::Strawberry, 600).unwrap();
    let u = field(&mesh, |p| 0.01 * Vector3::new(p.x, -POISSON * p.y, -POISSON * p.z));
    let (strain, stress, error, of_whole) = all_of(&mesh, &u);
    assert_all_near(&strain, 0.01, 1e-9);
    // σ = (E ε, 0, 0), and von Mises of a single tension is that tension.
    assert_all_near(&stress, 0.01 * YOUNG, 1e-8);
    assert_all_near(&error, 0.0, 1e-12);
    assert!(of_whole < 1e-12);
}

#[test]
fn pure_shear_has_half_its_angle_as_strain_and_root_three_of_its_stress() {
    let mesh = generate(BuiltIn::Sphere, 600).unwrap();
    let u = field(&mesh, |p| Vector3::new(0.02 * p.y, 0.0, 0.0));
    let (strain, stress, error, of_whole) = all_of(&mesh, &u);
    assert_all_near(&strain, 0.01, 1e-9);
    let shear_stress = YOUNG / (2.0 * (1.0 + POISSON)) * 0.02;
    assert_all_near(&stress, 3f64.sqrt() * shear_stress, 1e-8);
    assert_all_near(&error, 0.0, 1e-12);
    assert!(of_whole < 1e-12);
}

#[test]
fn small_rigid_motions_have_neither_stress_nor_error() {
    let mesh = generate(BuiltIn::Strawberry, 400).unwrap();
    let turn = Vector3::new(0.3, -0.1, 0.2);
    let u = field(&mesh, |p| Vector3::new(0.01, -0.02, 0.3) + turn.cross(&p.coords));
    let (strain, stress, error, of_whole) = all_of(&mesh, &u);
    assert_all_near(&strain, 0.0, 1e-12);
    assert_all_near(&stress, 0.0, 1e-12 * YOUNG);
    // What is left is rounding, and an error in proportion to it would be of any size.
    assert!(of_whole == 0.0 && error.iter().all(|&e| e == 0.0));
    let (.., of_rest) = all_of(&mesh, &field(&mesh, |_| Vector3::zeros()));
    assert_eq!(of_rest, 0.0);
}

#[test]
fn a_large_rotation_looks_like_the_strain_that_the_module_states() {
    let mesh = generate(BuiltIn::Cube, 64).unwrap();
    let rotation = Rotation3::from_axis_angle(&Vector3::z_axis(), 0.2);
    let (strain, ..) = all_of(&mesh, &field(&mesh, |p| rotation * p.coords - p.coords));
    // Two of the principal strains are equal, which costs the formula half of its digits.
    assert_all_near(&strain, 1.0 - 0.2f64.cos(), 1e-9);
}

/// Curvature of the bending field over the size of the cube, 1.
const BENT: f64 = 0.05;

/// Pure bending of a beam along x with a curvature κ: `σ_xx = E κ y`, everything else zero.
fn bending(mesh: &TetMesh) -> impl Fn(&Point3<f64>) -> Vector3<f64> {
    let k = BENT / mesh.size();
    move |p| {
        let across = p.x * p.x + POISSON * (p.y * p.y - p.z * p.z);
        k * Vector3::new(p.x * p.y, -0.5 * across, -POISSON * p.y * p.z)
    }
}

/// Deviator of the strain of [`bending`].
fn bent_deviator(mesh: &TetMesh, p: &Point3<f64>) -> Tensor {
    let axial = BENT / mesh.size() * p.y;
    let across = -POISSON * axial;
    deviator(&Tensor::new(axial, across, across, 0.0, 0.0, 0.0))
}

/// The finite-element answer where the surface follows [`bending`], which is the exact answer.
fn bent(mesh: &TetMesh, element: Element) -> Vec<[f64; 3]> {
    let model = Model::try_new(mesh.clone(), element, &[material()], vec![], &mut |_| {}).unwrap();
    let exact = field(mesh, bending(mesh));
    let nodes = Surface::from_mesh(mesh).nodes;
    let dofs: Vec<u32> = nodes.iter().flat_map(|n| [3 * n, 3 * n + 1, 3 * n + 2]).collect();
    let q_known: Vec<f64> = nodes.iter().flat_map(|&n| exact[n as usize]).collect();
    let factored = model.factor(&dofs, Method::SparseCholesky, &mut |_| {}).unwrap();
    let loads = Loads { q_known: &q_known, forces: &[], residual_rel: 0.0 };
    let solution = factored.solve(model.stiffness(), loads, &mut |_| {}).unwrap();
    solution.displacement.as_chunks().0.to_vec()
}

/// True error of the deviator in the energy norm, relative to the answer and its error.
fn true_error(mesh: &TetMesh, u: &[[f64; 3]]) -> f64 {
    let mut recovery = recovery(mesh);
    recovery.recover(u).unwrap();
    let (mut of_error, mut of_answer) = (0.0, 0.0);
    for (tet, strain) in recovery.of_elements.iter().enumerate() {
        let (own, volume) = (deviator(strain), mesh.signed_volume(tet));
        of_error += volume * mean_square(&mesh.corners(tet).map(|p| bent_deviator(mesh, &p) - own));
        of_answer += volume * own.norm_squared();
    }
    (of_error / (of_answer + of_error)).sqrt()
}

#[test]
fn estimate_falls_with_refinement_and_is_near_the_true_error_of_bending() {
    for element in [Element::Tet4, Element::Tet4Anp] {
        let of = |nodes: usize| {
            let mesh = generate(BuiltIn::Cube, nodes).unwrap();
            let u = bent(&mesh, element);
            let (.., at_nodes, estimate) = all_of(&mesh, &u);
            let ratio = estimate / true_error(&mesh, &u);
            let mean = at_nodes.iter().sum::<f64>() / at_nodes.len() as f64;
            assert!((0.5..1.5).contains(&ratio), "{element:?}, {nodes} nodes: {ratio}");
            (estimate, mean)
        };
        // Edges half as long: the error of linear elements halves.
        let (coarse, fine) = (of(125), of(729));
        assert!((0.4..0.6).contains(&(fine.0 / coarse.0)), "{element:?}: {coarse:?}, {fine:?}");
        assert!(fine.1 < 0.7 * coarse.1);
    }
}

#[test]
fn von_mises_stress_of_bending_is_that_of_the_beam_inside() {
    let mesh = generate(BuiltIn::Cube, 729).unwrap();
    let (_, stress, ..) = all_of(&mesh, &field(&mesh, bending(&mesh)));
    let surface = Surface::from_mesh(&mesh).nodes;
    let largest = YOUNG * BENT / 2.0;
    for (node, p) in mesh.vertices().iter().enumerate() {
        // At the surface the elements lie on one side only, and so does their average.
        if surface.binary_search(&(node as u32)).is_err() {
            let expected = YOUNG * BENT * p.y.abs() / mesh.size();
            assert!((stress[node] - expected).abs() < 0.1 * largest, "node {node}");
        }
    }
}

#[test]
fn displacements_of_another_mesh_are_refused_and_orphans_have_zero() {
    let mesh = generate(BuiltIn::Cube, 64).unwrap();
    let mut values = Vec::new();
    let refused = recovery(&mesh).error(&[[0.0; 3]; 63], &mut values);
    assert_eq!(refused, Err(OtherNodeCount { got: 63, expected: 64 }));
    let vertices = mesh.vertices().iter().copied().chain([Point3::new(9.0, 9.0, 9.0)]).collect();
    let with_orphan = TetMesh::try_new(vertices, mesh.tets().to_vec(), vec![]).unwrap();
    let u = field(&with_orphan, |p| Vector3::new(0.01 * p.x * p.y, 0.0, 0.0));
    let (strain, stress, error, _) = all_of(&with_orphan, &u);
    assert_eq!([strain[64], stress[64], error[64]], [0.0; 3]);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]
    #[test]
    fn linear_fields_are_recovered_exactly(h in prop::array::uniform9(-0.1..0.1f64)) {
        let mesh = generate(BuiltIn::Sphere, 200).unwrap();
        let h = nalgebra::Matrix3::from_row_slice(&h);
        let (strain, stress, error, _) = all_of(&mesh, &field(&mesh, |p| h * p.coords));
        let e = (h + h.transpose()) * 0.5;
        let principal = e.symmetric_eigenvalues().amax();
        let sigma = material().d() * nalgebra::Vector6::new(
            e[(0, 0)], e[(1, 1)], e[(2, 2)],
            2.0 * e[(1, 2)], 2.0 * e[(2, 0)], 2.0 * e[(0, 1)],
        );
        // Von Mises as it is printed in textbooks.
        let differences = (sigma[0] - sigma[1]).powi(2) + (sigma[1] - sigma[2]).powi(2)
            + (sigma[2] - sigma[0]).powi(2);
        let shears = sigma[3].powi(2) + sigma[4].powi(2) + sigma[5].powi(2);
        let von_mises = (0.5 * differences + 3.0 * shears).sqrt();
        for node in 0..mesh.node_count() {
            prop_assert!((strain[node] - principal).abs() < 1e-9 * principal.max(1e-6));
            prop_assert!((stress[node] - von_mises).abs() < 1e-9 * von_mises.max(1e-3));
            prop_assert!(error[node] < 1e-9);
        }
    }
}

#[test]
fn stress_of_a_bar_of_two_materials_is_the_same_in_both_and_that_of_each_strain() {
    // Two halves, pulled so that each has the strain of its stiffness: one uniaxial stress in both.
    let cube = generate(BuiltIn::Cube, 343).unwrap();
    let middle = 0.5 * (cube.bounds().0.x + cube.bounds().1.x);
    let is_right = |tet: &[u32; 4]| {
        let sum: f64 = tet.iter().map(|&n| cube.vertices()[n as usize].x).sum();
        u32::from(sum / 4.0 > middle)
    };
    let regions: Vec<u32> = cube.tets().iter().map(is_right).collect();
    assert!(regions.contains(&0) && regions.contains(&1));
    let mesh = TetMesh::try_new(cube.vertices().to_vec(), cube.tets().to_vec(), regions).unwrap();
    let stiff = Material::try_new(3.0 * YOUNG, 0.0).unwrap();
    let soft = Material::try_new(YOUNG, 0.0).unwrap();
    // Without a lateral strain the two halves fit together.
    let u = field(&mesh, |p| {
        let x = p.x - middle;
        Vector3::new(if x > 0.0 { 0.01 * x } else { 0.03 * x }, 0.0, 0.0)
    });
    let mut recovery = StressRecovery::new(&mesh, &[soft, stiff]);
    let (mut stress, mut strain) = (Vec::new(), Vec::new());
    recovery.von_mises(&u, &mut stress).unwrap();
    assert_all_near(&stress, 0.03 * YOUNG, 1e-8);
    let of_whole = recovery.error(&u, &mut strain).unwrap();
    assert!(of_whole < 1e-12, "{of_whole}");
    recovery.principal_strain(&u, &mut strain).unwrap();
    assert!(strain.iter().any(|e| (e - 0.01).abs() < 1e-9));
    assert!(strain.iter().any(|e| (e - 0.03).abs() < 1e-9));
}
