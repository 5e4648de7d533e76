//! Tests of the hierarchy and of answers by it, against dense factors.

use proptest::prelude::*;

use super::block_rows::{FineRows, NodeMatrix};
use super::galerkin::{self, ByColumn};
use super::level::Level;
use super::motions::{self, MOTIONS};
use super::{Goal, Hierarchy, solve};
use crate::fem::{AXES, Element, Material};
use crate::mesh::{BuiltIn, TetMesh, generate};
use crate::model::Model;
use crate::solve::{Loads, Method, Solution, SolveError};

fn model_of(mesh: TetMesh, element: Element, poisson: f64) -> Model {
    let material = Material::try_new(1e5, poisson).unwrap();
    Model::try_new(mesh, element, &[material], vec![], &mut |_| {}).unwrap()
}

fn model(shape: BuiltIn, nodes: usize, element: Element, poisson: f64) -> Model {
    model_of(generate(shape, nodes).unwrap(), element, poisson)
}

/// Degrees of freedom with displacements: all of three far-apart nodes, and one axis of a fourth.
fn held_at_few(model: &Model) -> Vec<(u32, f64)> {
    let last = model.mesh().node_count() as u32 - 1;
    let nodes = [0, last / 2 + 2, last];
    let all = nodes.into_iter().flat_map(|n| (0..3).map(move |axis| (3 * n + axis, 0.0)));
    let mut pairs: Vec<(u32, f64)> = all.collect();
    (pairs[4].1, pairs[8].1) = (0.01, -0.02);
    pairs.push((3 * (last / 3) + 1, 0.03));
    pairs
}

fn answer(model: &Model, pairs: &[(u32, f64)], method: Method) -> Result<Solution, SolveError> {
    let known = model.known(pairs.to_vec()).unwrap();
    let factored = model.factor(&known.dofs, method, &mut |_| {}).unwrap();
    let loads = Loads { q_known: &known.q_known, ..Loads::default() };
    factored.solve(model.stiffness(), loads, &mut |_| {})
}

fn off(a: &[f64], b: &[f64]) -> f64 {
    let size = |v: &mut dyn Iterator<Item = f64>| v.map(|x| x * x).sum::<f64>().sqrt();
    size(&mut a.iter().zip(b).map(|(a, b)| a - b)) / size(&mut b.iter().copied())
}

/// Same answer as a dense factor, an estimate that covers the error, and how many steps it took.
fn check_against_dense(model: &Model, pairs: &[(u32, f64)]) -> u32 {
    check_against(model, pairs, Method::DenseCholesky)
}

/// Steps of multigrid, whose answer is compared with that of another factor.
fn check_against(model: &Model, pairs: &[(u32, f64)], method: Method) -> u32 {
    let dense = answer(model, pairs, method).unwrap();
    let found = answer(model, pairs, Method::Multigrid).unwrap();
    let error = off(&found.displacement, &dense.displacement);
    let estimate = found.error_estimate_rel.unwrap();
    // Rounding of either answer is not in the estimate.
    assert!(error <= estimate + 1e-12 && error <= 1e-9, "{error:e}, estimated {estimate:e}");
    let forces = off(&found.reaction, &dense.reaction);
    assert!(forces <= 1e-7, "reactions off by {forces:e}");
    found.refinement_steps
}

#[test]
fn all_elements_answer_as_a_dense_factor_does() {
    for element in Element::ALL {
        let nodes = if element == Element::Tet10 { 120 } else { 400 };
        for shape in [BuiltIn::Cube, BuiltIn::Strawberry] {
            let model = model(shape, nodes, element, 0.3);
            let steps = check_against_dense(&model, &held_at_few(&model));
            assert!(steps <= 35, "{shape:?} {element:?}: {steps} steps");
        }
    }
}

