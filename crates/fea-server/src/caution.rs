//! What a user should know about an answer: where linear elasticity stops being right, and which
//! of the wishes it does not meet.

use softgrasp_core::fem::StrainSummary;
use softgrasp_protocol::{Question, SolveReport};

/// Linear elasticity errs by the square of the rotation: 1.5 % at 10°.
const ROTATION_WARNING_DEG: f64 = 10.0;
/// Above this the small-strain measure itself is off by several per cent.
const STRAIN_WARNING: f64 = 0.1;

/// Sentences for answers that leave the range of small rotations and strains.
pub(crate) fn warnings(summary: StrainSummary) -> Vec<String> {
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

/// Adds a sentence for each wish of the question that the answer does not meet.
pub(crate) fn add_unmet_wishes(question: &Question, report: &mut SolveReport) {
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
