//! Tests of the factor on small irregular bodies: answers, bits, partial solves, hard input.

use std::sync::Arc;

use nalgebra::{DMatrix, Point3};
use proptest::prelude::*;

use super::*;
use crate::fem::{Material, Stiffness, StiffnessPattern, assemble};
use crate::mesh::TetMesh;
use crate::mesh::samples::of_cell;
use crate::solve::k11::{SparseK11, visit_k11};
use crate::solve::oracle::sparse::Analysis;
use crate::solve::{Partition, ordering};

/// Boxes of nodes side by side, not connected, six tetrahedra a cell, inner nodes moved; the
/// region of an element is its box.
fn boxes(sizes: &[[usize; 3]]) -> TetMesh {
    let (mut vertices, mut tets, mut regions) = (Vec::new(), Vec::new(), Vec::new());
    for (region, &[nx, ny, nz]) in sizes.iter().enumerate() {
        let base = vertices.len();
        let at = |i: usize, j: usize, k: usize| (base + i + nx * (j + ny * k)) as u32;
        let cells = |nx: usize, ny: usize, nz: usize| {
            (0..nx * ny * nz).map(move |c| [c % nx, c / nx % ny, c / nx / ny])
        };
        for [i, j, k] in cells(nx, ny, nz) {
            let wiggle = |s: f64| 0.12 * (s * (1.0 + f64::from(at(i, j, k)))).sin();
            let p = [i as f64 + wiggle(1.3), j as f64 + wiggle(2.1), k as f64 + wiggle(3.7)];
            vertices.push(Point3::new(p[0] + 100.0 * region as f64, p[1], p[2]));
        }
        for cell in cells(nx - 1, ny - 1, nz - 1) {
            tets.extend(of_cell(cell, at, &vertices));
            regions.extend([region as u32; 6]);
        }
    }
    TetMesh::try_new(vertices, tets, regions).unwrap()
}

fn stiffness_of(mesh: &TetMesh, young: &[f64]) -> Stiffness {
    let pattern = Arc::new(StiffnessPattern::new(mesh));
    let materials: Vec<Material> =
        young.iter().map(|&e| Material::try_new(e, 0.3).unwrap()).collect();
    assemble(&pattern, mesh, &materials).unwrap()
}

fn partition_of(mesh: &TetMesh, known: &[u32]) -> Partition {
    Partition::try_new(&mesh.used_nodes(), known).unwrap()
}

fn factor_of<T: FrontPrecision>(stiffness: &Stiffness, partition: &Partition) -> FrontFactor<T> {
    let analysis = Arc::new(FrontAnalysis::new(stiffness, partition));
    FrontFactor::try_new(&analysis, stiffness).unwrap()
}

/// Dense `K11`, the oracle.
fn dense_k11(stiffness: &Stiffness, partition: &Partition) -> DMatrix<f64> {
    let n = partition.unknown().len();
    let mut k11 = DMatrix::zeros(n, n);
    visit_k11(stiffness, partition, |i, j, value| k11[(i, j)] = value);
    k11
}

fn right_hand_sides(n: usize, columns: usize) -> Vec<f64> {
    (0..n * columns).map(|i| (i as f64 * 0.731).sin()).collect()
}

/// Largest `‖K11 x − b‖ / ‖b‖` of the columns.
fn residual(stiffness: &Stiffness, partition: &Partition, x: &[f64], b: &[f64]) -> f64 {
    let n = partition.unknown().len();
    let mut worst = 0.0f64;
    for (x, b) in x.chunks(n).zip(b.chunks(n)) {
        let mut difference = b.to_vec();
        visit_k11(stiffness, partition, |i, j, value| difference[i] -= value * x[j]);
        let norm = |v: &[f64]| v.iter().map(|a| a * a).sum::<f64>().sqrt();
        worst = worst.max(norm(&difference) / norm(b));
    }
    worst
}

fn bits(values: &[f64]) -> Vec<u64> {
    values.iter().map(|x| x.to_bits()).collect()
}

#[test]
fn solves_equal_the_dense_answer_on_several_bodies_with_partly_known_nodes() {
    let mesh = boxes(&[[5, 4, 4], [2, 2, 2], [3, 2, 6]]);
    let stiffness = stiffness_of(&mesh, &[1.0e5, 3.0, 7.0e6]);
    // Whole nodes, single axes, and a fully known body.
    let mut known: Vec<u32> = vec![0, 1, 2, 14, 36, 37, 40, 100, 235];
    known.extend(3 * 80..3 * 88);
    known.extend([264, 265, 266, 300, 301, 302, 330, 331, 332, 351]);
    let partition = partition_of(&mesh, &known);
    let factor = factor_of::<f64>(&stiffness, &partition);
    let n = partition.unknown().len();
    let dense = dense_k11(&stiffness, &partition).cholesky().unwrap();
    for columns in [1, 2, 7] {
        let b = right_hand_sides(n, columns);
        let mut x = b.clone();
        factor.solve_in_place(&mut x, columns);
        assert!(residual(&stiffness, &partition, &x, &b) < 1e-12);
        let expected = dense.solve(&DMatrix::from_column_slice(n, columns, &b));
        let largest = expected.amax();
        for (x, expected) in x.iter().zip(expected.iter()) {
            assert!((x - expected).abs() <= 1e-11 * largest);
        }
    }
}

