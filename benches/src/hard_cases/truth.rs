//! The right answer of a case, and how far another one is from it.

use softgrasp_core::model::{Known, Model};
use softgrasp_core::solve::{Loads, Method};

use super::case::Question;
use super::double_double::solve_dense;
use super::ways::model_of;
use crate::reference::{Reference, error_rel};
use softgrasp_core::model::Element;

/// Right displacements of one question and element.
#[derive(Clone, Debug, Default)]
pub(super) struct Truth {
    /// Of every node of the system: the stiffness as assembled, solved to the last bits.
    solved: Option<Vec<f64>>,
    /// Of every node of the mesh, known without solving.
    field: Option<Vec<f64>>,
    /// Where it comes from, in words.
    pub source: &'static str,
}

/// How wrong an answer is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Errors {
    /// Largest difference over the largest displacement, the worst of all truths there are.
    pub largest_rel: f64,
    /// Norm of the difference to the solved truth over its norm.
    pub norm_rel: Option<f64>,
}

/// Largest unknown count that is solved densely in sums of two doubles.
const DENSE_MAX: usize = 1100;
/// Nodes from which the reference is made from a factor on all threads.
const LARGE: usize = 5000;
/// A reference whose last correction is larger has not settled.
const SETTLED: f64 = 1e-15;

impl Truth {
    /// Solves to the last bits, where that can be done: refined, else densely in twice the
    /// precision. Without either there is only the field of the case, if it has one.
    pub fn of(question: &Question, element: Element, field: Option<&[f64]>) -> Self {
        let field = field.map(<[f64]>::to_vec);
        let solved = model_of(question, element).ok().and_then(|model| {
            let known = model.known(question.pairs.clone()).ok()?;
            model.check_held(&known.dofs, &[]).ok()?;
            solve(&model, &known)
        });
        let (solved, by) = solved.unzip();
        let source = match (by, field.is_some()) {
            (Some(_), true) => "reference and closed form",
            (Some(by), false) => by,
            (None, true) => "closed form",
            (None, false) => "",
        };
        Self { solved, field, source }
    }

    /// None of its own: every question on the way has another.
    pub fn on_the_way() -> Self {
        Self { source: "reference", ..Self::default() }
    }

    /// Errors of an answer; `None` where there is nothing to compare with.
    pub fn errors_of(&self, answer: &[f64]) -> Option<Errors> {
        let compare = |right: &Vec<f64>| match answer.len() >= right.len() {
            true => error_rel(answer.iter().copied().zip(right.iter().copied())),
            false => f64::INFINITY,
        };
        let solved = self.solved.as_ref().map(compare);
        let all = [solved, self.field.as_ref().map(compare)];
        let largest_rel = all.into_iter().flatten().reduce(f64::max)?;
        let norm_rel = self.solved.as_ref().map(|right| {
            let largest = right.iter().fold(f64::MIN_POSITIVE, |m, x| m.max(x.abs()));
            let norm = |of: &dyn Fn(usize) -> f64| {
                (0..right.len()).map(|i| (of(i) / largest).powi(2)).sum::<f64>().sqrt()
            };
            let size = norm(&|i| right[i]);
            let off = norm(&|i| answer.get(i).map_or(f64::INFINITY, |a| a - right[i]));
            if size > 0.0 { off / size } else { off }
        });
        Some(Errors { largest_rel, norm_rel })
    }
}

fn solve(model: &Model, known: &Known) -> Option<(Vec<f64>, &'static str)> {
    let is_large = model.system_node_count() >= LARGE;
    let method = if is_large { Method::Front } else { Method::SparseCholesky };
    let refined = model.factor(&known.dofs, method, &mut |_| {}).ok().and_then(|factored| {
        let loads = Loads { q_known: &known.q_known, ..Loads::default() };
        Reference::refined(model.stiffness(), &factored, loads).ok()
    });
    if let Some(refined) = refined.filter(|r| r.last_correction_rel <= SETTLED) {
        return Some((refined.displacement, "reference"));
    }
    let partition = model.held_partition(&known.dofs).ok()?;
    if partition.unknown().len() > DENSE_MAX {
        return None;
    }
    let solved = solve_dense(model.stiffness(), &partition, &known.q_known)?;
    Some((solved, "dense reference"))
}
