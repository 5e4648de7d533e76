//! Cases in other units and magnitudes, which must change an answer only by their factor.

use softgrasp_core::fem::Material;

use super::case::{Allowed, Case, Family, Form, Question, plain};
use super::refusal::Reason;
use super::shapes::{block, in_unit};
use softgrasp_bench::report::ReportError;

/// The same block in units of length and force that differ by factors of a million and more.
///
/// # Errors
/// [`ReportError`] if a case cannot be set up.
pub(super) fn units(form: Form) -> Result<Family, ReportError> {
    let mesh = block([form.cells; 3], [1.0; 3])?;
    let pairs: &[(f64, f64)] = match form.is_quick {
        true => &[(1e-6, 1.0), (1e6, 1e12)],
        false => &[
            (1e-6, 1e5),
            (1e-3, 1e5),
            (1e3, 1e5),
            (1e6, 1e5),
            (1.0, 1.0),
            (1.0, 1e12),
            (1e-6, 1.0),
            (1e-6, 1e12),
            (1e6, 1.0),
            (1e6, 1e12),
        ],
    };
    let mut cases = Vec::new();
    for &(unit, young) in pairs {
        let materials = vec![Material::try_new(young, 0.3)?];
        let mesh = in_unit(&mesh, unit)?;
        let name = |held: &str| format!("size {unit:e} m, E = {young:e} Pa, {held}");
        let clamped = Question::clamped(mesh.clone(), materials.clone(), 2);
        cases.push(Case::new(name("clamped"), clamped, 1.0));
        cases.push(Case::new(name("held by contacts"), Question::held(mesh, materials), 1.0));
    }
    Ok(Family {
        name: "units",
        reasoning: "Every number is multiplied by a power of the unit, nothing is added to anything \
                    of another scale: the threshold of the block of one metre.",
        advice: "Nothing: any unit will do.",
        cases,
    })
}

/// Displacements from 1e-12 to half of the size, and values that are not finite.
///
/// # Errors
/// [`ReportError`] if a case cannot be set up.
pub(super) fn displacements(form: Form) -> Result<Family, ReportError> {
    let mesh = block([form.cells; 3], [1.0; 3])?;
    let shares: &[f64] =
        if form.is_quick { &[1e-12, 0.5] } else { &[1e-12, 1e-9, 1e-6, 1e-3, 0.1, 0.5] };
    let held = Question::held(mesh, plain()?);
    // The question moves a corner by a hundredth of the size.
    let mut cases: Vec<Case> = shares
        .iter()
        .map(|&share| Case::new(format!("{share:e} of the size"), held.scaled(100.0 * share), 1.0))
        .collect();
    // Forces overflow before displacements do.
    let case = |name: &str, by: f64| Case::new(name, held.scaled(by), 1.0);
    cases.push(case("1e-298 of the size", 1e-296).allowing(Allowed::ANY));
    cases.push(
        case("1e302 of the size", 1e304).allowing(Allowed::EXACT_OR_REFUSED).because(Reason::Range),
    );
    let refused = |case: Case| case.allowing(Allowed::REFUSED).because(Reason::Question);
    cases.push(refused(case("no number", f64::NAN)));
    let mut infinite = held.clone();
    infinite.pairs.push((3 * infinite.mesh.node_count() as u32 - 5, f64::INFINITY));
    cases.push(refused(Case::new("infinite", infinite, 1.0)));
    Ok(Family {
        name: "displacements",
        reasoning: "The equations are linear: the relative error is the same for every amount that \
                    stays within the range of a double. What is no number is refused, and what \
                    leaves the range may be.",
        advice: "Nothing for the digits. Linear elasticity itself ends at strains of some per cent: \
                 above, the answer solves its equations and not the object (max_strain warns).",
        cases,
    })
}
