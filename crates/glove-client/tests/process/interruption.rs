//! Ctrl-C and its like: `run` ends with its report, other commands end at once.

#![cfg(unix)]

use std::io::{BufRead, BufReader};
use std::process::{Child, Command, Stdio};

use crate::start::{Folder, command, succeed};

fn signal(name: &str, child: &Child) {
    let kill = format!("kill -{name} {}", child.id());
    assert!(Command::new("sh").args(["-c", &kill]).status().unwrap().success());
}

#[test]
fn run_that_is_interrupted_writes_its_report() {
    for name in ["INT", "TERM", "HUP"] {
        let folder = Folder::new();
        let report = folder.path("report.json");
        let mut run = command();
        // Slow enough that it is still at work when the signal comes.
        run.args(["run", "--headless", "--object", "cube", "--nodes", "64", "--rate", "50"]);
        run.args(["--frames", "100000", "--report", &report]);
        run.env("RUST_LOG", "fea_server=info");
        let mut run = run.stdout(Stdio::null()).stderr(Stdio::piped()).spawn().unwrap();
        let mut log = BufReader::new(run.stderr.take().unwrap());
        // The first session asks what the server can do, the second is that of the ticks.
        let mut sessions = 0;
        let mut line = String::new();
        while sessions < 2 {
            line.clear();
            assert_ne!(log.read_line(&mut line).unwrap(), 0, "it ended before the signal");
            sessions += usize::from(line.contains("session begins"));
        }
        std::thread::spawn(move || log.lines().for_each(drop));
        signal(name, &run);
        assert_eq!(run.wait().unwrap().code(), Some(0), "SIG{name}");
        assert!(folder.read("report.json").contains("\"interrupted\": true"), "SIG{name}");
    }
}

#[test]
fn press_that_is_interrupted_writes_the_report_of_the_steps_before() {
    let folder = Folder::new();
    let [mesh, report, series] = ["ball.msh", "r.json", "series"].map(|name| folder.path(name));
    succeed(&["mesh", "sphere", "--nodes", "100", "--out", &mesh]);
    let bodies = folder.write(
        "bodies.toml",
        "end = 10000\n[[body]]\nname = \"table\"\nshape = \"plane\"\nnormal = [0, 0, 1]\n\
         poses = [[0, 0, 0, -0.035, 1, 0, 0, 0]]\n",
    );
    let mut press = command();
    press.args(["press", "--mesh", &mesh, "--bodies", &bodies, "--report", &report]);
    let press = press.args(["--series", &series]).stdout(Stdio::null()).stderr(Stdio::piped());
    let mut press = press.spawn().unwrap();
    let third = std::path::Path::new(&series).join("step_00003.vtu");
    while !third.exists() {
        assert!(press.try_wait().unwrap().is_none(), "it ended by itself");
        std::thread::sleep(std::time::Duration::from_millis(20));
    }
    signal("INT", &press);
    let ended = press.wait_with_output().unwrap();
    let said = String::from_utf8(ended.stderr).unwrap();
    assert_eq!(ended.status.code(), Some(1), "{said}");
    let report: serde_json::Value = serde_json::from_str(&folder.read("r.json")).unwrap();
    let count = report["steps"].as_array().unwrap().len();
    assert!(count >= 3, "{count}");
    let told = format!("the press ends after {count} steps");
    assert!(said.contains(&told) && said.contains("a signal has ended it"), "{said}");
    assert!(report["ended_early"].as_str().unwrap().contains(&told));
    assert!(folder.read("series/series.pvd").contains(&format!("step_{count:05}.vtu")));
}

#[test]
fn solve_that_is_interrupted_ends_with_the_shells_exit_code() {
    // A server that never answers.
    let listener = std::net::TcpListener::bind(("127.0.0.1", 0)).unwrap();
    listener.set_nonblocking(true).unwrap();
    let folder = Folder::new();
    let known = folder.write("known.csv", "node,ux,uy,uz\n0,0,0,0\n1,0,0,0\n2,0,0,0\n");
    let mesh = folder.write("one.msh", ONE_TETRAHEDRON);
    for (name, code) in [("INT", 130), ("TERM", 143)] {
        let mut solve = command();
        solve.args(["solve", "--mesh", &mesh, "--known", &known, "--out", &folder.path("U.csv")]);
        solve.args(["--server", &listener.local_addr().unwrap().to_string()]);
        let mut solve = solve.stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap();
        let stream = loop {
            match listener.accept() {
                Ok((stream, _)) => break stream,
                Err(_) => assert!(solve.try_wait().unwrap().is_none(), "it ended by itself"),
            }
        };
        signal(name, &solve);
        assert_eq!(solve.wait().unwrap().code(), Some(code), "SIG{name}");
        drop(stream);
    }
}

const ONE_TETRAHEDRON: &str = "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n4\n\
    1 0 0 0\n2 1 0 0\n3 0 1 0\n4 0 0 1\n$EndNodes\n$Elements\n1\n1 4 2 0 0 1 2 3 4\n$EndElements\n";
