//! Our answers as a client gets them: a model uploaded to a server, then one frame per right-hand
//! side over a loopback socket.

use glove_client::ask::connection::{Host, LinkError, ServerChoice, ServerConnection, unexpected};
use softgrasp_bench::sample::timed_ms;
use softgrasp_protocol::{
    Answer, Ask, DofValue, ElementName, Material, MeshData, MethodName, ModelHash, NodeChoice,
    Question, Reply, Request, UploadModel, Want,
};

use crate::problem::{POISSON, Problem, YOUNG};

/// Runs one method on a server of as many threads: order and factor as the first frame reports them,
/// one more frame, and a frame for each right-hand side; all on the kept factor, refined.
pub fn run(problem: &Problem, method: &str, threads: usize) -> anyhow::Result<serde_json::Value> {
    // A server of its own each time: nothing is kept from the round before.
    let host = Host::open(&ServerChoice::Embedded, Some(threads))?;
    let mut connection = host.connect()?;
    let mesh = problem.model.mesh();
    let upload = UploadModel {
        mesh: MeshData {
            vertices: mesh.vertices().iter().map(|p| [p.x, p.y, p.z]).collect(),
            tets: mesh.tets().to_vec(),
            ..MeshData::default()
        },
        materials: vec![Material { young: YOUNG, poisson: POISSON }],
        element: ElementName::T4,
        fixed: Vec::new(),
    };
    let model = match connection.ask(&Request::UploadModel(upload))? {
        Reply::ModelReady(ready) => ready.model,
        other => return Err(unexpected("UploadModel", &other).into()),
    };
    let method = MethodName::try_new(method)?;
    let request = |column: usize| -> Request {
        let known = problem.known.dofs.iter().zip(&problem.q_known[column]);
        let question = Question {
            known: known.map(|(&dof, &value)| DofValue { dof, value }).collect(),
            method: method.clone(),
            want: Want { nodes: NodeChoice::All, reactions: false, ..Want::default() },
            ..Question::default()
        };
        frame(model, question)
    };
    let first = ask(&mut connection, &request(0))?;
    let stage_ms = first.report.stage_ms;
    let requests: Vec<Request> = (0..problem.q_known.len()).map(request).collect();
    let (solve_ms, single) = timed_ms(|| ask(&mut connection, &requests[0]));
    let (solve_wide_ms, wide) = timed_ms(|| -> anyhow::Result<Vec<Answer>> {
        requests.iter().map(|request| ask(&mut connection, request)).collect()
    });
    let mut answers = Vec::new();
    for answer in std::iter::once(single?).chain(wide?) {
        anyhow::ensure!(answer.report.factor_reused, "the server did not keep its factor");
        answers.extend(problem.unknown_of(&answer.displacements.into_f64().concat()));
    }
    problem.write_answers(&answers)?;
    Ok(serde_json::json!({
        "order_ms": stage_ms.order,
        "factor_ms": stage_ms.factor,
        "solve_ms": solve_ms,
        "solve_wide_ms": solve_wide_ms,
    }))
}

fn frame(model: ModelHash, question: Question) -> Request {
    Request::from(Ask::new(model, question))
}

fn ask(connection: &mut ServerConnection, request: &Request) -> anyhow::Result<Answer> {
    match connection.ask(request)? {
        Reply::Answer(answer) => Ok(*answer),
        Reply::Rejected(rejected) => Err(LinkError::Rejected(rejected).into()),
        other => Err(unexpected("Frame", &other).into()),
    }
}
