//! Iterations, times and memory of `multigrid` on bodies of growing size, each answer compared with
//! that of a factor where one is asked for.
//!
//! `multigrid_times SHAPE NODES [POISSON] [ELEMENT] [METHOD]…`, SHAPE a built-in object; or
//! `lattice`, a cube of boxes of six tetrahedra of any size; `flat:H`, the same of height H; `slivers:H`,
//! the same with every eighth inner node pushed up to that share of its box below the next;
//! `contrast:C`, the same of two materials in boxes of four nodes' breadth. METHOD those to run, `multigrid`
//! alone by default; `multigrid:8` solves eight load cases together as well, and compares them with each
//! alone. Peak memory is that of the process, so one method a run.
#![allow(clippy::print_stdout, reason = "a table on standard output is what it is for")]

use std::time::Instant;

use nalgebra::{Point3, Vector3};
use softgrasp_core::fem::{Element, Material};
use softgrasp_core::mesh::{BuiltIn, TetMesh, generate, signed_volume};
use softgrasp_core::model::{Known, Model};
use softgrasp_core::solve::{Factored, Loads, Method};

/// A cube of `n`³ nodes, six tetrahedra a box.
fn lattice(n: usize, place_of: impl Fn([usize; 3], Point3<f64>) -> Point3<f64>) -> TetMesh {
    let at = |[i, j, k]: [usize; 3]| (i + n * (j + n * k)) as u32;
    let of_index = |index: usize, n: usize| [index % n, index / n % n, index / (n * n)];
    let vertices: Vec<Point3<f64>> = (0..n * n * n)
        .map(|index| {
            let index = of_index(index, n);
            place_of(index, Point3::from(index.map(|i| i as f64 / (n - 1) as f64)))
        })
        .collect();
    let (mut tets, mut regions) = (Vec::new(), Vec::new());
    for index in 0..(n - 1).pow(3) {
        for axes in [[0, 1, 2], [0, 2, 1], [1, 0, 2], [1, 2, 0], [2, 0, 1], [2, 1, 0]] {
            let mut corner = of_index(index, n - 1);
            let mut tet = [at(corner); 4];
            for (position, axis) in axes.into_iter().enumerate() {
                corner[axis] += 1;
                tet[position + 1] = at(corner);
            }
            if signed_volume(&tet.map(|v| vertices[v as usize])) < 0.0 {
                tet.swap(0, 1);
            }
            tets.push(tet);
            regions.push(of_index(index, n - 1).iter().map(|i| i / 4).sum::<usize>() as u32 % 2);
        }
    }
    TetMesh::try_new(vertices, tets, regions).expect("every box is divided into positive volumes")
}

/// The lowest fiftieth of the height is held, the ten highest nodes are moved.
fn known(mesh: &TetMesh) -> Vec<(u32, f64)> {
    let (low, high) = mesh.bounds();
    let limit = low.y + 0.02 * (high.y - low.y);
    let mut by_height: Vec<u32> = (0..mesh.node_count() as u32).collect();
    by_height
        .sort_by(|a, b| mesh.vertices()[*b as usize].y.total_cmp(&mesh.vertices()[*a as usize].y));
    let held = by_height.iter().filter(|n| mesh.vertices()[**n as usize].y <= limit);
    let moved = by_height.iter().take(10);
    let all = |nodes: Vec<u32>, u: [f64; 3]| -> Vec<(u32, f64)> {
        nodes.iter().flat_map(|n| (0..3).map(move |a| (3 * n + a, u[a as usize]))).collect()
    };
    let down = -0.05 * (high.y - low.y);
    let mut pairs = all(held.copied().collect(), [0.0; 3]);
    pairs.extend(all(moved.copied().collect(), [0.2 * down, down, 0.0]));
    pairs
}

/// Peak resident memory of the process, GiB.
fn peak_gib() -> f64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"));
    let kib = line.and_then(|line| line.trim().trim_end_matches(" kB").parse::<f64>().ok());
    kib.unwrap_or(f64::NAN) / (1 << 20) as f64
}

