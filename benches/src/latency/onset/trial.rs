//! Measures first frames of grips, with and without prefetch, and checks their answers.

use std::collections::VecDeque;
use std::sync::Arc;
use std::time::{Duration, Instant};

use glove_client::ask::connection::{Host, ServerConnection};
use softgrasp_core::model::Model;
use softgrasp_core::solve::{FrontAnalysis, FrontFactor, Loads, Method};
use softgrasp_protocol::{
    Answer, Ask, MethodName, ModelHash, NodeChoice, Prefetch, Question, Reply, Request, StageMs,
    Want,
};

use super::grips::Grip;
use crate::reference::error_rel;
use crate::report::{ReportError, check};
use crate::requests::{answer, upload};
use crate::sample::timed_ms;
use crate::scene::Pressed;

/// Largest error, relative to a direct solve, with which a time is reported.
const ERROR_ALLOWED: f64 = 1e-9;
/// Longest wait for a proof of the error bound.
const PROOF_MAX: Duration = Duration::from_secs(120);
/// Pause before a touch, besides a multiple of the time that a touch takes.
const REST: Duration = Duration::from_millis(5);
/// Pause before a touch, as a multiple of the time that its columns take: a finger comes near as slowly.
const REST_TOUCHES: f64 = 3.0;
/// Number of latest touches that tell how long one takes.
const RECENT: usize = 8;

/// First frame of one grip.
pub(super) struct Trial {
    pub ms: f64,
    pub stages: StageMs,
    pub residual_rel: f64,
}

/// Client that touches a kept model at different nodes.
pub(super) struct Toucher<'a> {
    scene: &'a Pressed,
    connection: ServerConnection,
    model: ModelHash,
    /// Times of the latest touches without prefetch, ms.
    recent_ms: VecDeque<f64>,
}

impl<'a> Toucher<'a> {
    /// Uploads the object again, so that no column is kept, and waits until the server has no work.
    pub fn try_new(host: &Host, scene: &'a Pressed) -> Result<Self, ReportError> {
        let mut connection = host.connect()?;
        let object = scene.upload();
        let known = ModelHash::of(&object);
        if let Reply::ModelState { known: true } = connection.ask(&Request::HaveModel(known))? {
            connection.send(&Request::Drop(known))?;
        }
        let model = upload(&mut connection, object)?;
        Ok(Self { scene, connection, model, recent_ms: VecDeque::new() })
    }

    /// Touches until the proof of the error bound, which is made after an upload, is done.
    pub fn settle(&mut self, grip: &Grip) -> Result<(), ReportError> {
        let start = Instant::now();
        while start.elapsed() < PROOF_MAX {
            if self.ask(grip)?.1.report.error_bound_rel.is_some() {
                break;
            }
            std::thread::sleep(Duration::from_millis(20));
        }
        Ok(())
    }

    /// Pauses, prefetches the new nodes if asked to, pauses, touches.
    pub fn touch(
        &mut self,
        grip: &Grip,
        is_prefetched: bool,
    ) -> Result<(Trial, Vec<f64>), ReportError> {
        self.rest();
        if is_prefetched {
            let (model, nodes, masks) = (self.model, grip.fresh.clone(), Default::default());
            self.connection.send(&Request::Prefetch(Prefetch { model, nodes, masks }))?;
            self.rest();
        }
        let (ms, answer) = self.ask(grip)?;
        if !is_prefetched {
            self.recent_ms.truncate(RECENT - 1);
            self.recent_ms.push_front(ms);
        }
        let report = answer.report;
        check(|| "the residual of a first frame".to_owned(), report.residual_rel, ERROR_ALLOWED)?;
        let displacement: Vec<f64> =
            answer.displacements.into_f64().into_iter().flatten().collect();
        let error = self.error_at_touched(grip, &displacement);
        check(|| "the touched nodes of a first frame".to_owned(), error, ERROR_ALLOWED)?;
        let trial = Trial { ms, stages: report.stage_ms, residual_rel: report.residual_rel };
        Ok((trial, displacement))
    }

