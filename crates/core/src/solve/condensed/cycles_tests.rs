//! Tests of columns by conjugate gradients, where memory is too short for a factor: against a direct factor,
//! with the estimate of their error.

use std::sync::Arc;

use nalgebra::{Point3, Vector3};
use proptest::prelude::*;

use super::tests::{Shape, cube, pushes, touched};
use super::*;
use crate::fem::{AXES, SpreadLoads};
use crate::mesh::{Bodies, BuiltIn, TetMesh, generate};
use crate::mesh_io::parse;
use crate::mesh_io::tests::real_files::shared_meshes;
use crate::solve::memory::hierarchy_bytes;
use crate::solve::vectors::{norm, subtract};
use crate::solve::{RigidBodies, find_free_motion};

impl Shape {
    fn by_cycles(mesh: TetMesh, poisson: f64, fixed: &[u32]) -> Self {
        let shape = Self::with(mesh, poisson, |body| Base::without_factor(body, fixed)).unwrap();
        assert!(!shape.base.has_factor());
        shape
    }

    fn within(mesh: TetMesh, limit: u64) -> Result<Self, CondensedError> {
        Self::with(mesh, 0.3, |body| Base::try_new(body, &[], Some(limit), &mut |_| {}))
    }

    /// The answer is near that of a direct factor, and its estimate covers the difference.
    fn check_estimate(&self, dofs: &[u32], q: &[f64], what: &str) {
        let (u, lambda, certificate) = self.answer(dofs, q);
        let (expected, reaction) = self.direct(dofs, q);
        let error = relative_error(&u, &expected);
        let estimate = certificate.error_estimate_rel.expect("an estimate");
        assert!(error <= estimate + ROUNDING, "{what}: off by {error:e}, estimated {estimate:e}");
        assert!(estimate < 1e-5, "{what}: an estimate of {estimate:e} for {error:e} is of no use");
        let forces = norm(&subtract(&lambda, &reaction)) / norm(&reaction);
        assert!(forces < 1e-6, "{what}: reactions differ by {forces:e}");
        assert!(certificate.error_bound_rel.unwrap_err().contains("no bound is proven"));
    }
}

/// What rounding of an answer itself costs.
const ROUNDING: f64 = 1e-13;

fn relative_error(u: &[f64], expected: &[f64]) -> f64 {
    norm(&subtract(u, expected)) / norm(expected)
}

/// Nodes far apart, spread over the numbers of a mesh.
fn spread_nodes(mesh: &TetMesh, count: usize, from: usize) -> Vec<u32> {
    let used = mesh.used_nodes();
    let nodes: Vec<u32> = (0u32..).zip(&used).filter(|(_, used)| **used).map(|(n, _)| n).collect();
    let mut some: Vec<u32> =
        (0..count).map(|k| nodes[(from + k * nodes.len() / count) % nodes.len()]).collect();
    some.sort_unstable();
    some.dedup();
    some
}

#[test]
fn frames_without_a_factor_equal_the_direct_factor_within_their_estimate() {
    for (shape, poisson) in [
        (BuiltIn::Cube, 0.3),
        (BuiltIn::Sphere, 0.45),
        (BuiltIn::Strawberry, 0.3),
        (BuiltIn::Toothpaste, 0.4),
    ] {
        let mesh = generate(shape, 2000).unwrap();
        let nodes = spread_nodes(&mesh, 5, 3);
        let shape_of = Shape::by_cycles(mesh, poisson, &[]);
        let dofs = touched(&nodes);
        shape_of.check_estimate(&dofs, &pushes(dofs.len()), &shape.to_string());
    }
}

#[test]
fn bodies_that_the_scene_holds_and_several_bodies_equal_the_direct_factor() {
    let held = Shape::by_cycles(cube(2197), 0.3, &touched(&[0, 1, 13, 14, 169, 170]));
    assert!(held.base.is_held_by_scene());
    held.check_estimate(&touched(&[2000, 2196]), &pushes(6), "held by the scene");

    let one = cube(1000);
    let moved = one.vertices().iter().map(|p| p + Vector3::new(0.2, 0.01, 0.0));
    let vertices: Vec<Point3<f64>> = one.vertices().iter().copied().chain(moved).collect();
    let tets = one.tets().iter().copied().chain(one.tets().iter().map(|t| t.map(|n| n + 1000)));
    let two =
        Shape::by_cycles(TetMesh::try_new(vertices, tets.collect(), vec![]).unwrap(), 0.3, &[]);
    assert_eq!(two.base.modes.len(), 12);
    let mut of_base: Vec<u32> = two.base.held.iter().map(|d| d / AXES as u32).collect();
    of_base.dedup();
    let dofs = touched(&[0, 9, 990, 755, 1000, 1009, 1990, 1500]);
    two.check_estimate(&dofs, &pushes(dofs.len()), "two bodies");
    let dofs = touched(&of_base);
    two.check_estimate(&dofs, &pushes(dofs.len()), "the nodes of the base itself");
}

