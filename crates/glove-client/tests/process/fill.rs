//! `glove-client fill`: a surface with faults becomes a mesh, is grasped and pressed, or is refused.

use serde_json::Value;

use crate::start::{Folder, fail, succeed};

/// A ball of 3 cm as an OBJ of rings and segments, without the triangles that are not kept.
fn ball(keep: impl Fn(usize) -> bool, radius: f64) -> String {
    let (rings, segments) = (14, 24);
    let mut points = vec![[0.0, 0.0, radius]];
    for ring in 1..rings {
        let down = std::f64::consts::PI * f64::from(ring) / f64::from(rings);
        points.extend((0..segments).map(|s| {
            let around = std::f64::consts::TAU * f64::from(s) / f64::from(segments);
            let out = radius * down.sin();
            [out * around.cos(), out * around.sin(), radius * down.cos()]
        }));
    }
    points.push([0.0, 0.0, -radius]);
    let last = points.len();
    let at = |ring: i32, s: i32| (2 + (ring - 1) * segments + s % segments) as usize;
    let mut faces = Vec::new();
    for s in 0..segments {
        faces.push([1, at(1, s), at(1, s + 1)]);
        faces.push([last, at(rings - 1, s + 1), at(rings - 1, s)]);
        for ring in 1..rings - 1 {
            faces.push([at(ring, s), at(ring + 1, s), at(ring + 1, s + 1)]);
            faces.push([at(ring, s), at(ring + 1, s + 1), at(ring, s + 1)]);
        }
    }
    let points = points.iter().map(|[x, y, z]| format!("v {x} {y} {z}\n"));
    let kept = faces.iter().enumerate().filter(|(i, _)| keep(*i));
    let faces = kept.map(|(_, [a, b, c])| format!("f {a} {b} {c}\n"));
    points.chain(faces).collect()
}

#[test]
fn scan_with_holes_becomes_a_mesh_beside_it() {
    let folder = Folder::new();
    folder.write("scan.obj", &ball(|i| i % 40 != 7, 0.03));
    let scan = folder.path("scan.obj");
    let said = succeed(&["fill", &scan, "--nodes", "400"]);
    assert!(said.contains("holes") && said.contains("surface to mesh:"), "{said}");
    let told: Value =
        serde_json::from_str(&succeed(&["inspect", "--json", &folder.path("scan.msh")])).unwrap();
    assert_eq!(told["usable"], true);
    let nodes = told["nodes"].as_u64().unwrap();
    assert!((380..=420).contains(&nodes), "{nodes}");
    let said = succeed(&["fill", &scan, "--size", "0.01", "--out", &folder.path("fine.vtu")]);
    assert!(said.contains("cells of 0.0100 m") && said.contains("fine.vtu"), "{said}");
}

#[test]
fn millimetres_are_told_and_scaled() {
    let folder = Folder::new();
    folder.write("part.obj", &ball(|_| true, 30.0));
    let part = folder.path("part.obj");
    let said = succeed(&["fill", &part, "--nodes", "200"]);
    assert!(said.contains("60.0000 m long") && said.contains("--scale 0.001"), "{said}");
    let said = succeed(&["fill", &part, "--nodes", "200", "--scale", "0.001"]);
    assert!(said.contains("0.0600 m\n") && !said.contains("--scale"), "{said}");
}

#[test]
fn sheet_is_refused_with_its_place() {
    let folder = Folder::new();
    folder.write("sheet.off", "OFF\n4 2 0\n0 0 1\n1 0 1\n1 1 1\n0 1 1\n3 0 1 2\n3 0 2 3\n");
    let said = fail(1, &["fill", &folder.path("sheet.off")]);
    assert!(said.contains("no inside") && said.contains("(0.5000, 0.5000, 1.0000)"), "{said}");
    let said = fail(1, &["inspect", &folder.path("sheet.off")]);
    assert!(said.contains("glove-client fill"), "{said}");
    fail(2, &["fill", &folder.path("sheet.off"), "--nodes", "100", "--size", "0.1"]);
}

#[test]
fn surface_is_grasped_at_once() {
    let folder = Folder::new();
    folder.write("scan.obj", &ball(|i| i % 40 != 7, 0.03));
    let scan = folder.path("scan.obj");
    let said = succeed(&[
        "run",
        "--headless",
        "--object",
        &scan,
        "--nodes",
        "200",
        "--hand",
        "scripted:approach",
    ]);
    assert!(said.contains("Wavefront OBJ surface") && said.contains("filled"), "{said}");
}

#[test]
fn surface_is_pressed_at_once() {
    let folder = Folder::new();
    folder.write("ball.obj", &ball(|_| true, 0.03));
    folder.write(
        "bodies.toml",
        "end = 0.05\n[[body]]\nname = \"table\"\nshape = \"plane\"\nnormal = [0, 0, 1]\n\
         poses = [[0, 0, 0, -0.03, 1, 0, 0, 0]]\n",
    );
    let [mesh, bodies] = ["ball.obj", "bodies.toml"].map(|f| folder.path(f));
    let said = succeed(&["press", "--mesh", &mesh, "--bodies", &bodies]);
    assert!(said.contains("the end table presses"), "{said}");
}
