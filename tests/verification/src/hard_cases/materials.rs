//! Cases with hard materials: nearly incompressible, and stiff beside soft.

use nalgebra::Point3;
use softgrasp_core::fem::Material;

use super::case::{Case, Family, Form, Question};
use super::shapes::{block, with_regions};
use softgrasp_bench::report::ReportError;

/// ν from 0.3 to 0.49999, clamped by the scene and held by contacts.
///
/// # Errors
/// [`ReportError`] where a case cannot be set up.
pub(super) fn incompressible(form: Form) -> Result<Family, ReportError> {
    let mesh = block([form.cells; 3], [1.0; 3])?;
    let mut cases = Vec::new();
    for nu in [0.3, 0.45, 0.49, 0.499, 0.4999, 0.49999] {
        let materials = vec![Material::try_new(1.0e5, nu)?];
        let growth = 0.4 / (1.0 - 2.0 * nu);
        let clamped = Question::clamped(mesh.clone(), materials.clone(), 2);
        cases.push(Case::new(format!("ν = {nu}, clamped"), clamped, growth));
        if form.is_quick && nu < 0.4999 {
            continue;
        }
        let held = Question::held(mesh.clone(), materials);
        cases.push(Case::new(format!("ν = {nu}, held by contacts"), held, growth));
    }
    Ok(Family {
        name: "nearly incompressible",
        reasoning: "The bulk modulus over the shear modulus, and with it the condition, grows like \
                    1/(1 − 2ν): and so does the expected error.",
        advice: "Take t4-anp or t10 above ν = 0.45 (t4 locks, see the last figure); digits are not \
                 the problem: even at ν = 0.49999 nine are left.",
        cases,
    })
}

/// Regions of one material in another that is softer by up to 1e8.
///
/// # Errors
/// [`ReportError`] where a case cannot be set up.
pub(super) fn contrast(form: Form) -> Result<Family, ReportError> {
    let cells = form.cells;
    let mesh = block([cells; 3], [1.0; 3])?;
    let of_cell = |p: &Point3<f64>| p.coords.map(|x| (x * cells as f64).floor() as u32);
    let inclusion = with_regions(&mesh, |p| u32::from((p - Point3::from([0.5; 3])).norm() < 0.35))?;
    let layers = with_regions(&mesh, |p| of_cell(p).z % 2)?;
    let checkerboard = with_regions(&mesh, |p| of_cell(p).sum() % 2)?;
    let contrasts: &[f64] =
        if form.is_quick { &[1e4, 1e8] } else { &[1.0, 1e2, 1e4, 1e6, 1e8, 1e-4, 1e-8] };
    let mut cases = Vec::new();
    for &contrast in contrasts {
        let young = [1.0e5, 1.0e5 * contrast];
        let materials = young.map(|young| Material::try_new(young, 0.3));
        let materials = materials.into_iter().collect::<Result<Vec<_>, _>>()?;
        for (shape, mesh) in
            [("inclusion", &inclusion), ("layers", &layers), ("checkerboard", &checkerboard)]
        {
            let question = Question::clamped(mesh.clone(), materials.clone(), 2);
            let name = format!("{shape}, contrast {contrast:.0e}");
            cases.push(Case::new(name, question, contrast.max(1.0 / contrast)));
        }
    }
    Ok(Family {
        name: "stiffness contrast",
        reasoning: "The forces inside a hard region are differences of numbers as large as its \
                    stiffness, and the soft one balances them: rounding, that of the assembled \
                    stiffness too, counts times the contrast at most.",
        advice: "Up to a contrast of 1e4 nothing; beyond, make what is 10 000 times harder only \
                 1000 times harder, it does not deform either way, or hold its nodes instead.",
        cases,
    })
}