#[test]
fn fill_is_close_to_that_of_an_exact_symbolic_factorisation() {
    let mesh = boxes(&[[11, 10, 9]]);
    let stiffness = stiffness_of(&mesh, &[1.0]);
    let partition = partition_of(&mesh, &[0, 1, 2, 30, 31, 32, 900]);
    let analysis = FrontAnalysis::new(&stiffness, &partition);
    let order: Vec<usize> = analysis.order.iter().map(|&row| row as usize).collect();
    // No merging at all, under the same order.
    let exact = exact_fill(&stiffness, &partition, &order);
    assert!(exact <= analysis.fill(), "some entry of the factor has no place");
    assert!(analysis.fill() < exact * 7 / 5, "{} against {exact}", analysis.fill());
    // faer merges too; the two must not be far apart.
    let order = ordering::nested_dissection(&stiffness, &partition);
    let faer = Analysis::new(SparseK11::new(&stiffness, &partition), order).ok().unwrap().fill();
    assert!(analysis.fill() < faer + faer / 4, "{} against faer {faer}", analysis.fill());
}

/// Entries of the factor by elimination on index sets.
fn exact_fill(stiffness: &Stiffness, partition: &Partition, order: &[usize]) -> usize {
    let n = order.len();
    let mut position = vec![0; n];
    for (new, &old) in order.iter().enumerate() {
        position[old] = new;
    }
    let mut columns = vec![std::collections::BTreeSet::new(); n];
    visit_k11(stiffness, partition, |i, j, _| {
        if position[i] > position[j] {
            columns[position[j]].insert(position[i]);
        }
    });
    let mut fill = n;
    for j in 0..n {
        let column = std::mem::take(&mut columns[j]);
        fill += column.len();
        if let Some(&parent) = column.first() {
            columns[parent].extend(column.range(parent + 1..));
        }
    }
    fill
}

#[test]
fn blocks_that_wait_at_once_stay_within_their_bound() {
    let mesh = boxes(&[[9, 9, 9], [1000, 2, 2]]);
    let stiffness = stiffness_of(&mesh, &[1.0, 1.0]);
    let analysis = FrontAnalysis::new(&stiffness, &partition_of(&mesh, &[0, 1, 2]));
    let block = |v: usize| analysis.fronts[v].block_slabs::<f64>();
    let (mut waiting, mut most) = (0, 0);
    for (v, front) in analysis.fronts.iter().enumerate() {
        let children = || front.children.iter().map(|&c| block(c as usize));
        waiting -= children().map(|child| child.eliminated_len()).sum::<usize>();
        waiting += block(v).len();
        most = most.max(waiting);
        waiting -= children().map(|child| child.passed_on_len()).sum::<usize>();
    }
    assert_eq!(waiting, 0, "roots hand nothing on");
    let bound = analysis.blocks_max::<f64>();
    assert!((most..4 * most).contains(&bound), "at most {most} wait, {bound} are planned for");
}

#[test]
fn same_bits_for_one_two_four_and_seven_threads() {
    let mesh = boxes(&[[13, 10, 10], [4, 4, 4]]);
    let stiffness = stiffness_of(&mesh, &[1.0, 2.0]);
    let partition =
        partition_of(&mesh, &[0, 1, 2, 30, 31, 32, 2000, 3900, 3901, 3902, 3910, 3911, 4070]);
    let b = right_hand_sides(partition.unknown().len(), 3);
    let answers: Vec<(Vec<u64>, Vec<u64>)> = [1, 2, 4, 7]
        .into_iter()
        .map(|threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| {
                let analysis = Arc::new(FrontAnalysis::new(&stiffness, &partition));
                assert!(analysis.fronts.iter().filter(|f| !f.is_serial()).count() > 2);
                let factor = FrontFactor::<f64>::try_new(&analysis, &stiffness).unwrap();
                let mut x = b.clone();
                factor.solve_in_place(&mut x, 3);
                assert!(residual(&stiffness, &partition, &x, &b) < 1e-11);
                (bits(&x), factor.panels.iter().flat_map(|p| bits(p)).collect())
            })
        })
        .collect();
    for other in &answers[1..] {
        assert!(other == &answers[0], "the bits depend on the number of threads");
    }
}

