//! Answers one request that holds mesh, known displacements and partition (thesis 5.1.1).

use std::sync::Arc;

use softgrasp_core::model::{Known, Model, ModelError};
use softgrasp_core::solve::choose::Plan;
use softgrasp_core::solve::memory::Need;
use softgrasp_core::solve::{Analysed, Factored, FrontMethod, Method, Solution, SolveError};
use softgrasp_protocol::{Answer, Question as QuestionMessage, SolveOnce};

use super::condensed::{Contacts, StrainOf};
use super::direct::{self, Posed};
use super::factor::{FactorRequest, because_of_memory};
use super::upload::{may_prove, stored};
use super::warnings::add_plan_warnings;
use crate::budget::Reservation;
use crate::clock::StageClock;
use crate::plan::{OnceRequest, Subject, because, counted, plan_after_order, plan_once};
use crate::refusal::Refusal;
use crate::request::{
    check_node_count, checked_forces, element_given, model_of, name_of, pairs, poisson_max,
    question_of,
};
use crate::resources::Resources;

/// A request and what its answer may take.
struct Work<'a> {
    resources: &'a Resources,
    reservation: Reservation,
    request: OnceRequest,
    message: QuestionMessage,
}

/// Mesh, known displacements and partition in one request (thesis 5.1.1).
///
/// # Errors
/// [`Refusal`].
pub(crate) fn solve_once(
    resources: &Resources,
    once: SolveOnce,
    mut clock: StageClock,
) -> Result<Answer, Refusal> {
    let SolveOnce { mesh, materials, element, question: message } = once;
    let asked_element = element_given(element);
    let poisson_max = poisson_max(&materials);
    let question = question_of(&message, asked_element, poisson_max)?;
    check_node_count(&mesh, resources.config.max_nodes)?;
    let request = OnceRequest {
        question,
        subject: Subject::once(&mesh, message.known.len()),
        has_masks: !message.masks.is_empty(),
        has_forces: !message.forces.is_empty(),
    };
    let reservation = resources.budget.reservation();
    let models = &resources.models;
    let plan = plan_once(&request, models, &reservation, &resources.rates, || clock.elapsed_ms())?;
    let model = model_of(mesh, &materials, plan.element, Vec::new(), &mut clock)?;
    let known = model.known(pairs(&message.known))?;
    let forces = checked_forces(&model, &known, &message)?;
    let work = Work { resources, reservation, request, message };
    let (mut answer, plan) = match plan.method {
        Method::Condensed => work.by_columns(plan, model, known, clock)?,
        method if FrontMethod::of(method).is_some() && request.is_method_open() => {
            work.by_weighed_front(plan, &model, known, forces, clock)?
        }
        _ => work.by_factor(plan, &model, known, forces, clock)?,
    };
    add_plan_warnings(&plan, asked_element, poisson_max, &mut answer.report);
    Ok(answer)
}

/// A factor with its solution, the plan that led to it, and what was tried before.
type Found = (Factored, Solution, Plan, Option<String>);

