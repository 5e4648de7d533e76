//! Fields against closed forms, against the stiffness and the forces they belong to, and under turns.

use nalgebra::{DVector, Matrix3, Point3, Rotation3, Vector3};

use super::tensor::square;
use super::{Tensor, tensor_of, von_mises};
use crate::fem::hyperelastic::{Deformed, Elements, Law};
use crate::fem::tet10::tests::curved_fixtures::bent;
use crate::fem::{Element, Material, tet4};
use crate::mesh::{BuiltIn, TetMesh, generate};
use crate::model::Model;

const ELEMENTS: [Element; 3] = [Element::Tet4, Element::Tet4Anp, Element::Tet10];
const LAWS: [Law; 2] = [Law::NeoHookean, Law::NeoHookeanLog];

fn material(poisson: f64) -> Material {
    Material::try_new(2.0e4, poisson).unwrap()
}

fn model(mesh: TetMesh, element: Element, materials: &[Material]) -> Model {
    Model::try_new(mesh, element, materials, Vec::new(), &mut |_| {}).unwrap()
}

/// Places of all nodes of the system, mid-edge nodes behind the corners.
fn places(model: &Model) -> Vec<Point3<f64>> {
    match crate::fem::QuadraticMesh::try_new(model.mesh()) {
        Ok(quadratic) if model.element() == Element::Tet10 => quadratic.vertices().to_vec(),
        _ => model.mesh().vertices().to_vec(),
    }
}

fn field(model: &Model, map: impl Fn(&Point3<f64>) -> Vector3<f64>) -> Vec<f64> {
    places(model).iter().flat_map(|place| <[f64; 3]>::from(map(place))).collect()
}

/// Numbers without a pattern, within ±1.
fn wave(seed: u32, i: usize) -> f64 {
    (f64::from(seed) * 12.9898 + i as f64 * 78.233).sin() * 43_758.545_3 % 1.0
}

fn random_field(model: &Model, seed: u32, size: f64) -> Vec<f64> {
    (0..3 * model.system_node_count()).map(|i| size * wave(seed, i)).collect()
}

fn matrix(t: &Tensor) -> Matrix3<f64> {
    Matrix3::new(t[0], t[3], t[5], t[3], t[1], t[4], t[5], t[4], t[2])
}

fn turned(rotation: &Rotation3<f64>, t: &Tensor) -> Tensor {
    tensor_of(&(rotation.matrix() * matrix(t) * rotation.matrix().transpose()))
}

#[track_caller]
fn assert_near(found: &[Tensor], expected: &[Tensor], share: f64) {
    let largest = expected.iter().flatten().fold(0.0, |most: f64, x| most.max(x.abs()));
    assert_eq!(found.len(), expected.len());
    for (at, (found, expected)) in found.iter().zip(expected).enumerate() {
        let off = found.iter().zip(expected).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert!(off <= share * largest, "{at}: {found:?} for {expected:?}");
    }
}

/// Halves of a mesh as two regions.
fn halved(mesh: &TetMesh) -> TetMesh {
    let (low, high) = mesh.bounds();
    let middle = 0.5 * (low.x + high.x);
    let of_tet = |tet: usize| {
        let sum: f64 = mesh.corners(tet).iter().map(|corner| corner.x).sum();
        u32::from(0.25 * sum > middle)
    };
    let regions = (0..mesh.tets().len()).map(of_tet).collect();
    TetMesh::try_new(mesh.vertices().to_vec(), mesh.tets().to_vec(), regions).unwrap()
}

