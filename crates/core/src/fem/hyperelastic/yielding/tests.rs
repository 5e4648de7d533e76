//! Tests of yielding bodies: forces, tangent, state.

use std::sync::Arc;

use nalgebra::Rotation3;

use super::super::{Elements, Law};
use super::*;
use crate::fem::{Element, Material, QuadraticMesh, Stiffness};
use crate::mesh::{BuiltIn, generate};
use crate::model::Model;

/// Young's modulus of the bodies, Pa; they yield at a hundredth of it.
const YOUNG: f64 = 1.0e4;

struct Body {
    model: Model,
    elements: Elements,
    /// Places of all nodes, mid-edge nodes included.
    places: Vec<f64>,
}

fn body(element: Element) -> Body {
    let mesh = generate(BuiltIn::Sphere, 60).unwrap();
    let material = Material::try_new(YOUNG, 0.4).unwrap();
    let quadratic = QuadraticMesh::try_new(&mesh).unwrap();
    let nodes = match element {
        Element::Tet10 => quadratic.vertices(),
        _ => mesh.vertices(),
    };
    let places = nodes.iter().flat_map(|p| [p.x, p.y, p.z]).collect();
    let model = Model::try_new(mesh, element, &[material], vec![], &mut |_| {}).unwrap();
    let elements = model.hyperelastic(Law::NeoHookean).unwrap();
    Body { model, elements: elements.with_yield(1e-2 * YOUNG).unwrap(), places }
}

impl Body {
    /// A smooth field of about `size` of the body's size, and noise of half of that.
    fn field(&self, seed: u64, size: f64) -> Vec<f64> {
        let radius = self.places.iter().fold(0.0, |most: f64, x| most.max(x.abs()));
        let smooth = |i: usize| {
            let along = self.places[3 * (i / 3) + (i + 1) % 3] / radius;
            (along * (3.0 + seed as f64 + i as f64 % 3.0)).sin()
        };
        let noise = |i: usize| {
            let bits = (i as u64 + 1).wrapping_mul(0x9E37_79B9_7F4A_7C15).rotate_left(seed as u32);
            (bits >> 11) as f64 / (1u64 << 53) as f64 - 0.5
        };
        (0..self.places.len()).map(|i| size * radius * (smooth(i) + noise(i))).collect()
    }

    /// After two shapes that left plastic strain.
    fn dented(mut self) -> Self {
        for seed in [3, 4] {
            let u = self.field(seed, 0.05);
            self.elements.commit(&u);
        }
        assert!(self.elements.plastic_strain_max() > 0.05);
        self
    }

    fn tangent(&self, u: &[f64], curvature: Curvature) -> Stiffness {
        self.elements.tangent(self.model.stiffness().pattern(), u, curvature)
    }
}

const YIELDING: [Element; 2] = [Element::Tet4, Element::Tet10];

fn amax(v: &[f64]) -> f64 {
    v.iter().fold(0.0, |most: f64, x| most.max(x.abs()))
}

fn moved(u: &[f64], v: &[f64], t: f64) -> Vec<f64> {
    u.iter().zip(v).map(|(u, v)| u + t * v).collect()
}

#[test]
fn forces_are_the_slope_of_the_potential_and_the_tangent_that_of_the_forces() {
    for element in YIELDING {
        let body = body(element).dented();
        let (u, v) = (body.field(1, 0.03), body.field(2, 0.02));
        let here = body.elements.evaluate(&u);
        assert!(here.jacobian_min > 0.1, "{element:?}: {}", here.jacobian_min);
        // Small, so that no point comes across the yield stress.
        let step = 1e-8;
        let [before, after] = [-step, step].map(|t| body.elements.evaluate(&moved(&u, &v, t)));
        let work: f64 = here.forces.iter().zip(&v).map(|(f, v)| f * v).sum();
        let far = 1e-5;
        let [low, high] = [-far, far].map(|t| body.elements.evaluate(&moved(&u, &v, t)).energy);
        let slope = (high - low) / (2.0 * far);
        assert!((slope - work).abs() < 1e-6 * work.abs(), "{element:?}: {slope} {work}");
        let product = body.elements.tangent_times(&u, &v);
        let assembled = body.tangent(&u, Curvature::AsItIs).mul(&v);
        for (i, (a, b)) in after.forces.iter().zip(&before.forces).enumerate() {
            let difference = (a - b) / (2.0 * step);
            assert!((difference - product[i]).abs() < 1e-5 * amax(&product), "{element:?}");
            assert!((assembled[i] - product[i]).abs() < 1e-11 * amax(&product), "{element:?}");
        }
    }
}

