//! Frames of a moving hand over a socket, at a rate: delay and error of the answers.

use std::time::{Duration, Instant};

use glove_client::ask::connection::{Host, ServerChoice, ServerConnection};
use glove_client::ask::model_upload::mesh_data;
use softgrasp_core::mesh::{BuiltIn, Surface};
use softgrasp_protocol::{
    Answer, Ask, ElementName, LargeAsk, LargeReport, Masks, Material, ModelHash, NodeChoice, Pace,
    PathChoice, Question, Request, UploadModel, Want,
};

use super::squeeze::Squeeze;
use crate::report::ReportError;
use crate::requests::upload;
use crate::sample::{Spread, quantile};

/// Answers to a hand that moves at a rate.
pub(super) struct Held {
    pub nodes: usize,
    pub rate_hz: f64,
    pub frames: usize,
    /// Time from sending a frame question to having its answer, ms, of all but the first.
    pub ms: Spread,
    pub p99_ms: f64,
    /// Time of the first frame of the grip, which orders and makes the first factor, ms.
    pub first_ms: f64,
    pub estimate_max: f64,
    pub factor_age_max: u32,
    pub solves: Spread,
}

/// Squeezes in and out at a rate, several times, for a number of frames.
///
/// # Errors
/// [`ReportError`], also for a frame without equilibrium.
pub(super) fn hold_rate(
    nodes: usize,
    rate_hz: f64,
    frames: usize,
    threads: usize,
) -> Result<Held, ReportError> {
    let squeeze = Squeeze::new(BuiltIn::Strawberry, nodes, 0.4)?;
    let host = Host::open(&ServerChoice::Embedded, Some(threads))?;
    let mut connection = host.connect()?;
    let model = upload(&mut connection, model_of(&squeeze))?;
    let surface = Surface::from_mesh(squeeze.model.mesh()).nodes;
    // In for two seconds, out for two seconds.
    let in_frames = 2.0 * rate_hz;
    let (mut ms, mut solves) = (Vec::new(), Vec::new());
    let (mut estimate_max, mut factor_age_max, mut first_ms) = (0.0f64, 0, 0.0);
    let begin = Instant::now();
    for frame in 0..frames {
        let due = begin + Duration::from_secs_f64(frame as f64 / rate_hz);
        std::thread::sleep(due.saturating_duration_since(Instant::now()));
        let phase = (frame + 1) as f64 / in_frames % 2.0;
        let share = if phase <= 1.0 { phase } else { 2.0 - phase };
        let path = if frame == 0 { PathChoice::FromRest } else { PathChoice::Continue };
        let asked = frame_of(model, question_of(&squeeze, &surface, share), path);
        let start = Instant::now();
        let answered = answer(&mut connection, asked)?;
        let took = start.elapsed().as_secs_f64() * 1e3;
        if frame == 0 {
            first_ms = took;
            continue;
        }
        ms.push(took);
        solves.push(f64::from(of_large(&answered).linear_solves));
        let estimate = answered.report.error_estimate_rel.unwrap_or(f64::INFINITY);
        estimate_max = estimate_max.max(estimate);
        factor_age_max = factor_age_max.max(of_large(&answered).factor_age);
    }
    let mut sorted = ms.clone();
    sorted.sort_by(f64::total_cmp);
    Ok(Held {
        nodes: squeeze.model.mesh().node_count(),
        rate_hz,
        frames,
        p99_ms: quantile(&sorted, 0.99).unwrap_or(f64::NAN),
        ms: Spread::of(ms),
        first_ms,
        estimate_max,
        factor_age_max,
        solves: Spread::of(solves),
    })
}

fn model_of(squeeze: &Squeeze) -> UploadModel {
    let mesh = squeeze.model.mesh();
    UploadModel {
        mesh: mesh_data(mesh),
        materials: vec![Material { young: 2.0e4, poisson: 0.4 }],
        element: ElementName::T4,
        fixed: Vec::new(),
    }
}

fn question_of(squeeze: &Squeeze, surface: &[u32], share: f64) -> Question {
    let mut masks = Masks::default();
    for mask in &squeeze.masks {
        masks.push(mask.entries());
    }
    Question {
        masks,
        mask_displacements: squeeze.at(share).as_chunks().0.to_vec(),
        want: Want {
            nodes: NodeChoice::Nodes(surface.to_vec()),
            reactions: false,
            ..Want::default()
        },
        max_error: Some(2e-3),
        ..Question::default()
    }
}

fn frame_of(model: ModelHash, question: Question, path: PathChoice) -> Request {
    let large = LargeAsk { path, pace: Pace::Timely, ..LargeAsk::default() };
    Request::from(Ask { large: Some(large), ..Ask::new(model, question) })
}

fn of_large(answer: &Answer) -> LargeReport {
    answer.large.unwrap_or_default()
}

fn answer(connection: &mut ServerConnection, asked: Request) -> Result<Answer, ReportError> {
    crate::requests::answer(connection.ask(&asked))
}
