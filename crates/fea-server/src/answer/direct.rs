//! Answers a question by a factor or inverse of `K11`.

use std::time::Instant;

use softgrasp_core::fem::StrainSummary;
use softgrasp_core::model::{Known, Model};
use softgrasp_core::solve::{Certainty, Factored, Loads, Method, Solution};
use softgrasp_protocol::{
    Answer, CaseAnswer, Displacements, DofValue, ElementName, FieldValues, NodeChoice, Question,
    SolveReport, Want,
};

use super::fields::{Shape, field_values};
use super::gradient;
use super::warnings::{add_certainty, add_unmet_wishes, strain_warnings};
use crate::clock::{StageClock, ms_since};
use crate::machine_memory::peak_rss_bytes;
use crate::refusal::Refusal;

/// A question with its known displacements, forces and the reasons of its plan.
pub(super) struct Posed<'a> {
    pub question: &'a Question,
    pub known: Known,
    pub forces: Vec<f64>,
    pub element: ElementName,
    pub factor_reused: bool,
    pub chosen_because: String,
}

/// Solves one load case with the factor, refined as far as the question asks, and collects the results.
///
/// # Errors
/// [`Refusal`] if the request cannot be answered.
pub(super) fn answer(
    model: &Model,
    factored: &Factored,
    posed: Posed<'_>,
    mut clock: StageClock,
) -> Result<Answer, Refusal> {
    let residual_rel = posed.question.max_error.unwrap_or(0.0);
    let loads = Loads { q_known: &posed.known.q_known, forces: &posed.forces, residual_rel };
    let stiffness = model.stiffness();
    let on_stage = &mut |stage| clock.begin(stage);
    // How certain an answer is takes a few solves more, once per factor: not where somebody is in a
    // hurry.
    let (solution, certainty) = match posed.question.deadline_ms {
        None => {
            let found = factored.solve_for_certain(stiffness, loads, on_stage);
            found.map(|(solution, certainty)| (solution, Some(certainty)))
        }
        Some(_) => factored.solve(stiffness, loads, on_stage).map(|solution| (solution, None)),
    }
    .map_err(|error| Refusal::Model(error.into()))?;
    let gradient = gradient::of_solution(model, posed.question, (factored, &solution))?;
    let strain = Some(model.strain(&solution.displacement, &mut || {}));
    let answer = gather(model, factored, &posed, &solution, (certainty, strain), clock)?;
    Ok(Answer { gradient, ..answer })
}

/// Solves several load cases together; `estimate`: whether to compute condition, error and strain too.
///
/// # Errors
/// [`Refusal`] if the request cannot be answered.
pub(super) fn answer_several(
    model: &Model,
    factored: &Factored,
    posed: Posed<'_>,
    cases: &[Known],
    estimate: bool,
    mut clock: StageClock,
) -> Result<Answer, Refusal> {
    let residual_rel = posed.question.max_error.unwrap_or(0.0);
    let loads: Vec<Loads<'_>> = [&posed.known]
        .into_iter()
        .chain(cases)
        .map(|known| Loads { q_known: &known.q_known, forces: &posed.forces, residual_rel })
        .collect();
    let (stiffness, on_stage) = (model.stiffness(), &mut |stage| clock.begin(stage));
    let (mut solutions, certainty) = match estimate && posed.question.deadline_ms.is_none() {
        true => factored.solve_several_for_certain(stiffness, &loads, on_stage),
        false => factored.solve_several(stiffness, &loads, on_stage).map(|found| (found, None)),
    }
    .map_err(|error| Refusal::Model(error.into()))?;
    let strain = estimate.then(|| {
        let strains =
            solutions.iter().map(|solution| model.strain(&solution.displacement, &mut || {}));
        strains.fold(StrainSummary::default(), StrainSummary::or_larger)
    });
    let worst = |of: fn(&Solution) -> f64| solutions.iter().map(of).fold(0.0, f64::max);
    let residual_rel = worst(|solution| solution.residual_rel);
    let steps = solutions.iter().map(|solution| solution.refinement_steps).max();
    let further = solutions.split_off(1.min(solutions.len()));
    let want = &posed.question.want;
    let of_case = |case: &Solution| field_values(model, &Shape::Linear(&case.displacement), want);
    let fields: Vec<FieldValues> = further.iter().flat_map(of_case).collect();
    let further = further
        .iter()
        .map(|solution| CaseAnswer {
            displacements: displacements(model, solution, &posed.question.want).into_f64(),
            reactions: match posed.question.want.reactions {
                true => solution.reaction.clone(),
                false => Vec::new(),
            },
        })
        .collect();
    let [first] = &solutions[..] else { return Err(Refusal::Internal) };
    let mut answer = gather(model, factored, &posed, first, (certainty, strain), clock)?;
    answer.report.residual_rel = residual_rel;
    answer.report.refinement_steps = steps.unwrap_or(0);
    answer.cases = further;
    answer.fields.extend(fields);
    Ok(answer)
}

