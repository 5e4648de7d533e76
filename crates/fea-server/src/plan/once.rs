//! Plans a request that brings its own mesh, by what it asks for, its deadline and error budget,
//! material and memory.

use softgrasp_core::fem::Element;
use softgrasp_core::solve::choose::{
    Cost, Plan, Question, SMALLER_THAN_FRONT, candidates, candidates_after_order, cheapest_element,
    choose,
};
use softgrasp_core::solve::memory::Need;
use softgrasp_core::solve::rates::Rates;
use softgrasp_core::solve::work::Work;
use softgrasp_core::solve::{Analysed, Method};

use super::admission::PlanError;
use super::admission::{Subject, admit};
use super::rates::MeasuredRates;
use crate::budget::Reservation;
use crate::store::ModelStore;

/// Reason of a plan whose method the request named.
pub(super) const ASKED: &str = "asked for";

/// What the plan of a request with its own mesh depends on.
#[derive(Clone, Copy)]
pub(crate) struct OnceRequest {
    pub question: Question,
    pub subject: Subject,
    pub has_masks: bool,
}

impl OnceRequest {
    /// Whether the plan is chosen by comparing predicted costs.
    pub fn is_weighed(&self) -> bool {
        let Question { method, element, deadline_ms, max_error, .. } = self.question;
        let has_wish = deadline_ms.is_some() || max_error.is_some();
        let by_cost = element.is_none() || (method.is_none() && has_wish);
        by_cost && method != Some(Method::Condensed) && !self.has_masks
    }

    /// Whether the method is chosen by deadline or error budget.
    pub fn is_method_open(&self) -> bool {
        let Question { method, deadline_ms, max_error, .. } = self.question;
        method.is_none() && (deadline_ms.is_some() || max_error.is_some()) && !self.has_masks
    }
}

/// Plans a request and reserves the memory that it is predicted to need at least.
///
/// Units: `elapsed_ms` ms since the request came, for the deadline.
///
/// # Errors
/// [`PlanError`].
pub(crate) fn plan_once(
    request: &OnceRequest,
    models: &ModelStore,
    reservation: &Reservation,
    rates: &MeasuredRates,
    elapsed_ms: impl Fn() -> f64,
) -> Result<Plan, PlanError> {
    let plan = match request.is_weighed() {
        true => {
            // Measuring, where it happens now, is time of this request like any other.
            let rates = rates.get();
            weigh(request, models, reservation, &rates, elapsed_ms())?
        }
        false => plan_as_asked(request)?,
    };
    let methods: Vec<Method> = [&[plan.method], plan.instead].concat();
    let needs = request.subject.predict(plan.element, &methods);
    admit(models, reservation, &needs, &request.subject).map_err(PlanError::Memory)?;
    Ok(plan)
}

/// Plan without a comparison of costs: `auto` factors once, in single precision if only that fits.
fn plan_as_asked(request: &OnceRequest) -> Result<Plan, PlanError> {
    let question = &request.question;
    let element = question.element.unwrap_or_else(|| cheapest_element(question.poisson_max));
    if request.has_masks {
        return plan_for_masks(question, element, None);
    }
    match question.method {
        Some(method) => Ok(question.plan(element, method, ASKED)),
        None => {
            let why = "one request: the parallel exact factor is the fastest";
            let plan = question.plan(element, Method::Front, why);
            Ok(Plan { instead: SMALLER_THAN_FRONT, ..plan })
        }
    }
}

/// Plan for a question with masks, which only `condensed` answers, unless there is an `obstacle`.
pub(super) fn plan_for_masks(
    question: &Question,
    element: Element,
    obstacle: Option<PlanError>,
) -> Result<Plan, PlanError> {
    let why = match question.method {
        Some(Method::Condensed) => ASKED,
        None => "masks: only condensed answers them",
        Some(method) => return Err(PlanError::MasksDirect { method }),
    };
    match obstacle {
        None => Ok(question.plan(element, Method::Condensed, why)),
        Some(obstacle) => Err(PlanError::MasksNotCondensed(Box::new(obstacle))),
    }
}

/// Plan by the predicted costs of all methods and elements that fit in memory.
fn weigh(
    request: &OnceRequest,
    models: &ModelStore,
    reservation: &Reservation,
    rates: &Rates,
    elapsed_ms: f64,
) -> Result<Plan, PlanError> {
    let OnceRequest { question, subject, .. } = *request;
    let is_element_open = question.element.is_none();
    let method = match request.is_method_open() {
        true => None,
        // Without a wish the exact parallel factor stays what it is.
        false => Some(question.method.unwrap_or(Method::Front)),
    };
    let deadline_ms = question.deadline_ms.map(|deadline| deadline - elapsed_ms);
    let question = Question { method, deadline_ms, ..question };
    let all = candidates(&question, subject.problem.size, rates);
    let need = |plan: &Plan| Need::predicted(subject.problem, plan.element, plan.method);
    // Ten-node elements beside linear ones are weighed by the choice itself, which says why.
    let fits = |plan: &&Plan| {
        let is_weighed = is_element_open && plan.element == Element::Tet10;
        is_weighed || need(plan).bytes_min() <= reservation.free()
    };
    let fitting: Vec<Plan> = all.iter().filter(fits).cloned().collect();
    let without_factor = || {
        let question = Question { method: Some(Method::Multigrid), ..question };
        let mut plans = candidates(&question, subject.problem.size, rates);
        plans.retain(|plan| need(plan).bytes_min() <= reservation.free());
        choose(&question, &plans, reservation.free()).filter(|_| request.question.method.is_none())
    };
    match choose(&question, &fitting, reservation.free()).or_else(without_factor) {
        Some(plan) => Ok(plan),
        None => {
            let needs: Vec<Need> = all.iter().map(need).collect();
            let admitted =
                admit(models, reservation, &needs, &subject).map_err(PlanError::Memory)?;
            Ok(question.plan(admitted.element, admitted.method, ASKED))
        }
    }
}

/// Plan chosen again among the methods that fit, with the counted work of the factor and the time left.
///
/// Units: `elapsed_ms` ms since the request came.
pub(crate) fn plan_after_order(
    request: &OnceRequest,
    plan: Plan,
    analysed: &Analysed,
    rates: &Rates,
    elapsed_ms: f64,
    fits: impl Fn(Method) -> bool,
) -> Plan {
    let element = plan.element;
    let question = Question {
        element: Some(element),
        deadline_ms: request.question.deadline_ms.map(|deadline| deadline - elapsed_ms),
        ..request.question
    };
    let counted = Work::estimate(request.subject.problem.size, element);
    let counted = counted.counted(analysed.analysis());
    let mut plans = candidates_after_order(&question, element, &counted, rates);
    plans.retain(|plan| !plan.method.has_fronts() || fits(plan.method));
    let locks = plan.locks;
    let chosen = choose(&question, &plans, u64::MAX).unwrap_or(plan);
    let cost = chosen.cost.map(|cost| Cost { ms: cost.ms + elapsed_ms, ..cost });
    Plan { cost, locks, ..chosen }
}
