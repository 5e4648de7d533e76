//! Tests of ten-node elements on built-in objects and real meshes: threads, energies, methods.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use nalgebra::Vector3;

use super::fixtures::{at, irregular_cube, material, solve, stiffness_four, stiffness_ten};
use crate::fem::{QuadraticMesh, StiffnessPattern, assemble_quadratic, tet10};
use crate::mesh::{BuiltIn, TetMesh, generate};
use crate::mesh_io::{Companion, parse};
use crate::solve::Method;

/// The shared folder with real data, if this machine has it; says so when it has not.
fn shared() -> Option<PathBuf> {
    let named = std::env::var_os("SOFTGRASP_SHARED").map(PathBuf::from);
    let above = Path::new(env!("CARGO_MANIFEST_DIR")).ancestors().map(|dir| dir.join("shared"));
    let found = named.into_iter().chain(above).find(|dir| dir.join("meshes").is_dir());
    if found.is_none() {
        println!("skipped: no folder shared/meshes with real mesh files here");
    }
    found
}

fn read(folder: &Path, name: &str) -> TetMesh {
    let path = folder.join("meshes").join(name);
    let mut companion = |wanted: &Companion| match wanted {
        Companion::Extension(extension) => std::fs::read(path.with_extension(extension)).ok(),
        Companion::FileName(_) => None,
    };
    parse(name, &std::fs::read(&path).unwrap(), &mut companion).unwrap().mesh
}

/// Nodes and displacements of a `known.csv` whose rows are complete.
fn read_known(folder: &Path, case: &str) -> Vec<(usize, Vector3<f64>)> {
    let text = std::fs::read_to_string(folder.join("references").join(case).join("known.csv"));
    let row = |line: &str| {
        let cells: Vec<&str> = line.split(',').collect();
        let number = |i: usize| cells[i].parse::<f64>().unwrap();
        (cells[0].parse().unwrap(), Vector3::new(number(1), number(2), number(3)))
    };
    text.unwrap().lines().skip(1).map(row).collect()
}

/// Twice the energy stored, N m.
fn energy(reaction: &[f64], known: &[(usize, Vector3<f64>)]) -> f64 {
    let q = known.iter().flat_map(|k| <[f64; 3]>::from(k.1));
    reaction.iter().zip(q).map(|(f, q)| f * q).sum()
}

/// Answers the same question with both elements and returns their energies.
fn energies(mesh: &TetMesh, known: &[(usize, Vector3<f64>)], poisson: f64) -> (f64, f64) {
    let ten = QuadraticMesh::try_new(mesh).unwrap();
    let method = Method::SparseCholesky;
    let stiffness = stiffness_four(mesh, poisson);
    let four_answer = solve(&stiffness, &mesh.used_nodes(), known, &[], method);
    let stiffness = stiffness_ten(&ten, poisson);
    let ten_answer = solve(&stiffness, &ten.used_nodes(), known, &[], method);
    assert!(ten_answer.residual_rel < 1e-11, "residual {:e}", ten_answer.residual_rel);
    for (node, q) in known {
        assert_eq!(at(&ten_answer.displacement, *node), *q);
    }
    (energy(&four_answer.reaction, known), energy(&ten_answer.reaction, known))
}

/// Fields linear in each element are among those of ten nodes, and the answer is the field of
/// least energy.
#[test]
fn energy_on_built_in_objects_is_not_above_that_of_four_nodes() {
    for shape in [BuiltIn::Cube, BuiltIn::Sphere, BuiltIn::Strawberry, BuiltIn::Toothpaste] {
        let mesh = generate(shape, 200).unwrap();
        let last = mesh.node_count() - 1;
        let known: Vec<(usize, Vector3<f64>)> = [0, last / 3, last / 2, last]
            .map(|n| (n, Vector3::new(1e-3 * n as f64, 1e-3, -2e-5 * n as f64)))
            .to_vec();
        let (four, ten) = energies(&mesh, &known, 0.3);
        assert!(0.0 < ten && ten < four, "{shape:?}: {ten:e} against {four:e}");
    }
}

#[test]
fn energy_on_real_meshes_is_not_above_that_of_four_nodes() {
    let Some(folder) = shared() else { return };
    for name in ["liver.msh1.msh", "turtle.veg", "banana.vtk", "cylinder.medit.mesh"] {
        let mesh = read(&folder, name);
        for poisson in [0.3, 0.49] {
            let known = read_known(&folder, &format!("{name}-{poisson}"));
            let (four, ten) = energies(&mesh, &known, poisson);
            assert!(0.0 < ten && ten < four, "{name} ν = {poisson}: {ten:e} against {four:e}");
        }
    }
}