impl Work<'_> {
    fn by_columns(
        self,
        plan: Plan,
        model: Model,
        known: Known,
        mut clock: StageClock,
    ) -> Result<(Answer, Plan), Refusal> {
        let Self { resources, reservation, request, message } = self;
        let stored = Arc::new(stored(resources, &reservation, model, &mut clock));
        let may_prove = may_prove(&reservation, &stored);
        let contacts = Contacts::new(stored, &message, known)?;
        let why = because(&request, &plan, None);
        let strain = StrainOf::ThisAnswer { may_prove };
        let answer = contacts.answer(&message, &why, strain, clock)?;
        Ok((answer, plan))
    }

    fn by_factor(
        &self,
        plan: Plan,
        model: &Model,
        known: Known,
        forces: Vec<f64>,
        mut clock: StageClock,
    ) -> Result<(Answer, Plan), Refusal> {
        let methods: Vec<Method> = [plan.method].into_iter().chain(plan.instead).collect();
        let subject = Subject::about(model, known.dofs.len(), None);
        let dofs = known.dofs.clone();
        let factored = self.factor_request(model, &dofs, &subject).factor(&methods, &mut clock)?;
        let why = because(&self.request, &plan, None);
        let why = because_of_memory(why, plan.method, factored.method());
        let posed = self.posed(model, known, forces, why);
        Ok((direct::answer(model, &factored, posed, clock)?, plan))
    }

    fn by_weighed_front(
        &self,
        plan: Plan,
        model: &Model,
        known: Known,
        forces: Vec<f64>,
        mut clock: StageClock,
    ) -> Result<(Answer, Plan), Refusal> {
        let mut posed = self.posed(model, known, forces, String::new());
        let (factored, solution, plan, fell_back) =
            self.weighed_front(plan, model, &posed, &mut clock)?;
        posed.chosen_because = because(&self.request, &plan, fell_back);
        Ok((direct::gather(model, &factored, posed, &solution, clock)?, plan))
    }

    fn factor_request<'b>(
        &'b self,
        model: &'b Model,
        dofs: &'b [u32],
        subject: &'b Subject,
    ) -> FactorRequest<'b> {
        let (models, reservation) = (&self.resources.models, &self.reservation);
        let held = model.bytes() as u64;
        FactorRequest { models, reservation, model, dofs, subject, held }
    }

    fn posed(
        &self,
        model: &Model,
        known: Known,
        forces: Vec<f64>,
        chosen_because: String,
    ) -> Posed<'_> {
        let element = name_of(model.element());
        let question = &self.message;
        Posed { question, known, forces, element, factor_reused: false, chosen_because }
    }

    /// Orders, plans again by what is counted, factors and solves; where single precision was planned
    /// and does not do, double precision does.
    fn weighed_front(
        &self,
        plan: Plan,
        model: &Model,
        posed: &Posed<'_>,
        clock: &mut StageClock,
    ) -> Result<Found, Refusal> {
        let dofs = &posed.known.dofs;
        let analysed = model.analyse(dofs, &mut |stage| clock.begin(stage))?;
        clock.end();
        let subject = Subject::about(model, dofs.len(), None);
        let factor = self.factor_request(model, dofs, &subject);
        let need = |front| counted(model, factor.held, &analysed, front);
        let fits = |need: Need| need.bytes() <= self.reservation.free();
        let rates = self.resources.rates.get();
        let elapsed_ms = clock.elapsed_ms();
        let fits_front = |front| fits(need(front));
        let plan = plan_after_order(&self.request, plan, &analysed, &rates, elapsed_ms, fits_front);
        let front = FrontMethod::of(plan.method).unwrap_or(FrontMethod::Double);
        factor.admit(&[need(front)])?;
        let double_need = need(FrontMethod::Double);
        let double = analysed.clone();
        let mut try_once = |analysed: Analysed, front| -> Result<_, Refusal> {
            let factored = analysed
                .factor(model.stiffness(), front, &mut |stage| clock.begin(stage))
                .map_err(|error| Refusal::Model(error.into()))?;
            let solution = direct::solve(model, &factored, posed, clock)?;
            Ok((factored, solution))
        };
        let first = try_once(analysed, front);
        let reason = match front {
            FrontMethod::Double => None,
            _ => why_single_does_not_do(&first, &plan, posed, model, fits(double_need)),
        };
        let Some(reason) = reason else {
            let (factored, solution) = first?;
            return Ok((factored, solution, plan, None));
        };
        drop(first);
        factor.admit(&[double_need])?;
        let (factored, solution) = try_once(double, FrontMethod::Double)?;
        let fell_back = Some(format!("{reason}, so double precision was taken"));
        Ok((factored, solution, plan, fell_back))
    }
}

/// Why double precision has to be taken after single precision was tried; `None` if it need not.
/// Where double precision does not fit in memory, an answer of few digits is given and warned of.
fn why_single_does_not_do(
    first: &Result<(Factored, Solution), Refusal>,
    plan: &Plan,
    posed: &Posed<'_>,
    model: &Model,
    fits_double: bool,
) -> Option<String> {
    match first {
        Err(Refusal::Model(ModelError::Solve(SolveError::NotPositiveDefinite { .. }))) => {
            Some("single precision finds no factor".to_owned())
        }
        Ok((factored, solution))
            if fits_double
                && posed.question.deadline_ms.is_none()
                && direct::certainty(model, factored, solution).is_none() =>
        {
            Some("single precision leaves no digit certain".to_owned())
        }
        Ok((_, solution)) if fits_double && is_off(solution, plan.error_rel) => Some(format!(
            "single precision gets to a residual of {:.0e} only",
            solution.residual_rel
        )),
        _ => None,
    }
}

/// Whether a solution is further off than it was planned for; refinement stops a little short of its
/// goal where rounding does.
fn is_off(solution: &Solution, error_rel: f64) -> bool {
    const SHORT_OF_GOAL: f64 = 10.0;
    let most = SHORT_OF_GOAL * error_rel;
    solution.residual_rel > most || solution.error_estimate_rel.is_some_and(|error| error > most)
}
