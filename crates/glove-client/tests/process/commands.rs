//! Exit codes, first lines of failures, reports, closed pipes.

use std::net::{SocketAddr, TcpListener};
use std::process::Stdio;

use fea_server::ServerConfig;
use serde_json::Value;

use crate::start::{Folder, command, displacements, fail, succeed};

/// One tetrahedron, and a node beyond it that no element uses.
const NODES: &str = "5 3 0 0\n0 1 0 0\n1 0 1 0\n2 0 0 1\n3 0 0 0\n4 9 9 9\n";
const ELEMENTS: &str = "1 4 0\n0 0 1 2 3\n";
const KNOWN: &str = "node,ux,uy,uz\n0,0,0,0\n1,0,0,0\n3,0,0,0\n";

/// A folder with `t.node`, `t.ele` and `K.csv`.
fn tetrahedron() -> Folder {
    let folder = Folder::new();
    folder.write("t.node", NODES);
    folder.write("t.ele", ELEMENTS);
    folder.write("K.csv", KNOWN);
    folder
}

fn solve(folder: &Folder, more: &[&str]) -> Vec<String> {
    let (mesh, known, out) = (folder.path("t.node"), folder.path("K.csv"), folder.path("U.csv"));
    let mut arguments = vec!["solve".to_owned()];
    for (option, value) in [("--mesh", mesh), ("--known", known), ("--out", out)] {
        if !more.contains(&option) {
            arguments.extend([option.to_owned(), value]);
        }
    }
    arguments.extend(more.iter().map(|&m| m.to_owned()));
    arguments
}

/// Checks that the work fails: exit code 1, the reason in the first line.
fn fails(arguments: &[String], says: &[&str]) {
    let said = fail(1, arguments);
    let first = said.lines().next().unwrap_or("");
    assert!(first.starts_with("glove-client: "), "{said}");
    for part in says {
        assert!(first.contains(part), "'{part}' is missing in: {said}");
    }
}

#[test]
fn report_has_the_keys_of_the_contract() {
    let folder = tetrahedron();
    let report = folder.path("R.json");
    let forces = folder.write("F.csv", "node,fx,fy,fz\n2,,,3.5\n");
    succeed(&solve(&folder, &["--report", &report, "--forces", &forces]));
    let report: Value = serde_json::from_str(&folder.read("R.json")).unwrap();
    assert!(report["schema"].as_u64().unwrap() >= 1);
    for key in ["decode", "assemble", "order", "factor", "solve", "encode", "queue"] {
        assert!(report["ms"][key].as_f64().unwrap() >= 0.0, "ms.{key}");
    }
    assert!(!report["method"].as_str().unwrap().is_empty());
    assert_eq!((&report["unknown_dofs"], &report["known_dofs"]), (&3.into(), &9.into()));
    assert!(report["residual_rel"].as_f64().unwrap() < 1e-12);
    assert!(report["max_rotation_deg"].is_f64() && report["max_strain"].is_f64());
    assert!(report["peak_rss_bytes"].as_u64().unwrap() > 0 || !cfg!(target_os = "linux"));
    let object = report.as_object().unwrap();
    assert!(object.contains_key("error_bound_rel"));
    assert!(!report["error_bound_rel"].is_null() || report["why"].is_string());
}

#[test]
fn node_in_no_element_stays_and_an_empty_cell_leaves_its_direction_free() {
    let folder = tetrahedron();
    folder.write("K.csv", "node,ux,uy,uz\n0,0,0,0\n1,0,0,0\n3,0,0,0\n2,,,0.01\n");
    succeed(&solve(&folder, &["--poisson", "0.3"]));
    let rows = displacements(&folder.read("U.csv"));
    assert_eq!(rows.iter().map(|(node, _)| *node).collect::<Vec<_>>(), [0, 1, 2, 3, 4]);
    assert_eq!(rows[2].1[2], 0.01);
    assert_eq!(rows[4].1, [0.0; 3]);
    assert_eq!(rows[0].1, [0.0; 3]);
}

