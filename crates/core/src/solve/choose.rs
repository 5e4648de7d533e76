//! Which element, method and precision a question gets, by what it wishes and what each would cost.
//!
//! Pure: costs come in as numbers, nothing is measured or tried here.

use std::cmp::Ordering;
use std::fmt;

use super::Method;
use super::rates::{ERROR_EXACT, ERROR_REFINED, Rates};
use super::work::{MeshSize, Work};
use crate::fem::Element;

/// What a question wishes for.
///
/// Units: `deadline_ms` ms from now; `max_error` relative.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Wish {
    /// Method asked for; `None` leaves it open.
    pub method: Option<Method>,
    /// Element.
    pub element: ElementWish,
    /// Time there is.
    pub deadline_ms: Option<f64>,
    /// Error of the equations' solution that is small enough; the mesh's own error is not in it.
    pub max_error: Option<f64>,
}

/// Element asked for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ElementWish {
    /// This one.
    Given(Element),
    /// Ten nodes where linear elements lock and time and memory allow, else averaged nodal pressure,
    /// else plain linear ones.
    Auto {
        /// Largest Poisson's ratio of the materials.
        poisson_max: f64,
        /// Bytes a factor may take while it is made.
        memory_limit: u64,
    },
}

/// One way to the answer.
///
/// Units: ms, bytes, relative error.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Offer {
    /// Element.
    pub element: Element,
    /// Method.
    pub method: Method,
    /// Time it is predicted to take.
    pub predicted_ms: f64,
    /// Memory it is predicted to take at most.
    pub bytes: f64,
    /// Error it leaves, as far as rounding and its stopping rule decide.
    pub error_rel: f64,
}

/// A wish that could not be met.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum GaveUp {
    /// No way is predicted to be in time.
    Deadline,
    /// No way that is in time, or none at all, is as exact.
    ErrorBudget,
    /// Neither can be met.
    Both,
}

/// The way that was chosen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Choice {
    /// What is to be done.
    pub offer: Offer,
    /// What had to be given up.
    pub gave_up: Option<GaveUp>,
    /// Whether linear elements were taken though they lock, and why.
    pub locks: Option<Locks>,
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
const COMPARED: [Method; 4] =
    [Method::Front, Method::FrontMixed, Method::Pcg, Method::DenseCholesky];

impl Wish {
    /// Methods that may answer.
    fn methods(&self) -> &[Method] {
        self.method.as_ref().map_or(&COMPARED, std::slice::from_ref)
    }

    /// Elements that may answer.
    fn elements(&self) -> &'static [Element] {
        match self.element {
            ElementWish::Given(Element::Tet4) => &[Element::Tet4],
            ElementWish::Given(Element::Tet4Anp) => &[Element::Tet4Anp],
            ElementWish::Given(Element::Tet10) => &[Element::Tet10],
            ElementWish::Auto { poisson_max, .. } if poisson_max < LOCKING_POISSON => {
                &[Element::Tet4]
            }
            ElementWish::Auto { .. } => &Element::ALL,
        }
    }

    /// Relative error at which a method is to stop.
    fn error_of(&self, method: Method) -> f64 {
        match method {
            Method::Pcg => self.max_error.unwrap_or(ERROR_IN_A_HURRY).max(ERROR_REFINED),
            Method::FrontMixed => ERROR_REFINED,
            _ => ERROR_EXACT,
        }
    }

    fn offer(&self, element: Element, method: Method, work: &Work, predicted_ms: f64) -> Offer {
        let bytes_per_entry = match method {
            Method::FrontMixed | Method::Pcg => size_of::<f32>(),
            _ => size_of::<f64>(),
        };
        let bytes = match method.dense_bytes(work.unknown_dofs as usize) {
            Some(bytes) => bytes as f64,
            None => bytes_per_entry as f64 * work.peak_entries,
        };
        Offer { element, method, predicted_ms, bytes, error_rel: self.error_of(method) }
    }
}

/// All ways that a wish allows, before anything is assembled: times from the mesh's size.
pub fn offers(wish: &Wish, size: MeshSize, rates: &Rates) -> Vec<Offer> {
    let mut offers = Vec::new();
    for &element in wish.elements() {
        let work = Work::estimate(size, element);
        offers.extend(wish.methods().iter().map(|&method| {
            let error_rel = wish.error_of(method);
            let ms = rates.preparation_ms(&work, method)
                + rates.factor_and_solve_ms(&work, method, error_rel);
            wish.offer(element, method, &work, ms)
        }));
    }
    offers
}