#[test]
fn a_linear_field_has_the_stress_of_hookes_law_everywhere_and_no_error() {
    let h = Matrix3::new(0.01, 0.004, -0.002, 0.001, -0.02, 0.006, 0.003, -0.005, 0.015);
    let expected_strain = tensor_of(&h);
    for element in ELEMENTS {
        let (material, mesh) = (material(0.3), generate(BuiltIn::Sphere, 200).unwrap());
        let volume: f64 = (0..mesh.tets().len()).map(|tet| mesh.signed_volume(tet)).sum();
        let model = model(mesh, element, &[material]);
        let u = field(&model, |place| h * place.coords);
        let fields = model.fields(&u, true);
        let (mu, lambda) = (material.shear_modulus(), material.lame_lambda());
        let stress = matrix(&expected_strain) * (2.0 * mu)
            + Matrix3::from_diagonal_element(lambda * h.trace());
        let expected = tensor_of(&stress);
        let (elements, nodes) = (&fields.elements, &fields.nodes);
        assert_near(&elements.stress, &vec![expected; elements.stress.len()], 1e-11);
        assert_near(&nodes.stress, &vec![expected; nodes.stress.len()], 1e-11);
        assert_near(&elements.strain, &vec![expected_strain; elements.strain.len()], 1e-11);
        let density = 0.5 * stress.dot(&matrix(&expected_strain));
        assert!((fields.energy / (density * volume) - 1.0).abs() < 1e-11);
        assert!(nodes.energy_density.iter().all(|own| (own / density - 1.0).abs() < 1e-10));
        let largest = square(&expected).sqrt();
        assert!(elements.stress_error.iter().all(|error| *error < 1e-10 * largest));
        assert!(fields.error_rel.unwrap() < 1e-10, "{element:?}: {:?}", fields.error_rel);
    }
}

#[test]
fn pull_along_one_axis_gives_that_stress_and_its_von_mises() {
    let material = material(0.3);
    let (stretch, nu) = (1e-3, material.poisson());
    for element in ELEMENTS {
        let model = model(generate(BuiltIn::Cube, 64).unwrap(), element, &[material]);
        let u = field(&model, |p| stretch * Vector3::new(-nu * p.x, -nu * p.y, p.z));
        let fields = model.fields(&u, false);
        let expected = material.young() * stretch;
        for stress in fields.elements.stress.iter().chain(&fields.nodes.stress) {
            assert!((stress[2] - expected).abs() < 1e-10 * expected);
            assert!((von_mises(stress) - expected).abs() < 1e-10 * expected);
        }
        assert!(fields.error_rel.is_none() && fields.elements.stress_error.is_empty());
    }
}

#[test]
fn energies_of_elements_add_up_to_half_the_quadratic_form_of_the_stiffness() {
    let mesh = halved(&generate(BuiltIn::Strawberry, 150).unwrap());
    let materials = [material(0.3), Material::try_new(1.0e6, 0.45).unwrap()];
    for element in ELEMENTS {
        let model = model(mesh.clone(), element, &materials);
        for seed in 0..5 {
            let u = random_field(&model, seed, 1e-3);
            let force = model.stiffness().mul(&u);
            let half = 0.5 * DVector::from_vec(u.clone()).dot(&DVector::from_vec(force));
            let fields = model.fields(&u, false);
            assert!((fields.energy / half - 1.0).abs() < 1e-11, "{element:?}, seed {seed}");
            let sum: f64 = fields.elements.energy.iter().sum();
            assert_eq!(sum, fields.energy);
        }
    }
}

#[test]
fn a_turned_scene_has_the_turned_stress() {
    let mesh = generate(BuiltIn::Strawberry, 120).unwrap();
    for (seed, element) in (0..6).zip(ELEMENTS.into_iter().cycle()) {
        let turn = Rotation3::from_euler_angles(wave(seed, 1), 3.0 * wave(seed, 2), wave(seed, 3));
        let vertices = mesh.vertices().iter().map(|place| turn * place).collect();
        let other = mesh.with_vertices(vertices).unwrap();
        let as_is = model(mesh.clone(), element, &[material(0.4)]);
        let u = random_field(&as_is, seed, 1e-4);
        let turned_u: Vec<f64> = u
            .as_chunks::<3>()
            .0
            .iter()
            .flat_map(|u| <[f64; 3]>::from(turn * Vector3::from(*u)))
            .collect();
        let fields = as_is.fields(&u, true);
        let other = model(other, element, &[material(0.4)]).fields(&turned_u, true);
        let expected = |tensors: &[Tensor]| -> Vec<Tensor> {
            tensors.iter().map(|tensor| turned(&turn, tensor)).collect()
        };
        assert_near(&other.elements.stress, &expected(&fields.elements.stress), 1e-10);
        assert_near(&other.nodes.stress, &expected(&fields.nodes.stress), 1e-10);
        assert_near(&other.nodes.strain, &expected(&fields.nodes.strain), 1e-10);
        let (a, b) = (fields.error_rel.unwrap(), other.error_rel.unwrap());
        assert!((a - b).abs() < 1e-10 * a && (fields.energy / other.energy - 1.0).abs() < 1e-10);
    }
}

