//! Runs whose server is killed in the middle: the reasons of the later ticks, and the same result in a
//! replay of their recordings.

use std::io::{Read, Write};
use std::net::{Shutdown, SocketAddr, TcpListener, TcpStream};
use std::sync::Arc;
use std::sync::atomic::{AtomicI64, Ordering};

use fea_server::{RunningServer, ServerConfig};
use serde_json::Value;

use crate::start::{Folder, fail, succeed};

/// Server behind a connection that is cut for good once so many bytes have gone to it.
struct Mortal {
    address: SocketAddr,
    left: Arc<AtomicI64>,
    _server: RunningServer,
}

impl Mortal {
    fn dies_after(bytes: i64) -> Self {
        let listen = SocketAddr::from(([127, 0, 0, 1], 0));
        let config = ServerConfig { listen, threads: 2, ..ServerConfig::default() };
        let server = fea_server::start(config).unwrap();
        let (behind, way) = (server.address(), TcpListener::bind(listen).unwrap());
        let address = way.local_addr().unwrap();
        let left = Arc::new(AtomicI64::new(bytes));
        let counted = Arc::clone(&left);
        std::thread::spawn(move || {
            for client in way.incoming().map_while(Result::ok) {
                if counted.load(Ordering::SeqCst) <= 0 {
                    return;
                }
                let server = TcpStream::connect(behind).unwrap();
                let (to, from) = (client.try_clone().unwrap(), server.try_clone().unwrap());
                let counted = Arc::clone(&counted);
                std::thread::spawn(move || {
                    pass_on(client, server, |bytes| {
                        counted.fetch_sub(bytes, Ordering::SeqCst) > bytes
                    })
                });
                std::thread::spawn(move || pass_on(from, to, |_| true));
            }
        });
        Self { address, left, _server: server }
    }
}

/// Passes on bytes as long as `goes_on`, then closes both sides.
fn pass_on(mut from: TcpStream, mut to: TcpStream, goes_on: impl Fn(i64) -> bool) {
    let mut buffer = [0; 1 << 16];
    while let Ok(count) = from.read(&mut buffer) {
        if count == 0 || !goes_on(count as i64) || to.write_all(&buffer[..count]).is_err() {
            break;
        }
    }
    let _ = (from.shutdown(Shutdown::Both), to.shutdown(Shutdown::Both));
}

/// Report of a recorded run in real time with a small strawberry.
fn run(folder: &Folder, server: &Mortal, more: &[&str]) -> Value {
    let (path, report) = (folder.path("run.mcap"), folder.path("run.json"));
    let address = server.address.to_string();
    let usual = ["run", "--headless", "--nodes", "300", "--rate", "60"];
    let files = ["--server", &address, "--record", &path, "--report", &report];
    succeed(&[&usual[..], &files, more].concat());
    serde_json::from_str(&folder.read("run.json")).unwrap()
}

/// Kills the server when each of these shares of all bytes has gone to it, in a run of its own, all at once: they
/// wait most of the time. Checks each run and its replay.
fn check_runs(shares: &[f64], more: &[&str]) {
    let whole = Mortal::dies_after(i64::MAX);
    run(&Folder::new(), &whole, more);
    let all = i64::MAX - whole.left.load(Ordering::SeqCst);
    let after_it_was_killed: u32 = std::thread::scope(|scope| {
        let check = |share| scope.spawn(move || ticks_without_server(share, all, more));
        let checks: Vec<_> = shares.iter().map(|share| check(*share)).collect();
        checks.into_iter().map(|check| check.join().unwrap()).sum()
    });
    assert!(after_it_was_killed > 20, "{after_it_was_killed} ticks are said to have had no server");
}

/// Number of ticks that a run says to have had no server, which was killed after a share of all bytes; no later
/// tick waits for an answer, and the replay is the run.
fn ticks_without_server(share: f64, all: i64, more: &[&str]) -> u32 {
    let folder = Folder::new();
    let mortal = Mortal::dies_after((share * all as f64) as i64);
    let report = run(&folder, &mortal, more);
    let events = report["events"].as_array().unwrap();
    let lost = events.iter().find(|e| e["what"].as_str().unwrap().starts_with("lost: "));
    let lost = lost.unwrap_or_else(|| panic!("{share}: it was never killed"))["tick"].as_u64();
    let ticks = report["frames"].as_array().unwrap().iter();
    let mut without_server = 0;
    for tick in ticks.filter(|tick| tick["tick"].as_u64() > lost) {
        let why = &tick["unanswered"];
        assert_ne!(why, "answer_late", "{share}: tick {} of {lost:?}", tick["tick"]);
        without_server += u32::from(why == "server_lost");
    }
    succeed(&["replay", &folder.path("run.mcap"), "--check"]);
    without_server
}

#[test]
fn ticks_after_a_killed_server_are_not_said_to_wait_for_a_late_answer_when_grasped_by_contact() {
    check_runs(&[0.4, 0.6, 0.8], &[]);
}

#[test]
fn recording_of_a_run_whose_server_was_killed_is_repeated_by_the_rules_of_the_thesis() {
    check_runs(&[0.4, 0.6, 0.8], &["--grasp", "thesis", "--hand", "scripted:release"]);
}

#[test]
fn report_of_a_press_whose_server_was_killed_has_the_steps_before() {
    let folder = Folder::new();
    let [mesh, report] = ["ball.msh", "r.json"].map(|name| folder.path(name));
    succeed(&["mesh", "sphere", "--nodes", "150", "--out", &mesh]);
    let bodies = folder.write(
        "bodies.toml",
        "end = 0.2\n[[body]]\nname = \"table\"\nshape = \"plane\"\nnormal = [0, 0, 1]\n\
         poses = [[0, 0, 0, -0.035, 1, 0, 0, 0]]\n",
    );
    let press = |server: &Mortal| {
        let files = ["--mesh", &mesh, "--bodies", &bodies, "--report", &report];
        let address = server.address.to_string();
        [&["press", "--server", &address][..], &files]
            .concat()
            .iter()
            .map(|s| (*s).to_owned())
            .collect()
    };
    let steps = || -> Value { serde_json::from_str(&folder.read("r.json")).unwrap() };
    let whole = Mortal::dies_after(i64::MAX);
    let arguments: Vec<String> = press(&whole);
    succeed(&arguments);
    let (all, bytes) = (steps(), i64::MAX - whole.left.load(Ordering::SeqCst));
    assert_eq!(all["ended_early"], Value::Null);
    let mortal = Mortal::dies_after(bytes * 7 / 10);
    let arguments: Vec<String> = press(&mortal);
    let said = fail(1, &arguments);
    let some = steps();
    let count = some["steps"].as_array().unwrap().len();
    assert!((1..20).contains(&count), "{count}");
    assert!(said.contains(&format!("the press ends after {count} step")), "{said}");
    assert!(some["ended_early"].as_str().unwrap().contains(&format!("after {count} step")));
    for (some, all) in
        some["steps"].as_array().unwrap().iter().zip(all["steps"].as_array().unwrap())
    {
        assert_eq!(some["object_pose"], all["object_pose"]);
    }
}
