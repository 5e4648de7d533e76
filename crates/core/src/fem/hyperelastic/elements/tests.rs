//! Tests of energy, forces and tangent of whole bodies.

use std::sync::Arc;

use nalgebra::{Rotation3, Vector3};
use proptest::prelude::*;

use super::super::Curvature;
use super::*;
use crate::fem::StiffnessPattern;
use crate::fem::tet10::tests::curved_fixtures::bent;
use crate::fem::{NodalPatches, Stiffness};
use crate::mesh::{BuiltIn, generate};
use crate::model::Model;

struct Body {
    model: Model,
    elements: Elements,
    /// Places of all nodes, mid-edge nodes included.
    places: Vec<f64>,
}

fn body(element: Element, law: Law, poisson: f64) -> Body {
    body_of(generate(BuiltIn::Sphere, 60).unwrap(), element, law, poisson)
}

fn body_of(mesh: TetMesh, element: Element, law: Law, poisson: f64) -> Body {
    let material = Material::try_new(1.0e4, poisson).unwrap();
    let model = Model::try_new(mesh.clone(), element, &[material], vec![], &mut |_| {}).unwrap();
    let quadratic = QuadraticMesh::try_new(&mesh).unwrap();
    let elements = Elements::try_new(&mesh, element, Some(&quadratic), law, &[material]).unwrap();
    let nodes = match element {
        Element::Tet10 => quadratic.vertices(),
        _ => mesh.vertices(),
    };
    let places = nodes.iter().flat_map(|p| [p.x, p.y, p.z]).collect();
    Body { model, elements, places }
}

impl Body {
    /// A smooth field of about a tenth of the size, and some noise.
    fn field(&self, seed: u64, noise: f64) -> Vec<f64> {
        let wave = |i: usize, x: f64| {
            let phase = (seed as f64) + i as f64 % 3.0;
            0.06 * (x * (3.0 + phase)).sin() * self.size()
        };
        let jitter = |i: usize| {
            let bits = (i as u64 + 1).wrapping_mul(0x9E37_79B9_7F4A_7C15).rotate_left(seed as u32);
            noise * self.size() * ((bits >> 11) as f64 / (1u64 << 53) as f64 - 0.5)
        };
        let shifted = |i: usize| self.places[3 * (i / 3) + (i + 1) % 3] / self.size();
        (0..self.places.len()).map(|i| wave(i, shifted(i)) + jitter(i)).collect()
    }

    fn size(&self) -> f64 {
        self.places.iter().fold(0.0, |most: f64, x| most.max(x.abs()))
    }

    fn tangent(&self, u: &[f64], curvature: Curvature) -> Stiffness {
        self.elements.tangent(self.model.stiffness().pattern(), u, curvature)
    }
}

fn all() -> impl Iterator<Item = (Element, Law)> {
    Element::ALL
        .into_iter()
        .flat_map(|element| [Law::NeoHookean, Law::NeoHookeanLog].map(|law| (element, law)))
}

fn amax(v: &[f64]) -> f64 {
    v.iter().fold(0.0, |most: f64, x| most.max(x.abs()))
}

#[test]
fn forces_are_the_slope_of_the_energy_and_the_tangent_that_of_the_forces() {
    for (element, law) in all() {
        let body = body(element, law, 0.4);
        let (u, v) = (body.field(1, 0.02), body.field(2, 0.02));
        let moved = |t: f64| -> Vec<f64> { u.iter().zip(&v).map(|(u, v)| u + t * v).collect() };
        let here = body.elements.evaluate(&u);
        assert!(here.jacobian_min > 0.1, "{element:?}: {}", here.jacobian_min);
        let step = 1e-5;
        let [before, after] = [-step, step].map(|t| body.elements.evaluate(&moved(t)));
        let slope = (after.energy - before.energy) / (2.0 * step);
        let work: f64 = here.forces.iter().zip(&v).map(|(f, v)| f * v).sum();
        assert!((slope - work).abs() < 1e-7 * work.abs(), "{element:?} {law}: {slope} {work}");
        let product = body.elements.tangent_times(&u, &v);
        let assembled = body.tangent(&u, Curvature::AsItIs).mul(&v);
        for (i, (a, b)) in after.forces.iter().zip(&before.forces).enumerate() {
            let difference = (a - b) / (2.0 * step);
            assert!((difference - product[i]).abs() < 1e-6 * amax(&product), "{element:?} {law}");
            assert!((assembled[i] - product[i]).abs() < 1e-11 * amax(&product), "{element:?}");
        }
    }
}