#[test]
fn at_small_strain_both_laws_have_the_linear_fields() {
    let mesh = halved(&generate(BuiltIn::Cube, 64).unwrap());
    let materials = [material(0.3), Material::try_new(1.0e5, 0.45).unwrap()];
    for element in ELEMENTS {
        let model = model(mesh.clone(), element, &materials);
        let u = random_field(&model, 3, 1e-9);
        let linear = model.fields(&u, true);
        // Of the logarithmic law t4-anp averages λ alone, and of linear elasticity κ.
        let laws = LAWS.iter().take(if element == Element::Tet4Anp { 1 } else { 2 });
        for &law in laws {
            let elements = model.hyperelastic(law).unwrap();
            let large = model.large_fields(&elements, &u, true);
            assert_near(&large.elements.stress, &linear.elements.stress, 1e-5);
            assert_near(&large.nodes.strain, &linear.nodes.strain, 1e-5);
            assert!((large.energy / linear.energy - 1.0).abs() < 1e-5, "{element:?}, {law}");
            let (a, b) = (large.error_rel.unwrap(), linear.error_rel.unwrap());
            assert!((a - b).abs() < 1e-5 * b);
        }
    }
}

/// Forces at the nodes that hold Cauchy's stress of linear elements: `V J σ F⁻ᵀ ∇N`.
fn forces_of(mesh: &TetMesh, stress: &[Tensor], u: &[f64]) -> Vec<f64> {
    let mut forces = vec![0.0; u.len()];
    for (tet, nodes) in mesh.tets().iter().enumerate() {
        let g = tet4::gradients(&mesh.corners(tet));
        let at = |node: u32| Vector3::from_column_slice(&u[3 * node as usize..][..3]);
        let pairs = nodes.iter().zip(&g.of_shape);
        let h = pairs.fold(Matrix3::zeros(), |h, (&n, gradient)| h + at(n) * gradient.transpose());
        let deformed = Deformed::new(&h);
        let piola = matrix(&stress[tet]) * deformed.f_inverse_transposed * deformed.j;
        for (&node, gradient) in nodes.iter().zip(&g.of_shape) {
            let force = piola * gradient * g.volume;
            (0..3).for_each(|axis| forces[3 * node as usize + axis] += force[axis]);
        }
    }
    forces
}

#[test]
fn stress_and_energy_at_large_deformation_are_those_of_the_forces() {
    let mesh = halved(&generate(BuiltIn::Sphere, 120).unwrap());
    let materials = [material(0.3), Material::try_new(1.0e5, 0.45).unwrap()];
    for element in ELEMENTS {
        let model = model(mesh.clone(), element, &materials);
        for (seed, law) in (0..4).zip(LAWS.into_iter().cycle()) {
            let elements: Elements = model.hyperelastic(law).unwrap();
            let turn = Rotation3::from_euler_angles(1.0, -0.4, 0.7);
            let noise = random_field(&model, seed, 2e-4);
            let u: Vec<f64> = field(&model, |p| turn * (p.coords * 1.2) - p.coords)
                .iter()
                .zip(noise)
                .map(|(u, noise)| u + noise)
                .collect();
            let evaluated = elements.evaluate(&u);
            assert!(evaluated.jacobian_min > 0.1, "{}", evaluated.jacobian_min);
            let fields = model.large_fields(&elements, &u, false);
            assert!((fields.energy / evaluated.energy - 1.0).abs() < 1e-11);
            if element == Element::Tet10 {
                continue;
            }
            let forces = forces_of(&mesh, &fields.elements.stress, &u);
            let largest = evaluated.forces.iter().fold(0.0, |most: f64, f| most.max(f.abs()));
            let off = forces.iter().zip(&evaluated.forces).map(|(a, b)| (a - b).abs());
            assert!(off.fold(0.0, f64::max) < 1e-10 * largest, "{element:?}, {law}");
        }
    }
}