#[test]
fn several_bodies_and_bodies_of_one_free_axis_are_answered() {
    let one = generate(BuiltIn::Cube, 125).unwrap();
    let n = one.node_count() as u32;
    let moved = one.vertices().iter().map(|p| p + nalgebra::Vector3::new(3.0, 0.5, 0.0));
    let vertices = one.vertices().iter().copied().chain(moved).collect();
    let tets = one.tets().iter().copied().chain(one.tets().iter().map(|t| t.map(|v| v + n)));
    let two = TetMesh::try_new(vertices, tets.collect(), vec![]).unwrap();
    let model = model_of(two, Element::Tet4, 0.3);
    let few = held_at_few(&self::model(BuiltIn::Cube, 125, Element::Tet4, 0.3));
    let on_both: Vec<(u32, f64)> =
        few.iter().copied().chain(few.iter().map(|(dof, q)| (dof + 3 * n, -q))).collect();
    check_against_dense(&model, &on_both);
    // Of the second body one axis is left free.
    let all_but_one = (3 * n + 1..6 * n).map(|dof| (dof, 1e-3 * f64::from(dof % 5)));
    check_against_dense(&model, &few.into_iter().chain(all_but_one).collect::<Vec<_>>());
}

#[test]
fn nothing_unknown_is_answered_by_what_is_known() {
    let model = model(BuiltIn::Cube, 27, Element::Tet4, 0.3);
    let all: Vec<(u32, f64)> = (0..81).map(|dof| (dof, f64::from(dof))).collect();
    let found = answer(&model, &all, Method::Multigrid).unwrap();
    assert_eq!(found.displacement[5], 5.0);
    assert_eq!(found.refinement_steps, 0);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(16))]

    /// Whatever is known, single axes too.
    #[test]
    fn any_known_degrees_of_freedom_are_answered(
        shape in prop::sample::select(vec![BuiltIn::Cube, BuiltIn::Sphere, BuiltIn::Toothpaste]),
        nodes in prop::sample::select(vec![64usize, 216, 343]),
        poisson in 0.0..0.4f64,
        dofs in prop::collection::btree_map(0usize..3 * 64, -0.1..0.1f64, 0..40),
    ) {
        let Ok(mesh) = generate(shape, nodes) else { return Ok(()) };
        let model = model_of(mesh, Element::Tet4, poisson);
        let mut pairs = held_at_few(&model);
        let limit = model.modelled_dofs();
        pairs.retain(|(dof, _)| !dofs.contains_key(&(*dof as usize)));
        pairs.extend(
            dofs.into_iter().filter(|(d, _)| *d < limit).map(|(d, q)| (d as u32, q)),
        );
        check_against_dense(&model, &pairs);
    }
}

#[test]
fn any_number_of_threads_gives_the_same_bits() {
    let model = model(BuiltIn::Strawberry, 3000, Element::Tet4, 0.3);
    let with = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let known = model.known(held_at_few(&model)).unwrap();
            let factored = model.factor(&known.dofs, Method::Multigrid, &mut |_| {}).unwrap();
            let other: Vec<f64> = known.q_known.iter().map(|q| (7.0 * q).cos()).collect();
            let of = |q_known| Loads { q_known, ..Loads::default() };
            let loads = [of(&known.q_known[..]), of(&other), of(&other)];
            let together = factored.solve_several(model.stiffness(), &loads, &mut |_| {}).unwrap();
            let alone = factored.solve(model.stiffness(), loads[0], &mut |_| {}).unwrap();
            (together, alone)
        })
    };
    let one = with(1);
    for threads in [2, 4, 7] {
        assert_eq!(with(threads), one, "{threads} threads");
    }
}

