//! Weight and pressure by `glove-client solve`.

use std::fmt::Write as _;

use softgrasp_core::mesh::{BuiltIn, Surface, generate};

use crate::start::{Folder, displacements, fail, largest, succeed};

/// Sum of the forces of supports in a table `node,fx,fy,fz`.
fn carried(table: &str) -> [f64; 3] {
    let rows = displacements(&table.replace("fx,fy,fz", "ux,uy,uz"));
    rows.iter().fold([0.0; 3], |sum, (_, f)| [sum[0] + f[0], sum[1] + f[1], sum[2] + f[2]])
}

/// The lowest nodes of a cube are held.
fn held(nodes: usize) -> String {
    let mesh = generate(BuiltIn::Cube, nodes).unwrap();
    let low = mesh.bounds().0.z;
    let lowest = mesh.vertices().iter().enumerate().filter(|(_, p)| p.z < low + 1e-9);
    lowest.fold("node,ux,uy,uz\n".to_owned(), |mut table, (node, _)| {
        writeln!(table, "{node},0,0,0").unwrap();
        table
    })
}

#[test]
fn weight_and_pressure_are_carried_by_what_is_held_whatever_element_and_method() {
    let folder = Folder::new();
    let mesh = generate(BuiltIn::Cube, 125).unwrap();
    let (low, high) = mesh.bounds();
    let area = (high.x - low.x) * (high.y - low.y);
    let volume: f64 = (0..mesh.tets().len()).map(|tet| mesh.signed_volume(tet).abs()).sum();
    let down = 9.81 * 1000.0 * volume + 250.0 * area;
    let file = folder.path("cube.msh");
    succeed(&["mesh", "cube", "--nodes", "125", "--out", &file]);
    let known = folder.write("K.csv", &held(125));
    // The lid as a table of triangles.
    let is_high = |node: &u32| mesh.vertices()[*node as usize].z > high.z - 1e-9;
    let lid = Surface::from_mesh(&mesh).triangles;
    let lid = lid.iter().filter(|corners| corners.iter().all(is_high));
    let table = lid.fold("a,b,c\n".to_owned(), |mut table, [a, b, c]| {
        writeln!(table, "{c},{a},{b}").unwrap();
        table
    });
    let table = format!("250:{}", folder.write("lid.csv", &table));
    let [out, reactions] = ["U.csv", "R.csv"].map(|name| folder.path(name));
    let solve = |more: &[&str]| {
        let files = ["--mesh", &file, "--known", &known, "--out", &out, "--reactions", &reactions];
        let weight = ["--gravity", "0,0,-9.81", "--density", "1000"];
        let all = [&["solve"], &files[..], &weight, more].concat();
        succeed(&all);
        (displacements(&folder.read("U.csv")), carried(&folder.read("R.csv")))
    };
    let (expected, _) = solve(&["--pressure", "250:z=max"]);
    let scale = largest(&expected);
    for more in [
        &["--pressure", &table][..],
        &["--pressure", "100:z=max", "--pressure", "150:z=max"],
        &["--pressure", "250:z=max", "--method", "condensed"],
        &["--pressure", "250:z=max", "--method", "pcg"],
    ] {
        let (found, _) = solve(more);
        for ((_, a), (_, b)) in found.iter().zip(&expected) {
            let apart = (0..3).map(|i| (a[i] - b[i]).abs()).fold(0.0, f64::max);
            assert!(apart < 1e-9 * scale, "{more:?}: {apart:e}");
        }
    }
    for more in [&["--element", "t4"][..], &["--element", "t4-anp"], &["--element", "t10"]] {
        for large in [&[][..], &["--deformation", "large"]] {
            let (_, carried) = solve(&[&["--pressure", "250:z=max"], more, large].concat());
            assert!((carried[2] - down).abs() < 1e-6 * down, "{more:?}: {carried:?} for {down}");
            assert!(carried[0].abs() + carried[1].abs() < 1e-6 * down, "{carried:?}");
        }
    }
    let deck = folder.path("cube.inp");
    solve(&["--pressure", "250:z=max", "--element", "t10", "--export-deck", &deck]);
    let deck = folder.read("cube.inp");
    let loads = deck.split("*CLOAD\n").nth(1).unwrap().lines().take_while(|l| !l.starts_with('*'));
    let sum: f64 = loads.map(|line| line.split(',').nth(2).unwrap().parse::<f64>().unwrap()).sum();
    assert!((sum + down).abs() < 1e-9 * down, "{sum} N in the deck for {down} N");
}

#[test]
fn loads_that_make_no_sense_are_refused_by_name() {
    let folder = Folder::new();
    let mesh = folder.path("cube.msh");
    succeed(&["mesh", "cube", "--nodes", "27", "--out", &mesh]);
    let known = folder.write("K.csv", &held(27));
    let out = folder.path("U.csv");
    let files = ["solve", "--mesh", &mesh, "--known", &known, "--out", &out];
    let refused = |code, more: &[&str]| fail(code, &[&files[..], more].concat());
    assert!(refused(2, &["--gravity", "0,0,-9.81"]).contains("--density"));
    assert!(refused(2, &["--density", "1000"]).contains("--gravity"));
    let density = ["--gravity", "0,0,1", "--density", "0"];
    assert!(refused(2, &density).contains("--density"));
    assert!(refused(2, &["--pressure", "250"]).contains("PA:PART"));
    assert!(refused(1, &["--pressure", "250:z=7"]).contains("no triangle"));
    assert!(refused(1, &["--pressure", "250:none.csv"]).contains("none.csv"));
    let inner = folder.write("inner.csv", "a,b,c\n0,13,26\n");
    assert!(refused(1, &["--pressure", &format!("1:{inner}")]).contains("boundary"));
}
