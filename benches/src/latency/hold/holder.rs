//! Client with a schedule: it asks a server at each tick, or waits for as long without asking.

use std::time::{Duration, Instant};

use fea_server::{RunningServer, ServerConfig};
use glove_client::ask::connection::{Host, LinkError, ServerChoice, ServerConnection};
use softgrasp_protocol::{Answer, Ask, ModelHash, NodeChoice, Request};

use super::kept::{Kept, Solved, keep};
use crate::reference::{Reference, error_rel};
use crate::report::{ReportError, check};
use crate::requests::{answer, upload};
use crate::sample::Spread;
use crate::scene::Pressed;

/// Largest error, relative to a direct solve, with which a time is reported.
const ERROR_ALLOWED: f64 = 1e-9;
/// Longest wait for a proof of the error bound.
const PROOF_MAX: Duration = Duration::from_secs(120);

/// Client with a server of its own.
pub(super) struct Holder<'a> {
    scene: &'a Pressed,
    /// Exact displacements of the surface nodes for the load of the scene, m.
    right: &'a [f64],
    model: ModelHash,
    connection: ServerConnection,
    /// Answer to the load of the scene.
    answer: Answer,
    /// Median time of an answer in the newest turn.
    usual: Duration,
    // Stops when dropped.
    _server: RunningServer,
}

/// Exact displacements of the surface nodes of a scene, m.
///
/// # Errors
/// [`ReportError`].
pub(super) fn right(scene: &Pressed) -> Result<Vec<f64>, ReportError> {
    let (model, known) = scene.model()?;
    let displacement = Reference::of(&model, &known)?.displacement;
    let of_node = |&n: &u32| displacement[3 * n as usize..3 * n as usize + 3].to_vec();
    Ok(scene.surface.nodes.iter().flat_map(of_node).collect())
}

impl<'a> Holder<'a> {
    /// Starts a server, with real-time scheduling or without, and uploads the scene's model.
    ///
    /// # Errors
    /// [`ReportError`].
    pub fn try_new(
        scene: &'a Pressed,
        right: &'a [f64],
        threads: usize,
        real_time: bool,
    ) -> Result<Self, ReportError> {
        let config = ServerConfig {
            listen: ([127, 0, 0, 1], 0).into(),
            threads,
            real_time,
            ..ServerConfig::default()
        };
        let server = fea_server::start(config).map_err(LinkError::from)?;
        let host = Host::open(&ServerChoice::At(server.address().to_string()), None)?;
        let mut connection = host.connect()?;
        let model = upload(&mut connection, scene.upload())?;
        let answer = proven(&mut connection, &request(scene, model, 1.0))?;
        let usual = Duration::ZERO;
        Ok(Self { scene, right, model, connection, answer, usual, _server: server })
    }

    /// Sends one request at each tick, with another load each time.
    ///
    /// # Errors
    /// [`ReportError`], also for an answer that differs from the direct solve.
    pub fn ask_for(&mut self, count: usize) -> Result<Kept, ReportError> {
        let Self { scene, right, model, connection, .. } = self;
        let kept = keep(
            count,
            |number| request(scene, *model, scale(number)),
            |request| answer(connection.ask_awake(request)),
            |number, answer| judge(right, &answer, scale(number)),
        )?;
        self.usual = Duration::from_secs_f64(1e-3 * Spread::of(kept.of(|t| t.work)).median);
        Ok(kept)
    }

    /// Control without requests: sleeps in the same way, stays awake for as long as an answer usually
    /// takes, and makes the same preparation and comparison.
    ///
    /// # Errors
    /// The same as those of [`Self::ask_for`].
    pub fn idle_for(&mut self, count: usize) -> Result<Kept, ReportError> {
        let Self { scene, right, model, answer, usual, .. } = self;
        keep(
            count,
            |number| request(scene, *model, scale(number)),
            |_| {
                let end = Instant::now() + *usual;
                while Instant::now() < end {
                    std::thread::yield_now();
                }
                Ok(())
            },
            |_, ()| judge(right, answer, 1.0).map(|_| Solved::default()),
        )
    }
}

/// Load of a tick; the displacements are proportional to it.
fn scale(number: u32) -> f64 {
    1.0 + 0.25 * (1e-2 * f64::from(number)).sin()
}

fn request(scene: &Pressed, model: ModelHash, scale: f64) -> Request {
    let nodes = NodeChoice::Nodes(scene.surface.nodes.clone());
    let question = scene.question("condensed", scale, nodes);
    Request::from(Ask::new(model, question))
}

/// Answer with its error bound. The proof is made in the background after an upload, and a session lasts
/// longer than the proof takes.
fn proven(connection: &mut ServerConnection, request: &Request) -> Result<Answer, ReportError> {
    let start = Instant::now();
    loop {
        let answer = answer(connection.ask_awake(request))?;
        if answer.report.error_bound_rel.is_some() || start.elapsed() > PROOF_MAX {
            return Ok(answer);
        }
        std::thread::sleep(Duration::from_millis(20));
    }
}

fn judge(right: &[f64], answer: &Answer, scale: f64) -> Result<Solved, ReportError> {
    let got = answer.displacements.clone().into_f64();
    let error_rel = match 3 * got.len() == right.len() {
        true => {
            let right = right.iter().map(|u| scale * u);
            error_rel(got.iter().flatten().copied().zip(right))
        }
        false => f64::INFINITY,
    };
    check(|| "a held frame".to_owned(), error_rel, ERROR_ALLOWED)?;
    let report = &answer.report;
    Ok(Solved {
        stages: report.stage_ms,
        error_rel,
        residual_rel: report.residual_rel,
        error_bound_rel: report.error_bound_rel,
    })
}