#[test]
fn failed_work_ends_with_exit_code_1_and_the_reason_in_the_first_line() {
    let folder = tetrahedron();
    let missing = folder.path("missing.msh");
    fails(&solve(&folder, &["--mesh", &missing]), &["cannot read", "missing.msh"]);
    fails(&["inspect".to_owned(), missing.clone()], &["cannot read", "missing.msh"]);
    fails(&solve(&folder, &["--known", &missing]), &["cannot read", "missing.msh"]);
    let garbage = folder.write("garbage.xyz", "nothing that is a mesh\n");
    fails(&["inspect".to_owned(), garbage.clone()], &["garbage.xyz"]);
    fails(&solve(&folder, &["--mesh", &garbage]), &["garbage.xyz"]);
    let flat = folder.write(
        "flat.vtk",
        "# vtk DataFile Version 3.0\nflat\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS 3 float\n\
         0 0 0 1 0 0 0 1 0\nCELLS 1 4\n3 0 1 2\nCELL_TYPES 1\n5\n",
    );
    fails(&["inspect".to_owned(), flat.clone()], &["flat.vtk", "tetrahed"]);
    fails(&solve(&folder, &["--mesh", &flat]), &["flat.vtk", "tetrahed"]);
    let out = folder.path("mesh.stl");
    let mesh = ["mesh", "cube", "--nodes", "64", "--out", &out].map(str::to_owned);
    fails(&mesh, &["mesh.stl", ".msh", ".vtu"]);
    let few = ["mesh", "cube", "--nodes", "3", "--out", &folder.path("few.msh")].map(str::to_owned);
    fails(&few, &["3 nodes", "27"]);
    let nowhere = folder.path("no/such/folder/U.csv");
    fails(&solve(&folder, &["--out", &nowhere]), &["cannot write", "no/such/folder"]);
}

#[test]
fn broken_tables_are_named_by_line() {
    let folder = tetrahedron();
    for (table, says) in [
        ("node,x,y,z\n", "expected 'node,ux,uy,uz'"),
        ("", "header"),
        ("node,ux,uy,uz\n0,0,0\n", "K.csv"),
        ("node,ux,uy,uz\n0,0,zero,0\n", "line 2: 'zero' in column uy"),
        ("node,ux,uy,uz\n0,0,nan,0\n", "finite"),
        ("node,ux,uy,uz\n5,0,0,0\n", "node 5 does not exist"),
        ("node,ux,uy,uz\n", "names no degree of freedom"),
        ("node,ux,uy,uz\n0,,,\n", "names no degree of freedom"),
        ("\u{0}\u{1}\u{2}", "header"),
    ] {
        folder.write("K.csv", table);
        fails(&solve(&folder, &[]), &["K.csv", says]);
    }
    folder.write("K.csv", KNOWN);
    let forces = folder.write("F.csv", "node,ux,uy,uz\n");
    fails(&solve(&folder, &["--forces", &forces]), &["F.csv", "expected 'node,fx,fy,fz'"]);
    assert!(!std::path::Path::new(&folder.path("U.csv")).exists(), "nothing was written");
}

#[test]
fn refusals_of_the_server_are_passed_on_with_their_code() {
    let folder = tetrahedron();
    fails(&solve(&folder, &["--method", "magic"]), &["UnknownMethod", "magic", "sparse-cholesky"]);
    folder.write("K.csv", "node,ux,uy,uz\n0,0,0,0\n1,0,0,0\n");
    fails(&solve(&folder, &[]), &["RigidMotionFree", "turn about the axis", "three nodes"]);
    folder.write("K.csv", &format!("{KNOWN}4,0,0,0\n"));
    fails(&solve(&folder, &[]), &["BadRequest", "node 4", "no tetrahedron"]);
    folder.write("K.csv", &format!("{KNOWN}0,0,0,1\n"));
    fails(&solve(&folder, &[]), &["BadRequest", "node 0 axis z", "two displacements"]);
}

