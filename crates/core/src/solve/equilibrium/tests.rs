//! Tests of equilibria: against each other, against closed forms, and of what they promise.

use std::sync::Arc;

use nalgebra::{Rotation3, Vector3};
use proptest::prelude::*;

use super::*;
use crate::contact::Mask;
use crate::fem::hyperelastic::Law;
use crate::fem::{Element, Material};
use crate::mesh::{BuiltIn, generate};
use crate::model::Model;

fn model(shape: BuiltIn, nodes: usize, poisson: f64, element: Element) -> Model {
    let mesh = generate(shape, nodes).unwrap();
    let material = Material::try_new(2.0e4, poisson).unwrap();
    Model::try_new(mesh, element, &[material], vec![], &mut |_| {}).unwrap()
}

fn path(model: &Model, hold: Hold, is_single: bool) -> Path {
    let elements = Arc::new(model.hyperelastic(Law::NeoHookean).unwrap());
    let rest = vec![0.0; 3 * model.system_node_count()];
    Path::new(elements, model.stiffness(), Arc::new(hold), rest, is_single)
}

/// Five round patches of the surface around directions, and how deep each presses to the middle.
struct Grip {
    masks: Vec<Mask>,
    inward: Vec<Vector3<f64>>,
    size: f64,
}

impl Grip {
    fn of(model: &Model) -> Self {
        let mesh = model.mesh();
        let (low, high) = mesh.bounds();
        let (centre, size) = (nalgebra::center(&low, &high), mesh.size());
        let directions = [
            [1.0, 0.2, 0.1],
            [-0.8, 0.6, 0.1],
            [-0.8, 0.1, 0.4],
            [-0.8, -0.4, 0.1],
            [-0.7, -0.7, -0.2],
        ];
        let mut grip = Self { masks: Vec::new(), inward: Vec::new(), size };
        for direction in directions.map(|d| Vector3::from(d).normalize()) {
            let along = |n: &usize| (mesh.vertices()[*n] - centre).dot(&direction);
            let used: Vec<usize> = (0..mesh.node_count()).filter(|n| model.is_used(*n)).collect();
            let tip = used.into_iter().max_by(|a, b| along(a).total_cmp(&along(b))).unwrap();
            let tip = mesh.vertices()[tip];
            let near =
                |n: &usize| model.is_used(*n) && (mesh.vertices()[*n] - tip).norm() < 0.15 * size;
            let entries = (0..mesh.node_count()).filter(near).map(|n| (n as u32, 1.0)).collect();
            grip.masks.push(Mask::try_new(entries).unwrap());
            grip.inward.push(-direction);
        }
        grip
    }

    /// Means of the masks pressed in by a share of the size.
    fn pressed(&self, share: f64) -> Vec<f64> {
        self.inward.iter().flat_map(|d| <[f64; 3]>::from(d * (share * self.size))).collect()
    }
}

fn goal<'a>(q_known: &'a [f64], mask_q: &'a [f64]) -> Goal<'a> {
    Goal { q_known, mask_q, forces: &[] }
}

fn amax(v: &[f64]) -> f64 {
    v.iter().fold(0.0, |most: f64, x| most.max(x.abs()))
}

fn off(a: &[f64], b: &[f64]) -> f64 {
    let difference: Vec<f64> = a.iter().zip(b).map(|(a, b)| a - b).collect();
    amax(&difference) / amax(b)
}

const LOOSE: Wish<'_> = Wish { error_rel: Some(2e-3), ..Wish::EXACT };

#[test]
fn body_held_by_masks_alone_is_in_balance_and_follows_a_translation_without_force() {
    for element in Element::ALL {
        let model = model(BuiltIn::Sphere, 150, 0.4, element);
        let grip = Grip::of(&model);
        let mut path = path(&model, model.hold(&[], grip.masks.clone(), None).unwrap(), true);
        let shift = [0.03, -0.02, 0.01].repeat(5);
        let moved = path.advance(&goal(&[], &shift), &Wish::EXACT).unwrap();
        let used = (0..model.system_node_count()).filter(|n| model.is_used(*n));
        for n in used {
            for axis in 0..3 {
                let u = path.displacement()[3 * n + axis];
                assert!((u - shift[axis]).abs() < 1e-11, "{element:?} node {n}: {u}");
            }
        }
        let squeezed: Vec<f64> =
            grip.pressed(0.06).iter().zip(&shift).map(|(a, b)| a + b).collect();
        let held = path.advance(&goal(&[], &squeezed), &Wish::EXACT).unwrap();
        assert!(held.residual_rel < 1e-9 && held.settled, "{element:?}: {:e}", held.residual_rel);
        assert!(amax(&moved.mask_forces) < 1e-9 * amax(&held.mask_forces));
        for axis in 0..3 {
            let sum: f64 = held.mask_forces.iter().skip(axis).step_by(3).sum();
            assert!(sum.abs() < 1e-9 * amax(&held.mask_forces), "{element:?}: forces balance");
        }
    }
}