#[test]
fn tangent_at_rest_is_the_linear_stiffness() {
    for element in YIELDING {
        let body = body(element);
        let rest = vec![0.0; body.places.len()];
        let v = body.field(3, 0.5);
        let linear = body.model.stiffness().mul(&v);
        for curvature in [Curvature::AsItIs, Curvature::PositivePart] {
            let tangent = body.tangent(&rest, curvature).mul(&v);
            let off = linear.iter().zip(&tangent).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            assert!(off < 1e-11 * amax(&linear), "{element:?} {curvature:?}: {off}");
        }
    }
}

#[test]
fn positive_parts_have_no_negative_curvature_where_the_tangent_has() {
    for element in YIELDING {
        let body = body(element).dented();
        let u = body.field(1, 0.05);
        let tangents = [Curvature::PositivePart, Curvature::AsItIs].map(|c| body.tangent(&u, c));
        let least = tangents.map(|tangent| {
            let curvature = |seed| {
                let v = body.field(seed, 1.0);
                let curvature: f64 = tangent.mul(&v).iter().zip(&v).map(|(f, v)| f * v).sum();
                curvature / (amax(&v).powi(2) * amax(&tangent.diagonal()))
            };
            (0..20).map(curvature).fold(f64::INFINITY, f64::min)
        });
        assert!(least[0] >= -1e-9 && least[1] < least[0], "{element:?}: {least:?}");
    }
}

#[test]
fn forces_turn_with_the_body_and_flow_does_not_see_the_turn() {
    for element in YIELDING {
        let body = body(element).dented();
        let turn = Rotation3::new(Vector3::new(1.0, -0.4, 0.3).normalize() * 1.57);
        let u = body.field(1, 0.03);
        let nodes = body.places.chunks_exact(3).zip(u.chunks_exact(3));
        let turned: Vec<f64> = nodes
            .flat_map(|(x, u)| {
                let place = Vector3::from_column_slice(x) + Vector3::from_column_slice(u);
                <[f64; 3]>::from(turn * place - Vector3::from_column_slice(x))
            })
            .collect();
        let [before, after] = [&u, &turned].map(|u| body.elements.evaluate(u));
        for (f, g) in before.forces.chunks_exact(3).zip(after.forces.chunks_exact(3)) {
            let off = turn * Vector3::from_column_slice(f) - Vector3::from_column_slice(g);
            assert!(off.amax() < 1e-12 * amax(&before.forces), "{element:?}: {off}");
        }
        let strains = [&u, &turned].map(|u| {
            let mut elements = body.elements.clone();
            elements.commit(u);
            elements.plastic_strain_max()
        });
        assert!((strains[0] - strains[1]).abs() < 1e-12 && strains[0] > 0.0);
    }
}

/// Flow that was made permanent leaves the forces as they are and stores elastic energy only.
#[test]
fn commits_keep_the_forces_and_take_what_was_dissipated() {
    for element in YIELDING {
        let mut body = body(element);
        let u = body.field(1, 0.05);
        let before = body.elements.evaluate(&u);
        body.elements.commit(&u);
        let after = body.elements.evaluate(&u);
        // What flowed at the yield stress: V σ_y Δp.
        let plastic = body.elements.plastic.as_ref().unwrap();
        let points = plastic.points.len() / body.elements.body.rest.len();
        let of_tets = plastic.points.chunks(points).zip(&body.elements.body.rest);
        let flowed: f64 = of_tets
            .map(|(points, rest)| {
                let mean = points.iter().map(|p| p.strain).sum::<f64>() / points.len() as f64;
                rest.volume * 1e-2 * YOUNG * mean
            })
            .sum();
        assert!(flowed > 0.0);
        assert!((before.energy - after.energy - flowed).abs() < 1e-12 * before.energy);
        let off = before.forces.iter().zip(&after.forces).map(|(a, b)| (a - b).abs());
        assert!(off.fold(0.0, f64::max) < 1e-12 * amax(&before.forces));
        let strain = body.elements.plastic_strain_max();
        body.elements.commit(&u);
        assert!((body.elements.plastic_strain_max() - strain).abs() < 1e-14);
        let plastic = body.elements.plastic.as_ref().unwrap();
        for point in &plastic.points {
            assert!((point.fp_inverse.determinant() - 1.0).abs() < 1e-14);
        }
    }
}

