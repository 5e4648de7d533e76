//! Answers by a server over a loopback socket: one request with its own mesh, and frame questions about a
//! kept model.

use std::collections::BTreeMap;
use std::time::{Duration, Instant};

use glove_client::ask::connection::{Host, LinkError, ServerConnection};
use softgrasp_core::model::Element;
use softgrasp_protocol::{
    Ask, Body, DofValue, ElementChoice, ElementName, Masks, Material, MeshData, MethodName,
    NodeChoice, Question as Asked, Reply, Request, UploadModel, Want,
};

use super::answer::{Answer, since};
use super::case::Question;
use super::in_process::Grouped;
use super::refusal::{Reason, Refusal};

/// Longest wait for the estimate of a frame's error, which is made in the background.
const ESTIMATE_WAIT: Duration = Duration::from_secs(5);

/// Answer to one request with mesh, material and question, by the server's choice of method.
///
/// # Errors
/// [`Refusal`].
pub(super) fn solve(question: &Question, element: Element, host: &Host) -> Result<Answer, Refusal> {
    let mut known = question.pairs.clone();
    // A request that brings its own mesh knows no fixed nodes: they are known to stay.
    let moved: Vec<u32> = known.iter().map(|pair| pair.0).collect();
    known.extend(question.fixed.iter().filter(|dof| !moved.contains(dof)).map(|dof| (*dof, 0.0)));
    let (mesh, materials) = on_the_wire(question);
    let element = match element {
        Element::Tet4 => ElementChoice::T4,
        Element::Tet10 => ElementChoice::T10,
        Element::Tet4Anp => ElementChoice::T4Anp,
    };
    let begin = Instant::now();
    let mut connection = host.connect().map_err(broken)?;
    let question = asked(&known, false)?;
    let request = Request::from(Ask::new(Body { mesh, materials, element }, question));
    read(ask(&mut connection, &request)?, begin)?.if_certain()
}

/// Answer to a frame question about a kept model; with `by_masks` every touched node is held by a mask of
/// that node alone.
///
/// # Errors
/// [`Refusal`].
pub(super) fn frame(
    question: &Question,
    element: Element,
    by_masks: bool,
    host: &Host,
) -> Result<Answer, Refusal> {
    let (mesh, materials) = on_the_wire(question);
    let element = match element {
        Element::Tet4 => ElementName::T4,
        Element::Tet10 => ElementName::T10,
        Element::Tet4Anp => ElementName::T4Anp,
    };
    let fixed = question.fixed.clone();
    let begin = Instant::now();
    let mut connection = host.connect().map_err(broken)?;
    let upload = Request::UploadModel(UploadModel { mesh, materials, element, fixed });
    let model = match ask(&mut connection, &upload)? {
        Reply::ModelReady(ready) => ready.model,
        other => return Err(unexpected(&other)),
    };
    let request = Ask::new(model, asked(&question.pairs, by_masks)?);
    let request = Request::from(request);
    let mut answer = read(ask(&mut connection, &request)?, begin)?;
    let ms = answer.ms;
    while answer.stated_rel.is_nan() && begin.elapsed() < ESTIMATE_WAIT {
        std::thread::sleep(Duration::from_millis(2));
        answer = read(ask(&mut connection, &request)?, begin)?;
    }
    let answer = Answer { ms, ..answer };
    // Without an estimate an answer has to be exact.
    if answer.stated_rel.is_nan() { Ok(answer) } else { answer.if_certain() }
}

fn on_the_wire(question: &Question) -> (MeshData, Vec<Material>) {
    let mesh = MeshData {
        vertices: question.mesh.vertices().iter().map(|p| [p.x, p.y, p.z]).collect(),
        tets: question.mesh.tets().to_vec(),
        regions: question.mesh.regions().to_vec(),
        ..MeshData::default()
    };
    let materials = question.materials.iter();
    let of =
        |m: &softgrasp_core::fem::Material| Material { young: m.young(), poisson: m.poisson() };
    (mesh, materials.map(of).collect())
}

/// Question about all nodes in double precision, method left open.
fn asked(known: &[(u32, f64)], by_masks: bool) -> Result<Asked, Refusal> {
    let by_dof: BTreeMap<u32, f64> = known.iter().copied().collect();
    // What is given twice or is no number is sent as it is.
    let is_plain = by_dof.len() == known.len() && known.iter().all(|(_, q)| q.is_finite());
    let pairs: Vec<(u32, f64)> = match is_plain {
        true => by_dof.into_iter().collect(),
        false => known.to_vec(),
    };
    let Grouped { loose, masked } = Grouped::of(&pairs, by_masks && is_plain);
    let mut masks = Masks::default();
    masked.iter().for_each(|(node, _)| masks.push(&[(*node, 1.0)]));
    let method = MethodName::try_new("auto")
        .map_err(|error| Refusal::new(Reason::Other, error.to_string()))?;
    Ok(Asked {
        known: loose.into_iter().map(|(dof, value)| DofValue { dof, value }).collect(),
        masks,
        mask_displacements: masked.into_iter().map(|(_, mean)| mean).collect(),
        method,
        want: Want { nodes: NodeChoice::All, reactions: false, ..Want::default() },
        ..Asked::default()
    })
}

fn ask(connection: &mut ServerConnection, request: &Request) -> Result<Reply, Refusal> {
    match connection.ask(request) {
        Ok(Reply::Rejected(rejected)) | Err(LinkError::Rejected(rejected)) => Err(rejected.into()),
        Ok(reply) => Ok(reply),
        Err(error) => Err(broken(error)),
    }
}

fn read(reply: Reply, begin: Instant) -> Result<Answer, Refusal> {
    let answer = match reply {
        Reply::Answer(answer) => *answer,
        other => return Err(unexpected(&other)),
    };
    let report = answer.report;
    Ok(Answer {
        displacement: answer.displacements.into_f64().concat(),
        residual_rel: report.residual_rel,
        condition: report.condition_estimate.unwrap_or(f64::NAN),
        stated_rel: report.error_estimate_rel.unwrap_or(f64::NAN),
        bound_rel: report.error_bound_rel,
        remark: format!("{}: {}", report.method, report.chosen_because),
        ms: since(begin),
    })
}

fn broken(error: LinkError) -> Refusal {
    Refusal::new(Reason::Other, error.to_string())
}

fn unexpected(reply: &Reply) -> Refusal {
    Refusal::new(Reason::Other, format!("an unexpected reply: {:?}", reply.kind()))
}