#[test]
fn foreign_meshes_without_a_factor_equal_the_direct_factor_within_their_estimate() {
    let Some(folder) = shared_meshes() else { return };
    let mut seen = 0;
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        let name = path.file_name().unwrap().to_string_lossy().into_owned();
        let Ok(bytes) = std::fs::read(&path) else { continue };
        let Ok(read) = parse(&name, &bytes, &mut |_| None) else { continue };
        let mesh = read.mesh.without_mid_edge_nodes();
        let size = mesh.used_nodes().iter().filter(|used| **used).count();
        if !(1000..6000).contains(&size) || Bodies::from_mesh(&mesh).count() > 1 {
            continue;
        }
        let nodes = spread_nodes(&mesh, 5, 11);
        let shape = Shape::by_cycles(mesh, 0.35, &[]);
        let dofs = touched(&nodes);
        shape.check_estimate(&dofs, &pushes(dofs.len()), &name);
        seen += 1;
    }
    assert!(seen > 0, "no mesh of a fitting size");
}

#[test]
fn loads_beside_contacts_without_a_factor_equal_those_by_a_factor() {
    let mesh = generate(BuiltIn::Sphere, 2000).unwrap();
    let weight = SpreadLoads::new(&mesh, None).weight(&[800.0], -9.81 * Vector3::z()).unwrap();
    let dofs = touched(&spread_nodes(&mesh, 3, 0));
    let q = pushes(dofs.len());
    let answers = [Shape::new(mesh.clone(), 0.3, &[]), Shape::by_cycles(mesh, 0.3, &[])].map(|s| {
        let touched = Touched::of_dofs(&dofs);
        let set = Arc::new(ContactSet::try_new(&s.base, &s.columns, &touched).unwrap());
        let column = Arc::new(LoadColumn::try_new(&s.base, &weight).unwrap());
        let loaded = LoadedSet::new(&s.base, set, vec![UnitLoad::Forces(column)]);
        let answer = loaded.solve(&q, &[1.0]).unwrap();
        let certificate = loaded.certify(&s.base, &q, &answer, &[], Delivery::Double);
        (loaded.full_displacement(&s.base, &answer), certificate.error_estimate_rel)
    });
    let [(by_factor, none), (by_cycles, estimate)] = answers;
    let error = relative_error(&by_cycles, &by_factor);
    assert_eq!(none, None);
    assert!(error <= estimate.unwrap() && error < 1e-7, "{error:e}, {estimate:?}");
}

#[test]
fn columns_without_a_factor_have_the_same_bits_beside_any_others_and_on_any_threads() {
    let contacts: Vec<Contact> = [5, 700, 1500].map(Contact::Node).to_vec();
    let bits = |threads: usize, asked: &[Contact]| -> Vec<u64> {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let shape = Shape::by_cycles(cube(2197), 0.3, &[]);
            let columns = shape.columns.of_contacts(&shape.base, asked).unwrap();
            let last = columns.last().unwrap();
            last.fields.iter().flatten().map(|u| u.to_bits()).collect()
        })
    };
    let alone = bits(1, &contacts[2..]);
    assert!(alone == bits(2, &contacts) && alone == bits(4, &contacts[1..]));
}

#[test]
fn factor_in_either_precision_comes_first_then_multigrid_then_the_refusal_with_its_bytes() {
    let mesh = generate(BuiltIn::Sphere, 8000).unwrap();
    let needed_within = |limit: u64| match Shape::within(mesh.clone(), limit) {
        Err(CondensedError::OverLimit { needed, limit: told }) => {
            assert_eq!(told, limit);
            Err(needed)
        }
        Err(error) => panic!("{error}"),
        Ok(shape) => Ok(shape.base.has_factor()),
    };
    let blocks = crate::fem::StiffnessPattern::new(&mesh).block_count();
    let hierarchy = hierarchy_bytes(mesh.node_count(), blocks) as u64;
    let double = needed_within(hierarchy - 1).unwrap_err();
    assert!(double > 2 * hierarchy, "{double} bytes for a factor, {hierarchy} for a hierarchy");
    assert_eq!(needed_within(hierarchy), Ok(false));
    // A factor in single precision fits: the model is answered by that.
    let double = needed_within(double - double / 4).unwrap_err();
    assert_eq!(needed_within(double - 1), Err(double));
    assert_eq!(needed_within(double), Ok(true));
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(12))]
    /// Any material, any nodes that hold the body, any motions: the estimate covers what is off.
    #[test]
    fn random_frames_without_a_factor_are_within_their_estimate(
        poisson in 0.0..0.45f64,
        count in 3..7usize,
        from in 0..1500usize,
        amount in 0.1..10.0f64,
        kind in 0..4usize,
    ) {
        let mesh = generate(BuiltIn::ALL[kind], 1500).unwrap();
        let nodes = spread_nodes(&mesh, count, from);
        let dofs = touched(&nodes);
        let bodies = Bodies::from_mesh(&mesh);
        let rigid = RigidBodies::new(&mesh, &bodies);
        // Nodes in line leave a turn about them free, which is refused.
        prop_assume!(find_free_motion(&mesh, &bodies, &rigid, &dofs, &[]).is_none());
        let by_factor = Shape::new(mesh.clone(), poisson, &[]);
        let shape = Shape::by_cycles(mesh, poisson, &[]);
        let q: Vec<f64> = pushes(dofs.len()).iter().map(|q| amount * q).collect();
        shape.check_estimate(&dofs, &q, "random");
        let (u, _, certificate) = shape.answer(&dofs, &q);
        let (expected, _, _) = by_factor.answer(&dofs, &q);
        let error = relative_error(&u, &expected);
        let estimate = certificate.error_estimate_rel.unwrap();
        prop_assert!(error <= estimate + ROUNDING, "off by {error:e}, estimated {estimate:e}");
    }
}
