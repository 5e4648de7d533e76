//! The crate as others use it: one solve, frames and large deformation by [`SoftBody`], against closed
//! forms and against each other; and what cannot be asked.

#![allow(clippy::unwrap_used, reason = "a test fails where it unwraps")]

use nalgebra::{Point3, Vector3};
use softgrasp_core::mesh::{BuiltIn, Surface, TetMesh, generate};
use softgrasp_core::{Answer, Axis, Inexactness, Law, LoadCase, Material, SoftBody};

const YOUNG: f64 = 2.0e4;
const POISSON: f64 = 0.3;

fn body(mesh: &TetMesh) -> SoftBody {
    SoftBody::try_new(mesh.clone(), Material::try_new(YOUNG, POISSON).unwrap()).unwrap()
}

fn cube(nodes: usize) -> TetMesh {
    generate(BuiltIn::Cube, nodes).unwrap()
}

fn nodes_where(mesh: &TetMesh, is_there: impl Fn(&Point3<f64>) -> bool) -> Vec<u32> {
    (0u32..).zip(mesh.vertices()).filter(|(_, p)| is_there(p)).map(|(node, _)| node).collect()
}

/// The upper face is drawn up and slides freely, as the lower one does: uniaxial tension.
fn tension(mesh: &TetMesh, strain: f64) -> LoadCase {
    let (low, high) = mesh.bounds();
    let mut pull = LoadCase::new();
    for node in nodes_where(mesh, |p| p.z < low.z + 1e-9) {
        pull.prescribe_along(node, Axis::Z, 0.0);
    }
    for node in nodes_where(mesh, |p| p.z > high.z - 1e-9) {
        pull.prescribe_along(node, Axis::Z, strain * (high.z - low.z));
    }
    // One corner stays, and its neighbour along x may not turn about z.
    let corner =
        |x: f64| nodes_where(mesh, |p| (p - Point3::new(x, low.y, low.z)).norm() < 1e-9)[0];
    pull.hold([corner(low.x)]);
    pull.prescribe_along(corner(high.x), Axis::Y, 0.0);
    pull
}

#[test]
fn tension_of_a_block_is_the_linear_field_with_the_force_of_youngs_modulus() {
    let mesh = cube(125);
    let (low, high) = mesh.bounds();
    let strain = 0.01;
    let answer = body(&mesh).solve(&tension(&mesh, strain)).unwrap();
    for (u, place) in answer.displacements.iter().zip(mesh.vertices()) {
        let from_corner = place - low;
        let across = -POISSON * strain;
        let expected =
            Vector3::new(across * from_corner.x, across * from_corner.y, strain * from_corner.z);
        assert!((u - expected).norm() < 1e-12, "{place}: {u} and not {expected}");
    }
    let section = (high.x - low.x) * (high.y - low.y);
    let pulled: f64 = answer.reactions.values().map(|force| force.z.max(0.0)).sum();
    assert!((pulled / (YOUNG * strain * section) - 1.0).abs() < 1e-9, "{pulled} N");
    assert!(matches!(answer.inexactness, Inexactness::Estimated(error) if error < 1e-9));
}

#[test]
fn frames_give_what_one_solve_gives_within_their_proven_error() {
    let mesh = generate(BuiltIn::Strawberry, 300).unwrap();
    let tips = [0u32, 40, 90, 200];
    let body = body(&mesh);
    let mut frames = body.frames().unwrap();
    for step in 1..=3 {
        let mut squeeze = LoadCase::new();
        for (tip, along) in
            tips.iter().zip([Vector3::x(), -Vector3::x(), Vector3::y(), -Vector3::z()])
        {
            squeeze.prescribe(*tip, 1e-3 * f64::from(step) * along);
        }
        // The contacts change once.
        if step == 3 {
            squeeze.prescribe(150, Vector3::zeros());
        }
        let frame = frames.answer(&squeeze).unwrap();
        let once = body.solve(&squeeze).unwrap();
        let Inexactness::Proven(bound) = frame.inexactness else { panic!("{frame:?}") };
        let pairs = || frame.displacements.iter().zip(&once.displacements);
        let off = pairs().map(|(a, b)| (a - b).norm_squared()).sum::<f64>().sqrt();
        let size = pairs().map(|(_, b)| b.norm_squared()).sum::<f64>().sqrt();
        assert!(off <= (bound + 1e-9) * size, "{off} of {size}, bound {bound}");
        for (node, force) in &once.reactions {
            assert!((frame.reactions[node] - force).norm() < 1e-6 * force.norm(), "node {node}");
        }
    }
}

#[test]
fn large_deformation_comes_to_linear_elasticity_for_small_motions() {
    let mesh = cube(64);
    let body = body(&mesh);
    let [small, large] = [1e-5, 0.2].map(|strain| {
        let case = tension(&mesh, strain);
        let linear = body.solve(&case).unwrap();
        let large = body.equilibrium(&case, Law::NeoHookean).unwrap();
        assert!(large.answer.residual_rel < 1e-8, "{large:?}");
        let pulled = |answer: &softgrasp_core::Answer| -> f64 {
            answer.reactions.values().map(|force| force.z.max(0.0)).sum()
        };
        pulled(&large.answer) / pulled(&linear) - 1.0
    });
    assert!(small.abs() < 1e-4 && large.abs() > 1e-2, "{small} and {large}");
}