/// Every load case together as alone: what is known, its forces, none at all, and goals of its own.
#[test]
fn several_loads_together_are_answered_as_each_alone() {
    let model = model(BuiltIn::Strawberry, 1500, Element::Tet4, 0.3);
    let known = model.known(held_at_few(&model)).unwrap();
    let factored = model.factor(&known.dofs, Method::Multigrid, &mut |_| {}).unwrap();
    let free = model.stiffness().node_count() as u32 / 2;
    for count in [1usize, 2, 3, 5, 6, 8, 11] {
        let q_known: Vec<Vec<f64>> = (0..count)
            .map(|case| {
                // The third is not loaded at all.
                let value = |k: usize| {
                    if case == 2 { 0.0 } else { (1.3 * (k + 3 * case + 1) as f64).sin() }
                };
                (0..known.dofs.len()).map(value).collect()
            })
            .collect();
        let mut forces = vec![0.0; 3 * model.system_node_count()];
        forces[3 * free as usize] = 2.0;
        let loads: Vec<Loads<'_>> = q_known
            .iter()
            .enumerate()
            .map(|(case, q_known)| Loads {
                q_known,
                forces: if case == 1 { &forces } else { &[] },
                residual_rel: if case == 3 { 1e-3 } else { 0.0 },
            })
            .collect();
        let together = factored.solve_several(model.stiffness(), &loads, &mut |_| {}).unwrap();
        assert_eq!(together.len(), count);
        for (case, (found, loads)) in together.iter().zip(&loads).enumerate() {
            let alone = factored.solve(model.stiffness(), *loads, &mut |_| {}).unwrap();
            let (steps, of_alone) = (found.refinement_steps, alone.refinement_steps);
            assert!(steps.abs_diff(of_alone) <= 1, "{case} of {count}: {steps}, alone {of_alone}");
            if case == 2 {
                assert!(found.displacement.iter().all(|u| *u == 0.0) && steps == 0);
                continue;
            }
            let error = off(&found.displacement, &alone.displacement);
            let near = if case == 3 { 1e-3 } else { 1e-10 };
            assert!(error <= near, "{case} of {count}: {error:e}");
            assert!(off(&found.reaction, &alone.reaction) <= 10.0 * near);
            if count == 1 {
                assert_eq!(found, &alone, "one load goes the same way");
            }
        }
    }
}

/// A load that is no number, or leads to none, spoils only its own answer.
#[test]
fn a_load_that_is_no_number_is_refused_and_spoils_no_other() {
    let model = model(BuiltIn::Cube, 216, Element::Tet4, 0.3);
    let known = model.known(held_at_few(&model)).unwrap();
    let partition = model.held_partition(&known.dofs).unwrap();
    let hierarchy = Hierarchy::new(model.stiffness(), &partition);
    let goal = Goal { residual_rel: 1e-12, error_rel: 1e-10, steps_max: 100 };
    let side = |seed: f64| {
        let mut b = vec![0.0; partition.dof_count()];
        partition.unknown().iter().for_each(|&dof| b[dof as usize] = (seed * f64::from(dof)).cos());
        b
    };
    let mut broken = side(0.2);
    broken[partition.unknown()[7] as usize] = f64::NAN;
    let huge: Vec<f64> = side(0.4).iter().map(|b| 1e300 * b).collect();
    let asked = [side(0.3), broken, side(0.5), huge].map(|b| (b, goal));
    let found = solve(model.stiffness(), &partition, &hierarchy, &asked);
    assert!(found[1].x.iter().all(|x| x.is_nan()), "what is no number has no answer");
    for w in [0, 2, 3] {
        let alone = solve(model.stiffness(), &partition, &hierarchy, &asked[w..=w]).pop().unwrap();
        assert!(found[w].residual_rel <= 1e-12 && found[w].error_estimate_rel <= 1e-10);
        let largest = alone.x.iter().fold(0.0f64, |most, x| most.max(x.abs()));
        let pairs = found[w].x.iter().zip(&alone.x);
        let most = pairs.fold(0.0f64, |most, (a, b)| most.max((a - b).abs()));
        assert!(most <= 1e-9 * largest && largest > 0.0, "{w}: {most:e} of {largest:e}");
    }
}

/// The lowest tenth is held, the highest node is pushed.
fn pushed(model: &Model) -> Vec<(u32, f64)> {
    let (low, high) = model.mesh().bounds();
    let part = |y: f64| (y - low.y) / (high.y - low.y);
    let mut pairs = Vec::new();
    for (node, place) in model.mesh().vertices().iter().enumerate() {
        let q = match part(place.y) {
            p if p <= 0.1 => 0.0,
            p if p >= 0.999 => -0.1,
            _ => continue,
        };
        pairs.extend((0..3).map(|axis| (3 * node as u32 + axis, q)));
    }
    pairs
}

