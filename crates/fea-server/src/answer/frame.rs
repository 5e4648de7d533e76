//! Answers one frame question: linear elasticity on a kept model.

use std::sync::Arc;
use std::sync::atomic::Ordering::Relaxed;

use softgrasp_core::model::{Known, ModelError};
use softgrasp_core::solve::choose::{Plan, Question, SMALLER_THAN_FRONT};
use softgrasp_core::solve::{Factored, Method};
use softgrasp_protocol::{Answer, CaseAnswer, ModelHash, NodeChoice, Question as QuestionMessage};

use super::condensed::{Contacts, StrainOf};
use super::contact_solution::PreparedSet;
use super::direct::{self, Posed};
use super::factor::{FactorRequest, because_of_memory};
use super::finite::answer_is_finite;
use super::gradient;
use super::several::check_cases;
use crate::clock::StageClock;
use crate::plan::{Subject, columns_ms, factor_ms, plan_frame};
use crate::refusal::Refusal;
use crate::request::{check_frame, checked_forces, name_of, pairs, question_of};
use crate::resources::Resources;
use crate::store::StoredModel;

/// Number of multiplications below which answering takes less time than handing over to another thread.
const SMALL_PRODUCTS: usize = 1 << 18;

/// Largest number of prescribed displacements of such a frame question.
const TOUCHED_MAX: usize = 1 << 10;

/// A frame question with all data that its plan needs.
pub(crate) struct PosedFrame {
    hash: ModelHash,
    stored: Arc<StoredModel>,
    message: QuestionMessage,
    question: Question,
    known: Known,
    plan: Plan,
}

/// A frame question and its kept contact set: nothing has to be made for its answer.
pub(crate) struct KeptFrame {
    frame: PosedFrame,
    contacts: Contacts,
    prepared: PreparedSet,
}

/// Whether a frame question can be answered at once, or is work for the pool.
pub(crate) enum Readiness {
    /// The answer is a small product with kept data.
    Ready(Box<KeptFrame>),
    /// Any other frame question.
    NotReady(Box<QuestionMessage>),
}

/// Looks whether a frame question is a small product with kept data, and holds this data.
pub(crate) fn readiness(
    resources: &Resources,
    model: ModelHash,
    message: QuestionMessage,
) -> Readiness {
    match kept_frame(resources, model, &message) {
        Some(kept) => Readiness::Ready(Box::new(kept)),
        None => Readiness::NotReady(Box::new(message)),
    }
}

fn kept_frame(
    resources: &Resources,
    model: ModelHash,
    message: &QuestionMessage,
) -> Option<KeptFrame> {
    let QuestionMessage { known, masks, want, .. } = message;
    let NodeChoice::Nodes(nodes) = &want.nodes else { return None };
    // Fields need the displacements of all nodes, and derivatives a factor.
    if !want.fields.is_empty() || !message.quantity.is_empty() {
        return None;
    }
    // What cannot be small is not even copied for a look, on the thread that all sockets share.
    let forces = known.len() + 3 * masks.len();
    if forces > TOUCHED_MAX || 3 * nodes.len() * forces > SMALL_PRODUCTS {
        return None;
    }
    let frame = PosedFrame::new(resources, model, message.clone()).ok()?;
    if frame.plan.method != Method::Condensed {
        return None;
    }
    let stored = Arc::clone(&frame.stored);
    let contacts = Contacts::new(stored, &frame.message, frame.known.clone()).ok()?;
    let prepared = contacts.kept_set()?;
    let is_small =
        prepared.products() <= SMALL_PRODUCTS && !contacts.has_large_product(&frame.message);
    is_small.then_some(KeptFrame { frame, contacts, prepared })
}

impl KeptFrame {
    /// Answers at once with the kept contact set.
    ///
    /// # Errors
    /// [`Refusal`] if the request cannot be answered.
    pub fn answer(&self, resources: &Resources, clock: StageClock) -> Result<Answer, Refusal> {
        let Self { frame, contacts, prepared } = self;
        let strain = StrainOf::Beside(resources);
        contacts.answer_with(prepared, &frame.message, &frame.plan.why, strain, clock)
    }
}