#[test]
fn force_on_a_free_node_moves_it_and_the_holds_carry_it() {
    let mesh = cube(125);
    let (low, high) = mesh.bounds();
    let top = nodes_where(&mesh, |p| p.z > high.z - 1e-9)[7];
    let mut case = LoadCase::new();
    case.hold(nodes_where(&mesh, |p| p.z < low.z + 1e-9));
    let force = Vector3::new(0.2, -0.1, -0.4);
    case.force(top, force);
    let answer = body(&mesh).solve(&case).unwrap();
    assert!(answer.displacements[top as usize].dot(&force) > 0.0);
    let carried: Vector3<f64> = answer.reactions.values().sum();
    assert!((carried + force).norm() < 1e-9, "{carried}");
}

#[test]
fn what_cannot_be_asked_is_refused_with_the_node() {
    let mesh = cube(27);
    let body = body(&mesh);
    let refused = |case: &LoadCase| body.solve(case).unwrap_err().to_string();
    let held = |case: &mut LoadCase| {
        case.hold(0..9);
    };
    let mut case = LoadCase::new();
    assert!(refused(&case).contains("can still"), "{}", refused(&case));
    held(&mut case);
    case.force(3, Vector3::x());
    assert!(refused(&case).contains("node 3 (0-based) has a force"), "{}", refused(&case));
    for node in [27, u32::MAX] {
        let mut case = LoadCase::new();
        held(&mut case);
        case.force(node, Vector3::x());
        assert!(refused(&case).contains(&format!("node {node}")), "{}", refused(&case));
        let mut case = LoadCase::new();
        held(&mut case);
        case.prescribe(node, Vector3::x());
        assert!(refused(&case).contains("the mesh has 27 nodes"), "{}", refused(&case));
    }
    let mut case = LoadCase::new();
    held(&mut case);
    case.prescribe(20, Vector3::new(f64::NAN, 0.0, 0.0));
    assert!(body.solve(&case).is_err() && body.equilibrium(&case, Law::NeoHookean).is_err());
}

#[test]
fn frames_without_a_factor_give_what_frames_with_one_give_within_their_estimate() {
    let ball = generate(BuiltIn::Sphere, 900).unwrap();
    let body = SoftBody::try_new(ball, Material::try_new(2.0e4, 0.4).unwrap()).unwrap();
    let (mut by_factor, mut without) =
        (body.frames().unwrap(), body.frames_without_factor().unwrap());
    for tick in 1..4 {
        let mut squeeze = LoadCase::new();
        squeeze.prescribe(11, Vector3::new(-1e-4 * f64::from(tick), 0.0, 0.0));
        squeeze.prescribe(400, Vector3::new(0.0, 1e-4, 0.0));
        squeeze.hold([880]);
        let [exact, found] =
            [by_factor.answer(&squeeze).unwrap(), without.answer(&squeeze).unwrap()];
        let Inexactness::Estimated(estimate) = found.inexactness else { panic!("{found:?}") };
        let square = |v: &[Vector3<f64>]| v.iter().map(Vector3::norm_squared).sum::<f64>();
        let pairs = found.displacements.iter().zip(&exact.displacements);
        let apart: Vec<Vector3<f64>> = pairs.map(|(a, b)| a - b).collect();
        let off = (square(&apart) / square(&exact.displacements)).sqrt();
        assert!(off <= estimate && estimate < 1e-6, "off by {off:e}, estimated {estimate:e}");
    }
}

#[test]
fn frames_with_forces_weight_and_pressure_are_those_of_one_request() {
    let mesh = cube(125);
    let (low, high) = mesh.bounds();
    let at = |z: f64| nodes_where(&mesh, move |p| (p.z - z).abs() < 1e-9);
    let top = at(high.z);
    let on_top = |triangle: &[u32; 3]| triangle.iter().all(|node| top.contains(node));
    let lid: Vec<[u32; 3]> =
        Surface::from_mesh(&mesh).triangles.into_iter().filter(on_top).collect();
    let body = body(&mesh);
    let mut frames = body.frames().unwrap();
    for tick in 0..6 {
        let mut case = LoadCase::new();
        case.hold(at(low.z));
        // The same loads twice, then others; held otherwise, then as before.
        if tick != 3 {
            case.prescribe(top[0], Vector3::new(1e-3, 0.0, 1e-4 * f64::from(tick)));
        }
        case.weight(&[1000.0], Vector3::new(0.0, f64::from(tick / 2), -9.81));
        case.pressure(&lid, 200.0).force(top[7], Vector3::new(0.01, 0.0, -0.02));
        let (frame, once) = (frames.answer(&case).unwrap(), body.solve(&case).unwrap());
        let Inexactness::Proven(bound) = frame.inexactness else { panic!("{frame:?}") };
        let of =
            |answer: &Answer| answer.displacements.iter().map(|u| u.norm_squared()).sum::<f64>();
        let size = of(&once).sqrt();
        let pairs = frame.displacements.iter().zip(&once.displacements);
        let apart = pairs.map(|(a, b)| (a - b).norm_squared()).sum::<f64>().sqrt();
        assert!(apart <= bound * size && bound < 1e-6, "{apart:e}, bound {bound:e} of {size:e}");
        let carried: Vector3<f64> = frame.reactions.values().sum();
        let held: Vector3<f64> = once.reactions.values().sum();
        assert!((carried - held).norm() < 1e-9 * held.norm(), "{carried} and {held}");
    }
}

#[test]
fn force_that_is_no_number_is_refused() {
    let mesh = cube(27);
    let body = body(&mesh);
    let mut case = LoadCase::new();
    case.hold(0..9);
    for value in [f64::NAN, f64::INFINITY] {
        case.force(20, Vector3::new(value, 0.0, 0.0));
        assert!(body.solve(&case).is_err(), "{value}");
        assert!(body.equilibrium(&case, Law::NeoHookean).is_err(), "{value}");
    }
}
