//! Cases of bodies that contacts hold weakly or not at all.

use nalgebra::{Point3, Vector3};
use softgrasp_core::mesh::TetMesh;

use super::case::{Allowed, Case, Family, Form, Question, moved, plain};
use super::refusal::Reason;
use super::shapes::{block, nearest, with_node_at};
use softgrasp_bench::report::ReportError;

/// Three contacts, from well spread to nearly in line.
///
/// # Errors
/// [`ReportError`] if a case cannot be set up.
pub(super) fn weak(form: Form) -> Result<Family, ReportError> {
    // An even number of cells: an edge has a node in its middle.
    let mesh = block([2; 3], [1.0; 3])?;
    let arms: &[f64] =
        if form.is_quick { &[1.0, 1e-4, 1e-8] } else { &[1.0, 1e-1, 1e-2, 1e-3, 1e-4, 1e-6, 1e-8] };
    let mut cases = Vec::new();
    for &arm in arms {
        let (mesh, nodes) = three_contacts(&mesh, arm)?;
        let growth = 1.0 / (arm * arm);
        // Within 1e-8 of a line nothing may pass for certain.
        let promised = |case: Case| match arm <= 1e-8 {
            true => case.allowing(Allowed::CAUTIOUS),
            false => case,
        };
        let question = |pushes: [[f64; 3]; 3]| {
            let pairs = nodes.iter().zip(pushes).flat_map(|(&node, by)| moved(node, by, 0.01));
            let (mesh, pairs) = (mesh.clone(), pairs.collect());
            Ok::<_, ReportError>(Question { mesh, materials: plain()?, fixed: vec![], pairs })
        };
        let whole = [0.3, -1.0, 0.5];
        let case = Case::new(name(arm, "moved as a whole"), question([whole; 3])?, growth);
        cases.push(promised(case).with_field(|_| Vector3::from(whole) * 0.01));
        let bent = question([[0.0; 3], [-0.1, 0.0, 0.2], [0.1, 0.05, -0.1]])?;
        cases.push(promised(Case::new(name(arm, "squeezed"), bent, growth)));
    }
    Ok(Family {
        name: "three contacts nearly in line",
        reasoning: "A turn about the line is held with the arm δ of the third contact, so its \
                    stiffness falls, and the condition grows, with δ²; in line within 1e-8 of the \
                    size the condition is that of a body that is not held.",
        advice: "Take a further contact away from the line, or hold one more node: an arm of a \
                 hundredth of the size is enough for nine digits.",
        cases,
    })
}

fn name(arm: f64, how: &str) -> String {
    match arm >= 1.0 {
        true => format!("well spread, {how}"),
        false => format!("in line within {arm:.0e}, {how}"),
    }
}

/// The two ends of an edge of the block, and a third node at distance `arm` from their line: the opposite
/// corner, or the middle of the edge moved inwards.
fn three_contacts(mesh: &TetMesh, arm: f64) -> Result<(TetMesh, [u32; 3]), ReportError> {
    let at = |x: f64, y: f64, z: f64| nearest(mesh, &Point3::new(x, y, z));
    let ends = [at(0.0, 0.0, 0.0), at(1.0, 0.0, 0.0)];
    if arm >= 1.0 {
        return Ok((mesh.clone(), [ends[0], ends[1], at(0.5, 1.0, 1.0)]));
    }
    let middle = at(0.5, 0.0, 0.0);
    let mesh = with_node_at(mesh, middle, Point3::new(0.5, arm, 0.0))?;
    Ok((mesh, [ends[0], ends[1], middle]))
}

/// Two contacts, one, none; three in line.
///
/// # Errors
/// [`ReportError`] if a case cannot be set up.
pub(super) fn free(form: Form) -> Result<Family, ReportError> {
    let mesh = block([form.cells; 3], [1.0; 3])?;
    let corner =
        |x: f64, y: f64| moved(nearest(&mesh, &Point3::new(x, y, 0.0)), [0.0, 0.0, 1.0], 0.01);
    let cell = 1.0 / form.cells as f64;
    let case = |name: &str, contacts: &[Vec<(u32, f64)>]| {
        let pairs = contacts.concat();
        let question = Question { mesh: mesh.clone(), materials: plain()?, fixed: vec![], pairs };
        Ok::<_, ReportError>(
            Case::new(name, question, 1.0).allowing(Allowed::REFUSED).because(Reason::Free),
        )
    };
    let sliding: Vec<(u32, f64)> =
        (0..mesh.node_count() as u32).flat_map(|n| [(3 * n, 0.0), (3 * n + 1, 0.0)]).collect();
    let cases = vec![
        case("three contacts in line", &[corner(0.0, 0.0), corner(cell, 0.0), corner(1.0, 0.0)])?,
        case("two contacts", &[corner(0.0, 0.0), corner(1.0, 1.0)])?,
        case("one contact", &[corner(0.0, 0.0)])?,
        case("no contact", &[])?,
        case("every node held along x and y only", &[sliding])?,
    ];
    Ok(Family {
        name: "free bodies",
        reasoning: "A rigid motion that nothing holds has no answer: it is refused before anything \
                    is factored, and the motion is named.",
        advice: "Do what the message says: prescribe all three axes of three nodes not in line, on \
                 every body.",
        cases,
    })
}
