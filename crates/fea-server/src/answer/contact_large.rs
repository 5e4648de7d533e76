//! A session's object at large deformation between two contact frames, and the steps that it makes.

use std::sync::Arc;

use softgrasp_core::dynamics::{ContactStep, LargeBody, LargeStep, ObjectState, StepOutcome};
use softgrasp_core::fem::hyperelastic::{Elements, LargeSummary, Law};
use softgrasp_core::solve::Method;
use softgrasp_core::solve::condensed::Base;
use softgrasp_core::solve::memory::Need;
use softgrasp_protocol::{Deformation, ModelHash};

use super::large::LINEAR_ERROR_REL;
use super::large_once::promised_error;
use crate::budget::Reservation;
use crate::lock::Lock;
use crate::plan::{PlanError, Subject, admit};
use crate::refusal::Refusal;
use crate::resources::Resources;
use crate::store::StoredModel;

/// Place where a session keeps its free object at large deformation.
pub(crate) type PressedSeat = Arc<Lock<Option<Box<Pressed>>>>;

/// Free object at large deformation between two steps: its shape and the newest factor.
pub(crate) struct Pressed {
    model: ModelHash,
    law: Law,
    /// Pa; `None` for a material that never flows.
    yield_stress: Option<f64>,
    body: LargeBody,
    /// Memory reserved for the factor, given back with it.
    reservation: Reservation,
}

/// Wish for large deformation: model, equations and law, and the place where the object is kept.
pub(crate) struct LargeWish {
    pub model: ModelHash,
    pub deformation: Deformation,
    pub law: Law,
    /// Pa; `None` for a material that never flows.
    pub yield_stress: Option<f64>,
    /// Whether what the session keeps is forgotten.
    pub from_rest: bool,
    pub seat: PressedSeat,
}

/// Outcome of a step, whether it was made at large deformation, and the factors that it took.
pub(super) struct Made {
    pub outcome: StepOutcome,
    pub is_large: bool,
    pub factors: usize,
    /// Largest accumulated plastic strain of an element.
    pub plastic_strain: f64,
    /// Rotation and stretches of the elements, where they were computed.
    pub summary: LargeSummary,
    /// Whether linear elasticity answers beyond what it is meant for, because large deformation cannot be.
    pub is_beyond_linear: bool,
}

impl Made {
    /// Outcome of a step by linear elasticity.
    pub fn linear(outcome: StepOutcome) -> Self {
        let summary = LargeSummary::UNKNOWN;
        Self {
            outcome,
            is_large: false,
            factors: 0,
            plastic_strain: 0.0,
            summary,
            is_beyond_linear: false,
        }
    }
}

impl Pressed {
    /// The object at rest, with memory reserved for a factor.
    fn at_rest(
        resources: &Resources,
        stored: &StoredModel,
        wish: &LargeWish,
        base: &Base,
    ) -> Result<Box<Self>, Refusal> {
        let model = &stored.model;
        let elements = Arc::new(model.yielding(wish.law, wish.yield_stress)?);
        let pattern = model.stiffness().pattern();
        let reservation = resources.budget.reservation();
        // The tangent and its positive part stand beside the linear stiffness.
        let blocks = pattern.block_count();
        let held = (model.bytes() + 2 * blocks * size_of::<[f64; 9]>()) as u64;
        let element = model.element();
        let need = match base.analysis() {
            Some(analysis) => Need::counted(element, Method::Front, held, blocks, analysis),
            // Steps stay linear, or are refused where large deformation is asked for.
            None => Need::exact(element, Method::Multigrid, held, 0),
        };
        let subject = Subject::about(model, 0, Some(wish.model));
        admit(&resources.models, &reservation, &[need], &subject).map_err(PlanError::Memory)?;
        let body = LargeBody::at_rest(elements, Arc::clone(pattern));
        let LargeWish { model, law, yield_stress, .. } = *wish;
        Ok(Box::new(Self { model, law, yield_stress, body, reservation }))
    }

