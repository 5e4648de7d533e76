//! Chooses element, method and precision for a question, by what each is predicted to cost.
//!
//! Pure: costs come in as numbers, nothing is measured or tried here.

use std::cmp::Ordering;
use std::fmt;

use super::Method;
use super::memory::hierarchy_bytes;
use super::rates::{ERROR_EXACT, ERROR_ITERATED, ERROR_REFINED, Rates};
use super::work::{MeshSize, Work};
use crate::fem::{AXES, Element};

/// What is asked, apart from the numbers: what is named, and what is left open.
///
/// Units: `deadline_ms` ms from now; `max_error` relative.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Question {
    /// Method asked for; `None` leaves it open.
    pub method: Option<Method>,
    /// Element asked for. `None` leaves it open: ten nodes where linear elements lock and time and
    /// memory allow, else averaged nodal pressure, else plain linear ones.
    pub element: Option<Element>,
    /// Largest Poisson's ratio of the materials.
    pub poisson_max: f64,
    /// Time there is.
    pub deadline_ms: Option<f64>,
    /// Error of the equations' solution that is small enough; the mesh's own error is not in it.
    pub max_error: Option<f64>,
}

/// What will be done, why, what it is predicted to cost, and what had to be given up for it.
///
/// Units: relative error.
#[derive(Clone, Debug, PartialEq)]
pub struct Plan {
    /// Finite element of the plan.
    pub element: Element,
    /// Method of the plan.
    pub method: Method,
    /// Methods that are taken in its place, the first that fits, where its factor needs more memory than
    /// there is.
    pub instead: &'static [Method],
    /// What it is predicted to cost; `None` where nothing had to be weighed.
    pub cost: Option<Cost>,
    /// Error it leaves, as far as rounding and its stopping rule decide.
    pub error_rel: f64,
    /// What was asked for and cannot be kept.
    pub gave_up: Option<GaveUp>,
    /// Whether linear elements were taken though they lock, and why.
    pub locks: Option<Locks>,
    /// Why this was taken, where neither deadline nor error budget decided.
    pub why: String,
}

/// What a plan is predicted to cost.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cost {
    /// Predicted time, ms.
    pub ms: f64,
    /// Memory at most, bytes.
    pub bytes: f64,
}

/// What was asked for and cannot be kept.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum GaveUp {
    /// No plan is predicted to be in time.
    Deadline,
    /// No plan that is in time, or none at all, is as exact.
    ErrorBudget,
    /// Neither can be met.
    Both,
}

/// Why linear elements are used on a material on which they lock.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Locks {
    /// Elements that do not lock are predicted to be too late.
    NoTime,
    /// Elements that do not lock are predicted to need too much memory.
    NoMemory,
}

/// Linear tetrahedra lock visibly from this Poisson's ratio on.
pub const LOCKING_POISSON: f64 = 0.45;
/// The cheapest element that does not lock.
pub fn cheapest_element(poisson: f64) -> Element {
    if poisson < LOCKING_POISSON { Element::Tet4 } else { Element::Tet4Anp }
}

/// A prediction may be this much too short and the deadline is still kept.
const PREDICTION_MARGIN: f64 = 1.25;
/// Where an iterative method stops if only a deadline was named.
const ERROR_IN_A_HURRY: f64 = 1e-6;
/// The methods that are compared where none was asked for; the others are slower at any size.
const COMPARED: [Method; 5] =
    [Method::Front, Method::FrontMixed, Method::Pcg, Method::DenseCholesky, Method::Multigrid];
/// Below so many unknowns a factor is found so fast that nobody waits for it, and it fails on nothing.
const WITHOUT_FACTOR_MIN: f64 = 1e5;
/// What takes the place of the exact parallel factor where memory is short, the more exact first.
pub const SMALLER_THAN_FRONT: &[Method] = &[Method::FrontMixed, Method::Multigrid];

impl Question {
    /// Methods that may answer.
    fn methods(&self) -> &[Method] {
        self.method.as_ref().map_or(&COMPARED, std::slice::from_ref)
    }

