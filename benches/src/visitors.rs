//! Clients that ask frame questions at an even pace, whatever the server does, and check every answer.

use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use glove_client::ask::connection::ServerConnection;
use softgrasp_protocol::{
    Ask, Deformation, LargeAsk, LawName, ModelHash, NodeChoice, Pace, PathChoice, Reply, Request,
};

use crate::report_error::ReportError;
use crate::requests::upload;
use crate::scene::Pressed;

/// Kind of a frame question.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Kind {
    /// Linear elasticity: the answers are known to the last bit.
    Linear,
    /// Large deformation: the answers report their own error.
    Large,
}

/// Object, and the questions of clients about it, one after the other.
pub(crate) struct Subject {
    kind: Kind,
    scene: Pressed,
    model: ModelHash,
    requests: Vec<Request>,
    /// Hash of the bits of each answer; empty for large deformation.
    expected: Vec<u64>,
}

/// Number of questions, which press in and out again by shares of the full press.
const PRESSES: usize = 32;

impl Subject {
    /// Object of about `nodes` nodes, and the answers of a server without other clients.
    ///
    /// # Errors
    /// [`ReportError`].
    pub fn new(kind: Kind, nodes: usize, address: &str) -> Result<Self, ReportError> {
        let scene = Pressed::try_new(softgrasp_core::mesh::BuiltIn::Cube, nodes)?;
        let model = ModelHash::of(&scene.upload());
        let surface = NodeChoice::Nodes(scene.surface.nodes.clone());
        let pressed = |i: usize| {
            let turn = i as f64 / PRESSES as f64 * std::f64::consts::TAU;
            0.6 - 0.4 * turn.cos()
        };
        let question = |i: usize| scene.question("auto", pressed(i), surface.clone());
        let requests = (0..PRESSES).map(|i| match kind {
            Kind::Linear => Request::from(Ask::new(model, question(i))),
            Kind::Large => {
                let path = if i == 0 { PathChoice::FromRest } else { PathChoice::Continue };
                let large = LargeAsk {
                    deformation: Deformation::Large,
                    law: LawName::NeoHookean,
                    yield_stress: None,
                    path,
                    pace: Pace::Timely,
                };
                let mut question = question(i);
                question.max_error = Some(2e-3);
                Request::from(Ask { large: Some(large), ..Ask::new(model, question) })
            }
        });
        let requests = requests.collect();
        let mut this = Self { kind, scene, model, requests, expected: Vec::new() };
        let mut connection = this.connect(address)?;
        if kind == Kind::Linear {
            for request in &this.requests {
                let answer = crate::requests::answer(connection.ask(request))?;
                this.expected.push(hash(answer.displacements.into_f64()));
            }
        }
        Ok(this)
    }

    /// Client whose server keeps the model.
    ///
    /// # Errors
    /// [`ReportError::Link`].
    pub fn connect(&self, address: &str) -> Result<ServerConnection, ReportError> {
        let mut connection = ServerConnection::connect(address)?;
        match connection.ask(&Request::HaveModel(self.model))? {
            Reply::ModelState { known: true } => {}
            _ => drop(upload(&mut connection, self.scene.upload())?),
        }
        Ok(connection)
    }

    /// Asks one question and checks the answer; returns whether it is right.
    ///
    /// # Errors
    /// [`ReportError::Link`].
    pub fn ask(
        &self,
        connection: &mut ServerConnection,
        number: usize,
    ) -> Result<bool, ReportError> {
        // The path begins at rest once; later rounds go on from its end.
        let at = match (self.kind, number) {
            (Kind::Large, n) if n > 0 && n % PRESSES == 0 => 1,
            (_, n) => n % PRESSES,
        };
        match connection.ask(&self.requests[at])? {
            Reply::Answer(answer) if self.kind == Kind::Linear => {
                Ok(self.expected.get(at) == Some(&hash(answer.displacements.into_f64())))
            }
            Reply::Answer(answer) => {
                let error = answer.report.error_estimate_rel;
                Ok(error.is_some_and(|error| error <= 2e-3))
            }
            other => Err(glove_client::ask::connection::unexpected("Ask", &other).into()),
        }
    }
}

/// Hash of the bits of all displacements.
fn hash(displacements: Vec<[f64; 3]>) -> u64 {
    displacements
        .iter()
        .flatten()
        .flat_map(|u| u.to_bits().to_le_bytes())
        .fold(0xcbf2_9ce4_8422_2325, |hash, byte| {
            (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3)
        })
}

/// Answers to the clients.
#[derive(Clone, Debug, Default)]
pub(crate) struct Heard {
    /// Times from the moment when a question was due to its answer, ms; waiting for an earlier answer
    /// counts.
    pub latencies_ms: Vec<f64>,
    /// Number of wrong answers.
    pub wrong: usize,
    /// Reasons of clients that were not answered to the end.
    pub failed: Vec<String>,
}

/// Runs `clients` clients that each ask `rate_hz` times a second, spread evenly, for the time `lasts`;
/// the first quarter of the time does not count.
pub(crate) fn visit(
    subject: &Subject,
    address: &str,
    clients: usize,
    rate_hz: f64,
    lasts: Duration,
) -> Heard {
    let period = Duration::from_secs_f64(1.0 / rate_hz);
    let counts_from = lasts / 4;
    let is_open = AtomicBool::new(true);
    // All have their models before the first frame is due.
    let connections: Vec<_> = (0..clients).map(|_| subject.connect(address)).collect();
    let begin = Instant::now() + Duration::from_millis(50);
    let one = |number: usize, connection: Result<ServerConnection, ReportError>| {
        let mut heard = Heard::default();
        let mut connection = match connection {
            Ok(connection) => connection,
            Err(error) => return Heard { failed: vec![error.to_string()], ..heard },
        };
        let first = begin + period.mul_f64(number as f64 / clients as f64);
        for frame in 0.. {
            let due = first + period * frame as u32;
            if due > begin + lasts || !is_open.load(Ordering::Relaxed) {
                break;
            }
            std::thread::sleep(due.saturating_duration_since(Instant::now()));
            match subject.ask(&mut connection, frame) {
                Ok(right) => heard.wrong += usize::from(!right),
                Err(error) => {
                    heard.failed.push(error.to_string());
                    break;
                }
            }
            if due > begin + counts_from {
                heard.latencies_ms.push(1e3 * due.elapsed().as_secs_f64());
            }
            // A server that is seconds behind does not catch up.
            if due.elapsed() > lasts {
                is_open.store(false, Ordering::Relaxed);
            }
        }
        heard
    };
    let all = std::thread::scope(|scope| {
        let threads: Vec<_> = connections
            .into_iter()
            .enumerate()
            .map(|(number, connection)| {
                let one = &one;
                scope.spawn(move || one(number, connection))
            })
            .collect();
        threads.into_iter().map(std::thread::ScopedJoinHandle::join).collect::<Vec<_>>()
    });
    let mut sum = Heard::default();
    for heard in all {
        match heard {
            Ok(heard) => {
                sum.latencies_ms.extend(heard.latencies_ms);
                sum.wrong += heard.wrong;
                sum.failed.extend(heard.failed);
            }
            Err(_) => sum.failed.push("the client ended abnormally".to_owned()),
        }
    }
    sum
}
