//! Tests of equilibria whose corrections come from multigrid, with no factor of any tangent: the same shapes
//! as by factors.

use std::sync::Arc;

use nalgebra::Vector3;

use super::adjoint_tests::{converged, pressed_bar};
use super::*;
use crate::contact::Mask;
use crate::fem::hyperelastic::Law;
use crate::fem::{Element, Material};
use crate::mesh::{BuiltIn, TetMesh, generate};
use crate::model::{Known, Model};
use crate::solve::vectors::{norm, subtract};

fn model_of(mesh: TetMesh, poisson: f64, element: Element) -> Model {
    let material = Material::try_new(2.0e4, poisson).unwrap();
    Model::try_new(mesh, element, &[material], vec![], &mut |_| {}).unwrap()
}

/// The lowest tenth of the body held, the highest pushed down by a share of its height and aside.
fn pushed(model: &Model, share: f64) -> Known {
    let (low, high) = model.mesh().bounds();
    let height = high.z - low.z;
    let mut pairs = Vec::new();
    for (n, place) in
        (0u32..).zip(model.mesh().vertices()).filter(|(n, _)| model.is_used(*n as usize))
    {
        let is_high = place.z > high.z - 0.1 * height;
        if is_high || place.z < low.z + 0.1 * height {
            let moved = if is_high { share * height } else { 0.0 };
            pairs.extend([(3 * n, 0.3 * moved), (3 * n + 1, 0.0), (3 * n + 2, -moved)]);
        }
    }
    model.known(pairs).unwrap()
}

fn path(model: &Model, dofs: &[u32], masks: Vec<Mask>, by: TangentsBy) -> Path {
    let hold = Arc::new(model.hold_by(dofs, masks, by, None).unwrap());
    assert_eq!(hold.analysis().is_some(), by == TangentsBy::Factors);
    let elements = Arc::new(model.hyperelastic(Law::NeoHookean).unwrap());
    let rest = vec![0.0; 3 * model.system_node_count()];
    Path::new(elements, model.stiffness(), hold, rest, false)
}

fn off(a: &[f64], b: &[f64]) -> f64 {
    norm(&subtract(a, b)) / norm(b)
}

#[test]
fn pushed_bodies_of_every_element_have_the_shapes_that_factors_find() {
    for (shape, nodes, element, poisson) in [
        (BuiltIn::Strawberry, 1500, Element::Tet4, 0.3),
        (BuiltIn::Toothpaste, 1000, Element::Tet4, 0.45),
        (BuiltIn::Sphere, 600, Element::Tet4Anp, 0.45),
        (BuiltIn::Cube, 343, Element::Tet10, 0.4),
    ] {
        let model = model_of(generate(shape, nodes).unwrap(), poisson, element);
        let known = pushed(&model, 0.15);
        let goal = Goal { q_known: &known.q_known, mask_q: &[], forces: &[] };
        let [by_factors, by_multigrid] = [TangentsBy::Factors, TangentsBy::Multigrid].map(|by| {
            let mut path = path(&model, &known.dofs, vec![], by);
            let found = path.find(&goal, &Wish::EXACT).unwrap();
            assert!(found.settled && !found.jumped, "{shape} {element:?}: {found:?}");
            (path.displacement().to_vec(), found)
        });
        let error = off(&by_multigrid.0, &by_factors.0);
        let estimate = by_multigrid.1.error_estimate_rel;
        assert!(error < 1e-8, "{shape} {element:?}: {error:e}, estimated {estimate:e}");
        let forces = off(&by_multigrid.1.reactions, &by_factors.1.reactions);
        assert!(forces < 1e-7, "{shape} {element:?}: reactions differ by {forces:e}");
    }
}