    /// Whether a method is worth its weighing.
    fn weighs(&self, method: Method, work: &Work) -> bool {
        self.method.is_some()
            || method != Method::Multigrid
            || work.unknown_dofs >= WITHOUT_FACTOR_MIN
    }

    /// Elements that may answer.
    fn elements(&self) -> &[Element] {
        match &self.element {
            Some(element) => std::slice::from_ref(element),
            None if self.poisson_max < LOCKING_POISSON => &[Element::Tet4],
            None => &Element::ALL,
        }
    }

    /// Relative error at which a method is to stop.
    fn error_of(&self, method: Method) -> f64 {
        match method {
            Method::Pcg => self.max_error.unwrap_or(ERROR_IN_A_HURRY).max(ERROR_REFINED),
            Method::FrontMixed => ERROR_REFINED,
            Method::Multigrid => self.max_error.unwrap_or(ERROR_ITERATED).max(ERROR_ITERATED),
            _ => ERROR_EXACT,
        }
    }

    /// A plan that nothing has to be weighed for.
    pub fn plan(&self, element: Element, method: Method, why: impl Into<String>) -> Plan {
        Plan {
            element,
            method,
            instead: &[],
            cost: None,
            error_rel: self.error_of(method),
            gave_up: None,
            locks: None,
            why: why.into(),
        }
    }

    fn candidate(&self, element: Element, method: Method, work: &Work, ms: f64) -> Plan {
        let bytes_per_entry = match method {
            Method::FrontMixed | Method::Pcg => size_of::<f32>(),
            _ => size_of::<f64>(),
        };
        let bytes = match method.dense_bytes(work.unknown_dofs as usize) {
            _ if method == Method::Multigrid => {
                hierarchy_bytes(work.unknown_dofs as usize / AXES, work.blocks as usize) as f64
            }
            Some(bytes) => bytes as f64,
            None => bytes_per_entry as f64 * work.peak_entries,
        };
        Plan { cost: Some(Cost { ms, bytes }), ..self.plan(element, method, "") }
    }
}

impl Plan {
    /// Predicted time, ms; without end where none was predicted.
    fn ms(&self) -> f64 {
        self.cost.map_or(f64::INFINITY, |cost| cost.ms)
    }

    /// Predicted memory, bytes.
    fn bytes(&self) -> f64 {
        self.cost.map_or(0.0, |cost| cost.bytes)
    }
}

/// All plans that a question allows, before anything is assembled: times from the mesh's size.
pub fn candidates(question: &Question, size: MeshSize, rates: &Rates) -> Vec<Plan> {
    let mut plans = Vec::new();
    for &element in question.elements() {
        let work = Work::estimate(size, element);
        let methods = question.methods().iter().filter(|m| question.weighs(**m, &work));
        plans.extend(methods.map(|&method| {
            let error_rel = question.error_of(method);
            let ms = rates.preparation_ms(&work, method)
                + rates.factor_and_solve_ms(&work, method, error_rel);
            question.candidate(element, method, &work, ms)
        }));
    }
    plans
}

/// The plans that are left once `K11` has been ordered: the factor's work is counted, not estimated.
pub fn candidates_after_order(
    question: &Question,
    element: Element,
    counted: &Work,
    rates: &Rates,
) -> Vec<Plan> {
    let methods = question.methods().iter().filter(|method| method.is_sparse());
    methods
        .map(|&method| {
            let error_rel = question.error_of(method);
            let ms = rates.factor_and_solve_ms(counted, method, error_rel);
            question.candidate(element, method, counted, ms)
        })
        .collect()
}