#[test]
fn a_turn_on_top_of_a_large_deformation_turns_stress_and_leaves_strain() {
    let mesh = generate(BuiltIn::Cube, 64).unwrap();
    for element in ELEMENTS {
        let model = model(mesh.clone(), element, &[material(0.4)]);
        let elements = model.hyperelastic(Law::NeoHookean).unwrap();
        let turn = Rotation3::from_euler_angles(0.9, 2.0, -1.1);
        let u = field(&model, |p| Vector3::new(4.0 * p.y * p.y, 0.2 * p.z, -0.1 * p.x));
        let moved: Vec<f64> = places(&model)
            .iter()
            .zip(u.as_chunks::<3>().0)
            .flat_map(|(p, u)| <[f64; 3]>::from(turn * (p.coords + Vector3::from(*u)) - p.coords))
            .collect();
        let (fields, other) = (
            model.large_fields(&elements, &u, false),
            model.large_fields(&elements, &moved, false),
        );
        let expected: Vec<Tensor> =
            fields.elements.stress.iter().map(|tensor| turned(&turn, tensor)).collect();
        assert_near(&other.elements.stress, &expected, 1e-10);
        assert_near(&other.elements.strain, &fields.elements.strain, 1e-10);
        assert!((other.energy / fields.energy - 1.0).abs() < 1e-11);
    }
}

#[test]
fn a_uniform_stretch_has_the_cauchy_stress_of_the_law() {
    let (material, stretch) = (material(0.3), 1.4);
    let (mu, kappa) = (material.shear_modulus(), material.bulk_modulus());
    for element in ELEMENTS {
        let model = model(generate(BuiltIn::Cube, 27).unwrap(), element, &[material]);
        let elements = model.hyperelastic(Law::NeoHookean).unwrap();
        let u = field(&model, |p| Vector3::new(0.0, 0.0, (stretch - 1.0) * p.z));
        let fields = model.large_fields(&elements, &u, false);
        // F = diag(1, 1, λ): σ = μ J^(−5/3) dev(F Fᵀ) + κ (J − 1) I, and E = (λ² − 1) / 2 along z.
        let squares = [1.0, 1.0, stretch * stretch];
        let mean = squares.iter().sum::<f64>() / 3.0;
        let scale = mu * stretch.powf(-5.0 / 3.0);
        for stress in fields.elements.stress.iter().chain(&fields.nodes.stress) {
            for (found, square) in stress.iter().zip(squares) {
                let expected = scale * (square - mean) + kappa * (stretch - 1.0);
                assert!((found - expected).abs() < 1e-9 * expected.abs());
            }
        }
        let strain = 0.5 * (stretch * stretch - 1.0);
        assert!(fields.nodes.strain.iter().all(|own| (own[2] - strain).abs() < 1e-12));
    }
}

#[test]
fn a_linear_field_of_curved_elements_has_its_stress_at_mid_edge_nodes_too() {
    let curved = bent(&generate(BuiltIn::Cube, 64).unwrap(), 0.05);
    let h = Matrix3::new(0.02, -0.01, 0.03, 0.005, -0.03, 0.01, -0.02, 0.015, 0.01) * 1e-3;
    let model = model(curved, Element::Tet10, &[material(0.3)]);
    let u = field(&model, |p| h * p.coords);
    let fields = model.fields(&u, true);
    let strain = tensor_of(&h);
    let stress: Vec<Tensor> = model.fields(&u, false).elements.stress;
    assert_near(&fields.nodes.strain, &vec![strain; model.mesh().node_count()], 1e-12);
    assert_near(&fields.nodes.stress, &vec![stress[0]; model.mesh().node_count()], 1e-11);
    assert!(fields.error_rel.unwrap() < 1e-12, "{:?}", fields.error_rel);
    let u = random_field(&model, 1, 1e-4);
    let force = model.stiffness().mul(&u);
    let half = 0.5 * DVector::from_vec(u.clone()).dot(&DVector::from_vec(force));
    assert!((model.fields(&u, false).energy / half - 1.0).abs() < 1e-11);
    let elements = model.hyperelastic(Law::NeoHookean).unwrap();
    let large = model.large_fields(&elements, &u, false);
    assert!((large.energy / elements.evaluate(&u).energy - 1.0).abs() < 1e-11);
}