/// The ways that are left once `K11` has been ordered: the factor's work is counted, not estimated.
pub fn offers_after_order(
    wish: &Wish,
    element: Element,
    counted: &Work,
    rates: &Rates,
) -> Vec<Offer> {
    let methods = wish.methods().iter().filter(|method| method.is_sparse());
    methods
        .map(|&method| {
            let ms = rates.factor_and_solve_ms(counted, method, wish.error_of(method));
            wish.offer(element, method, counted, ms)
        })
        .collect()
}

/// Chooses among offers; `None` only if there are none.
///
/// With an error budget the fastest that is within it and in time, else the most exact in time.
/// Where not all can be met, a deadline that can be kept goes before the budget, because a late
/// answer is of no use; a deadline that nothing keeps is given up first, and then the fastest within
/// the budget is taken. Of several elements the most exact is taken that meets all wishes within the
/// memory allowed; what is late or inexact anyhow gets the cheapest that does not lock.
pub fn choose(wish: &Wish, offers: &[Offer]) -> Option<Choice> {
    let memory_limit = match wish.element {
        ElementWish::Auto { memory_limit, .. } => memory_limit as f64,
        ElementWish::Given(_) => f64::INFINITY,
    };
    let mixed = offers.iter().any(|o| o.element != offers[0].element);
    let fits = |o: &Offer| !mixed || o.element == Element::Tet4 || o.bytes <= memory_limit;
    let in_time = |o: &Offer| {
        wish.deadline_ms.is_none_or(|deadline| PREDICTION_MARGIN * o.predicted_ms <= deadline)
    };
    let exact = |o: &Offer| wish.max_error.is_none_or(|max| o.error_rel <= max);
    let faster = |a: &Offer, b: &Offer| a.predicted_ms.total_cmp(&b.predicted_ms);
    let exacter =
        |a: &Offer, b: &Offer| a.error_rel.total_cmp(&b.error_rel).then_with(|| faster(a, b));
    let preferred = |a: &Offer, b: &Offer| match wish.max_error {
        Some(_) => faster(a, b),
        None => exacter(a, b),
    };
    let best = |allowed: &dyn Fn(&Offer) -> bool, by: &dyn Fn(&Offer, &Offer) -> Ordering| {
        offers.iter().filter(|o| fits(o) && allowed(o)).copied().min_by(|a, b| by(a, b))
    };
    let finest_first =
        |a: &Offer, b: &Offer| b.element.cmp(&a.element).then_with(|| preferred(a, b));
    let locks = |o: &Offer| mixed && o.element == Element::Tet4;
    let cheapest =
        |a: &Offer, b: &Offer| locks(a).cmp(&locks(b)).then_with(|| a.element.cmp(&b.element));
    let cheap_fast = |a: &Offer, b: &Offer| cheapest(a, b).then_with(|| faster(a, b));
    let cheap_exact = |a: &Offer, b: &Offer| cheapest(a, b).then_with(|| exacter(a, b));
    let (offer, gave_up) = best(&|o| in_time(o) && exact(o), &finest_first)
        .map(|offer| (offer, None))
        .or_else(|| best(&in_time, &cheap_exact).map(|offer| (offer, Some(GaveUp::ErrorBudget))))
        .or_else(|| best(&exact, &cheap_fast).map(|offer| (offer, Some(GaveUp::Deadline))))
        .or_else(|| best(&|_| true, &cheap_fast).map(|offer| (offer, Some(GaveUp::Both))))?;
    let locks = locks(&offer).then(|| {
        let does_not_lock = |o: &&Offer| o.element != Element::Tet4;
        match offers.iter().filter(does_not_lock).any(fits) {
            true => Locks::NoTime,
            false => Locks::NoMemory,
        }
    });
    Some(Choice { offer, gave_up, locks })
}

impl fmt::Display for Choice {
    /// Why it was chosen, for the report.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.gave_up {
            None => write!(f, "chosen by deadline and error budget")?,
            Some(gave_up) => write!(f, "{gave_up}")?,
        }
        let Offer { predicted_ms, error_rel, .. } = self.offer;
        write!(f, "; predicted {predicted_ms:.1} ms at an error of {error_rel:.0e}")
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
