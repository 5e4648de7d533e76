//! Answers one request that holds mesh and known displacements, at large deformation.

use std::sync::Arc;

use softgrasp_core::fem::Element;
use softgrasp_core::model::Model;
use softgrasp_core::solve::choose::cheapest_element;
use softgrasp_core::solve::equilibrium::{Hold, Path, TangentsBy};
use softgrasp_core::solve::memory::{Need, hierarchy_bytes};
use softgrasp_core::solve::{Method, Stage};
use softgrasp_protocol::{Answer, Body, Deformation, LargeAsk, LargeReport, Question};

use super::gradient::{of_equilibrium, reserve_tangent};
use super::large::{Found, LINEAR_ERROR_REL, LargeQuestion, law_of};
use super::once::solve_once;
use super::warnings::locking_warning;
use crate::budget::Reservation;
use crate::clock::StageClock;
use crate::plan::{PlanError, Subject, admit};
use crate::refusal::Refusal;
use crate::request::{check_node_count, element_given, model_of, poisson_max};
use crate::resources::Resources;

/// Answers a request with its own mesh at large deformation: all known displacements grow in proportion
/// from rest.
///
/// # Errors
/// [`Refusal`] if the request cannot be answered.
pub(crate) fn solve_large(
    resources: &Resources,
    (body, message): (Body, Question),
    large: LargeAsk,
    reservation: Reservation,
    mut clock: StageClock,
) -> Result<Answer, Refusal> {
    let why = match large.deformation {
        Deformation::Linear => return Err(Refusal::LargeLinear),
        Deformation::Large => "asked for".to_owned(),
        Deformation::Auto => match linear_within(resources, (&body, &message), large, &clock)? {
            Linear::Within(answer) => return Ok(*answer),
            Linear::TooFar { promised } => {
                format!("linear elasticity promises an error of {promised:.1e} only")
            }
        },
    };
    let Body { mesh, materials, element } = body;
    let element = element_given(element).unwrap_or_else(|| cheapest(poisson_max(&materials)));
    check_node_count(&mesh, resources.config.max_nodes)?;
    let subject = Subject::once(&mesh, message.known.len());
    let needs = subject.predict(element, methods_of(&message));
    let need =
        admit(&resources.models, &reservation, &needs, &subject).map_err(PlanError::Memory)?;
    let model = model_of(mesh, &materials, element, Vec::new(), &mut clock)?;
    let question = LargeQuestion::new(&model, &large, &message)?;
    let elements = Arc::new(model.yielding(law_of(large.law), large.yield_stress)?);
    clock.begin(Stage::Order);
    let held = Held { resources, reservation: &reservation, model: &model, subject: &subject };
    let hold = Arc::new(held.hold(&question, &message, need.method)?);
    let why = match hold.analysis() {
        None if !question.by_multigrid => format!("{why}; {WITHOUT_FACTOR}"),
        _ => why,
    };
    let _of_tangent = reserve_tangent(resources, (&model, &hold), &message, None)?;
    clock.begin(Stage::Solve);
    let rest = vec![0.0; 3 * model.system_node_count()];
    let is_single = question.is_single || hold.analysis().is_none();
    let mut path = Path::new(elements, model.stiffness(), hold, rest, is_single);
    let equilibrium = question.find(&mut path, &clock)?;
    let gradient = of_equilibrium(&model, &message, (&path, &equilibrium))?;
    clock.end();
    let summary = path.elements().summary(path.displacement());
    let found = Found {
        model: &model,
        path: &path,
        equilibrium,
        summary,
        is_single,
        factor_reused: false,
        chosen_because: why,
        gradient,
    };
    let mut answered = found.answer(&question, &message, clock);
    let locks = locking_warning(model.element(), model.poisson_max());
    answered.report.warnings.extend(locks);
    Ok(answered)
}

/// Why corrections come from multigrid where that was not asked for.
const WITHOUT_FACTOR: &str = "corrections by conjugate gradients with multigrid, since memory is too \
                              short for factors of the tangents";

/// Methods by which tangents may be inverted: what the question names, else the first that fits.
fn methods_of(message: &Question) -> &'static [Method] {
    match message.method.as_str() {
        "multigrid" => &[Method::Multigrid],
        "front" => &[Method::Front],
        "front-mixed" => &[Method::FrontMixed],
        _ => &[Method::FrontMixed, Method::Multigrid],
    }
}

/// A body that is to be held at large deformation, and the memory that this may take.
struct Held<'a> {
    resources: &'a Resources,
    reservation: &'a Reservation,
    model: &'a Model,
    subject: &'a Subject,
}