#[test]
fn masks_of_one_node_hold_as_known_nodes_do() {
    let model = model(BuiltIn::Cube, 64, 0.3, Element::Tet4);
    let nodes = [0u32, 21, 42, 63, 15];
    let q: Vec<f64> = (0..15).map(|i| 0.004 * (f64::from(i) * 1.3).sin()).collect();
    let masks = nodes.map(Mask::of_node).to_vec();
    let mut by_masks = path(&model, model.hold(&[], masks, None).unwrap(), false);
    let held = by_masks.advance(&goal(&[], &q), &Wish::EXACT).unwrap();
    let mut pairs: Vec<(u32, f64)> = Vec::new();
    for (node, q) in nodes.iter().zip(q.chunks(3)) {
        pairs.extend(q.iter().enumerate().map(|(axis, q)| (3 * node + axis as u32, *q)));
    }
    let known = model.known(pairs).unwrap();
    let mut by_nodes = path(&model, model.hold(&known.dofs, vec![], None).unwrap(), false);
    let known_held = by_nodes.advance(&goal(&known.q_known, &[]), &Wish::EXACT).unwrap();
    assert!(off(by_masks.displacement(), by_nodes.displacement()) < 1e-10);
    for (i, node) in nodes.iter().enumerate() {
        for axis in 0..3 {
            let at = known.dofs.binary_search(&(3 * node + axis as u32)).unwrap();
            let difference = held.mask_forces[3 * i + axis] - known_held.reactions[at];
            assert!(difference.abs() < 1e-9 * amax(&known_held.reactions));
        }
    }
}

#[test]
fn many_frames_and_one_motion_lead_to_the_same_shape() {
    let model = model(BuiltIn::Strawberry, 300, 0.4, Element::Tet4);
    let grip = Grip::of(&model);
    let hold = || model.hold(&[], grip.masks.clone(), None).unwrap();
    let mut at_once = path(&model, hold(), true);
    at_once.advance(&goal(&[], &grip.pressed(0.08)), &Wish::EXACT).unwrap();
    let mut by_frames = path(&model, hold(), true);
    for frame in 1..=20 {
        let pressed = grip.pressed(0.08 * f64::from(frame) / 20.0);
        let found = by_frames.advance(&goal(&[], &pressed), &LOOSE).unwrap();
        assert!(found.error_estimate_rel <= 2e-3 && found.jacobian_min > 0.0);
        if let Some(renewal) = by_frames.renewal() {
            by_frames.install(renewal.make(), 1);
        }
    }
    let error = off(by_frames.displacement(), at_once.displacement());
    assert!(error < 4e-3, "{error:e}");
    // The hand rests: the shape settles by itself.
    for _ in 0..12 {
        by_frames.advance(&goal(&[], &grip.pressed(0.08)), &LOOSE).unwrap();
        if let Some(renewal) = by_frames.renewal() {
            by_frames.install(renewal.make(), 1);
        }
    }
    let rested = by_frames.advance(&goal(&[], &grip.pressed(0.08)), &LOOSE).unwrap();
    assert!(rested.settled && rested.linear_solves == 0, "{rested:?}");
    assert!(off(by_frames.displacement(), at_once.displacement()) < 1e-7);
}