#[test]
fn chain_of_large_fronts_under_a_poor_order_is_factored_too() {
    let mesh = boxes(&[[9, 9, 11], [60, 2, 2]]);
    let stiffness = stiffness_of(&mesh, &[1.0, 2.0]);
    let partition =
        partition_of(&mesh, &[0, 1, 2, 25, 26, 242, 2673, 2674, 2675, 2853, 3033, 3034]);
    let graph = ordering::NodeGraph::new(&stiffness, &partition);
    let natural = (0..graph.len() as u32).collect();
    let analysis = FrontAnalysis::with_order(&stiffness, &partition, &graph, natural);
    let only_child = |f: &&super::analysis::Front| !f.is_serial() && f.children.len() == 1;
    assert!(analysis.fronts.iter().filter(only_child).count() > 3);
    let factor = FrontFactor::<f64>::try_new(&Arc::new(analysis), &stiffness).unwrap();
    let b = right_hand_sides(partition.unknown().len(), 2);
    let mut x = b.clone();
    factor.solve_in_place(&mut x, 2);
    assert!(residual(&stiffness, &partition, &x, &b) < 1e-8);
}

#[test]
fn refactoring_with_other_values_equals_a_new_factor() {
    let mesh = boxes(&[[4, 4, 5], [3, 3, 3]]);
    let partition =
        partition_of(&mesh, &[0, 1, 2, 30, 31, 32, 44, 240, 241, 242, 254, 278, 279, 280]);
    let (first, second) = (stiffness_of(&mesh, &[1.0, 2.0]), stiffness_of(&mesh, &[3.0, 1.0]));
    let mut factor = factor_of::<f64>(&first, &partition);
    factor.refactor(&second).unwrap();
    let new = factor_of::<f64>(&second, &partition);
    assert!(factor.panels.iter().zip(&new.panels).all(|(a, b)| bits(a) == bits(b)));
    assert_eq!(factor.bytes(), factor.analysis().factor_bytes::<f64>());
    let other_mesh = boxes(&[[4, 4, 4]]);
    let error = factor.refactor(&stiffness_of(&other_mesh, &[1.0])).unwrap_err();
    assert_eq!(error, FrontError::OtherPattern);
}

#[test]
fn single_precision_with_refinement_reaches_double_precision() {
    let mesh = boxes(&[[7, 6, 6]]);
    let stiffness = stiffness_of(&mesh, &[1.0e5]);
    let partition = partition_of(&mesh, &[0, 1, 2, 18, 19, 20, 500, 700, 701]);
    let factor = factor_of::<f32>(&stiffness, &partition);
    let b = right_hand_sides(partition.unknown().len(), 1);
    let mut x = vec![0.0; b.len()];
    let mut residuals = Vec::new();
    for _ in 0..8 {
        let mut correction = b.clone();
        visit_k11(&stiffness, &partition, |i, j, value| correction[i] -= value * x[j]);
        factor.solve_in_place(&mut correction, 1);
        x.iter_mut().zip(&correction).for_each(|(x, c)| *x += c);
        residuals.push(residual(&stiffness, &partition, &x, &b));
    }
    assert!(residuals[0] > 1e-9, "one solve in single precision cannot be this good");
    assert!(residuals[7] < 1e-12, "{residuals:?}");
}

#[test]
fn failing_pivot_is_named_by_its_row() {
    let mesh = boxes(&[[3, 3, 3], [3, 3, 3]]);
    let partition = partition_of(&mesh, &[0, 1, 2, 6, 7, 8, 20, 81, 82, 83, 87, 88, 89, 101]);
    // Too soft, then too stiff for single precision: zero, then infinite pivots, second body only.
    for young in [1.0e-60, 1.0e60] {
        let stiffness = stiffness_of(&mesh, &[1.0, young]);
        let analysis = Arc::new(FrontAnalysis::new(&stiffness, &partition));
        let Err(FrontError::NotPositive { row }) =
            FrontFactor::<f32>::try_new(&analysis, &stiffness)
        else {
            panic!("single precision cannot hold {young}");
        };
        assert!(partition.unknown()[row] >= 81, "row {row} is in the sound body");
        // The failing pivot is the first of the body that is eliminated.
        let position = analysis.position[row];
        let first = analysis.order.iter().position(|&r| partition.unknown()[r as usize] >= 81);
        assert_eq!(Some(position as usize), first);
        assert!(FrontFactor::<f64>::try_new(&analysis, &stiffness).is_ok());
    }
}