#[test]
fn body_that_masks_alone_hold_has_the_shape_that_factors_find() {
    let model = model_of(generate(BuiltIn::Sphere, 800).unwrap(), 0.4, Element::Tet4);
    let size = model.mesh().size();
    let centre = Vector3::from(std::array::from_fn::<f64, 3, _>(|axis| {
        model.mesh().vertices().iter().map(|p| p[axis]).sum::<f64>() / 800.0
    }));
    let tips = [Vector3::x(), -Vector3::x(), Vector3::y(), Vector3::z(), -Vector3::z()];
    let near = |tip: &Vector3<f64>| {
        let along = |n: usize| (model.mesh().vertices()[n].coords - centre).dot(tip);
        let mut nodes: Vec<usize> = (0..model.mesh().node_count()).collect();
        nodes.sort_by(|a, b| along(*b).total_cmp(&along(*a)));
        let entries = nodes[..25].iter().map(|n| (*n as u32, 1.0)).collect();
        Mask::try_new(entries).unwrap()
    };
    let masks: Vec<Mask> = tips.iter().map(near).collect();
    let mask_q: Vec<f64> =
        tips.iter().flat_map(|tip| <[f64; 3]>::from(-0.03 * size * tip)).collect();
    let goal = Goal { q_known: &[], mask_q: &mask_q, forces: &[] };
    let [by_factors, by_multigrid] = [TangentsBy::Factors, TangentsBy::Multigrid].map(|by| {
        let mut path = path(&model, &[], masks.clone(), by);
        let found = path.find(&goal, &Wish::EXACT).unwrap();
        assert!(found.settled, "{found:?}");
        (path.displacement().to_vec(), found.mask_forces)
    });
    let (shape, forces) =
        (off(&by_multigrid.0, &by_factors.0), off(&by_multigrid.1, &by_factors.1));
    assert!(shape < 1e-7 && forces < 1e-6, "{shape:e}, forces {forces:e}");
}

/// Stability is told by whether conjugate gradients come to an end: no factor's pivots are there.
#[test]
fn tangent_beyond_buckling_is_seen_without_a_factor_and_the_adjoint_is_that_by_factors() {
    let adjoint = |share: f64, by: TangentsBy| {
        let path = pressed_bar(share, 343, by);
        let slopes: Vec<f64> =
            (0..path.displacement().len()).map(|i| (0.7 * i as f64).sin()).collect();
        let known = vec![0.0; path.hold().dofs().len()];
        path.adjoint(&converged(), &AdjointLoad { slopes: &slopes, known: &known })
    };
    let is_stable = |share: f64, by| match adjoint(share, by) {
        Ok(_) => true,
        Err(NoAdjoint::NotStable) => false,
        Err(error) => panic!("pressed to {share}: {error}"),
    };
    let mut seen = [0, 0];
    for percent in (54..98).step_by(2) {
        let share = f64::from(percent) / 100.0;
        let expected = is_stable(share, TangentsBy::Factors);
        assert_eq!(is_stable(share, TangentsBy::Multigrid), expected, "pressed to {share}");
        seen[usize::from(expected)] += 1;
    }
    assert!(seen[0] >= 5 && seen[1] >= 5, "{seen:?}");
    let [by_factors, by_multigrid] =
        [TangentsBy::Factors, TangentsBy::Multigrid].map(|by| adjoint(0.97, by).unwrap().field);
    let error = off(&by_multigrid, &by_factors);
    assert!(error < 1e-9, "{error:e}");
}

#[test]
fn paths_by_multigrid_have_the_same_bits_on_any_number_of_threads() {
    let model = model_of(generate(BuiltIn::Strawberry, 600).unwrap(), 0.4, Element::Tet4);
    let known = pushed(&model, 0.1);
    let on = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let mut path = path(&model, &known.dofs, vec![], TangentsBy::Multigrid);
            let goal = Goal { q_known: &known.q_known, mask_q: &[], forces: &[] };
            path.find(&goal, &Wish::EXACT).unwrap();
            path.displacement().to_vec()
        })
    };
    let one = on(1);
    assert!(one == on(2) && one == on(3));
}
