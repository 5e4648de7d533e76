//! Many clients bring one mesh at the same moment: all of them are answered.
//!
//! Threads that wait inside a parallel loop take other requests from the queue. When one of them needed
//! a number that the loop they had left was working out (the condition of the base, the proof of its
//! smallest eigenvalue), it waited for itself, and with it everybody else.

use std::time::Duration;

use fea_server::RunningServer;
use softgrasp_core::mesh::TetMesh;
use softgrasp_protocol::{Ask, DofValue, Masks, Prefetch, Reply, Request};
use softgrasp_tests::heard::displacement_hash;
use softgrasp_tests::questions::{Once, cube, once, question, upload};
use softgrasp_tests::watchdog::within;

use crate::start::{answer, client, config};

const CLIENTS: usize = 8;
/// Time limit of a round, which takes less than a second on two cores.
const LIMIT: Duration = Duration::from_secs(100);
/// Number of rounds for each number of threads, unless `CROWD_ROUNDS` says another.
const ROUNDS: usize = 8;

/// Five touched nodes, far apart.
const TOUCHED: [u32; 5] = [0, 9, 90, 900, 999];

/// Five nodes moved by `push` each along another axis.
fn grip(push: f64) -> Vec<DofValue> {
    let of_node = |(i, node): (usize, &u32)| {
        let moved = move |axis: usize| if axis == i % 3 { 1e-3 * push } else { 0.0 };
        [0, 1, 2].map(|axis| DofValue { dof: 3 * node + axis as u32, value: moved(axis) })
    };
    TOUCHED.iter().enumerate().flat_map(of_node).collect()
}

/// Conversation of every client, at the same time as the others; hashes of its displacements.
fn hold_conversation(server: &RunningServer, mesh: &TetMesh) -> Vec<u64> {
    let mut connection = client(server);
    let uploaded = connection.ask(&Request::UploadModel(upload(mesh))).unwrap();
    let Reply::ModelReady(ready) = uploaded else { panic!("{uploaded:?}") };
    let hint = Prefetch { model: ready.model, nodes: (0..24).collect(), masks: Masks::default() };
    connection.send(&Request::Prefetch(hint)).unwrap();
    let mut heard = Vec::new();
    for push in [1.0, -0.5, 0.25] {
        for method in ["auto", "condensed", "front"] {
            let question = question(grip(push), method);
            let request = Request::from(Ask::new(ready.model, question));
            let answer = answer(&mut connection, &request);
            heard.push(displacement_hash(&answer.displacements));
        }
    }
    let once = Once { question: question(grip(1.0), "condensed"), ..once(mesh, "auto") };
    let answer = answer(&mut connection, &Request::from(once));
    heard.push(displacement_hash(&answer.displacements));
    heard
}

#[test]
fn crowd_that_brings_one_mesh_at_once_does_not_stand_still() {
    let mesh = cube(1000);
    let rounds = std::env::var("CROWD_ROUNDS").ok().map(|text| text.parse().expect("a number"));
    for threads in [2, 3, 4] {
        for round in 0..rounds.unwrap_or(ROUNDS) {
            let mesh = mesh.clone();
            within(LIMIT, &format!("round {round} with {threads} threads"), move || {
                let server = fea_server::start(config(threads)).unwrap();
                let start = std::sync::Barrier::new(CLIENTS);
                let heard: Vec<Vec<u64>> = std::thread::scope(|scope| {
                    let clients: Vec<_> = (0..CLIENTS)
                        .map(|_| {
                            scope.spawn(|| {
                                start.wait();
                                hold_conversation(&server, &mesh)
                            })
                        })
                        .collect();
                    clients.into_iter().map(|client| client.join().unwrap()).collect()
                });
                for one in &heard {
                    assert_eq!(one, &heard[0], "not the same bits for all");
                }
            });
        }
    }
}

#[test]
fn uploads_of_one_mesh_at_once_make_one_base() {
    within(LIMIT, "uploads at once", || {
        let server = fea_server::start(config(2)).unwrap();
        let mesh = cube(1000);
        let start = std::sync::Barrier::new(CLIENTS);
        let made: usize = std::thread::scope(|scope| {
            let clients: Vec<_> = (0..CLIENTS)
                .map(|_| {
                    scope.spawn(|| {
                        let mut connection = client(&server);
                        start.wait();
                        match connection.ask(&Request::UploadModel(upload(&mesh))).unwrap() {
                            Reply::ModelReady(ready) => usize::from(!ready.reused),
                            other => panic!("{other:?}"),
                        }
                    })
                })
                .collect();
            clients.into_iter().map(|client| client.join().unwrap()).sum()
        });
        assert_eq!(made, 1, "the base was made {made} times");
    });
}
