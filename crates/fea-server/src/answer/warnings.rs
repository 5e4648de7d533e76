//! Writes the warnings of an answer: large rotations and strains, uncertain digits, a missed
//! deadline or error budget.

use softgrasp_core::fem::Element;
use softgrasp_core::fem::StrainSummary;
use softgrasp_core::solve::choose::{LOCKING_POISSON, Plan};
use softgrasp_core::solve::{Certainty, ERROR_SERIOUS, ERROR_UNREMARKABLE};
use softgrasp_protocol::{Question, SolveReport, WarningLevel};

use crate::refusal::Refusal;

/// Linear elasticity errs by the square of the rotation: 1.5 % at 10°.
const ROTATION_WARNING_DEG: f64 = 10.0;
/// Above this the small-strain measure itself is off by several per cent.
const STRAIN_WARNING: f64 = 0.1;

/// Sentences for answers that leave the range of small rotations and strains.
pub(super) fn strain_warnings(summary: StrainSummary) -> Vec<String> {
    let (rotation_deg, strain) = (summary.rotation_max.to_degrees(), summary.strain_max);
    let mut warnings = Vec::new();
    if rotation_deg > ROTATION_WARNING_DEG {
        warnings.push(format!(
            "an element turns by {rotation_deg:.1} degrees; linear elasticity is off by about \
             {:.0} % there",
            50.0 * rotation_deg.to_radians().powi(2)
        ));
    }
    if strain > STRAIN_WARNING {
        warnings.push(format!(
            "an element is strained by {:.0} %; linear elasticity is meant for small strains",
            100.0 * strain
        ));
    }
    warnings
}

/// Writes into the report how certain the digits are, and refuses an answer without any.
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
        true => (WarningLevel::Serious, "few digits are certain"),
        false => (WarningLevel::Caution, "digits are lost"),
    };
    report.warning_level = level;
    report.warnings.push(format!(
        "{few}: the displacements are estimated to be off by up to {error_rel:.0e} of the largest \
         (condition {condition:.0e}); hold nodes further apart, or use a material less near to \
         incompressible"
    ));
    Ok(())
}

/// Adds a sentence for each wish of the question that the answer does not meet.
pub(super) fn add_unmet_wishes(question: &Question, report: &mut SolveReport) {
    let ms = &report.stage_ms;
    let took = ms.queue + ms.decode + ms.assemble + ms.order + ms.factor + ms.solve + ms.encode;
    if let Some(deadline) = question.deadline_ms.filter(|deadline| took > *deadline) {
        report.warnings.push(format!("it took {took:.2} ms; wanted within {deadline} ms"));
    }
    let Some(wanted) = question.max_error else { return };
    match report.error_bound_rel {
        Some(bound) if bound > wanted => report.warnings.push(format!(
            "the error is proven to be below {bound:.1e} only; wanted below {wanted:.1e}"
        )),
        None if report.residual_rel > wanted => report.warnings.push(format!(
            "the residual is {:.1e}; wanted an error below {wanted:.1e}",
            report.residual_rel
        )),
        _ => {}
    }
}

/// Warns of linear elements that were asked for on a material on which they lock, and of what a plan
/// had to give up.
pub(super) fn add_plan_warnings(
    plan: &Plan,
    asked: Option<Element>,
    poisson_max: f64,
    report: &mut SolveReport,
) {
    report.warnings.extend(plan.gave_up.map(|gave_up| gave_up.to_string()));
    report.warnings.extend(plan.locks.map(|locks| locks.to_string()));
    if asked == Some(Element::Tet4) {
        report.warnings.extend(locking_warning(Element::Tet4, poisson_max));
    }
}

/// A sentence for elements that lock on a material.
pub(super) fn locking_warning(element: Element, poisson_max: f64) -> Option<String> {
    let locks = element == Element::Tet4 && poisson_max >= LOCKING_POISSON;
    locks.then(|| {
        format!(
            "linear elements lock at a Poisson's ratio of {poisson_max}: the object seems stiffer \
             than it is; ask for elements that do not (t4-anp, t10, auto)"
        )
    })
}