/// Processor time that the process has used, s: what other programs on the machine do is not in it.
fn busy_s() -> f64 {
    const TICKS: f64 = 100.0;
    let stat = std::fs::read_to_string("/proc/self/stat").unwrap_or_default();
    let fields = stat.rsplit_once(')').map_or("", |(_, fields)| fields).split_whitespace();
    fields.skip(11).take(2).filter_map(|ticks| ticks.parse::<f64>().ok()).sum::<f64>() / TICKS
}

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let of = |k: usize, default: &str| arguments.get(k).map_or(default.to_owned(), Clone::clone);
    let shape = of(0, "cube");
    let nodes: usize = of(1, "4000").parse().expect("a number of nodes");
    let poisson: f64 = of(2, "0.3").parse().expect("Poisson's ratio");
    let name = of(3, "t4");
    let element = Element::ALL.into_iter().find(|e| e.name() == name).expect("an element");
    let methods: Vec<(Method, usize)> = match arguments.get(4..) {
        None | Some([]) => vec![(Method::Multigrid, 1)],
        Some(names) => names.iter().map(|name| method_and_cases(name)).collect(),
    };
    let start = Instant::now();
    let (shape, hardness) = shape.split_once(':').unwrap_or((&shape, "1"));
    let hardness: f64 = hardness.parse().expect("a number behind the colon");
    let edge = (nodes as f64).cbrt().round() as usize;
    let mesh = match shape {
        "lattice" => lattice(edge, |_, place| place),
        "contrast" => lattice(edge, |_, place| place),
        "flat" => lattice(edge, |_, place| Point3::new(place.x, hardness * place.y, place.z)),
        "slivers" => lattice(edge, |[i, j, k], place| {
            let is_inner = [i, j, k].iter().all(|i| (1..edge - 1).contains(i));
            let up = (1.0 - hardness) / (edge - 1) as f64;
            let is_pushed = is_inner && (i + 2 * j + 4 * k) % 8 == 0;
            if is_pushed { place + Vector3::new(0.0, up, 0.0) } else { place }
        }),
        name => {
            let built_in: BuiltIn = name.parse().expect("a built-in object");
            generate(built_in, nodes).expect("a mesh")
        }
    };
    let mesh_s = start.elapsed().as_secs_f64();
    let start = Instant::now();
    let stiffer = if shape == "contrast" { hardness } else { 1.0 };
    let materials =
        [1e5, 1e5 * stiffer].map(|young| Material::try_new(young, poisson).expect("a material"));
    let model = Model::try_new(mesh, element, &materials, vec![], &mut |_| {}).expect("a model");
    let assemble_s = start.elapsed().as_secs_f64();
    let known = model.known(known(model.mesh())).expect("known displacements");
    println!(
        "{shape} {} nodes {} poisson {poisson}: mesh {mesh_s:.2} s, assembly {assemble_s:.2} s, \
         peak {:.2} GiB",
        model.system_node_count(),
        element.name(),
        peak_gib()
    );
    run(&model, &known, methods);
}

/// A method, and the number of load cases behind its colon.
fn method_and_cases(text: &str) -> (Method, usize) {
    let (name, cases) = text.split_once(':').unwrap_or((text, "1"));
    (name.parse().expect("a method"), cases.parse().expect("a number of load cases"))
}

fn size(v: &[f64]) -> f64 {
    v.iter().map(|x| x * x).sum::<f64>().sqrt()
}

/// How far two answers are apart, over the size of the first.
fn off(first: &[f64], second: &[f64]) -> f64 {
    let off: Vec<f64> = first.iter().zip(second).map(|(a, b)| a - b).collect();
    size(&off) / size(first)
}

/// Solves several load cases together and one by one.
fn run_together(model: &Model, known: &Known, factored: &Factored, cases: usize) {
    let sets: Vec<Vec<f64>> = (0..cases)
        .map(|case| {
            let value = |(k, q): (usize, &f64)| q * (1.0 + (1.7 * (k % 3 + case) as f64).sin());
            known.q_known.iter().enumerate().map(value).collect()
        })
        .collect();
    let loads: Vec<Loads<'_>> =
        sets.iter().map(|q_known| Loads { q_known, ..Loads::default() }).collect();
    let (start, busy) = (Instant::now(), busy_s());
    let together =
        factored.solve_several(model.stiffness(), &loads, &mut |_| {}).expect("their answers");
    let (together_s, together_busy_s) = (start.elapsed().as_secs_f64(), busy_s() - busy);
    let (mut alone_s, mut alone_busy_s, mut most, mut steps) = (0.0, 0.0, 0.0f64, 0);
    for (found, loads) in together.iter().zip(&loads) {
        let (start, busy) = (Instant::now(), busy_s());
        let alone = factored.solve(model.stiffness(), *loads, &mut |_| {}).expect("its answer");
        alone_s += start.elapsed().as_secs_f64();
        alone_busy_s += busy_s() - busy;
        most = most.max(off(&alone.displacement, &found.displacement));
        steps = steps.max(found.refinement_steps);
    }
    println!(
        "{cases} cases together {together_s:.2} s ({together_busy_s:.2} s of processors), one by one \
         {alone_s:.2} s ({alone_busy_s:.2} s), {:.2} times the processor time, at most {steps} steps, off by \
         {most:.1e}, peak {:.2} GiB",
        alone_busy_s / together_busy_s,
        peak_gib()
    );
}

/// Runs the methods one after the other, and compares each with the first.
fn run(model: &Model, known: &Known, methods: Vec<(Method, usize)>) {
    let mut first: Option<Vec<f64>> = None;
    for (method, cases) in methods {
        let start = Instant::now();
        let factored = model.factor(&known.dofs, method, &mut |_| {}).expect("a factor");
        let setup_s = start.elapsed().as_secs_f64();
        let start = Instant::now();
        let loads = Loads { q_known: &known.q_known, ..Loads::default() };
        let solution = match factored.solve(model.stiffness(), loads, &mut |_| {}) {
            Ok(solution) => solution,
            Err(error) => {
                println!("{method}: set-up {setup_s:.2} s, {error}");
                continue;
            }
        };
        let solve_s = start.elapsed().as_secs_f64();
        let error = first.as_ref().map_or(f64::NAN, |first| off(first, &solution.displacement));
        println!(
            "{method}: set-up {setup_s:.2} s, solve {solve_s:.2} s, {} steps, residual {:.1e}, \
             estimate {:.1e}, off the first method by {error:.1e}, held {:.2} GiB, peak {:.2} GiB",
            solution.refinement_steps,
            solution.residual_rel,
            solution.error_estimate_rel.unwrap_or(f64::NAN),
            factored.bytes() as f64 / (1u64 << 30) as f64,
            peak_gib()
        );
        first.get_or_insert(solution.displacement);
        if cases > 1 {
            run_together(model, known, &factored, cases);
        }
    }
}
