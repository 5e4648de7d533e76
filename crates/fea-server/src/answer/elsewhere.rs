//! Decides which questions are answered by the server's engine, and hands them over.

use std::sync::Arc;

use softgrasp_core::fem::{Element, StrainSummary};
use softgrasp_core::solve::choose::cheapest_element;
use softgrasp_core::solve::memory::Bytes;
use softgrasp_core::solve::{ERROR_SERIOUS, ERROR_UNREMARKABLE, Method};
use softgrasp_protocol::{
    Answer, Body, ModelHash, ModelReady, Question, TraceContext, UploadModel, Warning, WarningCode,
    WarningLevel,
};

use super::once::solve_once;
use super::several::solve_several;
use super::upload::upload;
use super::warnings::{add_unmet_wishes, locking_warning, strain_warnings};
use crate::budget::Reservation;
use crate::clock::StageClock;
use crate::engine::{ClusterMethod, Engine, Task};
use crate::machine_memory::available_bytes;
use crate::plan::Subject;
use crate::refusal::Refusal;
use crate::request::{
    check_node_count, element_given, element_of, name_of, poisson_max, question_of,
};
use crate::resources::Resources;

/// A question after it was looked at: answered here, or to be answered by the engine.
pub(crate) enum Placed {
    Here(Box<Answer>),
    Elsewhere(Box<HandedOver>),
}

/// A question for the engine, and why it gets it.
pub(crate) struct HandedOver {
    engine: Arc<dyn Engine>,
    task: Task,
    why: String,
    clock: StageClock,
    poisson_max: f64,
    /// Memory of the request, held until it is answered.
    _reservation: Reservation,
}

/// The engine that a question goes to, and why.
type Chosen = (Arc<dyn Engine>, String);

/// The engine that answers for a kept model, and the model.
pub(crate) type KeptElsewhere = (Arc<dyn Engine>, Arc<UploadModel>);

/// What a kept model is asked: a question and further cases of its known displacements.
pub(crate) type KeptQuestion = (ModelHash, Question, Vec<Vec<f64>>);

/// Answers a linear question about a mesh that came along, or prepares it for the engine.
///
/// # Errors
/// [`Refusal`] if the request cannot be answered.
pub(crate) fn place_once(
    resources: &Resources,
    (body, message): (Body, Question),
    (cases, estimate): (Vec<Vec<f64>>, bool),
    reservation: Reservation,
    clock: StageClock,
) -> Result<Placed, Refusal> {
    let Some((engine, why)) = engine_for(resources, &body, &message, &reservation)? else {
        let has_gradient = !message.quantity.is_empty();
        let answer = match cases.is_empty() && (estimate || has_gradient) {
            true => solve_once(resources, body, message, reservation, clock),
            false => {
                solve_several(resources, (body, message), (cases, estimate), reservation, clock)
            }
        };
        return answer.map(|answer| Placed::Here(Box::new(answer)));
    };
    check_node_count(&body.mesh, resources.config.max_nodes)?;
    let Body { mesh, materials, element } = body;
    let element =
        element_given(element).unwrap_or_else(|| cheapest_element(poisson_max(&materials)));
    let model = UploadModel { mesh, materials, element: name_of(element), fixed: Vec::new() };
    let task = Task {
        model: Arc::new(model),
        kept: None,
        question: message,
        cases,
        without_estimate: !estimate,
        trace: None,
    };
    handed_over(engine, task, why, (clock, reservation)).map(Placed::Elsewhere)
}

/// The engine and the model if the engine answers for a kept model.
///
/// # Errors
/// [`Refusal::NoCluster`] if it does not, and the question names one of its methods.
pub(crate) fn kept_elsewhere(
    resources: &Resources,
    hash: ModelHash,
    question: &Question,
) -> Result<Option<KeptElsewhere>, Refusal> {
    if let Some(engine) = &resources.config.engine
        && let Some(model) = resources.meshes.find(hash)
    {
        return Ok(Some((Arc::clone(engine), model)));
    }
    match ClusterMethod::named(question.method.as_str()) {
        Some(method) => Err(Refusal::NoCluster { method }),
        None => Ok(None),
    }
}

/// Prepares a question about a kept model for the engine.
///
/// # Errors
/// [`Refusal`] if the question cannot be answered there.
pub(crate) fn place_kept(
    resources: &Resources,
    (engine, model): KeptElsewhere,
    (hash, question, cases): KeptQuestion,
    without_estimate: bool,
    clock: StageClock,
) -> Result<Box<HandedOver>, Refusal> {
    let why = match engine.takes_all() {
        true => String::new(),
        false => "the model is too large for this server's memory".to_owned(),
    };
    let task = Task { model, kept: Some(hash), question, cases, without_estimate, trace: None };
    handed_over(engine, task, why, (clock, resources.budget.reservation()))
}

/// Keeps a model for the engine where that answers for it; else makes and keeps it here.
///
/// # Errors
/// [`Refusal`] if the model cannot be kept.
pub(crate) fn place_upload(
    resources: &Resources,
    hash: ModelHash,
    model: UploadModel,
    reservation: Reservation,
    clock: StageClock,
) -> Result<ModelReady, Refusal> {
    let reused = resources.meshes.find(hash).is_some();
    let is_kept = reused || resources.models.find(hash).is_some();
    let is_elsewhere = resources.config.engine.as_ref().is_some_and(|engine| {
        let subject = Subject::once(&model.mesh, model.fixed.len());
        let element = element_of(model.element);
        engine.takes_all() || shortage(&subject, element, &reservation).is_some()
    });
    if !reused && (is_kept || !is_elsewhere) {
        return upload(resources, hash, model, reservation, clock);
    }
    check_node_count(&model.mesh, resources.config.max_nodes)?;
    let size = Subject::once(&model.mesh, 0).problem.size;
    let mut fixed = model.fixed.clone();
    fixed.sort_unstable();
    fixed.dedup();
    let fixed_dofs = fixed.len() as u64;
    let unknown_dofs = (3 * size.nodes as u64).saturating_sub(fixed_dofs);
    if !reused {
        resources.meshes.keep(hash, Arc::new(model), reservation);
    }
    Ok(ModelReady { model: hash, unknown_dofs, fixed_dofs, reused, stage_ms: clock.finish() })
}

