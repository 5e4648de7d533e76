//! Tests of all methods on one small mesh: patch test, agreement, threads, odd partitions.

use std::sync::Arc;

use nalgebra::{Matrix3, Point3, Vector3};

use super::block::Block;
use super::kernel::Kernel;
use super::*;
use crate::fem::{Material, Stiffness, StiffnessPattern, assemble};
use crate::mesh::TetMesh;
use crate::mesh::samples::of_cell;
use crate::solve::front::{FrontAnalysis, FrontFactor};
use crate::solve::k11::SparseK11;
use crate::solve::oracle::sparse::Analysis;
use crate::solve::{Method, Partition, ordering};

/// n³ nodes, six tetrahedra a cell, inner nodes moved irregularly.
fn irregular_cube(n: usize) -> TetMesh {
    let at = |i: usize, j: usize, k: usize| (i + n * (j + n * k)) as u32;
    let mut vertices = Vec::new();
    for (k, j, i) in (0..n).flat_map(|k| (0..n).flat_map(move |j| (0..n).map(move |i| (k, j, i)))) {
        let inner = [i, j, k].iter().all(|&c| c > 0 && c < n - 1);
        let wiggle =
            |s: f64| if inner { 0.15 * (s * (1.0 + at(i, j, k) as f64)).sin() } else { 0.0 };
        let p = [i as f64 + wiggle(1.3), j as f64 + wiggle(2.1), k as f64 + wiggle(3.7)];
        vertices.push(Point3::from(p) / (n - 1) as f64);
    }
    let mut tets = Vec::new();
    for (k, j, i) in
        (0..n - 1).flat_map(|k| (0..n - 1).flat_map(move |j| (0..n - 1).map(move |i| (k, j, i))))
    {
        tets.extend(of_cell([i, j, k], at, &vertices));
    }
    TetMesh::try_new(vertices, tets, vec![]).unwrap()
}

fn stiffness_of(mesh: &TetMesh, poisson: f64) -> Stiffness {
    assembled(mesh, 1.0e5, poisson)
}

fn assembled(mesh: &TetMesh, young: f64, poisson: f64) -> Stiffness {
    let pattern = Arc::new(StiffnessPattern::new(mesh));
    assemble(&pattern, mesh, &[Material::try_new(young, poisson).unwrap()]).unwrap()
}

fn solve_with(
    mesh: &TetMesh,
    stiffness: &Stiffness,
    method: Method,
    known: &[(u32, f64)],
    forces: &[f64],
) -> Solution {
    let dofs: Vec<u32> = known.iter().map(|k| k.0).collect();
    let q_known: Vec<f64> = known.iter().map(|k| k.1).collect();
    let partition = Partition::try_new(&mesh.used_nodes(), &dofs).unwrap();
    let factored = Factored::try_new(stiffness, partition, method, &mut |_| {}).unwrap();
    factored
        .solve(stiffness, Loads { q_known: &q_known, forces, residual_rel: 0.0 }, &mut |_| {})
        .unwrap()
}

/// Three corner nodes and two others, moved.
fn five_contacts(mesh: &TetMesh) -> Vec<(u32, f64)> {
    let last = mesh.node_count() as u32 - 1;
    let mut nodes = [0, 4, last / 2, last - 7, last];
    nodes.sort_unstable();
    nodes
        .iter()
        .flat_map(|&n| (0..3).map(move |a| (3 * n + a, 0.01 * f64::from(n + 2 * a).sin())))
        .collect()
}

#[test]
fn linear_field_on_the_boundary_is_reproduced_inside() {
    let mesh = irregular_cube(5);
    let stiffness = stiffness_of(&mesh, 0.3);
    let gradient = Matrix3::new(0.1, 0.2, -0.1, 0.05, -0.2, 0.3, 0.15, 0.1, 0.25);
    let field = |p: &Point3<f64>| gradient * p.coords + Vector3::new(0.3, -0.2, 0.1);
    let on_boundary = |p: &Point3<f64>| p.iter().any(|&c| c == 0.0 || c == 1.0);
    let mut known = Vec::new();
    for (node, p) in mesh.vertices().iter().enumerate().filter(|(_, p)| on_boundary(p)) {
        known.extend((0..3).map(|a| ((3 * node + a) as u32, field(p)[a])));
    }
    for method in Method::DIRECT {
        let solution = solve_with(&mesh, &stiffness, method, &known, &[]);
        for (node, p) in mesh.vertices().iter().enumerate() {
            for a in 0..3 {
                let error = (solution.displacement[3 * node + a] - field(p)[a]).abs();
                assert!(error <= 1e-12 * 0.6, "{method}: node {node} is off by {error:e}");
            }
        }
    }
}