#[test]
fn turning_hand_and_object_together_changes_rounding_only() {
    let model = model(BuiltIn::Sphere, 200, 0.45, Element::Tet4Anp);
    let grip = Grip::of(&model);
    let squeezed = |turn: &Rotation3<f64>| {
        let mut path = path(&model, model.hold(&[], grip.masks.clone(), None).unwrap(), false);
        let mask_q = |turn: &Rotation3<f64>, depth: f64| -> Vec<f64> {
            let moved = |(mask, inward): (&Mask, &Vector3<f64>)| {
                let place = |axis: usize| mask.mean(|n| model.mesh().vertices()[n as usize][axis]);
                let centre = Vector3::new(place(0), place(1), place(2));
                <[f64; 3]>::from(turn * (centre + inward * (depth * grip.size)) - centre)
            };
            grip.masks.iter().zip(&grip.inward).flat_map(moved).collect()
        };
        // Along an arc, then in.
        for step in 1..=10 {
            let part = turn.powf(f64::from(step) / 10.0);
            path.advance(&goal(&[], &mask_q(&part, 0.0)), &LOOSE).unwrap();
        }
        let found = path.advance(&goal(&[], &mask_q(turn, 0.05)), &Wish::EXACT).unwrap();
        (path.displacement().to_vec(), found.mask_forces)
    };
    let turn = Rotation3::new(Vector3::new(0.3, 1.0, -0.2).normalize() * 1.5);
    let (plain, forces) = squeezed(&Rotation3::identity());
    let (turned, turned_forces) = squeezed(&turn);
    for (n, place) in model.mesh().vertices().iter().enumerate() {
        let u = Vector3::from_column_slice(&plain[3 * n..3 * n + 3]);
        let expected = turn * (place.coords + u) - place.coords;
        let found = Vector3::from_column_slice(&turned[3 * n..3 * n + 3]);
        assert!((found - expected).norm() < 1e-9 * grip.size, "node {n}: {found} {expected}");
    }
    for (f, g) in forces.chunks(3).zip(turned_forces.chunks(3)) {
        let expected = turn * Vector3::from_column_slice(f);
        assert!((expected - Vector3::from_column_slice(g)).norm() < 1e-8 * amax(&forces));
    }
}

#[test]
fn a_goal_without_equilibrium_is_refused_and_leaves_no_trace() {
    let model = model(BuiltIn::Strawberry, 300, 0.3, Element::Tet4);
    let grip = Grip::of(&model);
    let new = || path(&model, model.hold(&[], grip.masks.clone(), None).unwrap(), true);
    let (mut tried, mut plain) = (new(), new());
    for path in [&mut tried, &mut plain] {
        path.advance(&goal(&[], &grip.pressed(0.03)), &LOOSE).unwrap();
    }
    let before = tried.displacement().to_vec();
    // All tips beyond the middle: the body would have to pass through itself.
    let refused = tried.advance(&goal(&[], &grip.pressed(0.9)), &LOOSE).unwrap_err();
    assert!(refused.to_string().starts_with("no equilibrium found"), "{refused}");
    assert_eq!(tried.displacement(), before);
    for share in [0.035, 0.05] {
        for path in [&mut tried, &mut plain] {
            path.advance(&goal(&[], &grip.pressed(share)), &LOOSE).unwrap();
        }
        assert_eq!(tried.displacement(), plain.displacement(), "as if nobody had asked");
    }
    let nan = tried.advance(&goal(&[], &[f64::NAN; 15]), &LOOSE).unwrap_err();
    assert!(matches!(nan, NoEquilibrium::NotFinite | NoEquilibrium::InsideOut { .. }), "{nan}");
    assert!(tried.displacement().iter().all(|u| u.is_finite()));
}

#[test]
fn paths_have_the_same_bits_on_any_number_of_threads() {
    let model = model(BuiltIn::Strawberry, 300, 0.4, Element::Tet4);
    let grip = Grip::of(&model);
    let on = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let mut path = path(&model, model.hold(&[], grip.masks.clone(), None).unwrap(), true);
            for share in [0.01, 0.03, 0.05] {
                path.advance(&goal(&[], &grip.pressed(share)), &LOOSE).unwrap();
            }
            path.displacement().to_vec()
        })
    };
    let one = on(1);
    assert!(one == on(2) && one == on(4));
}

#[test]
fn dead_loads_are_carried_and_small_ones_linearly() {
    let model = model(BuiltIn::Cube, 64, 0.3, Element::Tet4);
    let mesh = model.mesh();
    let low = mesh.bounds().0.x;
    let fixed = (0..mesh.node_count()).filter(|&n| mesh.vertices()[n].x < low + 1e-9);
    let known: Vec<u32> = fixed.flat_map(|n| (0..3).map(move |a| 3 * n as u32 + a)).collect();
    let zeros = vec![0.0; known.len()];
    let mut forces = vec![0.0; 3 * mesh.node_count()];
    let high = mesh.bounds().1.x;
    for n in (0..mesh.node_count()).filter(|&n| mesh.vertices()[n].x > high - 1e-9) {
        forces[3 * n + 2] = 0.4;
    }
    let loaded = |scale: f64| {
        let forces: Vec<f64> = forces.iter().map(|f| scale * f).collect();
        let mut path = path(&model, model.hold(&known, vec![], None).unwrap(), false);
        let goal = Goal { q_known: &zeros, mask_q: &[], forces: &forces };
        let found = path.advance(&goal, &Wish::EXACT).unwrap();
        let sum: f64 = found.reactions.iter().skip(2).step_by(3).sum();
        let applied: f64 = forces.iter().sum();
        assert!((sum + applied).abs() < 1e-9 * applied.abs(), "{sum} {applied}");
        path.displacement().to_vec()
    };
    let (small, full) = (loaded(1e-5), loaded(1.0));
    let linear: Vec<f64> = {
        use crate::solve::{Loads, Method};
        let factored = model.factor(&known, Method::Front, &mut |_| {}).unwrap();
        let loads = Loads { q_known: &zeros, forces: &forces, residual_rel: 0.0 };
        factored.solve(model.stiffness(), loads, &mut |_| {}).unwrap().displacement
    };
    let scaled: Vec<f64> = small.iter().map(|u| 1e5 * u).collect();
    assert!(off(&scaled, &linear) < 1e-4, "{:e}", off(&scaled, &linear));
    assert!(off(&full, &linear) > 1e-2, "the load is large enough to tell the two apart");
}