#[test]
fn steps_hardly_grow_with_the_number_of_nodes() {
    for (shape, poisson) in [(BuiltIn::Cube, 0.4), (BuiltIn::Strawberry, 0.3)] {
        for nodes in [500, 4000, 12_000] {
            let model = model(shape, nodes, Element::Tet4, poisson);
            let found = answer(&model, &pushed(&model), Method::Multigrid).unwrap();
            let steps = found.refinement_steps;
            assert!(steps <= 30, "{shape:?} of {nodes}: {steps} steps");
            assert!(found.residual_rel <= 1e-11);
        }
    }
}

#[test]
fn levels_shrink_to_one_that_is_factored() {
    let model = model(BuiltIn::Cube, 8000, Element::Tet4, 0.3);
    let known = model.known(held_at_few(&model)).unwrap();
    let partition = model.held_partition(&known.dofs).unwrap();
    let rows = Hierarchy::new(model.stiffness(), &partition).level_rows();
    assert!(rows.windows(2).all(|w| 4 * w[1] < w[0]), "{rows:?}");
    assert!(*rows.last().unwrap() <= 120, "{rows:?}");
}

/// A flattened body's strong neighbours lie in lines, of which no small coarse system can be made: its
/// hierarchy stays small all the same, and its steps few enough.
#[test]
fn flat_bodies_have_small_hierarchies_and_answers() {
    for height in [0.3, 0.1, 0.03] {
        let even = generate(BuiltIn::Cube, 2197).unwrap();
        let flat = even.vertices().iter().map(|p| nalgebra::Point3::new(p.x, height * p.y, p.z));
        let mesh = TetMesh::try_new(flat.collect(), even.tets().to_vec(), vec![]).unwrap();
        let (even, flat) = (model_of(even, Element::Tet4, 0.3), model_of(mesh, Element::Tet4, 0.3));
        let bytes = |model: &Model| {
            let known = model.known(pushed(model)).unwrap();
            let partition = model.held_partition(&known.dofs).unwrap();
            Hierarchy::new(model.stiffness(), &partition).bytes()
        };
        let (of_even, of_flat) = (bytes(&even), bytes(&flat));
        assert!(of_flat <= 3 * of_even, "{height}: {of_flat} and {of_even} bytes");
        let steps = check_against(&flat, &pushed(&flat), Method::Front);
        println!("{height}: {steps} steps, {of_flat} and {of_even} bytes");
        assert!(steps <= 200, "{height}: {steps} steps");
    }
}

/// Far from known nodes the prolongator gives every rigid motion back, and what it makes of the
/// matrix is `Pᵀ A P`.
#[test]
fn prolongator_holds_the_rigid_motions_and_the_coarse_matrix_is_its_product() {
    let model = model(BuiltIn::Sphere, 600, Element::Tet4, 0.3);
    let known = model.known(held_at_few(&model)).unwrap();
    let partition = model.held_partition(&known.dofs).unwrap();
    let rows = FineRows::new(model.stiffness(), &partition);
    let of_nodes = motions::of_fine(&rows, rows.row_count());
    let (level, coarser) = Level::of_fine(&rows, of_nodes.clone());
    let p = level.prolongator();
    let is_near = |row: usize| {
        let mut near =
            model.mesh().node_count() != rows.row_count() && rows.unknown_axes(row) != [true; AXES];
        let columns = model.stiffness().pattern().columns(rows.nodes()[row] as usize);
        near |= columns
            .iter()
            .any(|n| (0..3).any(|a| partition.row_of((3 * n + a) as usize).is_none()));
        near
    };
    let mut far = 0;
    for row in (0..rows.row_count()).filter(|row| !is_near(*row)) {
        far += 1;
        for motion in 0..MOTIONS {
            for axis in 0..AXES {
                let parts = p.columns(row).iter().zip(p.blocks(row));
                let sum: f64 = parts
                    .map(|(&column, block)| {
                        let coarse = &coarser.motions[column as usize];
                        (0..MOTIONS)
                            .map(|k| f64::from(block[axis][k]) * coarse[k][motion])
                            .sum::<f64>()
                    })
                    .sum();
                let expected = of_nodes[row][axis][motion];
                assert!((sum - expected).abs() < 1e-5, "row {row}: {sum} for {expected}");
            }
        }
    }
    assert!(far > 300, "{far} nodes are far from known ones");
    let aggregates = coarser.a.row_count();
    let again =
        galerkin::product(&rows, p, &ByColumn::new(p, rows.row_count(), aggregates), aggregates);
    // xᵀ (Pᵀ A P) x = (P x)ᵀ A (P x), for an x without pattern.
    let x: Vec<[f64; MOTIONS]> = (0..aggregates)
        .map(|i| std::array::from_fn(|k| (7.3 * (MOTIONS * i + k) as f64).sin()))
        .collect();
    let px: Vec<[f64; AXES]> = (0..rows.row_count())
        .map(|row| {
            std::array::from_fn(|axis| {
                let parts = p.columns(row).iter().zip(p.blocks(row));
                parts
                    .map(|(&c, block)| {
                        (0..MOTIONS)
                            .map(|k| f64::from(block[axis][k]) * x[c as usize][k])
                            .sum::<f64>()
                    })
                    .sum()
            })
        })
        .collect();
    let energy = |count: usize, visit: &dyn Fn(usize, &mut f64)| {
        let mut sum = 0.0;
        (0..count).for_each(|row| visit(row, &mut sum));
        sum
    };
    let coarse = energy(aggregates, &|row, sum| {
        again.visit(row, &mut |column, block| *sum += form(&x[row], block, &x[column]));
    });
    let fine = energy(rows.row_count(), &|row, sum| {
        rows.visit(row, &mut |column, block| *sum += form(&px[row], block, &px[column]));
    });
    assert!((coarse / fine - 1.0).abs() < 1e-4, "{coarse} for {fine}");
}

