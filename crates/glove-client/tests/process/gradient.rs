//! Derivatives by `glove-client solve --gradient`.

use std::collections::BTreeMap;
use std::fmt::Write as _;

use softgrasp_core::mesh::{BuiltIn, generate};

use crate::start::{Folder, displacements, fail, succeed};

/// Values by node and axis as a table with a header.
fn table(header: &str, values: &BTreeMap<(usize, usize), f64>) -> String {
    let nodes: std::collections::BTreeSet<usize> = values.keys().map(|(node, _)| *node).collect();
    nodes.into_iter().fold(format!("{header}\n"), |mut text, node| {
        let cell = |axis| values.get(&(node, axis)).map_or(String::new(), |v| format!("{v:e}"));
        writeln!(text, "{node},{},{},{}", cell(0), cell(1), cell(2)).unwrap();
        text
    })
}

fn rows(text: &str) -> BTreeMap<(usize, usize), f64> {
    let text = text.replace("fx,fy,fz", "ux,uy,uz");
    let of_node = |(node, u): (usize, [f64; 3])| (0..3).map(move |axis| ((node, axis), u[axis]));
    displacements(&text).into_iter().flat_map(of_node).collect()
}

struct Bench {
    folder: Folder,
    mesh: String,
    known: BTreeMap<(usize, usize), f64>,
    forces: BTreeMap<(usize, usize), f64>,
    slope: BTreeMap<(usize, usize), f64>,
    of_reactions: BTreeMap<(usize, usize), f64>,
}

impl Bench {
    fn new() -> Self {
        let folder = Folder::new();
        let mesh = folder.path("cube.msh");
        succeed(&["mesh", "cube", "--nodes", "64", "--out", &mesh]);
        let cube = generate(BuiltIn::Cube, 64).unwrap();
        let (low, high) = cube.bounds();
        let wave = |i: usize| (1.7 * i as f64).sin();
        let mut known = BTreeMap::new();
        for (node, p) in cube.vertices().iter().enumerate() {
            if p.z < low.z + 1e-9 {
                known.extend((0..3).map(|axis| ((node, axis), 0.0)));
            } else if p.z > high.z - 1e-9 {
                known.insert((node, 2), -1e-3);
            }
        }
        let slope = (0..192).map(|dof| ((dof / 3, dof % 3), wave(dof))).collect();
        let of_reactions =
            known.keys().enumerate().map(|(i, key)| (*key, 1e-3 * wave(i + 7))).collect();
        let forces = [((21, 0), 0.02), ((22, 1), -0.01)].into();
        Self { folder, mesh, known, forces, slope, of_reactions }
    }

    fn solve(&self, element: &str, more: &[&str]) {
        let known = self.folder.write("K.csv", &table("node,ux,uy,uz", &self.known));
        let forces = self.folder.write("F.csv", &table("node,fx,fy,fz", &self.forces));
        let [out, reactions] = ["U.csv", "R.csv"].map(|name| self.folder.path(name));
        let files = ["solve", "--mesh", &self.mesh, "--known", &known, "--forces", &forces];
        let results = ["--out", &out, "--reactions", &reactions, "--element", element];
        let weight = ["--gravity", "0,1,-9.81", "--density", "1000", "--pressure", "50:x=max"];
        succeed(&[&files[..], &results, &weight, more].concat());
    }

    /// J of the newest answer.
    fn quantity(&self) -> f64 {
        let [u, r] = ["U.csv", "R.csv"].map(|name| rows(&self.folder.read(name)));
        let of_u: f64 = self.slope.iter().map(|(key, j)| j * u[key]).sum();
        of_u + self.of_reactions.iter().map(|(key, j)| j * r[key]).sum::<f64>()
    }
}

#[test]
fn derivatives_are_those_of_central_differences() {
    for element in ["t4", "t4-anp", "t10"] {
        let mut bench = Bench::new();
        let folder = &bench.folder;
        let of_u = folder.write("JU.csv", &table("node,ux,uy,uz", &bench.slope));
        let of_r = folder.write("JR.csv", &table("node,fx,fy,fz", &bench.of_reactions));
        let found = folder.path("G.csv");
        let wanted = ["--gradient", &found, "--gradient-by", &of_u];
        bench.solve(element, &[&wanted[..], &["--gradient-by-reactions", &of_r]].concat());
        let text = bench.folder.read("G.csv");
        assert!(text.starts_with("node,fx,fy,fz,ux,uy,uz\n"), "{text}");
        let cell = |text: &str, (node, axis): (usize, usize), is_known: bool| {
            let line = text.lines().nth(node + 1).unwrap();
            let cells: Vec<&str> = line.split(',').collect();
            assert_eq!((cells.len(), cells[0]), (7, node.to_string().as_str()));
            let (own, other) = if is_known { (4, 1) } else { (1, 4) };
            assert!(cells[other + axis].is_empty(), "{line}");
            cells[own + axis].parse::<f64>().unwrap()
        };
        for (key, step) in [((21, 0), 0.01), ((40, 2), 0.01), ((63, 1), 0.01)] {
            let mut both = [step, -step].map(|step| {
                let before = bench.forces.clone();
                *bench.forces.entry(key).or_default() += step;
                bench.solve(element, &[]);
                bench.forces = before;
                bench.quantity()
            });
            both[0] -= both[1];
            let (expected, found) = (both[0] / (2.0 * step), cell(&text, key, false));
            assert!((found - expected).abs() < 1e-6 * expected.abs(), "{found} for {expected}");
        }
        for (key, step) in [((0, 1), 1e-4), ((50, 2), 1e-4), ((63, 2), 1e-4)] {
            let mut both = [step, -step].map(|step| {
                let before = bench.known.clone();
                *bench.known.get_mut(&key).unwrap() += step;
                bench.solve(element, &[]);
                bench.known = before;
                bench.quantity()
            });
            both[0] -= both[1];
            let (expected, found) = (both[0] / (2.0 * step), cell(&text, key, true));
            assert!((found - expected).abs() < 1e-6 * expected.abs(), "{found} for {expected}");
        }
    }
}

#[test]
fn what_has_no_derivatives_is_refused() {
    let bench = Bench::new();
    let known = bench.folder.write("K.csv", &table("node,ux,uy,uz", &bench.known));
    let [out, found] = ["U.csv", "G.csv"].map(|name| bench.folder.path(name));
    let files = ["solve", "--mesh", &bench.mesh, "--known", &known, "--out", &out];
    let refused = |code, more: &[&str]| fail(code, &[&files[..], more].concat());
    let of_u = bench.folder.write("JU.csv", &table("node,ux,uy,uz", &bench.slope));
    assert!(refused(1, &["--gradient", &found]).contains("--gradient-by"));
    assert!(refused(2, &["--gradient-by", &of_u]).contains("--gradient"));
    let large = ["--gradient", &found, "--gradient-by", &of_u, "--deformation", "large"];
    assert!(refused(1, &large).contains("linear elasticity"));
    let of_r = bench.folder.write("JR.csv", "node,fx,fy,fz\n40,1,,\n");
    let nowhere = ["--gradient", &found, "--gradient-by-reactions", &of_r];
    assert!(refused(1, &nowhere).contains("node 40 has no reaction"));
}