/// Answers one frame question.
///
/// # Errors
/// [`Refusal`] if the request cannot be answered.
pub(crate) fn answer_frame(
    resources: &Resources,
    model: ModelHash,
    message: QuestionMessage,
    clock: StageClock,
) -> Result<Answer, Refusal> {
    PosedFrame::new(resources, model, message)?.answer(resources, clock)
}

/// Answers several cases of one frame question: other values of the same known displacements. The report
/// is that of the first case, with the largest residual and estimate of all.
///
/// # Errors
/// [`Refusal`] if the request cannot be answered.
pub(crate) fn answer_cases(
    resources: &Resources,
    model: ModelHash,
    (message, cases): (QuestionMessage, Vec<Vec<f64>>),
    clock: &StageClock,
) -> Result<Answer, Refusal> {
    let stored = resources.models.find(model).ok_or(Refusal::UnknownModel(model))?;
    let reservation = resources.budget.reservation();
    reservation.settle(check_cases(&stored.model, cases.len(), reservation.free())?);
    let mut answer = answer_frame(resources, model, message.clone(), clock.clone())?;
    for values in cases {
        let mut message = message.clone();
        for (known, value) in message.known.iter_mut().zip(values) {
            known.value = value;
        }
        let case = answer_frame(resources, model, message, clock.clone())?;
        let report = &mut answer.report;
        report.residual_rel = report.residual_rel.max(case.report.residual_rel);
        report.error_bound_rel = larger(report.error_bound_rel, case.report.error_bound_rel);
        report.error_bound_why = report.error_bound_why.take().or(case.report.error_bound_why);
        report.error_estimate_rel =
            larger(report.error_estimate_rel, case.report.error_estimate_rel);
        answer.fields.extend(case.fields);
        answer.cases.push(CaseAnswer {
            displacements: case.displacements.into_f64(),
            reactions: case.reactions.iter().map(|reaction| reaction.value).collect(),
        });
    }
    Ok(answer)
}

/// The larger of two errors; `None` if one of them is not known.
fn larger(a: Option<f64>, b: Option<f64>) -> Option<f64> {
    Some(a?.max(b?))
}

impl PosedFrame {
    /// Checks the nodes, forces and masks of a frame question, and plans its answer.
    ///
    /// # Errors
    /// [`Refusal`] if the request cannot be answered.
    pub fn new(
        resources: &Resources,
        hash: ModelHash,
        message: QuestionMessage,
    ) -> Result<Self, Refusal> {
        let stored = resources.models.find(hash).ok_or(Refusal::UnknownModel(hash))?;
        let model = &stored.model;
        let question = question_of(&message, Some(model.element()), 0.0)?;
        let known = model.known(pairs(&message.known))?;
        check_frame(model, &known, &message)?;
        let plan = plan_frame(&question, &stored, &known, !message.masks.is_empty())?;
        let plan = gradient::planned(&question, &message, plan)?;
        gradient::check_quantity(model, &known.dofs, &message)?;
        Ok(Self { hash, stored, message, question, known, plan })
    }

    /// Whether the contact set or factor of the plan is kept. If so the answer takes a product or a
    /// solve; otherwise it takes as long as making the missing one.
    pub fn is_prepared(&self) -> bool {
        match self.plan.method {
            Method::Condensed => {
                let stored = Arc::clone(&self.stored);
                Contacts::new(stored, &self.message, self.known.clone())
                    .is_ok_and(|contacts| contacts.kept_set().is_some())
            }
            _ => self.kept_factor().is_some(),
        }
    }

    /// Predicted time to make the missing contact set or factor.
    ///
    /// Units: ms.
    pub fn predicted_ms(&self, resources: &Resources) -> f64 {
        let Self { stored, message, known, plan, .. } = self;
        let rates = resources.rates.known();
        match (plan.method, stored.base()) {
            (Method::Condensed, Ok(base)) => {
                let fixed = stored.model.fixed().len().min(known.dofs.len());
                let nodes = (known.dofs.len() - fixed).div_ceil(3);
                let loads = message.forces.len().div_ceil(3) + message.spread.pressures.len();
                columns_ms(&base, nodes + message.masks.len() + loads, &rates)
            }
            (method, _) => factor_ms(&stored.model, method, &rates),
        }
    }