#[test]
fn free_rigid_motion_gives_an_error_or_finite_numbers() {
    let mesh = boxes(&[[3, 4, 3]]);
    let stiffness = stiffness_of(&mesh, &[1.0]);
    let partition = partition_of(&mesh, &[0, 1]);
    let analysis = Arc::new(FrontAnalysis::new(&stiffness, &partition));
    match FrontFactor::<f64>::try_new(&analysis, &stiffness) {
        Ok(factor) => {
            assert!(factor.panels.iter().flat_map(|panel| panel.iter()).all(|x| x.is_finite()))
        }
        Err(error) => assert!(matches!(error, FrontError::NotPositive { row } if row < 106)),
    }
}

#[test]
fn none_one_two_and_five_unknowns_are_solved() {
    let mesh = boxes(&[[3, 2, 2]]);
    let stiffness = stiffness_of(&mesh, &[1.0]);
    for unknown in [&[][..], &[7], &[0, 35], &[3, 4, 5, 20, 30]] {
        let known: Vec<u32> = (0..36).filter(|d| !unknown.contains(d)).collect();
        let partition = partition_of(&mesh, &known);
        let factor = factor_of::<f64>(&stiffness, &partition);
        assert_eq!(factor.analysis().row_count(), unknown.len());
        for columns in [0, 1, 4] {
            let b = right_hand_sides(unknown.len(), columns);
            let mut x = b.clone();
            factor.solve_in_place(&mut x, columns);
            if !b.is_empty() {
                assert!(residual(&stiffness, &partition, &x, &b) < 1e-13);
            }
        }
        assert_eq!(factor.solve_partial(&[], &[]).nrows(), 0);
    }
}

#[test]
fn partial_solve_passes_only_the_paths_it_needs_and_equals_the_full_solve() {
    let mesh = boxes(&[[9, 8, 8], [3, 3, 3]]);
    let stiffness = stiffness_of(&mesh, &[1.0, 5.0]);
    let partition =
        partition_of(&mesh, &[0, 1, 2, 21, 22, 23, 1000, 1728, 1729, 1730, 1734, 1735, 1744]);
    let factor = factor_of::<f64>(&stiffness, &partition);
    let n = partition.unknown().len();
    let loads = [vec![(17, 1.0)], vec![(18, 2.0), (n - 1, -1.0), (18, 0.5)], vec![]];
    let wanted = [n - 1, 5, 17, 18, 700, 5];
    let mut full = vec![0.0; 3 * n];
    for (j, load) in loads.iter().enumerate() {
        load.iter().for_each(|&(row, value)| full[j * n + row] += value);
    }
    factor.solve_in_place(&mut full, 3);
    let largest = full.iter().fold(0.0f64, |m, x| m.max(x.abs()));
    let partial = factor.solve_partial(&loads, &wanted);
    for (i, &row) in wanted.iter().enumerate() {
        for j in 0..3 {
            assert!((partial[(i, j)] - full[j * n + row]).abs() <= 1e-15 * largest);
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    #[test]
    fn any_partition_that_holds_the_body_is_solved(
        sizes in (2usize..5, 2usize..5, 2usize..6),
        known in proptest::collection::btree_set(0u32..300, 0..120),
        columns in 1usize..4,
        wanted in proptest::collection::vec(0usize..300, 1..6),
    ) {
        let mesh = boxes(&[[sizes.0, sizes.1, sizes.2]]);
        let stiffness = stiffness_of(&mesh, &[1.0]);
        let dofs = 3 * mesh.node_count() as u32;
        // Three corners of one face hold the rigid motion, the rest is arbitrary.
        let held = [0, 1, 2, 3, 4, 5, 3 * sizes.0 as u32, 3 * sizes.0 as u32 + 1, 3 * sizes.0 as u32 + 2];
        let known: std::collections::BTreeSet<u32> =
            known.into_iter().filter(|&d| d < dofs).chain(held).collect();
        let partition = partition_of(&mesh, &known.into_iter().collect::<Vec<_>>());
        let n = partition.unknown().len();
        prop_assume!(n > 0);
        let factor = factor_of::<f64>(&stiffness, &partition);
        let b = right_hand_sides(n, columns);
        let mut x = b.clone();
        factor.solve_in_place(&mut x, columns);
        prop_assert!(residual(&stiffness, &partition, &x, &b) < 1e-10);
        let wanted: Vec<usize> = wanted.into_iter().map(|w| w % n).collect();
        let load = vec![(wanted[0], 1.0)];
        let partial = factor.solve_partial(&[load], &wanted);
        let mut full = vec![0.0; n];
        full[wanted[0]] = 1.0;
        factor.solve_in_place(&mut full, 1);
        let largest = full.iter().fold(0.0f64, |m, x| m.max(x.abs()));
        for (i, &row) in wanted.iter().enumerate() {
            prop_assert!((partial[(i, 0)] - full[row]).abs() <= 1e-15 * largest);
        }
    }
}
