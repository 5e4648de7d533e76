//! Predicts the cost of a request before it is begun, so that it waits only for others of similar cost.
//!
//! The prediction chooses a lane and a turn; no answer depends on it.

use softgrasp_core::fem::Element;
use softgrasp_core::model::Model;
use softgrasp_core::solve::Method;
use softgrasp_core::solve::choose::cheapest_element;
use softgrasp_core::solve::condensed::Base;
use softgrasp_core::solve::rates::Rates;
use softgrasp_core::solve::work::{MeshSize, Work};
use softgrasp_protocol::{Ask, Body, ElementChoice, MeshData, Request, Subject, UploadModel};

use super::admission::Subject as Measured;
use crate::request::{element_given, element_of, poisson_max};

/// Number of tangents that a request at large deformation is assumed to factor.
const TANGENTS_OF_A_MOTION: f64 = 6.0;
/// Number of solves of a frame question that continues a path.
const SOLVES_OF_A_FRAME: f64 = 5.0;
/// Right-hand sides that are solved together in the time of about three single ones.
const TOGETHER: f64 = 15.0;
const SOLVES_TOGETHER: f64 = 3.0;
/// Steps of conjugate gradients for the columns of a contact where there is no factor.
const CYCLES_OF_A_COLUMN: f64 = 30.0;
/// Number of solves for all right-hand sides that refinement takes for one case of several.
const SOLVES_PER_CASE: f64 = 1.0;

/// Predicted time of a request with its own mesh, on all threads; 0 for requests about a kept model.
///
/// Units: ms.
pub(crate) fn request_ms(request: &Request, rates: &Rates) -> f64 {
    match request {
        Request::Ask(ask) => ask_ms(ask, rates),
        Request::UploadModel(UploadModel { mesh, element, .. }) => {
            made_ms(rates, &work_of(mesh, element_of(*element)), Method::Condensed)
        }
        _ => 0.0,
    }
}

fn ask_ms(ask: &Ask, rates: &Rates) -> f64 {
    let Ask { subject: Subject::Mesh(body), question, large, cases, .. } = ask else { return 0.0 };
    let Body { mesh, materials, element } = &**body;
    let work = work_of(mesh, element_chosen(*element, poisson_max(materials)));
    if large.is_some() {
        return TANGENTS_OF_A_MOTION * made_ms(rates, &work, Method::FrontMixed);
    }
    let solve_ms = 1e3 * rates.double.solve_entry_s * work.factor_entries;
    let method = method_of(question.method.as_str());
    made_ms(rates, &work, method) + SOLVES_PER_CASE * cases.len() as f64 * solve_ms
}

/// Predicted time to make a factor of a kept model and to answer with it.
///
/// Units: ms.
pub(crate) fn factor_ms(model: &Model, method: Method, rates: &Rates) -> f64 {
    made_ms(rates, &work_of_model(model), method)
}

/// Predicted time of a frame question at large deformation: one that continues a path takes some solves
/// with an older factor, the first one about a model makes the factor.
///
/// Units: ms.
pub(crate) fn large_frame_ms(model: &Model, goes_on: bool, rates: &Rates) -> f64 {
    if !goes_on {
        return factor_ms(model, Method::FrontMixed, rates);
    }
    let work = work_of_model(model);
    let solve_s = rates.single.solve_entry_s * work.factor_entries;
    // Evaluating the elements takes about as long as assembling them.
    let evaluation_s = rates.assemble_pair_s * work.element_pairs;
    1e3 * SOLVES_OF_A_FRAME * (solve_s + evaluation_s)
}

/// Predicted time to compute the columns of `contacts` contacts.
///
/// Units: ms.
pub(crate) fn columns_ms(base: &Base, contacts: usize, rates: &Rates) -> f64 {
    let entry_ms = 1e3 * rates.double.solve_entry_s;
    if !base.has_factor() {
        let entries = base.bytes() as f64 / size_of::<f32>() as f64;
        return entry_ms * CYCLES_OF_A_COLUMN * contacts as f64 * entries;
    }
    let entries = base.bytes() as f64 / size_of::<f64>() as f64;
    let together = (3.0 * contacts as f64 / TOGETHER).ceil();
    entry_ms * together * SOLVES_TOGETHER * entries
}

fn work_of_model(model: &Model) -> Work {
    let mesh = model.mesh();
    let size = match mesh.mid_edge_nodes().is_empty() {
        true => MeshSize { nodes: mesh.node_count(), tets: mesh.tets().len() },
        false => Measured::about(model, 0, None).problem.size,
    };
    Work::estimate(size, model.element())
}

fn made_ms(rates: &Rates, work: &Work, method: Method) -> f64 {
    rates.preparation_ms(work, method) + rates.factor_and_solve_ms(work, method, 0.0)
}

fn work_of(mesh: &MeshData, element: Element) -> Work {
    let size = match mesh.mid_edge.is_empty() {
        true => MeshSize { nodes: mesh.vertices.len(), tets: mesh.tets.len() },
        // The work is estimated from the corners.
        false => Measured::once(mesh, 0).problem.size,
    };
    Work::estimate(size, element)
}

/// Method of this name; an unknown name is refused later.
fn method_of(name: &str) -> Method {
    Method::named_or_auto(name).ok().flatten().unwrap_or(Method::Front)
}

fn element_chosen(element: ElementChoice, poisson_max: f64) -> Element {
    element_given(element).unwrap_or_else(|| cheapest_element(poisson_max))
}