/// Chooses among plans; `None` only if there are none.
///
/// With an error budget the fastest that is within it and in time, else the most exact in time.
/// Where not all can be met, a deadline that can be kept goes before the budget, because a late
/// answer is of no use; a deadline that nothing keeps is given up first, and then the fastest within
/// the budget is taken. Of several elements the most exact is taken that meets all wishes within the
/// memory allowed; what is late or inexact anyhow gets the cheapest that does not lock.
///
/// Units: `memory_limit` bytes that a factor of elements that do not lock may take.
pub fn choose(question: &Question, candidates: &[Plan], memory_limit: u64) -> Option<Plan> {
    let mixed = candidates.iter().any(|p| p.element != candidates[0].element);
    let fits = |p: &Plan| !mixed || p.element == Element::Tet4 || p.bytes() <= memory_limit as f64;
    let in_time = |p: &Plan| {
        question.deadline_ms.is_none_or(|deadline| PREDICTION_MARGIN * p.ms() <= deadline)
    };
    let exact = |p: &Plan| question.max_error.is_none_or(|max| p.error_rel <= max);
    let faster = |a: &Plan, b: &Plan| a.ms().total_cmp(&b.ms());
    let exacter =
        |a: &Plan, b: &Plan| a.error_rel.total_cmp(&b.error_rel).then_with(|| faster(a, b));
    let preferred = |a: &Plan, b: &Plan| match question.max_error {
        Some(_) => faster(a, b),
        None => exacter(a, b),
    };
    let best = |allowed: &dyn Fn(&Plan) -> bool, by: &dyn Fn(&Plan, &Plan) -> Ordering| {
        candidates.iter().filter(|p| fits(p) && allowed(p)).min_by(|a, b| by(a, b)).cloned()
    };
    let finest_first = |a: &Plan, b: &Plan| b.element.cmp(&a.element).then_with(|| preferred(a, b));
    let locks = |p: &Plan| mixed && p.element == Element::Tet4;
    let cheapest =
        |a: &Plan, b: &Plan| locks(a).cmp(&locks(b)).then_with(|| a.element.cmp(&b.element));
    let cheap_fast = |a: &Plan, b: &Plan| cheapest(a, b).then_with(|| faster(a, b));
    let cheap_exact = |a: &Plan, b: &Plan| cheapest(a, b).then_with(|| exacter(a, b));
    let (plan, gave_up) = best(&|p| in_time(p) && exact(p), &finest_first)
        .map(|plan| (plan, None))
        .or_else(|| best(&in_time, &cheap_exact).map(|plan| (plan, Some(GaveUp::ErrorBudget))))
        .or_else(|| best(&exact, &cheap_fast).map(|plan| (plan, Some(GaveUp::Deadline))))
        .or_else(|| best(&|_| true, &cheap_fast).map(|plan| (plan, Some(GaveUp::Both))))?;
    let locks = locks(&plan).then(|| {
        let does_not_lock = |p: &&Plan| p.element != Element::Tet4;
        match candidates.iter().filter(does_not_lock).any(fits) {
            true => Locks::NoTime,
            false => Locks::NoMemory,
        }
    });
    Some(Plan { gave_up, locks, ..plan })
}

impl fmt::Display for Plan {
    /// Why it was taken where deadline or error budget decided, for the report.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.gave_up {
            None => write!(f, "chosen by deadline and error budget")?,
            Some(gave_up) => write!(f, "{gave_up}")?,
        }
        match self.cost {
            Some(Cost { ms, .. }) => {
                write!(f, "; predicted {ms:.1} ms at an error of {:.0e}", self.error_rel)
            }
            None => Ok(()),
        }
    }
}

impl fmt::Display for GaveUp {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Deadline => {
                "the deadline was given up: nothing is predicted to be in time, so the fastest \
                 within the error budget was taken; allow more time, or use fewer nodes or a kept \
                 model"
            }
            Self::ErrorBudget => {
                "the error budget was given up: nothing so exact is to be had in the time there \
                 is, so the most exact was taken; allow more time or a larger error"
            }
            Self::Both => {
                "deadline and error budget were given up: nothing is so fast, nothing so exact, so \
                 the fastest was taken; allow more time and a larger error"
            }
        })
    }
}

impl fmt::Display for Locks {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let reason = match self {
            Self::NoTime => "would be too late",
            Self::NoMemory => "would need more memory than is allowed",
        };
        write!(
            f,
            "linear elements were taken though they lock from a Poisson's ratio of \
             {LOCKING_POISSON} on, because elements that do not lock {reason}"
        )
    }
}

#[cfg(test)]
mod tests;