#[test]
fn all_methods_agree_with_contacts_and_with_forces() {
    let mesh = irregular_cube(6);
    let stiffness = stiffness_of(&mesh, 0.45);
    let known = five_contacts(&mesh);
    let mut forces = vec![0.0; 3 * mesh.node_count()];
    forces[3 * 50 + 1] = 7.0;
    for forces in [&[][..], &forces] {
        let first = solve_with(&mesh, &stiffness, Method::GaussJordan, &known, forces);
        let largest = first.displacement.iter().fold(0.0f64, |m, x| m.max(x.abs()));
        for method in &Method::DIRECT[1..] {
            let other = solve_with(&mesh, &stiffness, *method, &known, forces);
            assert!(other.residual_rel < 1e-12, "{method}: residual {:e}", other.residual_rel);
            for (a, b) in first.displacement.iter().zip(&other.displacement) {
                assert!((a - b).abs() <= 1e-10 * largest, "{method}");
            }
            let push = first.reaction.iter().fold(0.0f64, |m, x| m.max(x.abs()));
            for (a, b) in first.reaction.iter().zip(&other.reaction) {
                assert!((a - b).abs() <= 1e-10 * push, "{method}");
            }
        }
    }
}

#[test]
fn reactions_balance_the_external_forces() {
    let mesh = irregular_cube(4);
    let stiffness = stiffness_of(&mesh, 0.3);
    let mut forces = vec![0.0; 3 * mesh.node_count()];
    forces[3 * 21] = 5.0;
    let solution =
        solve_with(&mesh, &stiffness, Method::SparseCholesky, &five_contacts(&mesh), &forces);
    let sum: f64 = solution.reaction.iter().step_by(3).sum();
    assert!((sum + 5.0).abs() < 1e-9, "reactions along x sum to {sum}");
}

#[test]
fn same_bits_for_one_two_four_and_seven_threads() {
    let mesh = irregular_cube(7);
    let known = five_contacts(&mesh);
    for method in Method::DIRECT {
        let answers: Vec<Vec<u64>> = [1, 2, 4, 7]
            .into_iter()
            .map(|threads| {
                let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
                let solution = pool.install(|| {
                    let stiffness = stiffness_of(&mesh, 0.3);
                    solve_with(&mesh, &stiffness, method, &known, &[])
                });
                solution
                    .displacement
                    .iter()
                    .chain(&solution.reaction)
                    .map(|x| x.to_bits())
                    .collect()
            })
            .collect();
        for other in &answers[1..] {
            assert!(other == &answers[0], "{method} depends on the number of threads");
        }
    }
}

#[test]
fn everything_known_leaves_nothing_to_solve() {
    let mesh = irregular_cube(2);
    let stiffness = stiffness_of(&mesh, 0.3);
    let known: Vec<(u32, f64)> = (0..24).map(|d| (d, 0.01 * f64::from(d))).collect();
    for method in Method::DIRECT {
        let solution = solve_with(&mesh, &stiffness, method, &known, &[]);
        assert_eq!(solution.residual_rel, 0.0);
        assert_eq!(solution.displacement[23], 0.23);
    }
}

#[test]
fn free_rigid_motion_never_gives_nan() {
    let mesh = irregular_cube(3);
    let stiffness = stiffness_of(&mesh, 0.3);
    for method in Method::DIRECT {
        let partition = Partition::try_new(&mesh.used_nodes(), &[0, 1, 2]).unwrap();
        // Rounding decides whether the last pivot is positive: an error or a finite answer.
        if let Ok(factored) = Factored::try_new(&stiffness, partition, method, &mut |_| {}) {
            let loads = Loads { q_known: &[0.1, 0.0, 0.0], ..Loads::default() };
            if let Ok(solution) = factored.solve(&stiffness, loads, &mut |_| {}) {
                assert!(solution.displacement.iter().all(|x| x.is_finite()));
            }
        }
    }
}

#[test]
fn nested_dissection_fills_less_than_the_natural_order() {
    let mesh = irregular_cube(10);
    let stiffness = stiffness_of(&mesh, 0.3);
    let partition = Partition::try_new(&mesh.used_nodes(), &[0, 1, 2]).unwrap();
    let fill = |order: Vec<usize>| {
        Analysis::new(SparseK11::new(&stiffness, &partition), order).ok().unwrap().fill()
    };
    let natural = fill((0..partition.unknown().len()).collect());
    let dissected = ordering::nested_dissection(&stiffness, &partition);
    let mut swapped = vec![0; dissected.len()];
    for (new, &old) in dissected.iter().enumerate() {
        swapped[old] = new;
    }
    // The inverse permutation is easy to pass by mistake and fills several times as much.
    assert!(3 * fill(dissected.clone()) < fill(swapped));
    assert!(fill(dissected) < natural);
}

