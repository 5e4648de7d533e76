//! What an engine found, and the answer that is made of it.

use softgrasp_core::solve::Certainty;
use softgrasp_protocol::{Answer, CaseAnswer, Displacements, DofValue, NodeChoice, SolveReport};

use super::equations::Equations;
use super::task::Task;

/// Displacements and reactions of one case.
pub struct Case {
    /// Displacements of all nodes of the mesh, 3N, m; zero where no element is.
    pub displacement: Vec<f64>,
    /// Forces at the known degrees of freedom, in their order, N.
    pub reaction: Vec<f64>,
}

/// What an engine found.
pub struct Outcome {
    /// The first case.
    pub first: Case,
    /// The further cases, in the order of the task.
    pub further: Vec<Case>,
    /// How it was found; of all cases the largest errors.
    pub report: SolveReport,
}

impl Outcome {
    /// Whether no digit of the displacements is certain, by the estimate of their error.
    pub fn has_no_certain_digit(&self) -> bool {
        let error_rel = self.report.error_estimate_rel.unwrap_or(0.0);
        Certainty { condition: 1.0, error_rel }.is_none()
    }

    /// The answer: what the question wants of it.
    pub fn answer(self, task: &Task, equations: &Equations) -> Answer {
        let want = &task.question.want;
        let rows = |case: &Case| -> Vec<[f64; 3]> {
            let nodes = case.displacement.as_chunks::<3>().0;
            match &want.nodes {
                NodeChoice::All => nodes.to_vec(),
                NodeChoice::Nodes(wanted) => wanted.iter().map(|&n| nodes[n as usize]).collect(),
            }
        };
        let of_case = |case: &Case| CaseAnswer {
            displacements: rows(case),
            reactions: if want.reactions { case.reaction.clone() } else { Vec::new() },
        };
        let pairs = equations.known.dofs.iter().zip(&self.first.reaction);
        let reactions = pairs.map(|(&dof, &value)| DofValue { dof, value });
        Answer {
            displacements: Displacements::of(rows(&self.first), want.precision),
            reactions: if want.reactions { reactions.collect() } else { Vec::new() },
            cases: self.further.iter().map(of_case).collect(),
            report: self.report,
            large: None,
            nodes: want.nodes.clone(),
            mask_forces: Vec::new(),
            fields: Vec::new(),
            gradient: None,
        }
    }
}
