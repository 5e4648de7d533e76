//! Times of the parallel factor against the sequential one on cubes of growing size, each answer
//! checked by its residual before a time is printed.
//!
//! faer has no refactoring and no wide solve here (NaN), and its solve includes the refinement and
//! reactions of `Factored::solve`.
//!
//! `front_times [NODES_PER_EDGE…]`, default 10 15 22 28; run it on a quiet machine.
#![allow(clippy::print_stdout, reason = "a table on standard output is what it is for")]

use std::sync::Arc;
use std::time::Instant;

use nalgebra::Point3;
use softgrasp_core::fem::{Material, Stiffness, StiffnessPattern, assemble};
use softgrasp_core::mesh::{TetMesh, signed_volume};
use softgrasp_core::solve::{
    Factored, FrontAnalysis, FrontFactor, FrontPrecision, Loads, Method, Partition, Stage,
};

/// Right-hand sides of the wider solve.
const COLUMNS: usize = 21;
/// Runs of which the median is printed.
const RUNS: usize = 5;

/// `n`³ nodes, six tetrahedra a cell.
fn cube(n: usize) -> TetMesh {
    let at = |i: usize, j: usize, k: usize| (i + n * (j + n * k)) as u32;
    let mut vertices = Vec::new();
    let mut tets = Vec::new();
    for (k, j, i) in (0..n).flat_map(|k| (0..n).flat_map(move |j| (0..n).map(move |i| (k, j, i)))) {
        vertices.push(Point3::new(i as f64, j as f64, k as f64) / (n - 1) as f64);
    }
    for (k, j, i) in
        (0..n - 1).flat_map(|k| (0..n - 1).flat_map(move |j| (0..n - 1).map(move |i| (k, j, i))))
    {
        for axes in [[0, 1, 2], [0, 2, 1], [1, 0, 2], [1, 2, 0], [2, 0, 1], [2, 1, 0]] {
            let mut corner = [i, j, k];
            let mut tet = [at(i, j, k); 4];
            for (position, axis) in axes.into_iter().enumerate() {
                corner[axis] += 1;
                tet[position + 1] = at(corner[0], corner[1], corner[2]);
            }
            if signed_volume(&tet.map(|v| vertices[v as usize])) < 0.0 {
                tet.swap(0, 1);
            }
            tets.push(tet);
        }
    }
    TetMesh::try_new(vertices, tets, vec![]).expect("every cell is divided into positive volumes")
}

/// Milliseconds of the stages of one run.
#[derive(Default)]
struct Times {
    analyse: Vec<f64>,
    factor: Vec<f64>,
    refactor: Vec<f64>,
    solve: Vec<f64>,
    solve_wide: Vec<f64>,
}

fn ms(since: Instant) -> f64 {
    since.elapsed().as_secs_f64() * 1e3
}

fn median(times: &mut [f64]) -> f64 {
    times.sort_by(f64::total_cmp);
    times.get(times.len() / 2).copied().unwrap_or(f64::NAN)
}

/// Largest of `‖K11 x − b‖ / ‖b‖` over the columns.
fn residual(stiffness: &Stiffness, partition: &Partition, x: &[f64], b: &[f64]) -> f64 {
    let n = partition.unknown().len();
    let norm = |v: &[f64]| v.iter().map(|a| a * a).sum::<f64>().sqrt();
    x.chunks(n)
        .zip(b.chunks(n))
        .map(|(x, b)| {
            let mut q = vec![0.0; partition.dof_count()];
            for (&dof, &value) in partition.unknown().iter().zip(x) {
                q[dof as usize] = value;
            }
            let f = stiffness.mul(&q);
            let difference: Vec<f64> =
                partition.unknown().iter().zip(b).map(|(&dof, b)| f[dof as usize] - b).collect();
            norm(&difference) / norm(b)
        })
        .fold(0.0, f64::max)
}

fn run_front<T: FrontPrecision>(
    stiffness: &Stiffness,
    partition: &Partition,
    b: &[f64],
    good: f64,
    times: &mut Times,
) -> FrontAnalysis {
    let n = partition.unknown().len();
    let clock = Instant::now();
    let analysis = Arc::new(FrontAnalysis::new(stiffness, partition));
    times.analyse.push(ms(clock));
    let clock = Instant::now();
    let mut factor = FrontFactor::<T>::try_new(&analysis, stiffness).expect("definite");
    times.factor.push(ms(clock));
    let clock = Instant::now();
    factor.refactor(stiffness).expect("definite");
    times.refactor.push(ms(clock));
    let mut x = b[..n].to_vec();
    let clock = Instant::now();
    factor.solve_in_place(&mut x, 1);
    times.solve.push(ms(clock));
    assert!(residual(stiffness, partition, &x, &b[..n]) < good, "wrong answer");
    let mut x = b.to_vec();
    let clock = Instant::now();
    factor.solve_in_place(&mut x, COLUMNS);
    times.solve_wide.push(ms(clock));
    assert!(residual(stiffness, partition, &x, b) < good, "wrong answer");
    drop(factor);
    Arc::into_inner(analysis).expect("the factor is gone")
}

