//! Elements in groups against one at a time.

use proptest::prelude::*;

use super::super::body::Shape;
use super::super::{Elements, step_limit, summary};
use super::*;
use crate::fem::{Element, Material};
use crate::mesh::{BuiltIn, TetMesh, generate};

fn mesh() -> TetMesh {
    let mesh = generate(BuiltIn::Strawberry, 60).unwrap();
    assert!(!mesh.tets().len().is_multiple_of(4), "the last group is to be smaller");
    mesh
}

fn field(mesh: &TetMesh, bend: [f64; 9], scale: f64) -> Vec<f64> {
    let size = mesh.size();
    let of = |p: &nalgebra::Point3<f64>| {
        let x = p / size;
        let wave = |k: usize| bend[k] * x.x + bend[k + 1] * x.y * x.y + bend[k + 2] * x.z;
        [wave(0), wave(3), wave(6)].map(|w| scale * size * w)
    };
    mesh.vertices().iter().flat_map(of).collect()
}

proptest! {
    #[test]
    fn groups_agree_with_elements_one_by_one(
        bend in prop::array::uniform9(-0.6..0.6f64),
        scale in prop::sample::select(vec![1.0, 1e-3, 1e-8]),
        is_log in any::<bool>(),
    ) {
        let mesh = mesh();
        let law = if is_log { Law::NeoHookeanLog } else { Law::NeoHookean };
        let material = Material::try_new(2e4, 0.4).unwrap();
        let body = Body::try_new(&mesh, Element::Tet4, None, law, &[material]).unwrap();
        let Shape::Linear(locals) = &body.shape else { panic!("linear elements") };
        let groups = Groups { body: &body, locals };
        let u = field(&mesh, bend, scale);
        let one_by_one = body.evaluate_points(locals, &u, ModuliPart::Whole);
        prop_assume!(one_by_one.energy.is_finite());
        let together = groups.evaluate(&u, ModuliPart::Whole);
        let near = |a: f64, b: f64, of: f64| (a - b).abs() <= 1e-13 * of;
        // Both laws divide by J, a difference of products that are as large as 1: where it is small, fewer of its
        // digits are right.
        let of_small = 1.0 / one_by_one.jacobian_min.min(1.0);
        let largest = one_by_one.forces.iter().fold(0.0f64, |most, f| most.max(f.abs()));
        for (a, b) in together.forces.iter().zip(&one_by_one.forces) {
            prop_assert!(near(*a, *b, of_small * largest), "{a:e} {b:e} of {largest:e}");
        }
        // Small energies are differences of two that are as large as the strain.
        let rounding = 1e-15 * scale * body.rest.iter().map(|r| r.volume).sum::<f64>() * 2e4;
        prop_assert!((together.energy - one_by_one.energy).abs()
            <= 1e-12 * of_small * one_by_one.energy + rounding);
        prop_assert!(near(together.jacobian_min, one_by_one.jacobian_min, 1.0));

        let step = field(&mesh, bend.map(|b| -1.7 * b), 1.0);
        let limit = step_limit::one_by_one(&body, locals, &u, &step);
        let change = summary::gradient_change_max(&body, &step);
        prop_assert!(near(groups.step_limit(&u, &step), limit, 100.0));
        prop_assert!(near(groups.gradient_change_max(&step), change, change));
    }
}

#[test]
fn an_element_inside_out_has_no_energy() {
    let mesh = mesh();
    let material = Material::try_new(2e4, 0.4).unwrap();
    for law in [Law::NeoHookean, Law::NeoHookeanLog] {
        let elements = Elements::try_new(&mesh, Element::Tet4, None, law, &[material]).unwrap();
        let mirrored = mesh.vertices().iter().flat_map(|p| [-2.0 * p.x, 0.0, 0.0]);
        let mut u: Vec<f64> = mirrored.collect();
        assert!(elements.evaluate(&u).energy.is_infinite());
        u[0] = f64::NAN;
        assert!(elements.evaluate(&u).energy.is_infinite());
    }
}

#[test]
fn steps_that_are_no_number_are_limited_to_nothing() {
    let mesh = mesh();
    let material = Material::try_new(2e4, 0.4).unwrap();
    let elements =
        Elements::try_new(&mesh, Element::Tet4, None, Law::NeoHookean, &[material]).unwrap();
    let u = vec![0.0; 3 * mesh.node_count()];
    let mut step = u.clone();
    assert_eq!(elements.step_limit(&u, &step), 1.0);
    step[7] = f64::NAN;
    assert!(elements.step_limit(&u, &step) < 1.0 || elements.step_limit(&u, &step).is_nan());
    assert!(elements.gradient_change_max(&step).is_nan());
}
