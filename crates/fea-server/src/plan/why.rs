//! Writes why a plan was taken, in a sentence for the report.

use softgrasp_core::fem::Element;
use softgrasp_core::solve::choose::{LOCKING_POISSON, Plan};

use super::once::OnceRequest;

/// Sentence that tells why a plan was chosen.
pub(crate) fn because(request: &OnceRequest, plan: &Plan) -> String {
    let choice = match request.is_method_open() {
        true => plan.to_string(),
        false if request.is_weighed() => String::new(),
        false => plan.why.clone(),
    };
    let parts = [Some(choice), element_because(request, plan)];
    let parts: Vec<String> = parts.into_iter().flatten().filter(|p| !p.is_empty()).collect();
    match parts.is_empty() {
        true => "asked for".to_owned(),
        false => parts.join("; "),
    }
}

/// Why this element was chosen, if the request left it open.
fn element_because(request: &OnceRequest, plan: &Plan) -> Option<String> {
    if request.question.element.is_some() {
        return None;
    }
    match plan.element {
        Element::Tet10 => Some(format!(
            "ten-node elements, because linear ones lock from a Poisson's ratio of \
             {LOCKING_POISSON} on"
        )),
        Element::Tet4Anp => Some(format!(
            "linear elements with averaged nodal pressure, because plain ones lock from a Poisson's \
             ratio of {LOCKING_POISSON} on and ten-node ones would take too much time or memory"
        )),
        Element::Tet4 => (request.question.poisson_max < LOCKING_POISSON).then(|| {
            format!(
                "linear elements, because they do not lock below a Poisson's ratio of \
                 {LOCKING_POISSON}"
            )
        }),
    }
}
