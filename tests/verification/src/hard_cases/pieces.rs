//! Cases with pieces joined by a node or an edge, and with bodies without contact.

use nalgebra::{Point3, Vector3};

use super::case::{Allowed, Case, Family, Form, Question, moved, plain};
use super::refusal::Reason;
use super::shapes::{block, doubled, nearest};
use softgrasp_bench::report::ReportError;

/// A block and its copy: hinged at a node, at an edge, or apart.
///
/// # Errors
/// [`ReportError`] if a case cannot be set up.
pub(super) fn family(form: Form) -> Result<Family, ReportError> {
    let block = block([form.cells; 3], [1.0; 3])?;
    let ways_to_join: [(&str, [f64; 3], usize); 3] = [
        ("hinged at an edge", [1.0, 0.0, 1.0], 1),
        ("hinged at a node", [1.0, 1.0, 1.0], 2),
        ("a second body", [2.0, 0.0, 0.0], 3),
    ];
    let mut cases = Vec::new();
    for (name, shift, contacts_needed) in ways_to_join {
        let shift = Vector3::from(shift);
        let mesh = doubled(&block, shift)?;
        let first = Question::clamped(block.clone(), plain()?, 2);
        // On corners of the copy that the block does not share.
        let corners = [[1.0, 0.0, 1.0], [0.0, 1.0, 1.0], [1.0, 1.0, 0.0]];
        let on_copy = |count: usize| {
            let touch = |corner: &[f64; 3]| {
                moved(nearest(&mesh, &(Point3::from(*corner) + shift)), [0.2, -0.1, 0.3], 0.01)
            };
            let pairs = first.pairs.iter().copied();
            pairs.chain(corners.iter().take(count).flat_map(touch)).collect::<Vec<_>>()
        };
        let question = |pairs: Vec<(u32, f64)>| {
            let fixed = first.fixed.clone();
            Ok::<_, ReportError>(Question { mesh: mesh.clone(), materials: plain()?, fixed, pairs })
        };
        let mut too_few = vec![0, contacts_needed - 1];
        too_few.dedup();
        for count in too_few {
            let title = format!("{name}, held by {count}");
            let case = Case::new(title, question(on_copy(count))?, 1.0);
            cases.push(case.allowing(Allowed::REFUSED).because(Reason::Free));
        }
        let held = question(on_copy(contacts_needed))?;
        cases.push(Case::new(format!("{name}, held by {contacts_needed}"), held, 1.0));
    }
    Ok(Family {
        name: "pieces and bodies",
        reasoning: "A hinge leaves a piece its turns: with too few contacts they are free and \
                    refused, with enough the piece is held as well as any body.",
        advice: "Touch or hold every piece, or mend the mesh: pieces that should be one share faces.",
        cases,
    })
}
