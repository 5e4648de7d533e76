//! Fifty sessions that upload, ask, keep shapes, drop and go, all by a seed: every answer has the bits it
//! has alone, nobody is left waiting, and the memory stays within its limit.

use std::collections::BTreeMap;
use std::net::SocketAddr;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::time::{Duration, Instant};

use fea_server::{RunningServer, ServerConfig};
use glove_client::ask::connection::{LinkError, ServerConnection};
use softgrasp_core::mesh::TetMesh;
use softgrasp_protocol::{ModelHash, RejectCode, Reply, Request, UploadModel};
use softgrasp_tests::heard::displacement_hash;
use softgrasp_tests::questions::{Once, cube, frame, once, question, squeeze, upload};
use softgrasp_tests::random::Random;
use softgrasp_tests::watchdog::within;

use crate::start::{answer, client, config};

const SESSIONS: usize = 50;
/// Time for which the crowd goes on, s, unless `CROWD_SECONDS` says another.
const SECONDS: u64 = 12;
/// Memory limit of the server, bytes: room for a few of the models, so that they displace each other.
const MEMORY_LIMIT: u64 = 32 << 20;
/// Sizes of the displacements that are asked about.
const PUSHES: [f64; 4] = [1.0, 0.5, -0.5, 0.25];
const METHODS: [&str; 3] = ["sparse-cholesky", "front", "dense-cholesky"];

/// Mesh that some sessions ask about, and its answers from a server without other clients.
struct Subject {
    mesh: TetMesh,
    message: UploadModel,
    hash: ModelHash,
    /// Hash of the answer, by displacement and method.
    expected: BTreeMap<(usize, usize), u64>,
}

impl Subject {
    fn new(mesh: TetMesh, quiet: &RunningServer) -> Self {
        let message = upload(&mesh);
        let hash = ModelHash::of(&message);
        let mut connection = client(quiet);
        connection.ask(&Request::UploadModel(message.clone())).unwrap();
        let mut expected = BTreeMap::new();
        for push in 0..PUSHES.len() {
            for method in 0..METHODS.len() {
                let request = Request::from(frame(&mesh, PUSHES[push], METHODS[method]));
                let found = answer(&mut connection, &request);
                expected.insert((push, method), displacement_hash(&found.displacements));
            }
        }
        Self { mesh, message, hash, expected }
    }

    fn once(&self, push: usize, method: usize) -> Request {
        let question = question(squeeze(&self.mesh, PUSHES[push]), METHODS[method]);
        Request::from(Once { question, ..once(&self.mesh, "auto") })
    }
}

/// One session after the other of a client, until the time is over.
struct Life<'a> {
    address: SocketAddr,
    subjects: &'a [Subject],
    random: Random,
    answers: &'a AtomicU64,
    refused: &'a AtomicU64,
}

impl Life<'_> {
    fn live(&mut self, until: Instant) {
        while Instant::now() < until {
            let mut connection = match ServerConnection::connect(self.address.to_string()) {
                Ok(connection) => connection,
                // Those who went in mid-request keep their places for a while.
                Err(LinkError::Rejected(rejected)) if rejected.code == RejectCode::Busy => {
                    std::thread::sleep(Duration::from_millis(50));
                    continue;
                }
                Err(error) => panic!("{error}"),
            };
            // The first is shared by all, the others are for few.
            let own = 1 + self.random.below(self.subjects.len() - 1);
            for _ in 0..1 + self.random.below(12) {
                let subject = match self.random.below(3) {
                    0 => &self.subjects[0],
                    _ => &self.subjects[own],
                };
                let (push, method) = (self.random.below(PUSHES.len()), self.random.below(3));
                self.act(&mut connection, subject, push, method);
            }
            if self.random.below(3) == 0 {
                // Goes in mid-request.
                let subject = &self.subjects[own];
                let _ = connection.send(&Request::UploadModel(subject.message.clone()));
                let _ = connection.send(&subject.once(0, 0));
            }
        }
    }

    fn act(
        &mut self,
        connection: &mut ServerConnection,
        subject: &Subject,
        push: usize,
        method: usize,
    ) {
        match self.random.below(12) {
            0 => connection.send(&Request::Drop(subject.hash)).map(drop).unwrap(),
            1 => self.check(connection, subject, &subject.once(push, method), (push, method)),
            2 => drop(connection.ask(&Request::HaveModel(subject.hash)).unwrap()),
            _ => {
                let request = Request::from(frame(&subject.mesh, PUSHES[push], METHODS[method]));
                self.check(connection, subject, &request, (push, method));
            }
        }
    }

    /// Asks, and uploads the model first if the server has dropped it; checks the bits.
    fn check(
        &mut self,
        connection: &mut ServerConnection,
        subject: &Subject,
        request: &Request,
        which: (usize, usize),
    ) {
        for _ in 0..20 {
            match connection.ask(request) {
                Ok(Reply::Answer(answer)) => {
                    let found = displacement_hash(&answer.displacements);
                    assert_eq!(found, subject.expected[&which], "wrong bits");
                    self.answers.fetch_add(1, Ordering::Relaxed);
                    return;
                }
                Err(LinkError::Rejected(rejected)) => match rejected.code {
                    RejectCode::UnknownModel => {
                        let brought =
                            connection.ask(&Request::UploadModel(subject.message.clone()));
                        match brought {
                            Ok(Reply::ModelReady(ready)) => assert_eq!(ready.model, subject.hash),
                            Err(LinkError::Rejected(rejected))
                                if rejected.code == RejectCode::MemoryLimit =>
                            {
                                self.refused.fetch_add(1, Ordering::Relaxed);
                            }
                            other => panic!("{other:?}"),
                        }
                    }
                    // Others have reserved what this would need; it is tried again.
                    RejectCode::MemoryLimit => {
                        self.refused.fetch_add(1, Ordering::Relaxed);
                        std::thread::sleep(Duration::from_millis(self.random.below(20) as u64));
                    }
                    _ => panic!("{}", rejected.text),
                },
                other => panic!("{other:?}"),
            }
        }
    }
}

