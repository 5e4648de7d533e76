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
    squares: BTreeMap<(usize, usize), f64>,
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
        let squares = (0..90).map(|dof| ((dof / 3, dof % 3), 200.0 * wave(dof + 3))).collect();
        let of_reactions =
            known.keys().enumerate().map(|(i, key)| (*key, 1e-3 * wave(i + 7))).collect();
        let forces = [((21, 0), 0.02), ((22, 1), -0.01)].into();
        Self { folder, mesh, known, forces, slope, squares, of_reactions }
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

    /// Arguments that tell J.
    fn told(&self) -> Vec<String> {
        let write =
            |name: &str, header: &str, values| self.folder.write(name, &table(header, values));
        let of_u = write("JU.csv", "node,ux,uy,uz", &self.slope);
        let squares = write("JS.csv", "node,ux,uy,uz", &self.squares);
        let of_r = write("JR.csv", "node,fx,fy,fz", &self.of_reactions);
        let all = ["--gradient-by", &of_u, "--gradient-by-squares", &squares];
        all.into_iter().chain(["--gradient-by-reactions", &of_r]).map(str::to_owned).collect()
    }

    /// J of the newest answer.
    fn quantity(&self) -> f64 {
        let [u, r] = ["U.csv", "R.csv"].map(|name| rows(&self.folder.read(name)));
        let of_u: f64 = self.slope.iter().map(|(key, j)| j * u[key]).sum();
        let squared: f64 = self.squares.iter().map(|(key, j)| 0.5 * j * u[key] * u[key]).sum();
        of_u + squared + self.of_reactions.iter().map(|(key, j)| j * r[key]).sum::<f64>()
    }
}

#[test]
fn derivatives_are_those_of_central_differences() {
    let linear = ["t4", "t4-anp", "t10"].map(|element| (element, "linear"));
    for (element, deformation) in linear.into_iter().chain([("t4", "large"), ("t10", "large")]) {
        let mut bench = Bench::new();
        let how = ["--deformation", deformation];
        let found = bench.folder.path("G.csv");
        let report = bench.folder.path("R.json");
        let told = bench.told();
        let told: Vec<&str> = told.iter().map(String::as_str).collect();
        let wanted = ["--gradient", &found, "--report", &report];
        bench.solve(element, &[&wanted[..], &told, &how].concat());
        let json = bench.folder.read("R.json");
        let json: serde_json::Value = serde_json::from_str(&json).unwrap();
        let value = bench.quantity();
        assert!((json["quantity"].as_f64().unwrap() - value).abs() < 1e-9 * value.abs(), "{json}");
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
        // Where equilibria are curved, a difference over a shorter way is nearer to the slope.
        let part = if deformation == "large" { 0.1 } else { 1.0 };
        for (key, step) in [((21, 0), 0.01 * part), ((40, 2), 0.01 * part), ((63, 1), 0.01 * part)]
        {
            let mut both = [step, -step].map(|step| {
                let before = bench.forces.clone();
                *bench.forces.entry(key).or_default() += step;
                bench.solve(element, &how);
                bench.forces = before;
                bench.quantity()
            });
            both[0] -= both[1];
            let (expected, found) = (both[0] / (2.0 * step), cell(&text, key, false));
            assert!((found - expected).abs() < 1e-6 * expected.abs(), "{found} for {expected}");
        }
        for (key, step) in [((0, 1), 1e-4 * part), ((50, 2), 1e-4 * part), ((63, 2), 1e-4 * part)] {
            let mut both = [step, -step].map(|step| {
                let before = bench.known.clone();
                *bench.known.get_mut(&key).unwrap() += step;
                bench.solve(element, &how);
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
fn derivatives_by_materials_and_places_are_those_of_central_differences() {
    let bench = Bench::new();
    for (element, deformation) in [("t4-anp", "linear"), ("t4", "large")] {
        let how = ["--deformation", deformation];
        let [by_nodes, found, places] =
            ["G.csv", "M.csv", "P.csv"].map(|name| bench.folder.path(name));
        let wanted = ["--gradient", &by_nodes, "--gradient-by-materials", &found];
        let told = bench.told();
        let told: Vec<&str> = told.iter().map(String::as_str).collect();
        let material = ["--young", "30000", "--poisson", "0.35"];
        let asked = [&wanted[..], &["--gradient-by-places", &places], &told, &how, &material];
        bench.solve(element, &asked.concat());
        let text = bench.folder.read("M.csv");
        let line = text.strip_prefix("region,young,poisson\n").unwrap().trim_end();
        let cells = line.strip_prefix("all,").unwrap().split(',');
        let cells: Vec<f64> = cells.map(|cell| cell.parse().unwrap()).collect();
        let difference = |[up, down]: [[&str; 2]; 2], step: f64| {
            let both = [up, down].map(|[young, poisson]| {
                let material = ["--young", young, "--poisson", poisson];
                bench.solve(element, &[&material[..], &how].concat());
                bench.quantity()
            });
            (both[0] - both[1]) / step
        };
        let by_young = difference([["30003", "0.35"], ["29997", "0.35"]], 6.0);
        let by_poisson = difference([["30000", "0.35001"], ["30000", "0.34999"]], 2e-5);
        for (found, expected) in [(cells[0], by_young), (cells[1], by_poisson)] {
            let off = (found - expected).abs();
            assert!(off < 1e-6 * expected.abs(), "{element}: {found} for {expected}");
        }
        assert_eq!(cells.len(), 2);
        // Core compares places with differences; a body that is moved as it is changes nothing.
        let places = bench.folder.read("P.csv");
        let places = rows(&places.replace("node,x,y,z", "node,ux,uy,uz"));
        assert_eq!(places.len(), 192);
        let largest = places.values().fold(0.0, |most: f64, slope| most.max(slope.abs()));
        for axis in 0..3 {
            let moved: f64 = (0..64).map(|node| places[&(node, axis)]).sum();
            assert!(moved.abs() < 1e-9 * largest, "{moved} of {largest}");
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
    let asked = ["--gradient", &found, "--gradient-by", &of_u];
    let with = |more: &[&str]| refused(1, &[&asked[..], more].concat());
    assert!(with(&["--deformation", "large", "--yield", "1000"]).contains("yield stress"));
    assert!(with(&["--deformation", "large", "--max-error", "0.1"]).contains("not converged"));
    assert!(with(&["--method", "condensed"]).contains("factor"));
    let of_r = bench.folder.write("JR.csv", "node,fx,fy,fz\n40,1,,\n");
    let nowhere = ["--gradient", &found, "--gradient-by-reactions", &of_r];
    assert!(refused(1, &nowhere).contains("reaction of node 40"));
    let nothing = bench.folder.write("JN.csv", "node,ux,uy,uz\n");
    let empty = ["--gradient", &found, "--gradient-by", &nothing];
    assert!(refused(1, &empty).contains("no number"));
}
