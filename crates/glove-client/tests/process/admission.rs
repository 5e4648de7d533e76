//! What a mesh needs, and what is done to a broken one, before anything is solved.

use serde_json::Value;

use crate::start::{Folder, fail, run, succeed};

/// Two tetrahedra of regions 7 and 12, the second inverted; then a flat one, one that repeats the
/// first, and a node in none of them.
const BROKEN: &str = "MeshVersionFormatted 2\nDimension 3\nVertices\n7\n0 0 0 0\n1 0 0 0\n\
                      0 1 0 0\n0 0 1 0\n1 1 1 0\n2 2 2 0\n9 9 9 0\nTetrahedra\n4\n1 2 3 4 7\n\
                      5 2 3 4 12\n1 2 3 3 7\n3 1 2 4 7\nEnd\n";

fn json(arguments: &[&str]) -> Value {
    serde_json::from_str(&succeed(arguments)).unwrap()
}

#[test]
fn mended_files_have_nothing_to_mend_the_same_nodes_and_regions() {
    let folder = Folder::new();
    let broken = folder.write("broken.mesh", BROKEN);
    let before = json(&["inspect", "--json", &broken]);
    assert_eq!(before["flipped"].as_u64().unwrap() + before["tets"].as_u64().unwrap(), 3);
    assert_eq!(before["mending"]["bad_tet_count"], 3);
    for ending in ["msh", "vtu", "txt"] {
        let out = folder.path(&format!("mended.{ending}"));
        let told = succeed(&["inspect", &broken, "--repair", &out]);
        assert!(told.contains("7 nodes with the same numbers") && told.contains("2 dropped"));
        assert!(told.contains("2 nodes in no tetrahedron stay"), "{told}");
        let after = json(&["inspect", "--json", &out]);
        assert_eq!(after["mending"], Value::Null, "{ending}");
        for same in ["nodes", "tets", "orphans", "regions", "region_labels", "volume"] {
            assert_eq!(after[same], before[same], "{ending}: {same}");
        }
        assert_eq!((&after["flipped"], &after["tets_in_file"]), (&0.into(), &2.into()));
    }
    let said = run(&["inspect", &broken, "--repair", &folder.path("mended.stl")]);
    assert_eq!(said.status.code(), Some(1));
    assert!(String::from_utf8_lossy(&said.stderr).contains("names no format to write"));
}

#[test]
fn memory_limit_is_told_by_inspect_and_kept_by_solve() {
    let folder = Folder::new();
    let mesh = folder.path("ball.msh");
    succeed(&["mesh", "sphere", "--nodes", "800", "--out", &mesh]);
    let told = json(&["inspect", "--json", &mesh, "--memory-limit", "1GiB"]);
    assert_eq!(told["usable"], true);
    let ways = told["forecast"]["ways"].as_array().unwrap();
    assert!(ways.iter().all(|way| way["bytes_min"].as_u64() <= way["bytes"].as_u64()));
    assert!(ways.iter().all(|way| way["predicted_ms"].as_f64().unwrap() > 0.0));
    let refused = run(&["inspect", &mesh, "--memory-limit", "500000"]);
    assert_eq!(refused.status.code(), Some(1));
    assert!(String::from_utf8_lossy(&refused.stdout).contains("can be used   no"));
    let known = folder.write("k.csv", "node,ux,uy,uz\n0,0,0,0\n100,0,0,0\n500,0,0,0.001\n");
    let out = folder.path("u.csv");
    let solve = ["solve", "--mesh", &mesh, "--known", &known, "--out", &out];
    let said = fail(1, &[&solve[..], &["--memory-limit", "500000"]].concat());
    for part in ["MemoryLimit", "800 nodes", "500000 bytes", "front-mixed", "fewer nodes"] {
        assert!(said.contains(part), "'{part}' is missing in: {said}");
    }
    assert!(!std::path::Path::new(&out).exists());
    succeed(&[&solve[..], &["--memory-limit", "64MiB"]].concat());
    let elsewhere = ["--memory-limit", "64MiB", "--server", "127.0.0.1:1"];
    let said = fail(1, &[&solve[..], &elsewhere].concat());
    assert!(said.contains("--memory-limit is for the embedded server"), "{said}");
    let said = fail(2, &[&solve[..], &["--memory-limit", "plenty"]].concat());
    assert!(said.contains("8GiB"), "{said}");
}
