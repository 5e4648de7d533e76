//! Tests of masks: a dense saddle-point system, bounds and true errors, refusals.

use nalgebra::{DMatrix, DVector};
use proptest::prelude::*;

use super::tests::{Shape, cube, pushes, relative_difference, touched};
use super::*;
use crate::contact::Mask;

/// `[K E; Eᵀ 0]` on the degrees of freedom that the scene leaves free, by elimination with full
/// pivoting, refined; displacements and forces.
fn saddle(shape: &Shape, touched: &Touched, q: &[f64]) -> (Vec<f64>, Vec<f64>) {
    let all = shape.base.dof_count();
    let free: Vec<usize> =
        (0..all).filter(|&d| shape.base.fixed().binary_search(&(d as u32)).is_err()).collect();
    let (n, c) = (free.len(), touched.force_count());
    let scale = shape.stiffness.row_sum_max();
    let mut a = DMatrix::zeros(n + c, n + c);
    let mut unit = vec![0.0; all];
    for (j, &dof) in free.iter().enumerate() {
        unit[dof] = 1.0;
        let column = shape.stiffness.mul(&unit);
        for (i, &row) in free.iter().enumerate() {
            a[(i, j)] = column[row] / scale;
        }
        for k in 0..c {
            let weight = touched.mean(k, &unit);
            (a[(j, n + k)], a[(n + k, j)]) = (weight, weight);
        }
        unit[dof] = 0.0;
    }
    let right = DVector::from_fn(n + c, |i, _| if i < n { 0.0 } else { q[i - n] });
    let lu = a.clone().full_piv_lu();
    let mut x = lu.solve(&right).unwrap();
    for _ in 0..2 {
        x += lu.solve(&(&right - &a * &x)).unwrap();
    }
    let mut u = vec![0.0; all];
    free.iter().zip(x.iter()).for_each(|(&dof, &value)| u[dof] = value);
    (u, x.iter().skip(n).map(|f| -f * scale).collect())
}

fn mask(entries: &[(u32, f64)]) -> Mask {
    Mask::try_new(entries.to_vec()).unwrap()
}

fn set(shape: &Shape, touched: &Touched) -> Result<ContactSet, CondensedError> {
    ContactSet::try_new(&shape.base, &shape.columns, touched)
}

fn check(shape: &Shape, touched: &Touched, q: &[f64], tolerance: f64) {
    let set = set(shape, touched).unwrap();
    let answer = set.solve(q).unwrap();
    let u = set.full_displacement(&shape.base, &answer);
    let (expected, forces) = saddle(shape, touched, q);
    let error = relative_difference(&u, &expected);
    assert!(error <= tolerance, "displacements differ by {error:e}");
    let error = relative_difference(&answer.lambda, &forces);
    assert!(error <= 100.0 * tolerance, "forces differ by {error:e}");
    let certificate = set.certify(&shape.base, q, &answer, &[], Delivery::Double);
    assert!(certificate.residual_rel < 1e-9, "residual {:e}", certificate.residual_rel);
}

/// Five masks around corners and faces of the cube of 64 nodes; the first two overlap.
fn five() -> Vec<Mask> {
    vec![
        mask(&[(0, 2.0), (1, 1.0), (4, 1.0), (16, 0.5)]),
        mask(&[(1, 1.0), (2, 3.0), (5, 1.0)]),
        mask(&[(60, 1.0), (61, 1.0), (56, 2.0)]),
        mask(&[(48, 1.0), (51, 0.1)]),
        mask(&[(15, 1.0), (31, 1.0), (47, 1.0), (14, 2.0)]),
    ]
}

#[test]
fn masks_alone_and_mixed_with_nodes_equal_the_dense_saddle_point() {
    for fixed in [vec![], touched(&[3, 12, 63]), vec![0, 1, 2, 190]] {
        let shape = Shape::new(cube(64), 0.3, &fixed);
        let masks = Touched { dofs: vec![], masks: five() };
        check(&shape, &masks, &pushes(15), 1e-11);
        // Nodes, one of them only along z, in and beside the masks.
        let mixed = Touched { dofs: vec![17, 3 * 42, 3 * 42 + 1, 3 * 42 + 2], masks: five() };
        check(&shape, &mixed, &pushes(19), 1e-11);
    }
}

#[test]
fn mask_of_one_node_is_that_node() {
    let shape = Shape::new(cube(125), 0.3, &[]);
    let nodes = [0, 4, 60, 100, 124];
    let (by_nodes, q) = (Touched::of_dofs(&touched(&nodes)), pushes(15));
    let by_masks = Touched { dofs: vec![], masks: nodes.map(Mask::of_node).to_vec() };
    let field = |touched: &Touched| {
        let set = set(&shape, touched).unwrap();
        let answer = set.solve(&q).unwrap();
        (set.full_displacement(&shape.base, &answer), answer.lambda)
    };
    let (a, b) = (field(&by_nodes), field(&by_masks));
    assert!(relative_difference(&b.0, &a.0) < 1e-14 && relative_difference(&b.1, &a.1) < 1e-12);
}