/// `aᵀ block b`.
fn form<const B: usize>(a: &[f64; B], block: &[[f64; B]; B], b: &[f64; B]) -> f64 {
    a.iter()
        .zip(block)
        .map(|(a, line)| a * line.iter().zip(b).map(|(x, b)| x * b).sum::<f64>())
        .sum()
}

#[test]
fn estimate_of_an_unfinished_answer_covers_its_error() {
    let model = model(BuiltIn::Strawberry, 1500, Element::Tet4, 0.45);
    let known = model.known(held_at_few(&model)).unwrap();
    let partition = model.held_partition(&known.dofs).unwrap();
    let hierarchy = Hierarchy::new(model.stiffness(), &partition);
    let mut b = vec![0.0; partition.dof_count()];
    for (k, &dof) in partition.unknown().iter().enumerate() {
        b[dof as usize] = (0.3 * k as f64).cos();
    }
    let to = |residual_rel: f64, steps_max: u32| {
        let goal = Goal { residual_rel, error_rel: 1.0, steps_max };
        let asked = [(b.clone(), goal)];
        solve(model.stiffness(), &partition, &hierarchy, &asked).pop().unwrap()
    };
    let truth = to(1e-12, 500);
    for steps_max in [6, 10, 15, 20] {
        let found = to(1e-12, steps_max);
        let error = off(&found.x, &truth.x);
        let estimate = found.error_estimate_rel;
        assert!(found.steps == steps_max && error <= estimate, "{error:e} above {estimate:e}");
        assert!(estimate <= 300.0 * error, "{error:e} far below {estimate:e}");
    }
}

/// So nearly incompressible that steps run out, or so many that rounding ends them: an answer within
/// its estimate, or a refusal with its steps.
#[test]
fn nearly_incompressible_bodies_are_answered_within_the_estimate_or_refused() {
    for poisson in [0.49, 0.4999, 0.499_999_9] {
        let model = model(BuiltIn::Cube, 1000, Element::Tet4, poisson);
        match answer(&model, &pushed(&model), Method::Multigrid) {
            Ok(found) => {
                let front = answer(&model, &pushed(&model), Method::Front).unwrap();
                let error = off(&found.displacement, &front.displacement);
                let estimate = found.error_estimate_rel.unwrap();
                assert!(error <= estimate + 1e-11, "{poisson}: {error:e}, estimated {estimate:e}");
            }
            Err(SolveError::NotConverged { steps, error_estimate_rel, .. }) => {
                assert!(steps > 0 && error_estimate_rel > 0.0);
            }
            Err(other) => panic!("{poisson}: {other}"),
        }
    }
}