    /// Predicted error of linear elasticity in the object's present shape, relative to the largest
    /// displacement.
    fn promised(&self) -> f64 {
        let summary = self.body.summary();
        promised_error(summary.rotation_max, summary.strain_max)
    }
}

impl LargeWish {
    /// Whether the session keeps an object of the same model and law, with which the step goes on.
    pub fn goes_on(&self) -> bool {
        self.seat.with(|kept| kept.as_ref().is_some_and(|kept| self.is_of(kept)))
    }

    /// Elements of the object that the session keeps, with their law.
    pub(super) fn elements(&self) -> Option<Arc<Elements>> {
        self.seat.with(|kept| kept.as_ref().map(|kept| Arc::clone(kept.body.elements())))
    }

    fn is_of(&self, kept: &Pressed) -> bool {
        !self.from_rest
            && kept.model == self.model
            && kept.law == self.law
            && kept.yield_stress == self.yield_stress
    }

    /// Makes one step of the object. `None` where the step is given up: the object then goes back to where it
    /// was.
    ///
    /// # Errors
    /// [`Refusal`]; the object then stays unchanged.
    pub(super) fn advance(
        &self,
        resources: &Resources,
        (stored, state): (&StoredModel, &ObjectState),
        step: &ContactStep<'_>,
        wanted: &[u32],
        is_given_up: &dyn Fn() -> bool,
    ) -> Result<Option<Made>, Refusal> {
        let base = step.elasticity.base;
        let kept = self.seat.with(Option::take).filter(|kept| self.is_of(kept));
        let mut pressed = match kept {
            Some(kept) => kept,
            None => Pressed::at_rest(resources, stored, self, base)?,
        };
        let before = pressed.body.clone();
        let made = self.made(&mut pressed, step, state, wanted);
        let made = made.map(|made| Some(made).filter(|_| !is_given_up()));
        if !matches!(made, Ok(Some(_))) {
            pressed.body = before;
        }
        pressed.reservation.settle(pressed.body.bytes(base) as u64);
        self.seat.with(|seat| *seat = Some(pressed));
        made
    }

    fn made(
        &self,
        pressed: &mut Pressed,
        step: &ContactStep<'_>,
        state: &ObjectState,
        wanted: &[u32],
    ) -> Result<Made, Refusal> {
        let may_be_linear = self.deformation == Deformation::Auto;
        // Without a factor linear elasticity is all there is: it answers, and warns.
        let allowed = match step.elasticity.base.has_factor() {
            true => LINEAR_ERROR_REL,
            false => f64::INFINITY,
        };
        if may_be_linear
            && pressed.promised() <= allowed
            && let Some(made) = linear_if_small(pressed, step, state, wanted, allowed)?
        {
            return Ok(made);
        }
        let before = pressed.body.factors();
        let outcome = LargeStep { step: *step, body: &mut pressed.body }.advance(state, wanted)?;
        Ok(Made {
            outcome,
            is_large: true,
            factors: pressed.body.factors() - before,
            plastic_strain: pressed.body.elements().plastic_strain_max(),
            summary: pressed.body.summary(),
            is_beyond_linear: false,
        })
    }
}

/// Step by linear elasticity, if rotation and strain at its end promise an error within the allowed one,
/// relative.
fn linear_if_small(
    pressed: &Pressed,
    step: &ContactStep<'_>,
    state: &ObjectState,
    wanted: &[u32],
    allowed: f64,
) -> Result<Option<Made>, Refusal> {
    let all: Vec<u32> = (0..step.vertices.len() as u32).collect();
    let mut outcome = step.advance(state, &all)?;
    let summary = pressed.body.summary_of(outcome.displacements.as_flattened());
    let promised = promised_error(summary.rotation_max, summary.strain_max);
    if promised > allowed || promised.is_nan() {
        return Ok(None);
    }
    outcome.displacements = wanted
        .iter()
        .filter_map(|&node| outcome.displacements.get(node as usize).copied())
        .collect();
    let is_beyond_linear = promised > LINEAR_ERROR_REL;
    Ok(Some(Made { summary, is_beyond_linear, ..Made::linear(outcome) }))
}