/// A sheet a thousand times as wide as thick, clamped at one edge and bent at the other: harder than
/// single precision's seven digits. Its stiffness and known degrees of freedom, fixed ones first.
fn harder_than_single_precision() -> (TetMesh, Stiffness, Vec<u32>, Vec<f64>) {
    let cube = irregular_cube(5);
    let thin = cube.vertices().iter().map(|p| Point3::new(p.x, p.y, 1e-4 * p.z)).collect();
    let sheet = cube.with_vertices(thin).unwrap();
    let stiffness = stiffness_of(&sheet, 0.3);
    let at = |x: f64| (0..125u32).filter(move |n| f64::from(n % 5) / 4.0 == x);
    let dofs: Vec<u32> = at(0.0).chain(at(1.0).take(1)).flat_map(|n| 3 * n..3 * n + 3).collect();
    let mut dofs_sorted = dofs.clone();
    dofs_sorted.sort_unstable();
    let pushed = at(1.0).next().unwrap();
    let q_known = dofs_sorted.iter().map(|&d| if d == 3 * pushed + 2 { 0.01 } else { 0.0 });
    let q_known = q_known.collect();
    (sheet, stiffness, dofs_sorted, q_known)
}

#[test]
fn question_too_hard_for_single_precision_is_answered_in_double_and_says_so() {
    let (mesh, stiffness, dofs, q_known) = harder_than_single_precision();
    let loads = Loads { q_known: &q_known, ..Loads::default() };
    let of = |method: Method| {
        let partition = Partition::try_new(&mesh.used_nodes(), &dofs).unwrap();
        let factored = Factored::try_new(&stiffness, partition, method, &mut |_| {}).unwrap();
        factored.solve_for_certain(&stiffness, loads, &mut |_| {}).unwrap()
    };
    let (right, certainty) = of(Method::Front);
    assert!(!certainty.is_none() && right.fallback.is_none(), "{certainty:?}");
    for method in [Method::FrontMixed, Method::Pcg] {
        let (solution, certainty) = of(method);
        assert!(solution.fallback.is_some() && !certainty.is_none(), "{method} {certainty:?}");
        for (a, b) in solution.displacement.iter().zip(&right.displacement) {
            assert!((a - b).abs() <= 0.02 * certainty.error_rel, "{method}: {a:e} {b:e}");
        }
    }
}

#[test]
fn double_precision_is_not_taken_beyond_the_memory_limit() {
    let (mesh, stiffness, dofs, q_known) = harder_than_single_precision();
    let loads = Loads { q_known: &q_known, ..Loads::default() };
    let partition = Partition::try_new(&mesh.used_nodes(), &dofs).unwrap();
    let analysed = Analysed::new(&stiffness, partition, &mut |_| {});
    let limit = analysed.peak_bytes(Method::FrontMixed);
    match Factored::of_analysed(analysed, &stiffness, Method::FrontMixed.within(limit), &mut |_| {})
    {
        Err(SolveError::NotPositiveDefinite { .. }) => {}
        Err(other) => panic!("{other}"),
        Ok(factored) => {
            let solved = factored.solve_for_certain(&stiffness, loads, &mut |_| {});
            assert_eq!(factored.fallback(), None);
            assert!((factored.bytes() as u64) <= limit, "{solved:?}");
        }
    }
}

#[test]
fn pivot_lost_in_rounding_is_not_called_a_free_motion() {
    for method in Method::DIRECT {
        let error = SolveError::NotPositiveDefinite { method, node: 3, axis: 'z' };
        let text = error.to_string();
        assert!(text.contains("rounding") && !text.contains("free"), "{text}");
        let precision = if method.is_single() { "single precision" } else { "double precision" };
        assert!(text.contains(precision), "{text}");
    }
}

