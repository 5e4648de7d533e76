//! Answers one request that holds mesh, known displacements and partition (thesis 5.1.1).

use std::sync::Arc;

use softgrasp_core::model::{Known, Model};
use softgrasp_core::solve::choose::Plan;
use softgrasp_core::solve::{Factored, Method};
use softgrasp_protocol::{Answer, Body, Question as QuestionMessage};

use super::condensed::{Contacts, StrainOf};
use super::direct::{self, Posed};
use super::factor::{FactorRequest, because_of_memory};
use super::gradient;
use super::upload::{may_prove, stored};
use super::warnings::add_plan_warnings;
use crate::budget::Reservation;
use crate::clock::StageClock;
use crate::plan::{OnceRequest, Subject, because, plan_after_order, plan_once};
use crate::refusal::Refusal;
use crate::request::{
    check_node_count, checked_forces, element_given, model_of, name_of, pairs, poisson_max,
    question_of,
};
use crate::resources::Resources;

/// A request with its own mesh, and the memory reserved for its answer.
pub(super) struct Work<'a> {
    pub resources: &'a Resources,
    pub reservation: Reservation,
    pub request: OnceRequest,
    pub message: QuestionMessage,
}

/// Answers a request with mesh, known displacements and partition by linear elasticity (thesis 5.1.1).
///
/// # Errors
/// [`Refusal`] if the request cannot be answered.
pub(crate) fn solve_once(
    resources: &Resources,
    body: Body,
    message: QuestionMessage,
    reservation: Reservation,
    mut clock: StageClock,
) -> Result<Answer, Refusal> {
    let Body { mesh, materials, element } = body;
    let asked_element = element_given(element);
    let poisson_max = poisson_max(&materials);
    let question = question_of(&message, asked_element, poisson_max)?;
    check_node_count(&mesh, resources.config.max_nodes)?;
    let request = OnceRequest {
        question,
        subject: Subject::once(&mesh, message.known.len()),
        has_masks: !message.masks.is_empty(),
    };
    let models = &resources.models;
    let plan = plan_once(&request, models, &reservation, &resources.rates, || clock.elapsed_ms())?;
    let plan = gradient::planned(&request.question, &message, plan)?;
    let model = model_of(mesh, &materials, plan.element, Vec::new(), &mut clock)?;
    let known = model.known(pairs(&message.known))?;
    gradient::check_quantity(&model, &known.dofs, &message)?;
    let forces = checked_forces(&model, &known, &message)?;
    let work = Work { resources, reservation, request, message };
    let (mut answer, plan) = match plan.method {
        Method::Condensed => work.by_columns(plan, model, known, clock)?,
        _ => work.by_factor(plan, &model, known, forces, clock)?,
    };
    add_plan_warnings(&plan, asked_element, poisson_max, &mut answer.report);
    Ok(answer)
}

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
        let why = because(&request, &plan);
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
        let (factored, plan, why) = self.factored(plan, model, &known, &mut clock)?;
        let posed = self.posed(model, known.clone(), forces, why);
        Ok((direct::answer(model, &factored, posed, clock)?, plan))
    }

    /// Makes the factor or inverse; also the plan as it was carried out, and its reason.
    pub(super) fn factored(
        &self,
        plan: Plan,
        model: &Model,
        known: &Known,
        clock: &mut StageClock,
    ) -> Result<(Factored, Plan, String), Refusal> {
        let subject = Subject::about(model, known.dofs.len(), None);
        let factor = self.factor_request(model, &known.dofs, &subject);
        let (factored, plan) = match self.request.is_method_open() && plan.method.has_fronts() {
            true => self.factor_planned_again(&factor, plan, clock)?,
            false => {
                let methods: Vec<Method> = [&[plan.method], plan.instead].concat();
                (factor.factor(&methods, clock)?, plan)
            }
        };
        let why = because(&self.request, &plan);
        let why = because_of_memory(why, plan.method, factored.method());
        Ok((factored, plan, why))
    }

    /// Orders, plans again by the counted work, and factors.
    fn factor_planned_again(
        &self,
        factor: &FactorRequest<'_>,
        plan: Plan,
        clock: &mut StageClock,
    ) -> Result<(Factored, Plan), Refusal> {
        let analysed = factor.analyse(clock)?;
        let fits = |method| factor.need(&analysed, method).bytes() <= self.reservation.free();
        let rates = self.resources.rates.get();
        let elapsed_ms = clock.elapsed_ms();
        let plan = plan_after_order(&self.request, plan, &analysed, &rates, elapsed_ms, fits);
        let factored = factor.factor_analysed(analysed, &[plan.method], clock)?;
        Ok((factored, plan))
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

    pub(super) fn posed(
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
}
