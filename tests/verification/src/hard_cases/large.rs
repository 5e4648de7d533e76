//! A mesh of a hundred thousand nodes.

use softgrasp_core::mesh::{BuiltIn, generate};

use super::case::{Case, Family, Form, Question, Reach, plain};
use softgrasp_bench::report::ReportError;

const NODES: usize = 100_000;

/// One press, by the ways that `auto` may choose; empty in the small form.
///
/// # Errors
/// [`ReportError`] if a case cannot be set up.
pub(super) fn family(form: Form) -> Result<Family, ReportError> {
    let mut cases = Vec::new();
    if !form.is_quick && !cfg!(test) {
        let mesh = generate(BuiltIn::Cube, NODES)?;
        let growth = (mesh.node_count() as f64 / 27.0).powf(2.0 / 3.0);
        let question = Question::held(mesh, plain()?);
        let case = Case::new("cube of about 100 000 nodes, held by contacts", question, growth);
        cases.push(Case { reach: Reach::Large, runs: 1, ..case });
    }
    Ok(Family {
        name: "large meshes",
        reasoning: "The condition grows with the square of the number of cells along an edge.",
        advice: "Nothing for the digits; for the time, `condensed` for frames and `pcg` or \
                 `front-mixed` for single answers.",
        cases,
    })
}
