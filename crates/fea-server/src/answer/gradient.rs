//! Derivatives of the quantity of a question: what they need, and how they travel.

use nalgebra::Vector3;
use softgrasp_core::gradient::{Gradient, GradientOf, NoGradient};
use softgrasp_core::model::Model;
use softgrasp_core::solve::choose::{Plan, Question, SMALLER_THAN_FRONT};
use softgrasp_core::solve::equilibrium::{Equilibrium, Hold, NoAdjoint, Path};
use softgrasp_core::solve::memory::{Need, hierarchy_bytes};
use softgrasp_core::solve::{Factored, Method, Solution};
use softgrasp_core::{Quantity, Term};
use softgrasp_protocol::{
    DofValue, GradientValues, LargeAsk, ModelHash, QuantityTerm, Question as QuestionMessage,
};

use crate::budget::Reservation;
use crate::refusal::Refusal;
use crate::resources::Resources;

/// The plan of a question: one with a factor, where derivatives are wanted.
///
/// # Errors
/// [`Refusal::GradientCondensed`] where the question leaves no factor open.
pub(super) fn planned(
    question: &Question,
    message: &QuestionMessage,
    plan: Plan,
) -> Result<Plan, Refusal> {
    if message.quantity.is_empty() {
        return Ok(plan);
    }
    if !message.masks.is_empty() || question.method == Some(Method::Condensed) {
        return Err(Refusal::GradientCondensed);
    }
    match plan.method {
        Method::Condensed => {
            let why = "derivatives are solved for with a factor";
            let plan = question.plan(plan.element, Method::Front, why);
            Ok(Plan { instead: SMALLER_THAN_FRONT, ..plan })
        }
        _ => Ok(plan),
    }
}

/// Whether the quantity of a question fits the model and its known degrees of freedom; called before
/// anything costly is made.
///
/// # Errors
/// [`Refusal::Gradient`] that names the node.
pub(super) fn check_quantity(
    model: &Model,
    known: &[u32],
    message: &QuestionMessage,
) -> Result<(), Refusal> {
    Ok(quantity_of(message).check(model.mesh().node_count(), known)?)
}

/// Whether an equilibrium can have derivatives, as far as the question says; called before anything costly
/// is made.
///
/// # Errors
/// [`Refusal::Gradient`] for a yield stress and for masks.
pub(super) fn check_equilibrium(ask: &LargeAsk, message: &QuestionMessage) -> Result<(), Refusal> {
    let refused = |why: NoAdjoint| Err(NoGradient::from(why).into());
    if message.quantity.is_empty() {
        return Ok(());
    }
    if ask.yield_stress.is_some() {
        return refused(NoAdjoint::Plastic);
    }
    match message.masks.is_empty() {
        true => Ok(()),
        false => refused(NoAdjoint::Masks),
    }
}

/// Derivatives at a linear answer; `None` if none are wanted.
///
/// # Errors
/// [`Refusal::Gradient`].
pub(super) fn of_solution(
    model: &Model,
    message: &QuestionMessage,
    (factored, solution): (&Factored, &Solution),
) -> Result<Option<GradientValues>, Refusal> {
    let known = factored.partition().known();
    asked(model, message, known, |of| of.at_solution(model, (factored, solution)))
}

/// Derivatives at an equilibrium that was found last on its path; `None` if none are wanted.
///
/// # Errors
/// [`Refusal::Gradient`].
pub(super) fn of_equilibrium(
    model: &Model,
    message: &QuestionMessage,
    (path, equilibrium): (&Path, &Equilibrium),
) -> Result<Option<GradientValues>, Refusal> {
    let known = path.hold().dofs();
    asked(model, message, known, |of| of.at_equilibrium(model, (path, equilibrium)))
}

/// Reserves the memory for the tangent of an equilibrium and its factor, which stand beside those of the
/// path, where derivatives are wanted. `kept` is a model that must not be dropped to make room.
///
/// # Errors
/// [`Refusal::GradientMemory`].
pub(super) fn reserve_tangent(
    resources: &Resources,
    (model, hold): (&Model, &Hold),
    message: &QuestionMessage,
    kept: Option<ModelHash>,
) -> Result<Option<Reservation>, Refusal> {
    if message.quantity.is_empty() {
        return Ok(None);
    }
    let blocks = model.stiffness().pattern().block_count();
    let of_inverse = match hold.analysis() {
        Some(analysis) => {
            Need::counted(model.element(), Method::Front, 0, blocks, analysis).bytes()
        }
        None => hierarchy_bytes(model.system_node_count(), blocks) as u64,
    };
    let bytes = of_inverse + (blocks * size_of::<[f64; 9]>()) as u64;
    let reservation = resources.budget.reservation();
    if !reservation.reserve(bytes, 0) {
        return Err(Refusal::GradientMemory { bytes, free: reservation.free() });
    }
    resources.models.make_room(kept);
    Ok(Some(reservation))
}

fn asked(
    model: &Model,
    message: &QuestionMessage,
    known: &[u32],
    solve: impl FnOnce(&GradientOf<'_>) -> Result<Gradient, NoGradient>,
) -> Result<Option<GradientValues>, Refusal> {
    if message.quantity.is_empty() {
        return Ok(None);
    }
    let spread = &message.spread;
    let weight = (spread.densities.as_slice(), Vector3::from(spread.gravity));
    let pressures = spread.pressures.iter().map(|on| (on.triangles.as_slice(), on.pressure));
    let gradient = solve(&GradientOf {
        quantity: &quantity_of(message),
        weight: (!spread.densities.is_empty()).then_some(weight),
        pressures: pressures.collect(),
        with_places: message.quantity.with_places,
    })?;
    Ok(Some(values(model, known, gradient)))
}

fn quantity_of(message: &QuestionMessage) -> Quantity {
    let term =
        |&QuantityTerm { dof, slope, curvature }: &QuantityTerm| Term { dof, slope, curvature };
    let terms = |terms: &[QuantityTerm]| terms.iter().map(term).collect();
    Quantity {
        of_displacements: terms(&message.quantity.of_displacements),
        of_reactions: terms(&message.quantity.of_reactions),
    }
}

/// Derivatives as they travel; those by forces on mid-edge nodes that the server has made do not.
fn values(model: &Model, known: &[u32], gradient: Gradient) -> GradientValues {
    let rows = |numbers: &[f64]| -> Vec<[f64; 3]> {
        numbers.as_chunks().0.iter().take(model.mesh().node_count()).copied().collect()
    };
    let by_known = known.iter().zip(gradient.by_known);
    GradientValues {
        value: gradient.value,
        by_forces: rows(&gradient.by_forces),
        by_known: by_known.map(|(&dof, value)| DofValue { dof, value }).collect(),
        by_materials: gradient.by_materials.iter().map(|of| [of.young, of.poisson]).collect(),
        by_acceleration: gradient.by_acceleration.map(Into::into),
        by_pressures: gradient.by_pressures,
        by_places: gradient.by_places.as_deref().map(rows).unwrap_or_default(),
    }
}