#[test]
fn rigid_motion_of_real_meshes_gives_zero_force() {
    let Some(folder) = shared() else { return };
    for name in ["liver.msh1.msh", "shark.binary22.msh", "hammer.v41.msh", "armadillo_4k.node"] {
        let mesh = QuadraticMesh::try_new(&read(&folder, name)).unwrap();
        let (turn, shift) = (Vector3::new(0.2, -0.1, 0.3), Vector3::new(1.0, 2.0, -3.0));
        let q: Vec<f64> = mesh
            .vertices()
            .iter()
            .flat_map(|p| <[f64; 3]>::from(shift + turn.cross(&p.coords)))
            .collect();
        let stiffness = stiffness_ten(&mesh, 0.3);
        let largest = q.iter().fold(0.0f64, |m, x| m.max(x.abs()));
        let force = stiffness.mul(&q).into_iter().fold(0.0f64, |m, x| m.max(x.abs()));
        assert!(force <= 1e-13 * stiffness.amax() * largest, "{name}: {force:e}");
    }
}

#[test]
fn assembly_by_rows_equals_the_sum_over_elements() {
    let linear = generate(BuiltIn::Sphere, 60).unwrap();
    let regions: Vec<u32> = (0..linear.tets().len() as u32).map(|t| t % 2).collect();
    let linear =
        TetMesh::try_new(linear.vertices().to_vec(), linear.tets().to_vec(), regions).unwrap();
    let mesh = QuadraticMesh::try_new(&linear).unwrap();
    let materials = [material(0.3), crate::fem::Material::try_new(7.0e6, 0.45).unwrap()];
    let pattern = Arc::new(StiffnessPattern::quadratic(&mesh));
    let stiffness = assemble_quadratic(&pattern, &mesh, &materials).unwrap();
    let q: Vec<f64> = (0..3 * mesh.node_count()).map(|d| (0.7 * d as f64).sin()).collect();
    let mut expected = vec![0.0; q.len()];
    for (t, nodes) in mesh.tets().iter().enumerate() {
        let k = tet10::element_stiffness(&mesh.corners(t), &materials[t % 2]);
        for i in 0..30 {
            for j in 0..30 {
                let column = 3 * nodes[j / 3] as usize + j % 3;
                expected[3 * nodes[i / 3] as usize + i % 3] += k[(i, j)] * q[column];
            }
        }
    }
    for (found, expected) in stiffness.mul(&q).into_iter().zip(expected) {
        assert!((found - expected).abs() <= 1e-13 * stiffness.amax());
    }
}

#[test]
fn stiffness_and_answer_have_the_same_bits_on_any_number_of_threads() {
    let linear = irregular_cube(4);
    let answer = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let mesh = QuadraticMesh::try_new(&linear).unwrap();
            let stiffness = stiffness_ten(&mesh, 0.3);
            let known: Vec<(usize, Vector3<f64>)> =
                [0, 4, 20, 124].map(|n| (n, Vector3::new(1e-3, 1e-4 * n as f64, 0.0))).to_vec();
            let solution =
                solve(&stiffness, &mesh.used_nodes(), &known, &[], Method::SparseCholesky);
            let strain =
                crate::fem::summarise_strain_quadratic(&mesh, &solution.displacement, &mut || {});
            let blocks: Vec<u64> = (0..stiffness.node_count())
                .flat_map(|n| stiffness.row(n).flat_map(|(_, b)| b.map(f64::to_bits)))
                .collect();
            (mesh, stiffness.pattern().clone(), blocks, solution, strain)
        })
    };
    let one = answer(1);
    for threads in [2, 4, 7] {
        assert!(answer(threads) == one, "{threads} threads");
    }
}

#[test]
fn all_methods_give_the_same_answer() {
    let mesh = QuadraticMesh::try_new(&generate(BuiltIn::Strawberry, 60).unwrap()).unwrap();
    let stiffness = stiffness_ten(&mesh, 0.3);
    let known: Vec<(usize, Vector3<f64>)> =
        [3, 30, 50].map(|n| (n, Vector3::new(1e-3, -1e-4 * n as f64, 2e-3))).to_vec();
    let answers = Method::DIRECT
        .map(|method| solve(&stiffness, &mesh.used_nodes(), &known, &[], method).displacement);
    let largest = answers[0].iter().fold(0.0f64, |m, x| m.max(x.abs()));
    for (method, answer) in Method::DIRECT.iter().zip(&answers) {
        for (a, b) in answer.iter().zip(&answers[0]) {
            assert!((a - b).abs() <= 1e-11 * largest, "{method}");
        }
    }
}

#[test]
#[should_panic(expected = "pattern is that of another element")]
fn pattern_of_four_nodes_is_not_taken_for_one_of_ten() {
    let linear = generate(BuiltIn::Cube, 27).unwrap();
    let mesh = QuadraticMesh::try_new(&linear).unwrap();
    let pattern = Arc::new(StiffnessPattern::new(&linear));
    let _ = assemble_quadratic(&pattern, &mesh, &[material(0.3)]);
}