/// Value of a metric on the server's page.
fn number(pages: SocketAddr, name: &str) -> f64 {
    use std::io::{Read, Write};
    let mut stream = std::net::TcpStream::connect(pages).unwrap();
    write!(stream, "GET /metrics HTTP/1.1\r\n\r\n").unwrap();
    let mut text = String::new();
    stream.read_to_string(&mut text).unwrap();
    text.lines().find_map(|line| line.strip_prefix(name)?.trim().parse().ok()).unwrap()
}

#[test]
fn fifty_sessions_at_random_get_the_bits_they_would_get_alone_within_the_memory_limit() {
    let seconds = std::env::var("CROWD_SECONDS").ok().map(|text| text.parse().expect("a number"));
    let seconds = seconds.unwrap_or(SECONDS);
    let mut random = Random::from_environment("fifty sessions");
    within(Duration::from_secs(seconds + 200), "fifty sessions", move || {
        let quiet = fea_server::start(config(1)).unwrap();
        let sizes = [343, 125, 216, 343, 512, 729, 64, 1000, 27];
        let subjects: Vec<Subject> =
            sizes.iter().map(|&nodes| Subject::new(cube(nodes), &quiet)).collect();
        drop(quiet);
        let metrics = Some(SocketAddr::from(([127, 0, 0, 1], 0)));
        let limits = ServerConfig { memory_limit: MEMORY_LIMIT, metrics, ..config(2) };
        let server = fea_server::start(limits).unwrap();
        let (address, pages) = (server.address(), server.metrics().unwrap());
        let (answers, refused) = (AtomicU64::new(0), AtomicU64::new(0));
        let is_over = AtomicBool::new(false);
        let until = Instant::now() + Duration::from_secs(seconds);
        let peak = std::thread::scope(|scope| {
            let watches = scope.spawn(|| {
                let mut peak = 0.0f64;
                while !is_over.load(Ordering::Relaxed) {
                    let reserved = number(pages, "softgrasp_reserved_bytes ");
                    let kept = number(pages, "softgrasp_models_bytes ");
                    assert!(reserved <= MEMORY_LIMIT as f64, "{reserved} reserved");
                    assert!(kept <= MEMORY_LIMIT as f64, "{kept} kept");
                    peak = peak.max(kept);
                    std::thread::sleep(Duration::from_millis(20));
                }
                peak
            });
            let lives: Vec<_> = (0..SESSIONS)
                .map(|_| {
                    let random = Random::new(random.number());
                    let (subjects, answers, refused) = (&subjects[..], &answers, &refused);
                    let mut life = Life { address, subjects, random, answers, refused };
                    scope.spawn(move || life.live(until))
                })
                .collect();
            let ends: Vec<_> = lives.into_iter().map(std::thread::ScopedJoinHandle::join).collect();
            is_over.store(true, Ordering::Relaxed);
            for end in ends {
                end.unwrap();
            }
            watches.join().unwrap()
        });
        println!(
            "{} answers and {} refusals for want of memory in {seconds} s; {peak:.0} bytes kept at most",
            answers.into_inner(),
            refused.into_inner()
        );
        assert!(peak > 0.3 * MEMORY_LIMIT as f64, "the models never pressed on the limit");
        // All have gone: what they reserved is given back, and the server answers as before.
        softgrasp_tests::watchdog::until(Duration::from_secs(60), "idle again", || {
            number(pages, "softgrasp_sessions ") == 0.0
                && number(pages, "softgrasp_queued_requests ") == 0.0
                && number(pages, "softgrasp_reserved_bytes ") == 0.0
        });
        let found = answer(&mut client(&server), &subjects[1].once(0, 0));
        assert_eq!(displacement_hash(&found.displacements), subjects[1].expected[&(0, 0)]);
    });
}
