//! Several clients at the same time: no answer depends on the others.

use std::time::Duration;

use fea_server::ServerConfig;
use glove_client::ask::connection::ServerConnection;
use softgrasp_core::mesh::{BuiltIn, TetMesh};
use softgrasp_protocol::{ModelHash, RejectCode, Reply, Request};
use softgrasp_tests::heard::Heard;
use softgrasp_tests::questions::{METHODS, cube, frame, object, once, upload};
use softgrasp_tests::watchdog::within;

use crate::start::{answer, client, config, refusal, server};

const LIMIT: Duration = Duration::from_secs(120);
const ROUNDS: usize = 4;

/// Requests of eight clients: different meshes and methods, kept models and requests with their own mesh.
fn clients() -> Vec<Vec<Request>> {
    let meshes = [
        cube(64),
        cube(216),
        object(BuiltIn::Sphere, 150),
        object(BuiltIn::Strawberry, 200),
        object(BuiltIn::Toothpaste, 180),
        cube(27),
        cube(64),
        object(BuiltIn::Sphere, 400),
    ];
    let script = |(i, mesh): (usize, &TetMesh)| {
        let method = METHODS[(i + usize::from(i >= 4)) % 4];
        vec![
            Request::UploadModel(upload(mesh)),
            Request::from(frame(mesh, 1.0, method)),
            Request::from(once(mesh, METHODS[(i + 1) % 4])),
            Request::from(frame(mesh, -0.5, method)),
            Request::Ping { nonce: i as u64 },
        ]
    };
    meshes.iter().enumerate().map(script).collect()
}

fn hear(connection: &mut ServerConnection, requests: &[Request]) -> Vec<Heard> {
    requests.iter().map(|request| Heard::of(&connection.ask(request).unwrap())).collect()
}

#[test]
fn eight_clients_at_once_get_the_same_bits_as_each_alone() {
    within(LIMIT, "eight clients", || {
        let clients = clients();
        let alone: Vec<Vec<Heard>> = clients
            .iter()
            .map(|requests| {
                let server = server(2);
                hear(&mut client(&server), requests)
            })
            .collect();
        let shared = server(2);
        std::thread::scope(|scope| {
            for (requests, expected) in clients.iter().zip(&alone) {
                let shared = &shared;
                scope.spawn(move || {
                    let mut connection = client(shared);
                    for round in 0..ROUNDS {
                        let heard = hear(&mut connection, requests);
                        assert_eq!(&heard, expected, "round {round}");
                    }
                });
            }
        });
    });
}

#[test]
fn two_clients_share_a_model_and_its_factor() {
    let server = server(1);
    let (mut first, mut second) = (client(&server), client(&server));
    let mesh = cube(64);
    let ready = |reply| match reply {
        Ok(Reply::ModelReady(ready)) => ready,
        other => panic!("{other:?}"),
    };
    let made = ready(first.ask(&Request::UploadModel(upload(&mesh))));
    assert!(!made.reused);
    let known = Request::HaveModel(made.model);
    assert_eq!(second.ask(&known).unwrap(), Reply::ModelState { known: true });
    let again = ready(second.ask(&Request::UploadModel(upload(&mesh))));
    assert!(again.reused);
    assert_eq!((again.model, again.unknown_dofs), (made.model, made.unknown_dofs));
    let request = Request::from(frame(&mesh, 1.0, "auto"));
    let one = answer(&mut first, &request);
    let two = answer(&mut second, &request);
    assert!(!one.report.factor_reused && two.report.factor_reused);
    assert_eq!(one.displacements, two.displacements);
    // The model outlives the client that brought it.
    drop(first);
    assert_eq!(answer(&mut second, &request).displacements, two.displacements);
}

#[test]
fn model_dropped_by_one_client_stays_for_another_that_has_named_it() {
    let server = server(1);
    let (mut first, mut second) = (client(&server), client(&server));
    let mesh = cube(64);
    let hash = ModelHash::of(&upload(&mesh));
    first.ask(&Request::UploadModel(upload(&mesh))).unwrap();
    assert_eq!(second.ask(&Request::HaveModel(hash)).unwrap(), Reply::ModelState { known: true });
    first.send(&Request::Drop(hash)).unwrap();
    // In order: the drop has been heard before this is answered.
    first.ask(&Request::Ping { nonce: 1 }).unwrap();
    answer(&mut second, &Request::from(frame(&mesh, 1.0, "auto")));
    second.send(&Request::Drop(hash)).unwrap();
    second.ask(&Request::Ping { nonce: 2 }).unwrap();
    let (code, _) = refusal(&mut second, &Request::from(frame(&mesh, 1.0, "auto")));
    assert_eq!(code, RejectCode::UnknownModel);
}

#[test]
fn model_that_had_to_make_room_is_unknown_and_may_be_uploaded_again() {
    // The cubes take about 3, 6 and 13 MB with what is made for them.
    let limit = ServerConfig { memory_limit: 12_000_000, ..config(1) };
    let server = fea_server::start(limit).unwrap();
    let mut connection = client(&server);
    let meshes = [cube(216), cube(343), cube(512)];
    let bring = |connection: &mut ServerConnection, mesh: &TetMesh| {
        let uploaded = connection.ask(&Request::UploadModel(upload(mesh))).unwrap();
        assert!(matches!(uploaded, Reply::ModelReady(_)));
        Heard::of(&connection.ask(&Request::from(frame(mesh, 1.0, "auto"))).unwrap())
    };
    let heard: Vec<Heard> = meshes.iter().map(|mesh| bring(&mut connection, mesh)).collect();
    let gone = Request::HaveModel(ModelHash::of(&upload(&meshes[0])));
    assert_eq!(connection.ask(&gone).unwrap(), Reply::ModelState { known: false });
    let request = Request::from(frame(&meshes[0], 1.0, "auto"));
    let (code, text) = refusal(&mut connection, &request);
    assert_eq!(code, RejectCode::UnknownModel);
    assert!(text.contains("upload it"), "{text}");
    assert_eq!(bring(&mut connection, &meshes[0]), heard[0], "the same bits after coming back");
    let kept = Request::HaveModel(ModelHash::of(&upload(&meshes[0])));
    assert_eq!(connection.ask(&kept).unwrap(), Reply::ModelState { known: true });
}
