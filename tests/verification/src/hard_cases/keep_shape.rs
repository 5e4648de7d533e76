//! Cases in which shapes are kept repeatedly: each answer is the next rest shape.

use glove_client::ask::connection::Host;
use nalgebra::Vector3;
use softgrasp_core::mesh::Inversion;

use super::answer::Answer;
use super::case::{Allowed, Case, Family, Form, Question, Reach, Repeats, THREADS, plain};
use super::outcome::{Judged, Outcome};
use super::refusal::{Reason, Refusal};
use super::shapes::block;
use super::truth::{Errors, Truth};
use super::ways::Way;
use softgrasp_bench::report::ReportError;

/// Number of times that a shape is kept.
const TIMES: usize = 200;
/// Number of answers of which one is compared with a reference.
const COMPARED_EVERY: usize = 10;

/// Two hundred shapes kept, to and fro and always onwards.
///
/// # Errors
/// [`ReportError`] if a case cannot be set up.
pub(super) fn family(form: Form) -> Result<Family, ReportError> {
    let mesh = block([2; 3], [1.0; 3])?;
    let question = Question::held(mesh, plain()?);
    // Two hundred questions each: fewer runs where time is short.
    let runs = if form.is_quick { 2 } else { THREADS.len() };
    let to_and_fro = Case {
        reach: Reach::OfEachKind,
        repeats: Repeats::ToAndFro(TIMES),
        runs,
        ..Case::new("200 times, to and fro", question.clone(), 1.0)
    };
    let onwards = Case {
        reach: Reach::OfEachKind,
        repeats: Repeats::Onwards(TIMES),
        runs,
        ..Case::new("200 times, always onwards", question, 1.0)
            .allowing(Allowed::EXACT_OR_REFUSED)
            .because(Reason::Inverted)
    };
    Ok(Family {
        name: "keep shape",
        reasoning: "Every kept shape is a mesh like any other, so its answers are as exact as the \
                    first; a step that turns an element inside out is refused, and the shape before \
                    it stays.",
        advice: "When keeping is refused, open the hand a little and keep again, or mesh the kept \
                 surface anew.",
        cases: vec![to_and_fro, onwards],
    })
}

/// Result of a question that is asked repeatedly.
pub(super) enum Walk {
    /// The last answer, and the largest errors of those that were compared.
    Answered(Answer, Option<Errors>),
    /// No answer, or a shape that cannot be kept.
    Refused(Refusal),
    /// An answer on the way whose error was above its threshold and above what it stated.
    Failed(String),
}

/// Asks, keeps the shape, and repeats.
pub(super) fn walk(way: Way, case: &Case, compare: bool, host: &Host) -> Walk {
    let (times, and_fro) = match case.repeats {
        Repeats::Once => (1, false),
        Repeats::ToAndFro(times) => (times, true),
        Repeats::Onwards(times) => (times, false),
    };
    let mut question = case.question.clone();
    let mut worst: Option<Errors> = None;
    let mut last = None;
    for time in 0..times {
        let refused = |reason: Reason, text: String| {
            Walk::Refused(Refusal::new(reason, format!("time {}: {text}", time + 1)))
        };
        let answer = match way.answer(&question, host) {
            Ok(answer) => answer,
            Err(Refusal { reason, text }) => return refused(reason, text),
        };
        if compare && (time % COMPARED_EVERY == 0 || time + 1 == times) {
            let truth = Truth::of(&question, way.element(), None);
            let errors = truth.errors_of(&answer.displacement, way.is_single());
            let Answer { stated_rel, bound_rel, .. } = answer;
            let promised_rel = way.promised_rel();
            let judged = Judged { errors, stated_rel, bound_rel, promised_rel };
            if let (Outcome::Failed, text) = Outcome::of_answer(&judged, Allowed::ANY) {
                return Walk::Failed(format!("time {}: {text}", time + 1));
            }
            worst = larger(worst, errors);
        }
        let mesh = &question.mesh;
        let steps = answer.displacement.as_chunks::<3>().0.iter();
        let moved: Vec<_> =
            mesh.vertices().iter().zip(steps).map(|(p, u)| p + Vector3::from(*u)).collect();
        if let Some(inversion) = Inversion::of(mesh, &moved) {
            return refused(Reason::Inverted, inversion.to_string());
        }
        question.mesh = match mesh.with_vertices(moved) {
            Ok(mesh) => mesh,
            Err(error) => return refused(Reason::Inverted, error.to_string()),
        };
        if and_fro {
            question = question.scaled(-1.0);
        }
        last = Some(answer);
    }
    match last {
        Some(answer) => Walk::Answered(answer, worst),
        None => Walk::Failed("it was not asked".to_owned()),
    }
}

/// The errors that are larger, relative to their threshold.
fn larger(a: Option<Errors>, b: Option<Errors>) -> Option<Errors> {
    match (a, b) {
        (Some(a), Some(b)) if a.largest_rel * b.threshold_rel > b.largest_rel * a.threshold_rel => {
            Some(a)
        }
        (a, None) => a,
        (_, b) => b,
    }
}
