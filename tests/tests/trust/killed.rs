//! A server that is killed as by a power cut, and comes back or is replaced: clients go on by the name of
//! their model, and every answer has the bits of an undisturbed run.

use std::net::SocketAddr;
use std::time::{Duration, Instant};

use glove_client::ask::link::{Link, Reached, RequestEnd};
use glove_client::ask::model_upload::ModelUpload;
use glove_client::pace::tick_budget::Priority;
use softgrasp_core::mesh::TetMesh;
use softgrasp_protocol::{Question, UploadModel};
use softgrasp_tests::faulty_proxy::FaultyProxy;
use softgrasp_tests::questions::{cube, question, squeeze, upload};
use softgrasp_tests::random::Random;
use softgrasp_tests::server_process::{ServerProcess, serve_if_asked};
use softgrasp_tests::watchdog::{until, within};

const LIMIT: Duration = Duration::from_secs(240);
/// Time after which a test gives up waiting.
const PATIENCE: Duration = Duration::from_secs(60);
const TICKS: u64 = 40;

/// Not a test by itself: the server of the other tests, in a process of its own.
#[test]
fn server_process() {
    serve_if_asked();
}

fn start(address: SocketAddr) -> ServerProcess {
    ServerProcess::start("killed::server_process", address)
}

fn anywhere() -> SocketAddr {
    ([127, 0, 0, 1], 0).into()
}

fn model(mesh: &TetMesh) -> ModelUpload {
    let message: UploadModel = upload(mesh);
    let hash = softgrasp_protocol::ModelHash::of(&message);
    ModelUpload { rest_shape: 0, hash, message: std::sync::Arc::new(message) }
}

/// Question of a tick.
fn asked(mesh: &TetMesh, tick: u64) -> Question {
    question(squeeze(mesh, 1.0 - tick as f64 / 100.0), "sparse-cholesky")
}

fn bits(reached: &Reached) -> Vec<u64> {
    reached.displacement.iter().flatten().map(|u| u.to_bits()).collect()
}

/// Answers to all ticks, each awaited; `beside` is called after a tick has asked.
fn answers(address: SocketAddr, mesh: &TetMesh, mut beside: impl FnMut(u64)) -> Vec<Vec<u64>> {
    let link = Link::start(address.to_string(), Priority::Ordinary).unwrap();
    link.set_model(model(mesh));
    let mut answers = Vec::new();
    for tick in 0..TICKS {
        link.ask(tick, 0, asked(mesh, tick), None);
        beside(tick);
        let mut ended = Vec::new();
        until(PATIENCE, "an answer", || {
            ended.extend(link.take().1);
            !ended.is_empty()
        });
        let [RequestEnd { tick: of, reached: Ok(reached) }] = &ended[..] else {
            panic!("tick {tick}: {ended:?}")
        };
        assert_eq!(*of, tick);
        answers.push(bits(reached));
    }
    answers
}

#[test]
fn server_killed_in_mid_frame_and_in_mid_upload_comes_back_and_every_answer_has_the_same_bits() {
    within(LIMIT, "a server that is killed again and again", || {
        let mut random = Random::from_environment("killed server");
        let mesh = cube(343);
        let mut server = Some(start(anywhere()));
        let address = server.as_ref().unwrap().address();
        let expected = answers(address, &mesh, |_| {});
        server.take().unwrap().kill();
        server = Some(start(address));
        // The first tick brings the model, so kills fall into uploads as well.
        let found = answers(address, &mesh, |tick| {
            if tick % 3 == 0 {
                // A frame takes some milliseconds, an upload some tens.
                std::thread::sleep(Duration::from_micros(random.below(20_000) as u64));
                server.take().unwrap().kill();
                server = Some(start(address));
            }
        });
        assert_eq!(found, expected);
    });
}

#[test]
fn other_server_at_the_same_address_costs_at_most_one_frame_when_it_has_the_model() {
    within(LIMIT, "two servers behind one address", || {
        let mesh = cube(216);
        let servers = [start(anywhere()), start(anywhere())];
        let expected = servers.each_ref().map(|server| answers(server.address(), &mesh, |_| {}));
        assert_eq!(expected[0], expected[1]);
        let proxy = FaultyProxy::start(servers[0].address());
        let link = Link::start(proxy.address().to_string(), Priority::Ordinary).unwrap();
        link.set_model(model(&mesh));
        let mut servers = servers.into_iter();
        let mut first = servers.next();
        let second = servers.next().unwrap();
        let mut ended = Vec::new();
        for tick in 0..TICKS {
            if tick == TICKS / 2 {
                // Its clients are led to the other one from now on.
                proxy.lead_to(second.address());
                first.take().unwrap().kill();
            }
            link.ask(tick, 0, asked(&mesh, tick), None);
            // The hand does not wait; only the model is waited for.
            if tick == 0 {
                assert!(link.wait_idle(PATIENCE));
            }
            std::thread::sleep(Duration::from_millis(50));
            ended.extend(link.take().1);
        }
        assert!(link.wait_idle(PATIENCE));
        ended.extend(link.take().1);
        assert_eq!(ended.len(), TICKS as usize, "every request ends once");
        let lost: Vec<&RequestEnd> = ended.iter().filter(|end| end.reached.is_err()).collect();
        // A machine that stalls loses frames as well, but not most of them.
        assert!(lost.len() <= 1 + TICKS as usize / 4, "{lost:?}");
        println!("{} of {TICKS} frames lost", lost.len());
        for RequestEnd { tick, reached } in &ended {
            if let Ok(reached) = reached {
                assert_eq!(bits(reached), expected[0][*tick as usize], "tick {tick}");
            }
        }
    });
}

#[test]
fn server_that_comes_back_is_found_at_once() {
    within(LIMIT, "a server that comes back", || {
        let mesh = cube(64);
        let server = start(anywhere());
        let address = server.address();
        let link = Link::start(address.to_string(), Priority::Ordinary).unwrap();
        link.set_model(model(&mesh));
        link.ask(0, 0, asked(&mesh, 0), None);
        assert!(link.wait_idle(PATIENCE));
        link.take();
        server.kill();
        link.ask(1, 0, asked(&mesh, 1), None);
        until(PATIENCE, "the loss", || !link.is_connected());
        // By now the link rests for as long as it ever does between two tries.
        std::thread::sleep(Duration::from_secs(2));
        let _server = start(address);
        let back = Instant::now();
        until(PATIENCE, "the server again", || link.is_connected());
        println!("found {:.0} ms after it listened", 1e3 * back.elapsed().as_secs_f64());
        assert!(link.wait_idle(PATIENCE));
        let (_, ended) = link.take();
        assert!(matches!(&ended[..], [RequestEnd { tick: 1, reached: Ok(_) }]), "{ended:?}");
    });
}