/// Collects the wanted displacements, reactions and fields of a solution, and writes the report.
fn gather(
    model: &Model,
    factored: &Factored,
    posed: &Posed<'_>,
    solution: &Solution,
    (certainty, strain): (Option<Certainty>, Option<StrainSummary>),
    clock: StageClock,
) -> Result<Answer, Refusal> {
    let Posed { question, known, element, factor_reused, chosen_because, .. } = posed;
    let mut stage_ms = clock.finish();
    let start = Instant::now();
    let displacements = displacements(model, solution, &question.want);
    let reactions = match question.want.reactions {
        true => reactions(known, solution),
        false => Vec::new(),
    };
    let fields = field_values(model, &Shape::Linear(&solution.displacement), &question.want);
    stage_ms.encode = ms_since(start);
    let (precision, chosen_because) = match solution.fallback {
        None => (factored.method().precision(), chosen_because.clone()),
        Some(fallback) => (Method::Front.precision(), format!("{chosen_because}; {fallback}")),
    };
    let mut report = SolveReport {
        method: factored.method().to_string(),
        element: (*element).into(),
        unknown_dofs: factored.partition().unknown().len() as u64,
        known_dofs: known.dofs.len() as u64,
        stage_ms,
        residual_rel: solution.residual_rel,
        error_bound_rel: None,
        error_bound_why: Some(no_bound(solution.error_estimate_rel)),
        refinement_steps: solution.refinement_steps,
        // No number where nobody wanted to know.
        max_rotation_deg: strain.map_or(f64::NAN, |strain| strain.rotation_max.to_degrees()),
        max_strain: strain.map_or(f64::NAN, |strain| strain.strain_max),
        precision: precision.to_owned(),
        warnings: strain.map(strain_warnings).unwrap_or_default(),
        peak_rss_bytes: peak_rss_bytes(),
        factor_reused: *factor_reused,
        chosen_because,
        ..SolveReport::default()
    };
    if let Some(certainty) = certainty {
        add_certainty(certainty, question, &mut report)?;
    }
    add_unmet_wishes(question, &mut report);
    let nodes = question.want.nodes.clone();
    Ok(Answer {
        report,
        large: None,
        nodes,
        displacements,
        reactions,
        mask_forces: Vec::new(),
        cases: Vec::new(),
        fields,
        gradient: None,
    })
}

fn no_bound(error_estimate_rel: Option<f64>) -> String {
    let none = "a bound is proven for the method condensed only";
    match error_estimate_rel {
        Some(error) => format!("{none}; estimated, not proven, is an error of {error:.1e}"),
        None => none.to_owned(),
    }
}

/// Displacements of the wanted nodes of the mesh; those of mid-edge nodes are never sent.
fn displacements(model: &Model, solution: &Solution, want: &Want) -> Displacements {
    let of = |n: usize| {
        let u = &solution.displacement[3 * n..3 * n + 3];
        [u[0], u[1], u[2]]
    };
    let rows = match &want.nodes {
        NodeChoice::All => (0..model.mesh().node_count()).map(of).collect(),
        NodeChoice::Nodes(nodes) => nodes.iter().map(|&n| of(n as usize)).collect(),
    };
    Displacements::of(rows, want.precision)
}

fn reactions(known: &Known, solution: &Solution) -> Vec<DofValue> {
    let pairs = known.dofs.iter().zip(&solution.reaction);
    pairs.map(|(&dof, &value)| DofValue { dof, value }).collect()
}
