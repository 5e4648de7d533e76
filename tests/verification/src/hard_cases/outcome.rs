//! Outcome of a question: exact, degraded as stated, refused with a reason, or failed.

use softgrasp_core::solve::ERROR_UNREMARKABLE;

use super::case::Allowed;
use super::refusal::{Reason, Refusal};
use super::truth::Errors;

/// Outcome of one row.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Outcome {
    /// The error is at most a hundred times the expected one, or the one that the way stops at.
    Exact,
    /// The error is larger, at most what the answer states, and the answer warns of it.
    Degraded,
    /// There is no answer, but a sentence with the reason.
    Refused,
    /// Any other result, and any that the case does not allow.
    Failed,
}

/// Statement of an answer about its error, and its true error.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Judged {
    pub errors: Option<Errors>,
    pub stated_rel: f64,
    pub bound_rel: Option<f64>,
    /// Relative error that the way stops at, if not at rounding.
    pub promised_rel: f64,
}

impl Outcome {
    pub const ALL: [Self; 4] = [Self::Exact, Self::Degraded, Self::Refused, Self::Failed];

    pub const fn name(self) -> &'static str {
        match self {
            Self::Exact => "exact",
            Self::Degraded => "degraded as stated",
            Self::Refused => "refused with reason",
            Self::Failed => "FAILED",
        }
    }

    /// Outcome of a refusal, and a note about it.
    pub fn of_refusal(refusal: &Refusal, right: Reason, allowed: Allowed) -> (Self, String) {
        let Refusal { reason, text } = refusal;
        if text.trim().is_empty() {
            return (Self::Failed, "refused without a reason".to_owned());
        }
        if !allowed.refused {
            return (Self::Failed, format!("refused, which was not to be: {text}"));
        }
        match *reason == right {
            true => (Self::Refused, text.clone()),
            false => {
                let (said, right) = (reason.name(), right.name());
                (Self::Failed, format!("refused for {said}, but the reason is {right}: {text}"))
            }
        }
    }

    /// Outcome of an answer, and a note about it.
    pub fn of_answer(judged: &Judged, allowed: Allowed) -> (Self, String) {
        let failed = |text: String| (Self::Failed, text);
        let Judged { errors: Some(errors), stated_rel, bound_rel, promised_rel } = *judged else {
            return failed("there is no right answer to compare with".to_owned());
        };
        let (error, threshold) = (errors.largest_rel, errors.threshold_rel.max(promised_rel));
        if !error.is_finite() {
            return failed("the answer is not finite".to_owned());
        }
        if let (Some(bound), Some(norm)) = (bound_rel, errors.norm_rel)
            && norm > bound.max(ROUNDED)
        {
            return failed(format!("the error {norm:.1e} is above its proven bound {bound:.1e}"));
        }
        let is_warned = stated_rel > ERROR_UNREMARKABLE;
        if error <= threshold && allowed.exact {
            return (Self::Exact, String::new());
        }
        if error <= stated_rel && is_warned && allowed.degraded {
            return (Self::Degraded, format!("states an error of about {stated_rel:.1e}"));
        }
        if error <= threshold || error <= stated_rel && is_warned {
            return failed(format!("answered with an error of {error:.1e}, which was not to be"));
        }
        failed(format!("the error is {error:.1e}, stated is {stated_rel:.1e}"))
    }
}

/// Relative rounding of the exact answer, which is stored in double precision.
const ROUNDED: f64 = 4.0 * f64::EPSILON;

#[cfg(test)]
mod tests {
    use super::*;

    fn outcome(error: f64, stated_rel: f64, bound_rel: Option<f64>, allowed: Allowed) -> Outcome {
        let errors =
            Some(Errors { largest_rel: error, norm_rel: Some(error), threshold_rel: 1e-11 });
        let judged = Judged { errors, stated_rel, bound_rel, promised_rel: 0.0 };
        Outcome::of_answer(&judged, allowed).0
    }

    #[test]
    fn an_error_is_below_the_threshold_or_stated_or_a_failure() {
        let any = Allowed::ANY;
        assert_eq!(outcome(1e-12, 1e-14, None, any), Outcome::Exact);
        assert_eq!(outcome(1e-8, 1e-7, None, any), Outcome::Degraded);
        // Beyond what it states, below what is warned of, not allowed, above its bound, no number.
        assert_eq!(outcome(1e-6, 1e-7, None, any), Outcome::Failed);
        assert_eq!(outcome(1e-10, 5e-10, None, any), Outcome::Failed);
        assert_eq!(outcome(1e-8, 1e-7, None, Allowed::EXACT), Outcome::Failed);
        assert_eq!(outcome(1e-12, 1e-14, None, Allowed::REFUSED), Outcome::Failed);
        assert_eq!(outcome(1e-12, 1e-14, Some(1e-13), any), Outcome::Failed);
        assert_eq!(outcome(f64::INFINITY, f64::INFINITY, None, any), Outcome::Failed);
        assert_eq!(outcome(1e-12, f64::NAN, None, any), Outcome::Exact);
        let nothing = Judged { errors: None, stated_rel: 1.0, bound_rel: None, promised_rel: 0.0 };
        assert_eq!(Outcome::of_answer(&nothing, any).0, Outcome::Failed);
    }

    #[test]
    fn a_refusal_needs_the_right_reason_and_leave() {
        let free = |text: &str| Refusal::new(Reason::Free, text);
        let of = |text, allowed| Outcome::of_refusal(&free(text), Reason::Free, allowed).0;
        assert_eq!(of("body 1 can still move", Allowed::REFUSED), Outcome::Refused);
        assert_eq!(of("", Allowed::ANY), Outcome::Failed);
        assert_eq!(of("body 1 can still move", Allowed::ANSWERED), Outcome::Failed);
        // A body that is held must not be said to be free.
        let blamed = Outcome::of_refusal(&free("it can move"), Reason::Weak, Allowed::ANY);
        assert_eq!(blamed.0, Outcome::Failed);
    }
}
