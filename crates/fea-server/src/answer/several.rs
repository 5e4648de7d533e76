//! Answers one request that holds mesh, partition and several sets of known displacements: one
//! matrix, one factor (thesis 3.43).

use softgrasp_core::model::{Known, Model};
use softgrasp_core::solve::Method;
use softgrasp_protocol::{Answer, Body, DofValue, Question};

use super::direct;
use super::once::Work;
use super::warnings::add_plan_warnings;
use crate::budget::Reservation;
use crate::clock::StageClock;
use crate::plan::{OnceRequest, Subject, plan_once};
use crate::refusal::Refusal;
use crate::request::{
    check_node_count, checked_forces, element_given, model_of, pairs, poisson_max, question_of,
};
use crate::resources::Resources;

/// Vectors of all degrees of freedom that one case holds while it is solved and afterwards: known and
/// unknown displacements, forces, products, residual, correction, answer.
const VECTORS_PER_CASE: usize = 12;

/// Answers a request with mesh, partition and several sets of known displacements: those of `message` and
/// `cases` more; `estimate`: whether to compute condition, error and strain too.
///
/// # Errors
/// [`Refusal`] if the request cannot be answered.
pub(crate) fn solve_several(
    resources: &Resources,
    (body, message): (Body, Question),
    (cases, estimate): (Vec<Vec<f64>>, bool),
    reservation: Reservation,
    mut clock: StageClock,
) -> Result<Answer, Refusal> {
    let Body { mesh, materials, element } = body;
    let asked_element = element_given(element);
    let poisson_max = poisson_max(&materials);
    let question = question_of(&message, asked_element, poisson_max)?;
    if !message.masks.is_empty() || question.method == Some(Method::Condensed) {
        return Err(Refusal::SeveralCondensed);
    }
    check_node_count(&mesh, resources.config.max_nodes)?;
    let request = OnceRequest {
        question,
        subject: Subject::once(&mesh, message.known.len()),
        has_masks: false,
    };
    let models = &resources.models;
    let plan = plan_once(&request, models, &reservation, &resources.rates, || clock.elapsed_ms())?;
    if plan.method == Method::Condensed {
        return Err(Refusal::SeveralCondensed);
    }
    let model = model_of(mesh, &materials, plan.element, Vec::new(), &mut clock)?;
    let known = model.known(pairs(&message.known))?;
    let further = further(&model, &message.known, &cases)?;
    let forces = checked_forces(&model, &known, &message)?;
    let work = Work { resources, reservation, request, message };
    let (factored, plan, why) = work.factored(plan, &model, &known, &mut clock)?;
    let free = work.reservation.free().saturating_sub((factored.bytes() + model.bytes()) as u64);
    check_cases(&model, cases.len(), free)?;
    let posed = work.posed(&model, known, forces, why);
    let mut answer = direct::answer_several(&model, &factored, posed, &further, estimate, clock)?;
    add_plan_warnings(&plan, asked_element, poisson_max, &mut answer.report);
    Ok(answer)
}

/// Known displacements of the further cases.
fn further(model: &Model, first: &[DofValue], cases: &[Vec<f64>]) -> Result<Vec<Known>, Refusal> {
    let known = |values: &Vec<f64>| {
        let pairs = first.iter().zip(values).map(|(known, &value)| (known.dof, value)).collect();
        Ok(model.known(pairs)?)
    };
    cases.iter().map(known).collect()
}

/// Memory that solving and answering the further cases takes beside the factor, if so much is free.
///
/// Units: bytes.
///
/// # Errors
/// [`Refusal::TooManyCases`].
pub(super) fn check_cases(model: &Model, cases: usize, free: u64) -> Result<u64, Refusal> {
    let vector = (3 * model.system_node_count() * size_of::<f64>()) as u64;
    let bytes = (VECTORS_PER_CASE * cases) as u64 * vector;
    match bytes > free {
        true => Err(Refusal::TooManyCases { cases: cases + 1, bytes, free }),
        false => Ok(bytes),
    }
}