/// Forces of a body that is moved rigidly are rounding: nothing to divide a residual by.
#[test]
fn a_body_led_by_a_face_follows_without_force() {
    for element in Element::ALL {
        let model = model(BuiltIn::Cube, 27, 0.3, element);
        let mesh = model.mesh();
        let low = mesh.bounds().0.x;
        let face = (0..mesh.node_count()).filter(|&n| mesh.vertices()[n].x < low + 1e-9);
        let face: Vec<usize> = face.collect();
        for angle in [0.0, 0.02] {
            let turn = Rotation3::new(Vector3::z() * angle);
            let to = |n: usize| {
                let place = mesh.vertices()[n].coords;
                turn * place + Vector3::new(0.1, 0.2, 0.3) - place
            };
            let pairs = face
                .iter()
                .flat_map(|&n| (0..3).map(move |axis| (3 * n as u32 + axis as u32, to(n)[axis])));
            let known = model.known(pairs.collect()).unwrap();
            let mut path = path(&model, model.hold(&known.dofs, vec![], None).unwrap(), false);
            let found = path.advance(&goal(&known.q_known, &[]), &Wish::EXACT).unwrap();
            assert!(found.settled, "{element:?}: {:e}", found.residual_rel);
            for n in 0..mesh.node_count() {
                let u = Vector3::from_column_slice(&path.displacement()[3 * n..3 * n + 3]);
                assert!((u - to(n)).norm() < 1e-9, "{element:?} {angle}: {u} {}", to(n));
            }
        }
    }
}

/// One force in one motion, on a slender bar: what is answered is in balance, or nothing is.
#[test]
fn many_pieces_of_a_motion_are_not_taken_for_an_answer() {
    let size = |cells: usize| cells as f64;
    let (long, wide) = (40usize, 1usize);
    let at = |i: usize, j: usize, k: usize| (i * (wide + 1) + j) * (wide + 1) + k;
    let mut vertices = Vec::new();
    for i in 0..=long {
        for j in 0..=wide {
            for k in 0..=wide {
                vertices.push(nalgebra::Point3::new(size(i), size(j), size(k)));
            }
        }
    }
    let mut tets = Vec::new();
    for i in 0..long {
        let corner = |c: usize| at(i + (c & 1), (c >> 1) & 1, (c >> 2) & 1) as u32;
        for [a, b] in [[1, 3], [3, 2], [2, 6], [6, 4], [4, 5], [5, 1]] {
            let tet = [corner(0), corner(a), corner(b), corner(7)];
            let places = tet.map(|n| vertices[n as usize]);
            let is_positive = crate::mesh::signed_volume(&places) > 0.0;
            tets.push(if is_positive { tet } else { [tet[0], tet[1], tet[3], tet[2]] });
        }
    }
    let mesh = crate::mesh::TetMesh::try_new(vertices, tets, vec![]).unwrap();
    let material = Material::try_new(1.0e7, 0.0).unwrap();
    let model = Model::try_new(mesh, Element::Tet10, &[material], vec![], &mut |_| {}).unwrap();
    let known: Vec<u32> = (0..12).collect();
    let mut forces = vec![0.0; 3 * model.system_node_count()];
    let tip = model.mesh().node_count() - 1;
    forces[3 * tip + 2] = 2.0e3;
    let zeros = vec![0.0; known.len()];
    let tip_of = |error_rel: Option<f64>| {
        let mut path = path(&model, model.hold(&known, vec![], None).unwrap(), false);
        let goal = Goal { q_known: &zeros, mask_q: &[], forces: &forces };
        let found = path.advance(&goal, &Wish { error_rel, ..Wish::EXACT }).unwrap();
        let at = 3 * tip;
        (Vector3::from_column_slice(&path.displacement()[at..at + 3]), found)
    };
    let (exact, found) = tip_of(None);
    assert!(found.settled && exact.norm() > 10.0, "{exact} {:e}", found.residual_rel);
    let (loose, found) = tip_of(Some(1e-4));
    let off = (loose - exact).norm() / exact.norm();
    assert!(off < 2e-3, "{off:e}, estimated {:e}", found.error_estimate_rel);
}