    /// Pauses for longer than the columns of a grip take, so that prefetch and strain are done.
    fn rest(&self) {
        let slowest_ms = self.recent_ms.iter().copied().fold(0.0, f64::max);
        std::thread::sleep(REST + Duration::from_secs_f64(1e-3 * REST_TOUCHES * slowest_ms));
    }

    fn ask(&mut self, grip: &Grip) -> Result<(f64, Answer), ReportError> {
        let request = Request::from(Ask::new(self.model, self.question(grip)));
        let (ms, reply) = timed_ms(|| self.connection.ask_awake(&request));
        Ok((ms, answer(reply)?))
    }

    fn question(&self, grip: &Grip) -> Question {
        Question {
            known: grip.known.clone(),
            method: MethodName::try_new("condensed").expect("the name can be sent"),
            want: Want {
                nodes: NodeChoice::Nodes(self.scene.surface.nodes.clone()),
                reactions: false,
                ..Want::default()
            },
            ..Question::default()
        }
    }

    /// Distance of the touched nodes from their prescribed positions, m; infinite if some are missing.
    fn error_at_touched(&self, grip: &Grip, displacement: &[f64]) -> f64 {
        let surface = &self.scene.surface.nodes;
        if displacement.len() != 3 * surface.len() {
            return f64::INFINITY;
        }
        let at = |dof: u32| {
            let place = surface.binary_search(&(dof / 3)).ok()?;
            displacement.get(3 * place + dof as usize % 3).copied()
        };
        error_rel(grip.known.iter().map(|k| (at(k.dof).unwrap_or(f64::NAN), k.value)))
    }
}

/// Error of an answer against a direct solve of the same grip.
///
/// Shapes: `displacement` 3 for each surface node, m.
///
/// # Errors
/// [`ReportError::Wrong`] if the error is above 1e-9.
pub(super) fn error_of(
    scene: &Pressed,
    model: &Model,
    grip: &Grip,
    displacement: &[f64],
) -> Result<f64, ReportError> {
    let known = model.known(grip.known.iter().map(|k| (k.dof, k.value)).collect())?;
    let factored = model.factor(&known.dofs, Method::Front, &mut |_| {})?;
    let loads = Loads { q_known: &known.q_known, ..Loads::default() };
    let right = factored.solve(model.stiffness(), loads, &mut |_| {})?.displacement;
    let at_surface = scene.surface.nodes.iter().flat_map(|&n| {
        let first = 3 * n as usize;
        right[first..first + 3].iter().copied()
    });
    let error = error_rel(displacement.iter().copied().zip(at_surface));
    check(|| "the first frame of a grip".to_owned(), error, ERROR_ALLOWED)?;
    Ok(error)
}

/// One solve with the factor of a held shape: the least work for a column of the compliance.
pub(super) struct SparseSolve {
    factor: FrontFactor<f64>,
    rows: usize,
}

impl SparseSolve {
    /// Factors the shape with its five touched nodes held, of which the base holds two.
    pub fn try_new(scene: &Pressed, model: &Model) -> Result<Self, ReportError> {
        let dofs: Vec<u32> = scene.pairs.iter().map(|&(dof, _)| dof).collect();
        let partition = model.held_partition(&dofs)?;
        let analysis = Arc::new(FrontAnalysis::new(model.stiffness(), &partition));
        let rows = analysis.row_count();
        let factor = FrontFactor::try_new(&analysis, model.stiffness())
            .map_err(|_| ReportError::NoFactor)?;
        Ok(Self { factor, rows })
    }

    /// Time of one solve with a unit force, on the current pool, ms. The factor is in the caches as far
    /// as it fits, because another solve precedes.
    pub fn once(&self, row: usize) -> f64 {
        let mut load = vec![0.0; self.rows];
        if let Some(b) = load.get_mut(row % self.rows.max(1)) {
            *b = 1.0;
        }
        self.factor.solve_in_place(&mut load.clone(), 1);
        timed_ms(|| self.factor.solve_in_place(&mut load, 1)).0
    }
}