#[test]
fn stress_that_jumps_between_regions_is_no_error() {
    let mesh = halved(&generate(BuiltIn::Cube, 125).unwrap());
    let materials = [material(0.3), Material::try_new(2.0e6, 0.3).unwrap()];
    let alike = [materials[0], materials[0]];
    for element in ELEMENTS {
        let jumping = model(mesh.clone(), element, &materials);
        let u = field(&jumping, |p| Vector3::new(0.0, 0.0, 1e-3 * p.z));
        let fields = jumping.fields(&u, true);
        assert!(fields.error_rel.unwrap() < 1e-10, "{element:?}: {:?}", fields.error_rel);
        let soft = model(mesh.clone(), element, &alike).fields(&u, true);
        assert!(fields.energy > 10.0 * soft.energy);
    }
}

#[test]
fn the_estimate_of_the_error_is_near_the_true_one_and_falls_with_the_mesh() {
    // u = (0, 0, x² / 2): γ_zx = x exactly, so the stress of linear elements is off by what is linear
    // in x inside each of them.
    let exact = |model: &Model, stress: &[Tensor], mu: f64| -> f64 {
        let mesh = model.mesh();
        let (mut error, mut energy) = (0.0, 0.0);
        for (tet, own) in stress.iter().enumerate() {
            let (corners, volume) = (mesh.corners(tet), mesh.signed_volume(tet));
            let shear = corners.map(|corner| mu * corner.x);
            // Mean of a square of a field that is linear between corners.
            let mean = |values: [f64; 4]| {
                let sum: f64 = values.iter().sum();
                (values.iter().map(|v| v * v).sum::<f64>() + sum * sum) / 20.0
            };
            let others = square(own) - 2.0 * own[5] * own[5];
            error += volume * (2.0 * mean(shear.map(|shear| shear - own[5])) + others) / (2.0 * mu);
            energy += volume * 2.0 * mean(shear) / (2.0 * mu);
        }
        (error / energy).sqrt()
    };
    let mut before = f64::INFINITY;
    for nodes in [125, 729, 3375] {
        let material = Material::try_new(2.0e4, 0.0).unwrap();
        let model = model(generate(BuiltIn::Cube, nodes).unwrap(), Element::Tet4, &[material]);
        let u = field(&model, |p| Vector3::new(0.0, 0.0, 0.5 * p.x * p.x));
        let fields = model.fields(&u, true);
        let truth = exact(&model, &fields.elements.stress, material.shear_modulus());
        let ratio = fields.error_rel.unwrap() / truth;
        assert!((0.6..1.4).contains(&ratio), "{nodes} nodes: {ratio} of {truth}");
        assert!(truth < 0.7 * before);
        before = truth;
    }
}

#[test]
fn a_rigid_turn_of_linear_elasticity_by_a_small_angle_has_no_error() {
    let mesh = generate(BuiltIn::Sphere, 200).unwrap();
    for element in ELEMENTS {
        let model = model(mesh.clone(), element, &[material(0.3)]);
        let axis = Vector3::new(0.3, -1.0, 2.0);
        let u = field(&model, |p| axis.cross(&p.coords) + Vector3::new(5.0, -7.0, 1.0));
        let fields = model.fields(&u, true);
        assert_eq!(fields.error_rel, Some(0.0), "{element:?}");
    }
}

#[test]
fn a_yielding_body_has_no_more_stress_than_it_yields_at() {
    let mesh = generate(BuiltIn::Cube, 27).unwrap();
    for element in [Element::Tet4, Element::Tet10] {
        let model = model(mesh.clone(), element, &[material(0.3)]);
        let mut elements = model.yielding(Law::NeoHookean, Some(300.0)).unwrap();
        let u = field(&model, |p| Vector3::new(-0.05 * p.x, -0.05 * p.y, 0.12 * p.z));
        elements.commit(&u);
        let fields = model.large_fields(&elements, &u, false);
        let j: f64 = 0.95 * 0.95 * 1.12;
        // The yield stress is that of Kirchhoff's stress, J times Cauchy's.
        for stress in &fields.elements.stress {
            assert!((von_mises(stress) * j - 300.0).abs() < 1e-6, "{}", von_mises(stress) * j);
        }
        let strain = 0.5 * (1.12f64.powi(2) - 1.0);
        assert!(fields.elements.strain.iter().all(|own| (own[2] - strain).abs() < 1e-12));
    }
}