#[test]
fn masks_on_fixed_and_on_artificially_held_nodes_equal_the_dense_saddle_point() {
    // Half of the mask does not move at all; the mean of it does.
    let shape = Shape::new(cube(64), 0.3, &touched(&[0, 1, 2, 3, 4]));
    let half = Touched { dofs: vec![], masks: vec![mask(&[(1, 1.0), (20, 1.0), (3, 0.5)])] };
    check(&shape, &half, &[1e-3, -2e-3, 5e-4], 1e-11);
    let shape = Shape::new(cube(64), 0.3, &[]);
    let held: Vec<(u32, f64)> = shape.base.held.iter().map(|d| d / 3).zip([1.0; 6]).collect();
    let mut held = held;
    held.dedup_by_key(|e| e.0);
    let masks = [&[mask(&held)], &five()[..4]].concat();
    check(&shape, &Touched { dofs: vec![], masks }, &pushes(15), 1e-11);
}

#[test]
fn masks_that_say_what_others_say_are_refused_and_named() {
    let shape = Shape::new(cube(64), 0.3, &touched(&[63]));
    let named = |dofs: &[u32], masks: &[Mask]| match set(
        &shape,
        &Touched { dofs: dofs.to_vec(), masks: masks.to_vec() },
    )
    .err()
    {
        Some(CondensedError::Dependent { mask, .. }) => mask,
        other => panic!("{other:?}"),
    };
    let (a, b) = (mask(&[(0, 1.0), (1, 1.0)]), mask(&[(7, 1.0)]));
    assert_eq!(named(&[], &[b.clone(), a.clone(), a.clone()]), 2, "twice the same");
    assert_eq!(named(&touched(&[7]), &[a.clone(), b.clone()]), 1, "a touched node");
    assert_eq!(named(&[0, 3], &[b.clone(), a.clone()]), 1, "touched nodes along x");
    assert_eq!(named(&[], &[mask(&[(63, 1.0)])]), 0, "a fixed node");
    let sum = mask(&[(0, 1.0), (1, 1.0), (7, 2.0)]);
    assert_eq!(named(&[], &[a.clone(), sum, b.clone()]), 2, "the sum of two is a third");
    // Close to the same is as good as the same.
    let near = mask(&[(0, 1.0), (1, 1.0 + 1e-9)]);
    assert_eq!(named(&[], &[a.clone(), near]), 1);
    let crowd: Vec<Mask> = (0..64).chain(0..1).map(Mask::of_node).collect();
    named(&[], &crowd);
    let outside = set(&shape, &Touched { dofs: vec![], masks: vec![mask(&[(3, 1.0), (64, 1.0)])] });
    assert!(matches!(outside.err(), Some(CondensedError::NoSuchNode { mask: 0, node: 64, .. })));
}

#[test]
fn masks_that_leave_a_motion_free_are_refused() {
    let shape = Shape::new(cube(64), 0.3, &[]);
    for count in [1, 2] {
        let two = Touched { dofs: vec![], masks: five()[..count].to_vec() };
        assert!(matches!(set(&shape, &two).err(), Some(CondensedError::NotHeld)), "{count} masks");
    }
}

#[test]
fn columns_of_a_mask_are_kept_under_its_exact_weights() {
    let shape = Shape::new(cube(125), 0.3, &[]);
    let of = |contact: Contact| shape.columns.of_contacts(&shape.base, &[contact]).unwrap();
    of(Contact::Mask(mask(&[(3, 1.0), (4, 2.0)])));
    of(Contact::Mask(mask(&[(4, 2.0), (3, 1.0)])));
    assert_eq!(shape.columns.computed(), 1);
    of(Contact::Mask(mask(&[(3, 1.0), (4, 2.0 + 1e-15)])));
    of(Contact::Node(3));
    assert_eq!(shape.columns.computed(), 3);
    let bytes = 3 * Columns::bytes_per_contact(&shape.base) + 2 * 32;
    assert_eq!(shape.columns.bytes(&shape.base), bytes);
}

#[test]
fn masks_give_the_same_bits_for_one_two_four_and_seven_threads() {
    let answers: Vec<Vec<u64>> = [1, 2, 4, 7]
        .into_iter()
        .map(|threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| {
                let shape = Shape::new(cube(343), 0.3, &[]);
                let touched = Touched { dofs: vec![900, 901, 902], masks: five() };
                let mut set = set(&shape, &touched).unwrap();
                set.want(&shape.base, &(0..343).collect::<Vec<u32>>());
                let answer = set.solve(&pushes(18)).unwrap();
                let u = set.wanted_displacements(&answer);
                u.iter().flatten().chain(&answer.lambda).map(|x| x.to_bits()).collect()
            })
        })
        .collect();
    assert!(answers.iter().all(|a| a == &answers[0]));
}

