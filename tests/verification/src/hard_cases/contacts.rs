//! Cases with contacts on neighbouring nodes, and twice on one node.

use nalgebra::Point3;

use super::case::{Allowed, Case, Family, Form, Question, moved, plain};
use super::refusal::Reason;
use super::shapes::{block, nearest, nodes_where};
use softgrasp_bench::report::ReportError;

/// Contacts on neighbours and twice on one node, with equal and with contradicting values.
///
/// # Errors
/// [`ReportError`] if a case cannot be set up.
pub(super) fn family(form: Form) -> Result<Family, ReportError> {
    let mesh = block([form.cells; 3], [1.0; 3])?;
    let cell = 1.0 / form.cells as f64;
    let corner = nearest(&mesh, &Point3::from([1.0; 3]));
    let neighbour = nearest(&mesh, &Point3::new(1.0 - cell, 1.0, 1.0));
    let (push, pull) = ([0.1, 0.2, -1.0], [-0.1, -0.2, 1.0]);
    let case = |name: &str, contacts: Vec<Vec<(u32, f64)>>| {
        let clamped = Question::clamped(mesh.clone(), plain()?, 2);
        Ok::<_, ReportError>(Case::new(name, Question { pairs: contacts.concat(), ..clamped }, 1.0))
    };
    let on = |node: u32, by: [f64; 3]| moved(node, by, 0.01);
    let top = nodes_where(&mesh, |p| p.z > 1.0 - 0.5 * cell);
    let all: Vec<u32> = (0..mesh.node_count() as u32).collect();
    let inner = nodes_where(&mesh, |p| p.iter().all(|x| *x > 0.0 && *x < 1.0));
    let but_one = all.iter().filter(|n| inner.first() != Some(n));
    let cases = vec![
        case("neighbours, equal", vec![on(corner, push), on(neighbour, push)])?,
        case("neighbours, against each other", vec![on(corner, push), on(neighbour, pull)])?,
        case("one node twice, equal", vec![on(corner, push), on(corner, push)])?,
        case("one node twice, contradicting", vec![on(corner, push), on(corner, pull)])?
            .allowing(Allowed::REFUSED)
            .because(Reason::Question),
        case("a whole face", top.iter().map(|&n| on(n, push)).collect())?,
        case("one axis of one node", vec![vec![(3 * corner, 0.01)]])?,
        // Nodes that the scene holds stay where they are.
        case(
            "all nodes but one",
            but_one
                .filter(|n| mesh.vertices()[**n as usize].z > 0.0)
                .map(|&n| on(n, push))
                .collect(),
        )?,
    ];
    Ok(Family {
        name: "contacts",
        reasoning: "Known nodes beside each other take unknowns away and make the rest stiffer, \
                    never softer. Equal repetitions are one contact; a contradiction has no answer.",
        advice: "Send one displacement for every node.",
        cases,
    })
}