#[test]
fn small_fields_leave_no_plastic_strain_and_shapes_inside_out_none() {
    let mut body = body(Element::Tet4);
    let inside_out: Vec<f64> = body.places.iter().map(|x| -2.0 * x).collect();
    assert!(body.elements.evaluate(&inside_out).energy.is_infinite());
    for u in [body.field(1, 1e-4), inside_out] {
        body.elements.commit(&u);
        assert_eq!(body.elements.plastic_strain_max(), 0.0);
    }
}

#[test]
fn answers_have_the_same_bits_on_any_number_of_threads() {
    let body = body(Element::Tet10);
    let u = body.field(5, 0.04);
    let on = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let mut elements = body.elements.clone();
            elements.commit(&body.field(3, 0.04));
            let evaluated = elements.evaluate(&u);
            let diagonal = elements
                .tangent(body.model.stiffness().pattern(), &u, Curvature::PositivePart)
                .diagonal();
            let strain = elements.plastic_strain_max();
            let energy = evaluated.energy.to_bits();
            (energy, evaluated.forces, strain, diagonal, elements.tangent_times(&u, &u))
        })
    };
    let one = on(1);
    assert!(one.2 > 0.0);
    for threads in [2, 5] {
        assert_eq!(one, on(threads));
    }
}

#[test]
fn what_cannot_yield_is_refused() {
    let mesh = generate(BuiltIn::Cube, 27).unwrap();
    let material = Material::try_new(YOUNG, 0.3).unwrap();
    let elements =
        |element| Elements::try_new(&mesh, element, None, Law::NeoHookean, &[material]).unwrap();
    for stress_pa in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        let refused = elements(Element::Tet4).with_yield(stress_pa).unwrap_err();
        assert!(matches!(refused, YieldError::Stress { .. }), "{refused}");
    }
    let refused = elements(Element::Tet4Anp).with_yield(1.0).unwrap_err();
    assert_eq!(refused, YieldError::Averaged);
    assert!(refused.to_string().contains("t10"));
    let plain = elements(Element::Tet4);
    assert!(!plain.is_plastic() && plain.plastic_strain_max() == 0.0);
    let bytes = plain.bytes();
    assert!(plain.with_yield(1.0).unwrap().bytes() > bytes + 72 * mesh.tets().len());
}

/// Of several regions each has its own moduli, by both laws the same.
#[test]
fn regions_and_laws_give_their_moduli() {
    let mesh = generate(BuiltIn::Cube, 27).unwrap();
    let regions = (0..mesh.tets().len() as u32).map(|t| t % 2).collect();
    let mesh =
        crate::mesh::TetMesh::try_new(mesh.vertices().to_vec(), mesh.tets().to_vec(), regions)
            .unwrap();
    let materials = [(1.0e4, 0.3), (5.0e4, 0.45)]
        .map(|(young, poisson)| Material::try_new(young, poisson).unwrap());
    let model = Model::try_new(mesh, Element::Tet4, &materials, vec![], &mut |_| {}).unwrap();
    let pattern = Arc::clone(model.stiffness().pattern());
    let rest = vec![0.0; 3 * model.mesh().node_count()];
    let v: Vec<f64> = (0..rest.len()).map(|i| (i as f64 * 1.7).sin()).collect();
    let linear = model.stiffness().mul(&v);
    for law in [Law::NeoHookean, Law::NeoHookeanLog] {
        let elements = model.hyperelastic(law).unwrap().with_yield(1.0e3).unwrap();
        let tangent = elements.tangent(&pattern, &rest, Curvature::AsItIs).mul(&v);
        for (a, b) in linear.iter().zip(&tangent) {
            assert!((a - b).abs() < 1e-11 * amax(&linear), "{law}");
        }
    }
}
