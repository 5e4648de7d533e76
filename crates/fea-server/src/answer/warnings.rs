//! Writes the warnings of an answer: large rotations and strains, uncertain digits, a missed
//! deadline or error budget.

use softgrasp_core::fem::Element;
use softgrasp_core::fem::StrainSummary;
use softgrasp_core::solve::choose::{LOCKING_POISSON, Plan};
use softgrasp_core::solve::{Certainty, ERROR_SERIOUS, ERROR_UNREMARKABLE};
use softgrasp_protocol::{Question, SolveReport, Warning, WarningCode, WarningLevel};

use crate::refusal::Refusal;

/// Chosen: linear elasticity errs by the square of the rotation, 1.5 % at this angle in degrees.
const ROTATION_WARNING_DEG: f64 = 10.0;
/// Chosen: above this strain the small-strain measure itself is wrong by several per cent.
const STRAIN_WARNING: f64 = 0.1;

/// Warnings for answers outside the range of small rotations and strains.
pub(super) fn strain_warnings(summary: StrainSummary) -> Vec<Warning> {
    let (rotation_deg, strain) = (summary.rotation_max.to_degrees(), summary.strain_max);
    let mut warnings = Vec::new();
    if rotation_deg > ROTATION_WARNING_DEG {
        let text = format!(
            "an element turns by {rotation_deg:.1} degrees; linear elasticity is off by about \
             {:.0} % there",
            50.0 * rotation_deg.to_radians().powi(2)
        );
        warnings.push(Warning::new(WarningCode::ROTATION, text));
    }
    if strain > STRAIN_WARNING {
        let text = format!(
            "an element is strained by {:.0} %; linear elasticity is meant for small strains",
            100.0 * strain
        );
        warnings.push(Warning::new(WarningCode::STRAIN, text));
    }
    warnings
}

/// Writes into the report how many digits are certain, and refuses an answer without any.
pub(super) fn add_certainty(
    certainty: Certainty,
    question: &Question,
    report: &mut SolveReport,
) -> Result<(), Refusal> {
    let Certainty { condition, error_rel } = certainty;
    if certainty.is_none() {
        return Err(Refusal::Uncertain { method: report.method.clone(), error_rel, condition });
    }
    report.condition_estimate = Some(condition);
    report.error_estimate_rel = Some(error_rel);
    // Who asks for few digits is not warned of having few.
    let unremarkable = ERROR_UNREMARKABLE.max(question.max_error.unwrap_or(0.0));
    if error_rel <= unremarkable {
        return Ok(());
    }
    let (level, few) = match error_rel > ERROR_SERIOUS {
        true => (WarningLevel::SERIOUS, "few digits are certain"),
        false => (WarningLevel::CAUTION, "digits are lost"),
    };
    report.warning_level = level;
    let text = format!(
        "{few}: the displacements are estimated to be off by up to {error_rel:.0e} of the largest \
         (condition {condition:.0e}); hold nodes further apart, or use a material less near to \
         incompressible"
    );
    report.warnings.push(Warning::new(WarningCode::DIGITS, text));
    Ok(())
}

/// Adds a warning if the answer took longer than the deadline.
pub(super) fn add_late(deadline_ms: Option<f64>, report: &mut SolveReport) {
    let ms = &report.stage_ms;
    let took = ms.queue + ms.decode + ms.assemble + ms.order + ms.factor + ms.solve + ms.encode;
    if let Some(deadline) = deadline_ms.filter(|deadline| took > *deadline) {
        let text = format!("it took {took:.2} ms; wanted within {deadline} ms");
        report.warnings.push(Warning::new(WarningCode::LATE, text));
    }
}

/// Adds a warning for the error or the deadline of the question that the answer does not meet.
pub(super) fn add_unmet_wishes(question: &Question, report: &mut SolveReport) {
    add_late(question.deadline_ms, report);
    let Some(wanted) = question.max_error else { return };
    let text = match report.error_bound_rel {
        Some(bound) if bound > wanted => {
            format!("the error is proven to be below {bound:.1e} only; wanted below {wanted:.1e}")
        }
        None if report.residual_rel > wanted => {
            let residual = report.residual_rel;
            format!("the residual is {residual:.1e}; wanted an error below {wanted:.1e}")
        }
        _ => return,
    };
    report.warnings.push(Warning::new(WarningCode::ERROR, text));
}

/// Adds warnings for linear elements that lock on the material although they were asked for, and for what
/// a plan gave up.
pub(super) fn add_plan_warnings(
    plan: &Plan,
    asked: Option<Element>,
    poisson_max: f64,
    report: &mut SolveReport,
) {
    let gave_up = plan.gave_up.map(|text| Warning::new(WarningCode::CHOICE, text.to_string()));
    let locks = plan.locks.map(|text| Warning::new(WarningCode::LOCKING, text.to_string()));
    report.warnings.extend(gave_up.into_iter().chain(locks));
    if asked == Some(Element::Tet4) {
        report.warnings.extend(locking_warning(Element::Tet4, poisson_max));
    }
}

/// Warning for elements that lock on a material of this Poisson's ratio.
pub(super) fn locking_warning(element: Element, poisson_max: f64) -> Option<Warning> {
    let locks = element == Element::Tet4 && poisson_max >= LOCKING_POISSON;
    locks.then(|| {
        let text = format!(
            "linear elements lock at a Poisson's ratio of {poisson_max}: the object seems stiffer \
             than it is; ask for elements that do not (t4-anp, t10, auto)"
        );
        Warning::new(WarningCode::LOCKING, text)
    })
}