impl Held<'_> {
    /// The hold, with memory reserved for factors of its tangents, or for hierarchies where factors do not
    /// fit and are not asked for.
    fn hold(
        &self,
        question: &LargeQuestion,
        message: &Question,
        predicted: Method,
    ) -> Result<Hold, Refusal> {
        let Self { resources, reservation, model, subject } = *self;
        let by = |by| {
            let hold = model.hold_by(&question.known.dofs, question.masks.clone(), by, None)?;
            admit_path(resources, reservation, model, (&hold, question.is_single), subject)?;
            Ok(hold)
        };
        if predicted == Method::Multigrid {
            return by(TangentsBy::Multigrid);
        }
        match by(TangentsBy::Factors) {
            Err(Refusal::Plan(PlanError::Memory(shortage)))
                if methods_of(message).contains(&Method::Multigrid) =>
            {
                // What is short for a hierarchy too is told by what a factor would take.
                by(TangentsBy::Multigrid).map_err(|_| Refusal::Plan(PlanError::Memory(shortage)))
            }
            held => held,
        }
    }
}

/// Element at large strain, where ten-node elements do not follow as far: a linear one that does not
/// lock.
fn cheapest(poisson_max: f64) -> Element {
    match cheapest_element(poisson_max) {
        Element::Tet4 => Element::Tet4,
        _ => Element::Tet4Anp,
    }
}

/// A linear answer that is accurate enough, or the error that it may have.
enum Linear {
    Within(Box<Answer>),
    TooFar { promised: f64 },
}

/// Linear answer, if its rotation and strain promise an error within the allowed one.
fn linear_within(
    resources: &Resources,
    (body, question): (&Body, &Question),
    large: LargeAsk,
    clock: &StageClock,
) -> Result<Linear, Refusal> {
    if large.yield_stress.is_some() {
        return Ok(Linear::TooFar { promised: f64::INFINITY });
    }
    let allowed = question.max_error.unwrap_or(LINEAR_ERROR_REL);
    let reservation = resources.budget.reservation();
    let (body, question) = (body.clone(), question.clone());
    let answer = solve_once(resources, body, question, reservation, clock.clone())?;
    let report = &answer.report;
    let promised = promised_error(report.max_rotation_deg.to_radians(), report.max_strain);
    // Without a number nothing is promised.
    if promised.is_nan() || promised > allowed {
        return Ok(Linear::TooFar { promised });
    }
    Ok(Linear::Within(Box::new(linear_answer(answer, promised))))
}

/// Largest error promised for a linear displacement field, relative to the largest displacement: rotation
/// and strain leave out terms as large as themselves.
///
/// Units: rad, 1.
pub(super) fn promised_error(rotation_max: f64, strain_max: f64) -> f64 {
    rotation_max + strain_max
}

/// Turns a linear answer into the answer to a question about large deformation.
pub(super) fn linear_answer(mut answer: Answer, promised: f64) -> Answer {
    let report = &mut answer.report;
    let of_digits = report.error_estimate_rel.unwrap_or(0.0);
    report.error_estimate_rel = Some(promised.max(of_digits));
    report.chosen_because = format!(
        "{}; linear: rotation and strain promise an error below {promised:.1e}",
        report.chosen_because
    );
    answer.large = Some(LargeReport {
        is_linear: true,
        linear_solves: 1,
        min_jacobian: 1.0 - 3.0 * report.max_strain,
        max_stretch: 1.0 + report.max_strain,
        settled: true,
        ..LargeReport::default()
    });
    answer
}

/// Reserves the memory of a path, once that of its factor is counted.
///
/// # Errors
/// [`PlanError::Memory`].
pub(super) fn admit_path(
    resources: &Resources,
    reservation: &Reservation,
    model: &Model,
    (hold, is_single): (&Hold, bool),
    subject: &Subject,
) -> Result<(), Refusal> {
    let method = if is_single { Method::FrontMixed } else { Method::Front };
    let blocks = model.stiffness().pattern().block_count();
    // The tangent stands beside the linear stiffness.
    let held = (model.bytes() + blocks * size_of::<[f64; 9]>()) as u64;
    let need = match hold.analysis() {
        Some(analysis) => Need::counted(model.element(), method, held, blocks, analysis),
        None => {
            let hierarchy = hierarchy_bytes(model.system_node_count(), blocks) as u64;
            Need::exact(model.element(), Method::Multigrid, held, hierarchy)
        }
    };
    admit(&resources.models, reservation, &[need], subject).map_err(PlanError::Memory)?;
    Ok(())
}
