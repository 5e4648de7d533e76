//! The report of an answer that all ranks found, and the refusal where they found none.

use fea_server::engine::{Case, Equations, Outcome, Task};
use softgrasp_protocol::{RejectCode, Rejected, SolveReport, StageMs};

use crate::order::Preparation;
use crate::settings::Choice;
use crate::solve::{Found, Solved};

/// Why there is no proven bound.
const NO_BOUND: &str = "no smallest eigenvalue is proven over several processes; what is estimated is the \
                        largest correction that a further solve made";

/// Displacements, reactions and report of what was found.
pub fn outcome(
    solved: &Solved,
    (choice, ranks): (&Choice, usize),
    (task, equations): (&Task, &Equations),
) -> Outcome {
    let mut cases = solved.cases.iter().map(|found| case(found, equations));
    let none = || Case { displacement: vec![0.0; 3 * equations.used.len()], reaction: Vec::new() };
    let first = cases.next().unwrap_or_else(none);
    let further = cases.collect();
    let used = equations.used.iter().filter(|used| **used).count() as u64;
    let known_dofs = equations.known.dofs.len() as u64;
    let [assemble, factor, solve] = solved.ms;
    let (rotation, strain) = solved.strain.unwrap_or((f64::NAN, f64::NAN));
    let report = SolveReport {
        method: choice.method.name().to_owned(),
        element: task.model.element.into(),
        unknown_dofs: 3 * used - known_dofs,
        known_dofs,
        stage_ms: StageMs { assemble, factor, solve, ..StageMs::default() },
        residual_rel: solved.residual_rel,
        error_bound_rel: None,
        error_bound_why: Some(NO_BOUND.to_owned()),
        refinement_steps: solved.steps,
        max_rotation_deg: rotation.to_degrees(),
        max_strain: strain,
        precision: "f64".to_owned(),
        error_estimate_rel: solved.error_rel,
        peak_rss_bytes: solved.peak_bytes,
        chosen_because: chosen(solved, choice, ranks),
        ..SolveReport::default()
    };
    Outcome { first, further, report }
}

/// Why it was answered so, and what is not promised.
pub fn chosen(solved: &Solved, choice: &Choice, ranks: usize) -> String {
    let by = solved.preparation.map_or("nothing", Preparation::name);
    let ranks_text = if ranks == 1 { "1 rank" } else { &format!("{ranks} ranks") };
    let failed: String = solved.failed.iter().map(|why| format!("; {why}")).collect();
    let bits = match (solved.preparation, ranks) {
        (Some(Preparation::Hypre), _) | (_, 1) => "its bits are those of as many ranks",
        _ => "its bits may differ from run to run",
    };
    format!("{}; {by} on {ranks_text}{failed}; {bits}", choice.why)
}

/// The refusal of a question that no preparation led to an answer of.
pub fn refusal(why: &[String]) -> Rejected {
    let text = format!(
        "no answer is near enough ({}); where the material is nearly incompressible or elements are \
         flat, cluster-factor does not mind",
        why.join("; ")
    );
    Rejected::new(RejectCode::Uncertain, text)
}

/// A case in the order of the mesh.
fn case(found: &Found, equations: &Equations) -> Case {
    let mut displacement = vec![0.0; 3 * equations.used.len()];
    let used = (0..equations.used.len()).filter(|&node| equations.used[node]);
    for (node, u) in used.zip(found.displacements.as_chunks::<3>().0) {
        displacement[3 * node..3 * node + 3].copy_from_slice(u);
    }
    Case { displacement, reaction: found.reactions.clone() }
}
