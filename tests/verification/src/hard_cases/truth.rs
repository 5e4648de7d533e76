//! Exact answer of a case, and the error of another answer.

use softgrasp_core::model::{Known, Model};
use softgrasp_core::solve::{ERROR_UNREMARKABLE, Loads, Method};

use super::case::Question;
use super::double_double::solve_dense;
use super::in_process::model_of;
use softgrasp_bench::reference::{Reference, error_rel};
use softgrasp_core::model::Element;

/// Exact displacements for one question and element.
#[derive(Clone, Debug, Default)]
pub(super) struct Truth {
    /// Displacements of every node of the system, m: the assembled stiffness, solved to the last bits.
    solved: Option<Vec<f64>>,
    /// Displacements of every node of the mesh, m, known without solving.
    field: Option<Vec<f64>>,
    /// Number of degrees of freedom of the mesh; further ones belong to mid-edge nodes.
    mesh_dofs: usize,
    /// Skeel's condition number, by the factor that the exact answer was made with.
    condition: Option<f64>,
    /// Origin of the exact answer, in words.
    pub source: &'static str,
}

/// Errors of an answer.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Errors {
    /// Largest difference, relative to the largest displacement; the largest over all exact answers.
    pub largest_rel: f64,
    /// Norm of the difference to the solved answer, relative to its norm.
    pub norm_rel: Option<f64>,
    /// Largest relative error with which an answer counts as exact.
    pub threshold_rel: f64,
}

/// Largest number of unknowns that is solved densely in sums of two doubles.
const DENSE_MAX: usize = 1100;
/// Number of nodes from which on the reference is made by a factor on all threads.
const LARGE: usize = 5000;
/// Largest last correction of a reference that counts as converged.
const SETTLED: f64 = 1e-15;

/// Upper limit of the error with which an answer counts as exact; a larger one must be stated.
const THRESHOLD_MAX: f64 = ERROR_UNREMARKABLE;
/// Ratio of the threshold to the expected error.
const MARGIN: f64 = 100.0;
/// Ratio of Skeel's condition number, which assumes that all roundings add up, to the error in practice.
const CANCELLED: f64 = 64.0;
/// Relative error that a factor in single precision leaves: refinement ends with corrections below 1e-13.
const SINGLE_LEFT: f64 = 1e-14;

/// Expected relative error of an answer: `ε (κ / 64 + 1)`, κ Skeel's condition number of the case, and
/// for a factor in single precision the error that refinement leaves.
pub(super) fn expected_error(condition: f64, is_single: bool) -> f64 {
    let left = if is_single { SINGLE_LEFT } else { 0.0 };
    f64::EPSILON * (condition / CANCELLED + 1.0) + left
}

impl Truth {
    /// Solves to the last bits, if possible: refined, or densely in twice the precision. Otherwise only
    /// the field of the case is known, if it has one.
    pub fn of(question: &Question, element: Element, field: Option<&[f64]>) -> Self {
        let field = field.map(<[f64]>::to_vec);
        let solved = model_of(question, element).ok().and_then(|model| {
            let known = model.known(question.pairs.clone()).ok()?;
            model.check_held(&known.dofs, &[]).ok()?;
            solve(&model, &known)
        });
        let mesh_dofs = 3 * question.mesh.node_count();
        let condition = solved.as_ref().and_then(|solved| solved.condition);
        let (solved, by) = solved.map(|s| (s.displacement, s.by)).unzip();
        let source = match (by, field.is_some()) {
            (Some(_), true) => "reference and closed form",
            (Some(by), false) => by,
            (None, true) => "closed form",
            (None, false) => "",
        };
        Self { solved, field, mesh_dofs, condition, source }
    }

    /// No exact answer: every question on the way has another one.
    pub fn on_the_way() -> Self {
        Self { source: "reference", ..Self::default() }
    }

    /// Errors of an answer; `None` if there is no exact answer.
    pub fn errors_of(&self, answer: &[f64], is_single: bool) -> Option<Errors> {
        // A server sends the nodes of the mesh only.
        let compare = |right: &Vec<f64>| match answer.len() >= self.mesh_dofs {
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
            let off = norm(&|i| answer.get(i).map_or(0.0, |a| a - right[i]));
            if size > 0.0 { off / size } else { off }
        });
        Some(Errors { largest_rel, norm_rel, threshold_rel: self.threshold_rel(is_single) })
    }

    /// Largest relative error with which an answer counts as exact: a hundred times the expected one.
    fn threshold_rel(&self, is_single: bool) -> f64 {
        let condition = self.condition.unwrap_or(f64::INFINITY);
        (MARGIN * expected_error(condition, is_single)).min(THRESHOLD_MAX)
    }
}

/// Exact answer that was solved for.
struct Solved {
    displacement: Vec<f64>,
    condition: Option<f64>,
    by: &'static str,
}

fn solve(model: &Model, known: &Known) -> Option<Solved> {
    let is_large = model.system_node_count() >= LARGE;
    let method = if is_large { Method::Front } else { Method::SparseCholesky };
    let factored = model.factor(&known.dofs, method, &mut |_| {}).ok();
    let condition = factored.as_ref().map(|f| f.certainty(model.stiffness(), 0.0).condition);
    let refined = factored.and_then(|factored| {
        let loads = Loads { q_known: &known.q_known, ..Loads::default() };
        Reference::refined(model.stiffness(), &factored, loads).ok()
    });
    if let Some(refined) = refined.filter(|r| r.last_correction_rel <= SETTLED) {
        return Some(Solved { displacement: refined.displacement, condition, by: "reference" });
    }
    let partition = model.held_partition(&known.dofs).ok()?;
    if partition.unknown().len() > DENSE_MAX {
        return None;
    }
    let displacement = solve_dense(model.stiffness(), &partition, &known.q_known)?;
    Some(Solved { displacement, condition, by: "dense reference" })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn thresholds_are_a_hundred_times_what_is_expected_and_can_fail() {
        let truth = |condition| Truth { condition: Some(condition), ..Truth::default() };
        for condition in [1.0, 1e3, 1e5] {
            let expected = expected_error(condition, false);
            let threshold = truth(condition).threshold_rel(false);
            assert!((threshold / (MARGIN * expected) - 1.0).abs() < 1e-12);
            // An answer that loses one digit more than rounding takes is not exact.
            assert!(threshold < 10.0 * (condition * f64::EPSILON).max(1e-14), "{threshold:e}");
            assert!(truth(condition).threshold_rel(true) < threshold + 1.1e-12);
        }
        assert_eq!(truth(1e12).threshold_rel(false), THRESHOLD_MAX);
        assert_eq!(Truth::default().threshold_rel(false), THRESHOLD_MAX);
    }
}