/// The averaged law that is split by logarithms leaves 2μ ε:ε with the elements, which the linear
/// element does not; all others are the linear stiffness at rest.
#[test]
fn tangent_at_rest_is_the_linear_stiffness() {
    for (element, law) in all() {
        if (element, law) == (Element::Tet4Anp, Law::NeoHookeanLog) {
            continue;
        }
        let body = body(element, law, 0.45);
        let rest = vec![0.0; body.places.len()];
        let v = body.field(3, 0.5);
        let linear = body.model.stiffness().mul(&v);
        for curvature in [Curvature::AsItIs, Curvature::PositivePart] {
            let tangent = body.tangent(&rest, curvature).mul(&v);
            let off = linear.iter().zip(&tangent).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            assert!(off < 1e-11 * amax(&linear), "{element:?} {law} {curvature:?}: {off}");
        }
    }
}

#[test]
fn positive_parts_have_no_negative_curvature_and_change_nothing_where_there_is_none() {
    for (element, law) in all() {
        let body = body(element, law, 0.4);
        let u = body.field(1, 0.06);
        assert!(body.elements.evaluate(&u).jacobian_min > 0.0, "{element:?}");
        let positive = body.tangent(&u, Curvature::PositivePart);
        for seed in 0..20 {
            let v = body.field(seed, 2.0);
            let curvature: f64 = positive.mul(&v).iter().zip(&v).map(|(f, v)| f * v).sum();
            assert!(curvature >= -1e-9 * amax(&v).powi(2) * amax(&positive.diagonal()));
        }
    }
}

#[test]
fn turned_bodies_hold_no_force_and_forces_turn_with_the_body() {
    for (element, law) in all() {
        let body = body(element, law, 0.45);
        let turn = Rotation3::new(Vector3::new(1.0, -0.4, 0.3).normalize() * 1.57);
        let turned = |u: &[f64]| -> Vec<f64> {
            let nodes = body.places.chunks_exact(3).zip(u.chunks_exact(3));
            nodes
                .flat_map(|(x, u)| {
                    let place = Vector3::from_column_slice(x) + Vector3::from_column_slice(u);
                    <[f64; 3]>::from(turn * place - Vector3::from_column_slice(x))
                })
                .collect()
        };
        let stiff =
            amax(&body.tangent(&vec![0.0; body.places.len()], Curvature::AsItIs).diagonal());
        let rigid = body.elements.evaluate(&turned(&vec![0.0; body.places.len()]));
        assert!(amax(&rigid.forces) < 1e-13 * stiff * body.size(), "{element:?} {law}");
        let u = body.field(1, 0.02);
        let (before, after) = (body.elements.evaluate(&u), body.elements.evaluate(&turned(&u)));
        for (f, g) in before.forces.chunks_exact(3).zip(after.forces.chunks_exact(3)) {
            let f = turn * Vector3::from_column_slice(f);
            let off = (f - Vector3::from_column_slice(g)).amax();
            assert!(off < 1e-12 * amax(&before.forces), "{element:?} {law}: {off}");
        }
    }
}

#[test]
fn answers_have_the_same_bits_on_any_number_of_threads() {
    let body = body(Element::Tet4Anp, Law::NeoHookean, 0.45);
    let u = body.field(5, 0.05);
    let on = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| (body.elements.evaluate(&u), body.elements.tangent_times(&u, &u)))
    };
    let (one, product) = on(1);
    for threads in [2, 5] {
        let (several, other) = on(threads);
        assert_eq!(one.energy.to_bits(), several.energy.to_bits());
        assert_eq!(one.forces, several.forces);
        assert_eq!(product, other);
    }
}

#[test]
fn elements_inside_out_have_infinite_energy_and_steps_stop_before() {
    let body = body(Element::Tet4, Law::NeoHookean, 0.3);
    let inside_out: Vec<f64> = body.places.iter().map(|x| -2.0 * x).collect();
    let evaluated = body.elements.evaluate(&inside_out);
    assert!(evaluated.energy.is_infinite() && evaluated.jacobian_min < 0.0);
    let rest = vec![0.0; body.places.len()];
    let limit = body.elements.step_limit(&rest, &inside_out);
    assert!((limit - 0.45).abs() < 1e-4, "{limit}");
    let half: Vec<f64> = inside_out.iter().map(|x| x * limit).collect();
    assert!(body.elements.evaluate(&half).jacobian_min > 0.0);
}