/// At rest nothing is left to divide an error by.
#[test]
fn a_hand_that_goes_back_to_where_it_began_is_answered() {
    let model = model(BuiltIn::Strawberry, 300, 0.4, Element::Tet4);
    let grip = Grip::of(&model);
    let mut path = path(&model, model.hold(&[], grip.masks.clone(), None).unwrap(), true);
    for frame in (1..=20).chain((0..20).rev()).chain([0, 0, 1, 2, 0]) {
        let pressed = grip.pressed(0.08 * f64::from(frame) / 20.0);
        let found = path.advance(&goal(&[], &pressed), &LOOSE).unwrap();
        assert!(found.error_estimate_rel <= 2e-3, "{frame}: {found:?}");
        if let Some(renewal) = path.renewal() {
            path.install(renewal.make(), 1);
        }
    }
    assert!(amax(path.displacement()) < 1e-4 * grip.size, "it is back");
}

#[test]
fn masks_that_say_the_same_are_refused() {
    let model = model(BuiltIn::Cube, 64, 0.3, Element::Tet4);
    let mask = Mask::try_new(vec![(0, 1.0), (1, 1.0), (5, 2.0)]).unwrap();
    let others = [21, 42, 63].map(Mask::of_node);
    let masks: Vec<Mask> = others.into_iter().chain([mask.clone(), mask]).collect();
    let Err(error) = model.hold(&[], masks, None) else { panic!("the last mask says nothing new") };
    assert!(error.to_string().contains("mask 4"), "{error}");
    let Err(error) = model.hold(&[], vec![Mask::of_node(3)], None) else { panic!("free to turn") };
    assert!(matches!(error, crate::model::ModelError::Free(_)));
}

#[test]
fn late_answers_say_how_far_they_are_from_what_was_asked() {
    let model = model(BuiltIn::Strawberry, 300, 0.4, Element::Tet4);
    let grip = Grip::of(&model);
    let mut late = path(&model, model.hold(&[], grip.masks.clone(), None).unwrap(), true);
    let wish = Wish { error_rel: Some(1e-6), is_late: &|| true, ..Wish::EXACT };
    let pressed = grip.pressed(0.15);
    let found = late.advance(&goal(&[], &pressed), &wish).unwrap();
    let mut exact = path(&model, model.hold(&[], grip.masks.clone(), None).unwrap(), true);
    exact.advance(&goal(&[], &pressed), &Wish::EXACT).unwrap();
    let error = off(late.displacement(), exact.displacement());
    assert!(found.error_estimate_rel > 1e-6 && error > 1e-6, "it was stopped");
    assert!(error < 10.0 * found.error_estimate_rel, "{error:e} {:e}", found.error_estimate_rel);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(12))]
    #[test]
    fn estimates_are_of_the_size_of_the_error(share in 0.01..0.09f64, tolerance in -6.0..-2.0f64,
                                              turn in -0.3..0.3f64) {
        let model = model(BuiltIn::Strawberry, 200, 0.42, Element::Tet4);
        let grip = Grip::of(&model);
        let mut mask_q = grip.pressed(share);
        mask_q[1] += turn * share * grip.size;
        let hold = || model.hold(&[], grip.masks.clone(), None).unwrap();
        let mut exact = path(&model, hold(), false);
        exact.advance(&goal(&[], &mask_q), &Wish::EXACT).unwrap();
        let tolerance = 10f64.powf(tolerance);
        let wish = Wish { error_rel: Some(tolerance), ..LOOSE };
        let mut loose = path(&model, hold(), true);
        let found = loose.advance(&goal(&[], &mask_q), &wish).unwrap();
        let error = off(loose.displacement(), exact.displacement());
        prop_assert!(found.error_estimate_rel <= tolerance);
        prop_assert!(error < 5.0 * found.error_estimate_rel.max(1e-12),
                     "{error:e} {:e}", found.error_estimate_rel);
    }
}