    /// Answers the frame question, after making the missing contact set or factor.
    ///
    /// # Errors
    /// [`Refusal`] if the request cannot be answered.
    pub fn answer(mut self, resources: &Resources, clock: StageClock) -> Result<Answer, Refusal> {
        if self.plan.method == Method::Condensed {
            let answer = self.by_columns(resources, clock.clone());
            resources.models.trim();
            match answer {
                // What the small system cannot do, a factor of its own may.
                Err(Refusal::Model(ModelError::Condensed(error)))
                    if self.question.method.is_none() && self.message.masks.is_empty() =>
                {
                    let why = format!("not condensed: {error}");
                    let plan = self.question.plan(self.plan.element, Method::Front, why);
                    self.plan = Plan { instead: SMALLER_THAN_FRONT, ..plan };
                }
                // A factor of its own works with smaller numbers than columns of the inverse.
                Ok(answer)
                    if self.question.method.is_none()
                        && self.message.masks.is_empty()
                        && !answer_is_finite(&answer) =>
                {
                    let why = "not condensed: its answer is not finite";
                    let plan = self.question.plan(self.plan.element, Method::Front, why);
                    self.plan = Plan { instead: SMALLER_THAN_FRONT, ..plan };
                }
                answered => return answered,
            }
        }
        self.by_factor(resources, clock)
    }

    fn by_columns(&self, resources: &Resources, clock: StageClock) -> Result<Answer, Refusal> {
        let stored = Arc::clone(&self.stored);
        let contacts = Contacts::new(stored, &self.message, self.known.clone())?;
        let strain = StrainOf::Beside(resources);
        contacts.answer(&self.message, &self.plan.why, strain, clock)
    }

    fn by_factor(self, resources: &Resources, mut clock: StageClock) -> Result<Answer, Refusal> {
        // What does not fit the model is refused before a factor is made.
        let forces = checked_forces(&self.stored.model, &self.known, &self.message)?;
        let kept = self.kept_factor();
        let factor_reused = kept.is_some();
        let factored = match kept {
            Some(factored) => factored,
            None => self.made_factor(resources, &mut clock)?,
        };
        let Self { stored, message, known, plan, .. } = self;
        let posed = Posed {
            question: &message,
            known,
            forces,
            element: name_of(plan.element),
            factor_reused,
            chosen_because: because_of_memory(plan.why, plan.method, factored.method()),
        };
        let answer = direct::answer(&stored.model, &factored, posed, clock);
        // Double precision may have been taken beside a factor in single precision.
        resources.models.trim();
        answer
    }

    fn kept_factor(&self) -> Option<Arc<Factored>> {
        let Self { stored, known, plan, .. } = self;
        let kept = |method| stored.factor_for(&known.dofs, method);
        let instead = match stored.single_only.load(Relaxed) {
            true => plan.instead,
            false => &[],
        };
        kept(plan.method).or_else(|| instead.iter().copied().find_map(kept))
    }

    fn made_factor(
        &self,
        resources: &Resources,
        clock: &mut StageClock,
    ) -> Result<Arc<Factored>, Refusal> {
        let Self { hash, stored, known, plan, .. } = self;
        let reservation = resources.budget.reservation();
        let request = FactorRequest {
            models: &resources.models,
            reservation: &reservation,
            model: &stored.model,
            dofs: &known.dofs,
            subject: &Subject::about(&stored.model, known.dofs.len(), Some(*hash)),
            held: stored.lasting_bytes(),
        };
        let methods: Vec<Method> = [&[plan.method], plan.instead].concat();
        let made = Arc::new(request.factor(&methods, clock)?);
        if made.method() != plan.method {
            stored.single_only.store(true, Relaxed);
        }
        drop(reservation);
        stored.keep_factor(known.dofs.clone(), Arc::clone(&made));
        resources.models.trim();
        Ok(made)
    }
}
