//! Parses method, element, deadline and error budget of a question, once.

use softgrasp_core::fem::Element;
use softgrasp_core::solve::Method;
use softgrasp_core::solve::choose::Question;
use softgrasp_protocol::Question as QuestionMessage;

use crate::refusal::Refusal;

/// Question as the planner takes it: what a message asks for and what it leaves open.
///
/// Shapes: `element` `None` where the server chooses; `poisson_max` the largest Poisson's ratio.
///
/// # Errors
/// [`Refusal::Method`] for an unknown name of a method, [`Refusal::Wish`] for a deadline or an error
/// budget that is no positive finite number.
pub(crate) fn question_of(
    message: &QuestionMessage,
    element: Option<Element>,
    poisson_max: f64,
) -> Result<Question, Refusal> {
    let QuestionMessage { deadline_ms, max_error, .. } = *message;
    for (what, value) in [("the deadline", deadline_ms), ("the error budget", max_error)] {
        if let Some(value) = value.filter(|v| !(*v > 0.0 && v.is_finite())) {
            return Err(Refusal::Wish { what, value });
        }
    }
    let method = Method::named_or_auto(message.method.as_str())?;
    Ok(Question { method, element, poisson_max, deadline_ms, max_error })
}
