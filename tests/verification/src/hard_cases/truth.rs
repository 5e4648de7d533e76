//! The right answer of a case, and the error of another answer to it.

use softgrasp_core::model::{Known, Model};
use softgrasp_core::solve::{ERROR_UNREMARKABLE, Loads, Method};

use super::case::Question;
use super::double_double::solve_dense;
use super::in_process::model_of;
use softgrasp_bench::reference::{Reference, error_rel};
use softgrasp_core::model::Element;

/// Right displacements of one question and element.
#[derive(Clone, Debug, Default)]
pub(super) struct Truth {
    /// Of every node of the system: the stiffness as assembled, solved to the last bits.
    solved: Option<Vec<f64>>,
    /// Of every node of the mesh, known without solving.
    field: Option<Vec<f64>>,
    /// Degrees of freedom of the mesh: what lies behind are mid-edge nodes.
    mesh_dofs: usize,
    /// Skeel's condition number by the factor that the truth was made with.
    condition: Option<f64>,
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
    /// The largest error with which an answer is exact.
    pub threshold_rel: f64,
}

/// Largest unknown count that is solved densely in sums of two doubles.
const DENSE_MAX: usize = 1100;
/// Nodes from which the reference is made from a factor on all threads.
const LARGE: usize = 5000;
/// A reference whose last correction is larger has not settled.
const SETTLED: f64 = 1e-15;

/// The largest error with which an answer is exact, at most: beyond, it has to say so.
const THRESHOLD_MAX: f64 = ERROR_UNREMARKABLE;
/// How far above the expected error the threshold is.
const MARGIN: f64 = 100.0;
/// Skeel's condition number is the error when all roundings conspire; they cancel to a sixty-fourth
/// of it or so.
const CANCELLED: f64 = 64.0;
/// What a factor in single precision leaves: refinement ends with corrections below 1e-13.
const SINGLE_LEFT: f64 = 1e-14;

/// Expected error of an answer: `ε (κ / 64 + 1)`, κ Skeel's condition number of the case, and for a
/// factor in single precision what its refinement leaves.
pub(super) fn expected_error(condition: f64, is_single: bool) -> f64 {
    let left = if is_single { SINGLE_LEFT } else { 0.0 };
    f64::EPSILON * (condition / CANCELLED + 1.0) + left
}

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

    /// None of its own: every question on the way has another.
    pub fn on_the_way() -> Self {
        Self { source: "reference", ..Self::default() }
    }

    /// Errors of an answer; `None` where there is nothing to compare with.
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

    /// The largest error with which an answer is exact: a hundred times the expected one.
    fn threshold_rel(&self, is_single: bool) -> f64 {
        let condition = self.condition.unwrap_or(f64::INFINITY);
        (MARGIN * expected_error(condition, is_single)).min(THRESHOLD_MAX)
    }
}

/// A right answer.
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