/// The engine that a question about a mesh goes to, and why; `None` if it is answered here.
fn engine_for(
    resources: &Resources,
    body: &Body,
    message: &Question,
    reservation: &Reservation,
) -> Result<Option<Chosen>, Refusal> {
    let method = ClusterMethod::named(message.method.as_str());
    let Some(engine) = &resources.config.engine else {
        return match method {
            Some(method) => Err(Refusal::NoCluster { method }),
            None => Ok(None),
        };
    };
    let found = |why: String| Ok(Some((Arc::clone(engine), why)));
    if engine.takes_all() {
        return found(String::new());
    }
    if method.is_some() {
        return found("asked for".to_owned());
    }
    // What is wrong with the question, the server's own way says.
    let is_open =
        matches!(question_of(message, None, 0.0), Ok(question) if question.method.is_none());
    let is_plain = message.want.fields.is_empty() && message.quantity.is_empty();
    if !is_open || !message.masks.is_empty() || !is_plain {
        return Ok(None);
    }
    let element = element_given(body.element)
        .unwrap_or_else(|| cheapest_element(poisson_max(&body.materials)));
    let subject = Subject::once(&body.mesh, message.known.len());
    match shortage(&subject, element, reservation) {
        Some(why) => found(why),
        None => Ok(None),
    }
}

/// Why no method of this server fits into its memory; `None` if one does.
fn shortage(subject: &Subject, element: Element, reservation: &Reservation) -> Option<String> {
    let needs = subject.predict(element, &[Method::Front, Method::FrontMixed, Method::Multigrid]);
    let free = reservation.free().min(available_bytes().unwrap_or(u64::MAX));
    let smallest = needs.iter().min_by_key(|need| need.bytes())?;
    (smallest.bytes() > free).then(|| {
        format!(
            "no method fits into this server's memory ({} is predicted to need {}, {} are free)",
            smallest.method,
            Bytes(smallest.bytes()),
            Bytes(free)
        )
    })
}

fn handed_over(
    engine: Arc<dyn Engine>,
    task: Task,
    why: String,
    (clock, reservation): (StageClock, Reservation),
) -> Result<Box<HandedOver>, Refusal> {
    let refused = |what, instead| Err(Refusal::NotByCluster { what, instead });
    let question = &task.question;
    if !question.masks.is_empty() {
        return refused("a question with masks", "name nodes, or ask a server for condensed");
    }
    if !question.want.fields.is_empty() {
        return refused("fields of strain and stress", "ask for displacements and reactions");
    }
    // Deadline and error budget are checked as everywhere; a name may be one of the engine's.
    match question_of(question, None, 0.0) {
        Err(Refusal::Method(_)) if ClusterMethod::named(question.method.as_str()).is_some() => {}
        checked => drop(checked?),
    }
    let poisson_max = poisson_max(&task.model.materials);
    Ok(Box::new(HandedOver { engine, task, why, clock, poisson_max, _reservation: reservation }))
}

impl HandedOver {
    /// Asks the engine, as part of a trace. Dropping the future tells the engine that nobody waits any more.
    ///
    /// # Errors
    /// The engine's refusal.
    pub async fn answer(self, trace: Option<TraceContext>) -> Result<Answer, Refusal> {
        let Self { engine, task, why, clock, poisson_max, _reservation: _held } = self;
        let (question, element) = (task.question.clone(), element_of(task.model.element));
        let mut answer = engine.answer(Task { trace, ..task }).await.map_err(Refusal::Elsewhere)?;
        let report = &mut answer.report;
        if !why.is_empty() {
            report.chosen_because = match report.chosen_because.is_empty() {
                true => why,
                false => format!("{why}; {}", report.chosen_because),
            };
        }
        let own = clock.finish();
        report.stage_ms.decode += own.decode;
        report.stage_ms.queue += own.queue;
        // A server on the way adds nothing to what the last one has said.
        if engine.takes_all() {
            let (rotation_max, strain_max) =
                (report.max_rotation_deg.to_radians(), report.max_strain);
            report.warnings.extend(strain_warnings(StrainSummary { rotation_max, strain_max }));
            report.warnings.extend(locking_warning(element, poisson_max));
            if let Some(error_rel) = report.error_estimate_rel {
                let unremarkable = ERROR_UNREMARKABLE.max(question.max_error.unwrap_or(0.0));
                if error_rel > unremarkable {
                    report.warning_level = match error_rel > ERROR_SERIOUS {
                        true => WarningLevel::SERIOUS,
                        false => WarningLevel::CAUTION,
                    };
                    let text = format!(
                        "the displacements are estimated to be off by up to {error_rel:.0e} of the \
                         largest"
                    );
                    report.warnings.push(Warning::new(WarningCode::DIGITS, text));
                }
            }
            add_unmet_wishes(&question, report);
        }
        Ok(answer)
    }
}