fn run_faer(stiffness: &Stiffness, partition: &Partition, times: &mut Times) {
    let mut clock = Instant::now();
    let mut factor_began = clock;
    let factored =
        Factored::try_new(stiffness, partition.clone(), Method::SparseCholesky, &mut |stage| {
            match stage {
                Stage::Factor => factor_began = Instant::now(),
                _ => clock = Instant::now(),
            }
        })
        .expect("definite");
    times.factor.push(ms(factor_began));
    times.analyse.push((factor_began - clock).as_secs_f64() * 1e3);
    let q_known = vec![0.01; partition.known().len()];
    let clock = Instant::now();
    let solution = factored
        .solve(stiffness, Loads { q_known: &q_known, ..Loads::default() }, &mut |_| {})
        .expect("finite");
    times.solve.push(ms(clock));
    assert!(solution.residual_rel < 1e-11, "wrong answer");
}

fn print(name: &str, threads: usize, times: &mut Times) {
    println!(
        "  {name:10} {threads} thread(s): order + analyse {:7.1}  factor {:7.1}  refactor {:7.1}  \
         solve 1: {:6.2}  solve {COLUMNS}: {:6.1} ms",
        median(&mut times.analyse),
        median(&mut times.factor),
        median(&mut times.refactor),
        median(&mut times.solve),
        median(&mut times.solve_wide),
    );
}

fn main() {
    let edges: Vec<usize> = std::env::args().skip(1).filter_map(|a| a.parse().ok()).collect();
    let edges = if edges.is_empty() { vec![10, 15, 22, 28] } else { edges };
    for n in edges {
        let mesh = cube(n);
        let pattern = Arc::new(StiffnessPattern::new(&mesh));
        let material = Material::try_new(1.0, 0.3).expect("in range");
        let stiffness = assemble(&pattern, &mesh, &[material]).expect("one material");
        let top = n * n * (n - 1);
        let contacts = [n * n / 2, top, top + n - 1, top + n * n - n, top + n * n - 1];
        let known: Vec<u32> =
            contacts.iter().flat_map(|&v| (0..3).map(move |a| (3 * v + a) as u32)).collect();
        let partition = Partition::try_new(&mesh.used_nodes(), &known).expect("contacts exist");
        let rows = partition.unknown().len();
        let b: Vec<f64> = (0..rows * COLUMNS).map(|i| (i as f64 * 0.37).sin()).collect();
        let mut assembly = [Vec::new(), Vec::new()];
        let pools = [1, 2].map(|threads| {
            rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads")
        });
        let mut faer = Times::default();
        let mut front = [Times::default(), Times::default()];
        let mut single = [Times::default(), Times::default()];
        let mut analysis = None;
        // Interleaved, so that a busy spell of the machine hits all of them alike.
        for _ in 0..RUNS {
            pools[0].install(|| run_faer(&stiffness, &partition, &mut faer));
            for (k, pool) in pools.iter().enumerate() {
                let clock = Instant::now();
                let again = pool.install(|| assemble(&pattern, &mesh, &[material]));
                assembly[k].push(ms(clock));
                assert_eq!(again.expect("one material").amax(), stiffness.amax());
                analysis = Some(pool.install(|| {
                    run_front::<f32>(&stiffness, &partition, &b, 1e-2, &mut single[k]);
                    run_front::<f64>(&stiffness, &partition, &b, 1e-10, &mut front[k])
                }));
            }
        }
        let analysis = analysis.expect("at least one run");
        println!(
            "{} nodes, {rows} rows: {} fronts, fill {:.2} M, {:.2} GFlop, factor {} MB, peak {} MB",
            mesh.node_count(),
            analysis.front_count(),
            analysis.fill() as f64 / 1e6,
            analysis.flops() / 1e9,
            analysis.factor_bytes::<f64>() >> 20,
            analysis.peak_bytes::<f64>() >> 20,
        );
        let [one, two] = assembly.each_mut().map(|times| median(times));
        println!("  assembly into the pattern: 1 thread {one:.1}, 2 threads {two:.1} ms");
        print("faer", 1, &mut faer);
        for k in 0..2 {
            print("front f64", k + 1, &mut front[k]);
        }
        for k in 0..2 {
            print("front f32", k + 1, &mut single[k]);
        }
    }
}
