//! The same bits whatever the number of threads, for every method, over TCP.

use std::collections::BTreeMap;

use softgrasp_core::mesh::{BuiltIn, TetMesh};
use softgrasp_protocol::Request;
use softgrasp_tests::heard::displacement_hash;
use softgrasp_tests::questions::{METHODS, cube, frame, object, once, upload};

use crate::start::{answer, client, server};

const THREADS: [usize; 4] = [1, 2, 4, 7];

/// Meshes and the methods they are solved by: dense ones over several tiles with a remainder, a sparse
/// one with a tree deep enough to be shared among threads.
fn cases() -> Vec<(&'static str, TetMesh, &'static [&'static str])> {
    vec![
        ("cube of 64", cube(64), &METHODS),
        ("strawberry of 300", object(BuiltIn::Strawberry, 300), &METHODS),
        ("cube of 6000", cube(6000), &["sparse-cholesky", "auto"]),
    ]
}

#[test]
fn one_two_four_and_seven_threads_give_the_same_bits_for_every_method() {
    let cases = cases();
    let mut hashes: BTreeMap<(&str, &str, &str), Vec<u64>> = BTreeMap::new();
    for threads in THREADS {
        let server = server(threads);
        let mut connection = client(&server);
        assert_eq!(connection.welcome().threads as usize, threads);
        for (name, mesh, methods) in &cases {
            connection.ask(&Request::UploadModel(upload(mesh))).unwrap();
            for method in *methods {
                let whole = Request::from(once(mesh, method));
                let kept = Request::from(frame(mesh, 1.0, method));
                for (kind, request) in [("once", whole), ("frame", kept)] {
                    let answer = answer(&mut connection, &request);
                    assert!(answer.report.residual_rel < 1e-9, "{name}, {method}");
                    let hash = displacement_hash(&answer.displacements);
                    hashes.entry((name, method, kind)).or_default().push(hash);
                }
            }
        }
    }
    assert_eq!(hashes.len(), 2 * (2 * METHODS.len() + 2));
    for ((name, method, kind), found) in hashes {
        assert_eq!(found.len(), THREADS.len());
        assert!(found.iter().all(|&h| h == found[0]), "{name}, {method}, {kind}: {found:x?}");
        println!("{name}, {method}, {kind}: {:016x}", found[0]);
    }
}

#[test]
fn methods_agree_on_one_server() {
    let server = server(2);
    let mut connection = client(&server);
    for mesh in [cube(125), object(BuiltIn::Toothpaste, 200)] {
        let answers: Vec<Vec<[f64; 3]>> = METHODS
            .iter()
            .map(|method| {
                let request = Request::from(once(&mesh, method));
                answer(&mut connection, &request).displacements.into_f64()
            })
            .collect();
        let largest = answers[0].iter().flatten().fold(0.0, |most: f64, u| most.max(u.abs()));
        for (method, other) in METHODS.iter().zip(&answers).skip(1) {
            for (a, b) in answers[0].iter().flatten().zip(other.iter().flatten()) {
                assert!((a - b).abs() <= 1e-10 * largest, "{method}: {a:e} and {b:e}");
            }
        }
    }
}
