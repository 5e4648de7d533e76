//! Cases of sheets and rods that are one element thick.

use super::case::{Case, Family, Form, Question, plain};
use super::shapes::block;
use softgrasp_bench::report::ReportError;

/// Number of cells along a sheet and a rod.
const SHEET_CELLS: usize = 4;
const ROD_CELLS: usize = 8;

/// Sheets and rods, clamped at one end and bent at the other.
///
/// # Errors
/// [`ReportError`] if a case cannot be set up.
pub(super) fn family(form: Form) -> Result<Family, ReportError> {
    let ratios: &[f64] = if form.is_quick { &[1e3] } else { &[1e1, 1e2, 1e3] };
    let mut cases = Vec::new();
    for &ratio in ratios {
        let sheet = block([SHEET_CELLS, SHEET_CELLS, 1], [1.0, 1.0, 1.0 / ratio])?;
        let question = Question::clamped(sheet, plain()?, 0);
        cases.push(Case::new(
            format!("sheet {ratio:e} times as wide as thick"),
            question,
            ratio * ratio,
        ));
        let rod = block([ROD_CELLS, 1, 1], [1.0, 1.0 / ratio, 1.0 / ratio])?;
        let question = Question::clamped(rod, plain()?, 0);
        cases.push(Case::new(
            format!("rod {ratio:e} times as long as thick"),
            question,
            ratio * ratio,
        ));
    }
    Ok(Family {
        name: "sheets and rods",
        reasoning: "Bending is softer than stretching by the square of length over thickness, and \
                    so grows the condition.",
        advice: "Up to 100 times as long as thick nothing. Beyond: t10 elements (linear ones are \
                 too stiff in bending long before digits are short), or a thicker stand-in of \
                 softer material.",
        cases,
    })
}