#[test]
fn several_loads_together_equal_each_of_them_alone() {
    let mesh = irregular_cube(6);
    let stiffness = stiffness_of(&mesh, 0.4);
    let known = five_contacts(&mesh);
    let dofs: Vec<u32> = known.iter().map(|k| k.0).collect();
    let displacements: Vec<Vec<f64>> = (0..27)
        .map(|case| known.iter().map(|(_, u)| u * (1.0 + f64::from(case)).cos()).collect())
        .collect();
    let mut pushed = vec![0.0; 3 * mesh.node_count()];
    pushed[3 * 100] = 5.0;
    assert!(!dofs.contains(&300));
    for method in [Method::Front, Method::FrontMixed, Method::SparseCholesky, Method::Pcg] {
        let partition = Partition::try_new(&mesh.used_nodes(), &dofs).unwrap();
        let factored = Factored::try_new(&stiffness, partition, method, &mut |_| {}).unwrap();
        // One of them is zero and one is pushed besides.
        let loads: Vec<Loads<'_>> = displacements
            .iter()
            .enumerate()
            .map(|(case, q_known)| match case {
                3 => Loads { q_known, forces: &pushed, residual_rel: 0.0 },
                _ => Loads { q_known, ..Loads::default() },
            })
            .collect();
        let together = factored.solve_several(&stiffness, &loads, &mut |_| {}).unwrap();
        assert_eq!(together.len(), loads.len());
        let pool = rayon::ThreadPoolBuilder::new().num_threads(3).build().unwrap();
        let again = pool.install(|| factored.solve_several(&stiffness, &loads, &mut |_| {}));
        assert_eq!(again.unwrap(), together, "{method:?}: bits depend on the number of threads");
        for (together, loads) in together.iter().zip(&loads) {
            let alone = factored.solve(&stiffness, *loads, &mut |_| {}).unwrap();
            let agree = |a: &[f64], b: &[f64]| {
                let largest = b.iter().fold(0.0f64, |m, x| m.max(x.abs()));
                a.iter().zip(b).all(|(a, b)| (a - b).abs() <= 1e-12 * largest)
            };
            assert!(agree(&together.displacement, &alone.displacement), "{method:?}");
            assert!(agree(&together.reaction, &alone.reaction), "{method:?}");
            assert!(together.residual_rel < 1e-13 && together.backward_error < 1e-13);
        }
    }
}

#[test]
fn several_loads_say_what_is_wrong_with_one_of_them() {
    let mesh = irregular_cube(4);
    let stiffness = stiffness_of(&mesh, 0.3);
    let known = five_contacts(&mesh);
    let dofs: Vec<u32> = known.iter().map(|k| k.0).collect();
    let partition = Partition::try_new(&mesh.used_nodes(), &dofs).unwrap();
    for method in [Method::Front, Method::FrontMixed] {
        let partition = partition.clone();
        let factored = Factored::try_new(&stiffness, partition, method, &mut |_| {}).unwrap();
        bad_loads_are_told(&factored, &stiffness, &known);
    }
}

fn bad_loads_are_told(factored: &Factored, stiffness: &Stiffness, known: &[(u32, f64)]) {
    let good: Vec<f64> = known.iter().map(|k| k.1).collect();
    let mut bad = good.clone();
    bad[2] = f64::NAN;
    let solve = |some: &[&[f64]]| {
        let loads: Vec<Loads<'_>> =
            some.iter().map(|q_known| Loads { q_known, ..Loads::default() }).collect();
        factored.solve_several(stiffness, &loads, &mut |_| {})
    };
    assert!(matches!(solve(&[&good, &bad]), Err(SolveError::NotFinite { .. })));
    assert!(matches!(solve(&[&good, &good[1..]]), Err(SolveError::LoadCount { .. })));
    assert_eq!(solve(&[]).unwrap(), vec![]);
    // Zeros are an answer.
    let zeros = vec![0.0; good.len()];
    let solutions = solve(&[&zeros, &good]).unwrap();
    assert!(solutions[0].displacement.iter().all(|q| *q == 0.0));
}

/// Plain refinement with the factor of a body a fifth stiffer takes a fifth of the error's share in
/// each step, twenty of them to 1e-13.
#[test]
fn conjugate_corrections_make_good_what_a_stiffer_factor_gets_wrong() {
    let mesh = irregular_cube(6);
    let (stiffness, stiffer) = (stiffness_of(&mesh, 0.4), assembled(&mesh, 1.2e5, 0.4));
    let known = five_contacts(&mesh);
    let dofs: Vec<u32> = known.iter().map(|k| k.0).collect();
    let partition = Partition::try_new(&mesh.used_nodes(), &dofs).unwrap();
    let analysis = Arc::new(FrontAnalysis::new(&stiffer, &partition));
    let kernel = Kernel::FrontSingle(FrontFactor::try_new(&analysis, &stiffer).unwrap());
    let q_known: Vec<f64> = known.iter().map(|k| k.1).collect();
    let turned: Vec<f64> = q_known.iter().rev().copied().collect();
    let loads = [&q_known, &turned].map(|q_known| Loads { q_known, ..Loads::default() });
    let system = solution::System {
        stiffness: &stiffness,
        partition: &partition,
        method: Method::FrontMixed,
        fallback: None,
    };
    for solution in Block::solve(system, &kernel, &loads) {
        let solution = solution.expect("corrections shrink");
        assert!(solution.residual_rel < 1e-13, "{}", solution.residual_rel);
        assert!(solution.refinement_steps <= 5, "{} corrections", solution.refinement_steps);
    }
}