#[test]
fn regions_are_averaged_apart() {
    let mesh = generate(BuiltIn::Cube, 27).unwrap();
    let regions = (0..mesh.tets().len() as u32).map(|t| t % 2).collect();
    let mesh = TetMesh::try_new(mesh.vertices().to_vec(), mesh.tets().to_vec(), regions).unwrap();
    let materials = [(1.0e4, 0.3), (5.0e4, 0.45)]
        .map(|(young, poisson)| Material::try_new(young, poisson).unwrap());
    let element = Element::Tet4Anp;
    let elements = Elements::try_new(&mesh, element, None, Law::NeoHookean, &materials).unwrap();
    let patches = NodalPatches::new(&mesh);
    let pattern = Arc::new(StiffnessPattern::nodal_pressure(&mesh, &patches));
    let rest = vec![0.0; 3 * mesh.node_count()];
    let tangent = elements.tangent(&pattern, &rest, Curvature::AsItIs);
    let model = Model::try_new(mesh, element, &materials, vec![], &mut |_| {}).unwrap();
    let v: Vec<f64> = (0..rest.len()).map(|i| (i as f64 * 1.7).sin()).collect();
    let (linear, tangent) = (model.stiffness().mul(&v), tangent.mul(&v));
    for (a, b) in linear.iter().zip(&tangent) {
        assert!((a - b).abs() < 1e-11 * amax(&linear));
    }
    assert!(Elements::try_new(model.mesh(), element, None, Law::NeoHookean, &[]).is_err());
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(16))]
    #[test]
    fn summaries_are_those_of_the_field_that_was_made(
        angle in 0.0..3.0f64, stretch in 0.4..2.0f64,
    ) {
        let body = body(Element::Tet4, Law::NeoHookean, 0.3);
        let turn = Rotation3::new(Vector3::z() * angle);
        let u: Vec<f64> = body.places.chunks_exact(3).flat_map(|x| {
            let x = Vector3::from_column_slice(x);
            let stretched = Vector3::new(stretch * x.x, x.y, x.z);
            <[f64; 3]>::from(turn * stretched - x)
        }).collect();
        let summary = body.elements.summary(&u);
        prop_assert!((summary.rotation_max - angle).abs() < 1e-7);
        prop_assert!((summary.strain_max - (stretch - 1.0).abs()).abs() < 1e-9);
        prop_assert!((summary.stretch_max - stretch.max(1.0)).abs() < 1e-9);
        prop_assert!((summary.jacobian_min - stretch).abs() < 1e-9);
    }
}

#[test]
fn curved_elements_have_the_slopes_of_their_energy_and_none_in_a_turn() {
    let sphere = generate(BuiltIn::Sphere, 60).unwrap();
    for law in [Law::NeoHookean, Law::NeoHookeanLog] {
        let body = body_of(bent(&sphere, 0.04), Element::Tet10, law, 0.4);
        assert_eq!(body.places.len(), 3 * body.model.mesh().node_count());
        let (u, v) = (body.field(1, 0.005), body.field(2, 0.005));
        let moved = |t: f64| -> Vec<f64> { u.iter().zip(&v).map(|(u, v)| u + t * v).collect() };
        let step = 1e-5;
        let [before, after] = [-step, step].map(|t| body.elements.evaluate(&moved(t)));
        let slope = (after.energy - before.energy) / (2.0 * step);
        let here = body.elements.evaluate(&u);
        assert!(here.jacobian_min > 0.1, "{law}: {}", here.jacobian_min);
        let work: f64 = here.forces.iter().zip(&v).map(|(f, v)| f * v).sum();
        assert!((slope - work).abs() < 1e-7 * work.abs(), "{law}: {slope} {work}");
        let product = body.elements.tangent_times(&u, &v);
        let assembled = body.tangent(&u, Curvature::AsItIs).mul(&v);
        for (i, (a, b)) in after.forces.iter().zip(&before.forces).enumerate() {
            assert!(((a - b) / (2.0 * step) - product[i]).abs() < 1e-6 * amax(&product), "{law}");
            assert!((assembled[i] - product[i]).abs() < 1e-11 * amax(&product), "{law}");
        }
        let rest = vec![0.0; u.len()];
        let linear = body.model.stiffness().mul(&v);
        let tangent = body.tangent(&rest, Curvature::AsItIs).mul(&v);
        let off = linear.iter().zip(&tangent).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert!(off < 1e-11 * amax(&linear), "{law}: {off}");
        let turn = Rotation3::from_euler_angles(1.0, -2.0, 0.5);
        let places = body.places.as_chunks::<3>().0.iter().map(|p| Vector3::from(*p));
        let turned: Vec<f64> = places.flat_map(|p| <[f64; 3]>::from(turn * p - p)).collect();
        let turned = body.elements.evaluate(&turned);
        let (force, energy) = (amax(&turned.forces), turned.energy);
        assert!(force < 1e-9 * amax(&here.forces), "{law}: {force:e}");
        assert!(energy.abs() < 1e-11 * here.energy, "{law}: {energy:e} of {:e}", here.energy);
    }
}
