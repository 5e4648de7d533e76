//! Plans the answer to a frame question: by kept columns where possible, else by a factor.

use softgrasp_core::model::Known;
use softgrasp_core::solve::Method;
use softgrasp_core::solve::choose::{Plan, Question, SMALLER_THAN_FRONT};

use super::admission::PlanError;
use super::once::{ASKED, plan_for_masks};
use crate::store::StoredModel;

/// Number of touched degrees of freedom above which the small system is too large.
const TOUCHED_DOFS_MAX: usize = 600;

/// Where the columns of frames come from.
const BY_FACTOR: &str = "frames on a kept model: exact from cached columns";
const BY_CYCLES: &str = "frames on a kept model: from cached columns, which come from conjugate gradients \
                         with multigrid, since memory is too short for a factor";

/// Plan of the answer to one frame question.
///
/// # Errors
/// [`PlanError`] if the model cannot be answered by the method asked for, or with masks.
pub(crate) fn plan_frame(
    question: &Question,
    stored: &StoredModel,
    known: &Known,
    has_masks: bool,
) -> Result<Plan, PlanError> {
    let element = stored.model.element();
    let asked = question.method;
    if let Some(method) = asked.filter(|method| *method != Method::Condensed && !has_masks) {
        return Ok(question.plan(element, method, ASKED));
    }
    let obstacle = match stored.base() {
        Err(error) => Some(PlanError::Model(error)),
        Ok(_) => moved_fixed_node(stored, known).map(|node| PlanError::FixedMoved { node }),
    };
    if has_masks {
        return plan_for_masks(question, element, obstacle);
    }
    let by_factor = |why: String| Plan {
        instead: SMALLER_THAN_FRONT,
        ..question.plan(element, Method::Front, format!("not condensed: {why}"))
    };
    let touched = known.dofs.len() - stored.model.fixed().len().min(known.dofs.len());
    match (asked, obstacle) {
        (None, _) if touched > TOUCHED_DOFS_MAX => {
            Ok(by_factor(format!("{touched} degrees of freedom are held at once")))
        }
        (None, None) => {
            let has_factor = stored.base().is_ok_and(|base| base.has_factor());
            let why = if has_factor { BY_FACTOR } else { BY_CYCLES };
            Ok(question.plan(element, Method::Condensed, why))
        }
        (None, Some(obstacle)) => Ok(by_factor(obstacle.to_string())),
        (Some(_), None) => Ok(question.plan(element, Method::Condensed, ASKED)),
        (Some(_), Some(obstacle)) => Err(obstacle),
    }
}

/// A node that the model fixes and the question moves, if there is one.
fn moved_fixed_node(stored: &StoredModel, known: &Known) -> Option<u32> {
    let fixed = stored.model.fixed();
    let moved = |(dof, q): (&u32, &f64)| *q != 0.0 && fixed.binary_search(dof).is_ok();
    let mut pairs = known.dofs.iter().zip(&known.q_known);
    pairs.find(|&pair| moved(pair)).map(|(dof, _)| dof / 3)
}