#[test]
fn server_that_is_not_there_or_wants_a_token_is_told_in_one_line() {
    let folder = tetrahedron();
    let closed = TcpListener::bind(("127.0.0.1", 0)).unwrap();
    let address = closed.local_addr().unwrap().to_string();
    drop(closed);
    fails(&solve(&folder, &["--server", &address]), &["no server answers at", &address]);
    fails(&solve(&folder, &["--server", "nonsense"]), &["nonsense", "HOST:PORT"]);
    let listen = SocketAddr::from(([127, 0, 0, 1], 0));
    let tokens = Some(fea_server::Tokens::of("hush"));
    let config = ServerConfig { listen, threads: 1, ..ServerConfig::default() };
    let closed = fea_server::start(ServerConfig { tokens, ..config.clone() }).unwrap();
    let address = closed.address().to_string();
    fails(&solve(&folder, &["--server", &address]), &["NotAuthorised", "token"]);
    let open = fea_server::start(config).unwrap();
    let address = open.address().to_string();
    succeed(&solve(&folder, &["--server", &address]));
    let remote = folder.read("U.csv");
    succeed(&solve(&folder, &["--server", "embedded", "--threads", "3"]));
    assert_eq!(folder.read("U.csv"), remote, "the same text from both");
}

#[test]
fn wrong_usage_ends_with_exit_code_2() {
    let folder = tetrahedron();
    for more in [
        &["--nonsense"][..],
        &["--element", "t7"],
        &["--out", "U.txt"],
        &["--method", "No Method"],
        &["--young", "stiff"],
        &["--max-error", "0"],
        &["--max-error", "nan"],
        &["--deadline=-3"],
        &["stray"],
    ] {
        let said = fail(2, &solve(&folder, more));
        assert!(said.starts_with("error: "), "{more:?}: {said}");
    }
    for arguments in [
        &["solve"][..],
        &["inspect"],
        &["mesh", "cube"],
        &["mesh", "teapot", "--nodes", "64", "--out", "x.msh"],
        &["no-such-command"],
    ] {
        let said = fail(2, arguments);
        assert!(said.starts_with("error: "), "{arguments:?}: {said}");
    }
}

#[test]
fn inspection_as_json_says_what_is_there() {
    let folder = tetrahedron();
    let printed = succeed(&["inspect", "--json", &folder.path("t.node")]);
    let told: Value = serde_json::from_str(&printed).unwrap();
    assert!(told["schema"].as_u64().unwrap() >= 1);
    assert_eq!(told["nodes"], 5);
    assert_eq!(told["tets"], 1);
    assert_eq!(told["orphans"], 1);
    assert_eq!(told["usable"], true);
    let plain = succeed(&["inspect", &folder.path("t.node")]);
    assert!(plain.contains("tetrahedra") && plain.contains("can be used"), "{plain}");
}

#[test]
fn closed_pipe_is_harmless() {
    let folder = tetrahedron();
    let mesh = folder.path("t.node");
    let out = folder.path("cube.msh");
    let commands = [
        vec!["inspect".to_owned(), mesh.clone()],
        vec!["inspect".to_owned(), "--json".to_owned(), mesh],
        ["mesh", "cube", "--nodes", "64", "--out", &out].map(str::to_owned).to_vec(),
        solve(&folder, &[]),
    ];
    for arguments in commands {
        let (reader, writer) = std::io::pipe().unwrap();
        drop(reader);
        let mut command = command();
        command.args(&arguments).stdout(writer).stderr(Stdio::piped());
        let output = command.spawn().unwrap().wait_with_output().unwrap();
        let said = String::from_utf8_lossy(&output.stderr);
        assert_eq!((output.status.code(), &*said), (Some(0), ""), "{arguments:?}");
    }
}