/// Held by masks and nodes only, and by the scene; the true error against the refined saddle point.
#[test]
fn proven_bound_of_masks_is_above_the_true_error_on_random_frames() {
    for fixed in [vec![], touched(&[0, 1, 2, 3, 4])] {
        let shape = Shape::new(cube(64), 0.3, &fixed);
        assert!(shape.base.prove_eigenvalue_min().is_some());
        let mut state = 11u64;
        let mut next = move || {
            state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            (state >> 33) as f64 / (1u64 << 31) as f64
        };
        let mut frames = 0;
        for _ in 0..12 {
            let masks = (0..4).map(|_| {
                let mut entries: Vec<(u32, f64)> =
                    (0..5).map(|_| ((next() * 64.0) as u32, 0.1 + next())).collect();
                entries.sort_by_key(|e| e.0);
                entries.dedup_by_key(|e| e.0);
                mask(&entries)
            });
            let masks = masks.collect();
            let touched = Touched { dofs: touched(&[5 + (next() * 58.0) as u32]), masks };
            let Ok(set) = set(&shape, &touched) else { continue };
            for _ in 0..4 {
                let q: Vec<f64> = (0..touched.force_count()).map(|_| next() - 0.5).collect();
                let answer = set.solve(&q).unwrap();
                let bound = set
                    .certify(&shape.base, &q, &answer, &[], Delivery::Double)
                    .error_bound_rel
                    .unwrap();
                let u = set.full_displacement(&shape.base, &answer);
                let (exact, _) = saddle(&shape, &touched, &q);
                let difference: f64 = u.iter().zip(&exact).map(|(a, b)| (a - b).powi(2)).sum();
                let size: f64 = exact.iter().map(|x| x * x).sum();
                let error = (difference / size).sqrt();
                assert!(error <= bound, "true error {error:e} above the bound {bound:e}");
                assert!(bound < 1e-3, "a bound of {bound:e} says nothing");
                frames += 1;
            }
        }
        assert!(frames > 20, "only {frames} frames");
    }
}

/// What the bound stands on, without the tiny numbers: a load's response under held means is at
/// most as large as the compliance says.
#[test]
fn compliance_bounds_the_response_to_any_load_under_held_means() {
    for fixed in [vec![], touched(&[0, 1, 2, 3, 4])] {
        let shape = Shape::new(cube(64), 0.3, &fixed);
        let proven = shape.base.prove_eigenvalue_min().unwrap();
        let touched = Touched { dofs: vec![], masks: five() };
        let set = set(&shape, &touched).unwrap();
        let factors = set.verified.amplification(&shape.base, proven).unwrap();
        let rigid = shape.base.rigid.as_ref().map_or(0.0, |rigid| rigid.norm);
        let compliance = factors.of_residual + rigid * factors.of_moment;
        // Held at zero and pulled at one degree of freedom, taken as one more contact.
        for dof in (3 * 5..192).step_by(7) {
            let pulled = Touched { dofs: vec![dof], ..touched.clone() };
            // A mask may be left with this one free node.
            if ContactSet::try_new(&shape.base, &shape.columns, &pulled).is_err() {
                continue;
            }
            let mut q = vec![0.0; pulled.force_count()];
            q[0] = 1.0;
            let (u, forces) = saddle(&shape, &pulled, &q);
            let size = u.iter().map(|x| x * x).sum::<f64>().sqrt();
            assert!(size <= compliance * forces[0].abs(), "{size} at {dof}");
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(32))]
    #[test]
    fn random_masks_and_nodes_equal_the_dense_saddle_point(
        masks in prop::collection::vec(
            prop::collection::btree_map(0u32..64, 0.05..1.0f64, 1..8), 3..6),
        nodes in prop::collection::btree_set(0u32..64, 0..3),
        fixed in prop::collection::btree_set(0u32..192, 0..7),
        q in prop::collection::vec(-1e-2..1e-2f64, 24),
    ) {
        let fixed: Vec<u32> = fixed.into_iter().filter(|d| !nodes.contains(&(d / 3))).collect();
        let shape = Shape::new(cube(64), 0.3, &fixed);
        let masks = masks.into_iter().map(|m| mask(&m.into_iter().collect::<Vec<_>>())).collect();
        let dofs = touched(&nodes.into_iter().collect::<Vec<_>>());
        let touched = Touched { dofs, masks };
        let q = &q[..touched.force_count()];
        // Random masks that follow from others or hold nothing are refused, which is as well.
        let Ok(set) = set(&shape, &touched) else { return Ok(()) };
        let answer = set.solve(q).unwrap();
        let u = set.full_displacement(&shape.base, &answer);
        let (expected, _) = saddle(&shape, &touched, q);
        let eigenvalue = shape.base.estimate_eigenvalue_min().unwrap();
        let base = shape.stiffness.row_sum_max() / eigenvalue;
        let allowed = 1e-11f64.max(1e-15 * base) * (1.0 + 1e-4 * set.condition());
        let error = relative_difference(&u, &expected);
        prop_assert!(error <= allowed, "error {:e}, allowed {:e}", error, allowed);
    }
}
