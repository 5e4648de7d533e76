//! Numbers at the border of double precision: whatever is asked, by any method, an answer has finite
//! numbers or there is none.

use glove_client::ask::connection::{LinkError, ServerConnection};
use softgrasp_core::mesh::TetMesh;
use softgrasp_protocol::{
    Answer, Ask, Deformation, DofValue, LargeAsk, LawName, Material, ModelHash, Pace, PathChoice,
    Precision, Question, RejectCode, Reply, Request,
};
use softgrasp_tests::questions::{METHODS, cube, once, question, squeeze, upload};

use crate::start::{client, server};

/// Factors of displacements, forces and Young's modulus that exceed the range of squares, of products
/// with the stiffness, or of numbers.
const SCALES: [f64; 9] = [1e308, 1e300, 1e200, 1e155, 1e100, 1e-100, 1e-155, 1e-300, 5e-324];

fn scaled(mesh: &TetMesh, scale: f64) -> Vec<DofValue> {
    // The largest displacement is the scale, up to the largest number.
    let known = squeeze(mesh, 1.0);
    let largest = known.iter().map(|known| known.value.abs()).fold(0.0, f64::max);
    known.iter().map(|k| DofValue { dof: k.dof, value: k.value / largest * scale }).collect()
}

fn is_finite(answer: &Answer) -> bool {
    let displacements = answer.displacements.clone().into_f64();
    displacements.iter().flatten().all(|u| u.is_finite())
        && answer
            .cases
            .iter()
            .flat_map(|case| case.displacements.iter().flatten())
            .all(|u| u.is_finite())
        && answer.reactions.iter().all(|reaction| reaction.value.is_finite())
        && answer.mask_forces.iter().flatten().all(|force| force.is_finite())
        && answer.report.residual_rel.is_finite()
        && answer.report.error_estimate_rel.is_none_or(f64::is_finite)
        && answer.report.error_bound_rel.is_none_or(f64::is_finite)
}

/// Whether a request was answered; checks that the answer is finite, or that the refusal says why.
fn is_answered(connection: &mut ServerConnection, request: &Request, what: &str) -> bool {
    let answer = match connection.ask(request) {
        Ok(Reply::Answer(answer)) => *answer,
        Err(LinkError::Rejected(rejected)) => {
            assert!(rejected.code != RejectCode::Internal, "{what}: {}", rejected.text);
            assert!(!rejected.text.is_empty());
            return false;
        }
        other => panic!("{what}: {other:?}"),
    };
    assert!(is_finite(&answer), "{what}: {:?}", answer.report);
    true
}

#[test]
fn a_frame_with_a_huge_displacement_is_refused_and_never_nan() {
    let (mesh, server) = (cube(64), server(1));
    let mut connection = client(&server);
    let Ok(Reply::ModelReady(ready)) = connection.ask(&Request::UploadModel(upload(&mesh))) else {
        panic!("no model")
    };
    let last = mesh.node_count() as u32 - 1;
    let nodes = [0, 1, last / 2, last - 1, last];
    let mut frame = |method: &str, scale: f64, precision| {
        let dofs = nodes.iter().flat_map(|n| 3 * n..3 * n + 3);
        let known = dofs.map(|dof| DofValue { dof, value: scale * f64::from(dof).sin() });
        let mut asked = question(known.collect(), method);
        asked.want.precision = precision;
        let request = Ask::new(ready.model, asked);
        is_answered(&mut connection, &Request::from(request), &format!("{method} {scale:e}"))
    };
    for method in ["auto", "condensed", "front", "front-mixed", "pcg"] {
        for precision in [Precision::F64, Precision::F32Quantised] {
            for scale in SCALES {
                frame(method, scale, precision);
            }
            assert!(!frame(method, 1e308, precision), "{method}");
            assert!(frame(method, 1e-3, precision), "{method}");
        }
    }
}

#[test]
fn one_request_at_the_border_of_numbers_is_finite_or_refused_by_every_method() {
    let (mesh, server) = (cube(27), server(1));
    let mut connection = client(&server);
    for method in METHODS {
        for scale in SCALES {
            let what = format!("{method} {scale:e}");
            let mut request = once(&mesh, method);
            request.question.known = scaled(&mesh, scale);
            is_answered(&mut connection, &Request::from(request), &what);
            let mut request = once(&mesh, method);
            request.materials = vec![Material { young: scale, poisson: 0.3 }];
            is_answered(&mut connection, &Request::from(request), &what);
            let mut request = once(&mesh, method);
            for vertex in &mut request.mesh.vertices {
                *vertex = vertex.map(|x| x * scale);
            }
            is_answered(&mut connection, &Request::from(request), &what);
        }
        let request = Request::from(once(&mesh, method));
        assert!(is_answered(&mut connection, &request, method));
    }
}

#[test]
fn several_cases_and_large_deformation_at_the_border_of_numbers_are_finite_or_refused() {
    let (mesh, server) = (cube(27), server(1));
    let mut connection = client(&server);
    let model = ModelHash::of(&upload(&mesh));
    assert!(connection.ask(&Request::UploadModel(upload(&mesh))).is_ok());
    let ask = |law, path| LargeAsk {
        deformation: Deformation::Large,
        law,
        yield_stress: None,
        path,
        pace: Pace::Repeatable,
    };
    for scale in SCALES.into_iter().chain([1e-3]) {
        let whole = Ask::from(once(&mesh, "auto"));
        let values: Vec<f64> = scaled(&mesh, scale).iter().map(|known| known.value).collect();
        let several = Ask { cases: vec![values.clone(), values], ..whole.clone() };
        let request = Request::from(several);
        is_answered(&mut connection, &request, &format!("several {scale:e}"));
        for law in [LawName::NeoHookean, LawName::NeoHookeanLog] {
            let large = ask(law, PathChoice::FromRest);
            let known = Question { known: scaled(&mesh, scale), ..whole.question.clone() };
            let once = Ask { large: Some(large), question: known.clone(), ..whole.clone() };
            let what = format!("large {scale:e}");
            let request = Request::from(once);
            let is_found = is_answered(&mut connection, &request, &what);
            assert!(is_found || scale != 1e-3, "{what}");
            let frame = Ask { large: Some(large), ..Ask::new(model, known) };
            is_answered(&mut connection, &Request::from(frame), &what);
        }
    }
}
