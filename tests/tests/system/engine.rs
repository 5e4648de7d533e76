//! The method `condensed`, subscriptions, prefetch and ten-node elements, end to end.

use std::time::Duration;

use fea_server::{RunningServer, ServerConfig};
use glove_client::ask::connection::ServerConnection;
use softgrasp_core::mesh::TetMesh;
use softgrasp_protocol::{
    Answer, Ask, Displacements, DofValue, ElementName, Masks, ModelHash, NodeChoice, Precision,
    Prefetch, Question, RejectCode, Reply, Request, UploadModel,
};
use softgrasp_tests::questions::{cube, once, question, upload};
use softgrasp_tests::watchdog::until;

use crate::start::{answer, client, config, refusal, server};

/// Five contacts of a hand, each with its own displacement.
fn contacts(mesh: &TetMesh, push: f64) -> Vec<DofValue> {
    let last = mesh.node_count() as u32 - 1;
    let mut nodes = [0, 5, last / 2, last - 9, last];
    nodes.sort_unstable();
    let values = nodes.iter().flat_map(|n| (0..3).map(move |axis| 3 * n + axis));
    values.map(|dof| DofValue { dof, value: push * 1e-3 * f64::from(dof).sin() }).collect()
}

/// Question about a kept model.
fn asking(model: ModelHash, question: Question) -> Request {
    Request::from(Ask::new(model, question))
}

struct Scene {
    mesh: TetMesh,
    model: ModelHash,
    connection: ServerConnection,
}

impl Scene {
    fn new(server: &RunningServer, nodes: usize) -> Self {
        let mesh = cube(nodes);
        let mut connection = client(server);
        let model = match connection.ask(&Request::UploadModel(upload(&mesh))) {
            Ok(Reply::ModelReady(ready)) => ready.model,
            other => panic!("the upload got {other:?}"),
        };
        Self { mesh, model, connection }
    }

    fn ask(&mut self, method: &str, push: f64, nodes: NodeChoice, precision: Precision) -> Answer {
        let mut asked = question(contacts(&self.mesh, push), method);
        asked.want.nodes = nodes;
        asked.want.precision = precision;
        answer(&mut self.connection, &asking(self.model, asked))
    }

    fn all(&mut self, method: &str, push: f64) -> Answer {
        self.ask(method, push, NodeChoice::All, Precision::F64)
    }
}

fn largest(values: &[[f64; 3]]) -> f64 {
    values.iter().flatten().fold(0.0, |m, x| m.max(x.abs()))
}

fn largest_difference(a: &[[f64; 3]], b: &[[f64; 3]]) -> f64 {
    let pairs = a.iter().flatten().zip(b.iter().flatten());
    pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}

#[test]
fn condensed_frames_equal_the_factor_s_and_say_how_wrong_they_can_be() {
    let server = server(2);
    let mut scene = Scene::new(&server, 343);
    for push in [1.0, -0.3, 7.0] {
        let condensed = scene.all("condensed", push);
        let front = scene.all("front", push);
        assert_eq!(condensed.report.method, "condensed");
        assert!(condensed.report.residual_rel < 1e-12);
        let (a, b) = (condensed.displacements.into_f64(), front.displacements.into_f64());
        assert!(largest_difference(&a, &b) <= 1e-11 * largest(&b));
        let force = front.reactions.iter().fold(0.0f64, |m, r| m.max(r.value.abs()));
        for (a, b) in condensed.reactions.iter().zip(&front.reactions) {
            assert!(a.dof == b.dof && (a.value - b.value).abs() <= 1e-9 * force);
        }
        assert_eq!(scene.all("auto", push).report.method, "condensed");
    }
}

/// The proof runs in the background; once it is done every answer carries its bound.
#[test]
fn proven_bound_arrives_and_is_above_the_true_error() {
    let server = server(1);
    let mut scene = Scene::new(&server, 216);
    let mut proven = None;
    until(Duration::from_secs(60), "a proven bound", || {
        proven = scene.all("condensed", 1.0).report.error_bound_rel;
        proven.is_some()
    });
    let bound = proven.unwrap();
    let condensed = scene.all("condensed", 1.0).displacements.into_f64();
    let exact = scene.all("front", 1.0).displacements.into_f64();
    let norm = |v: &[[f64; 3]]| v.iter().flatten().map(|x| x * x).sum::<f64>().sqrt();
    let difference: Vec<[f64; 3]> = condensed
        .iter()
        .zip(&exact)
        .map(|(a, b)| [a[0] - b[0], a[1] - b[1], a[2] - b[2]])
        .collect();
    assert!(norm(&difference) / norm(&exact) <= bound && bound < 1e-4, "bound {bound:e}");
}

#[test]
fn subscribed_nodes_are_those_of_the_whole_answer_and_rounding_is_bounded() {
    let server = server(2);
    let mut scene = Scene::new(&server, 216);
    let nodes = vec![215, 3, 100, 7];
    for method in ["condensed", "front"] {
        let all = scene.all(method, 1.0).displacements.into_f64();
        let some = scene.ask(method, 1.0, NodeChoice::Nodes(nodes.clone()), Precision::F64);
        let some = some.displacements.into_f64();
        let picked: Vec<[f64; 3]> = nodes.iter().map(|&n| all[n as usize]).collect();
        assert!(largest_difference(&some, &picked) <= 1e-16, "{method}");
        let rounded = scene.ask(method, 1.0, NodeChoice::All, Precision::F32Quantised);
        let rounded = rounded.displacements.into_f64();
        // Two to the minus 24 of the largest component, as the protocol promises.
        assert!(largest_difference(&rounded, &all) <= largest(&all) * 2f64.powi(-24));
    }
}

#[test]
fn prefetched_columns_change_no_bit() {
    let bits = |answer: Answer| -> Vec<u64> {
        let u = answer.displacements.into_f64();
        u.iter().flatten().map(|x| x.to_bits()).collect()
    };
    let plain = bits(Scene::new(&server(2), 343).all("condensed", 1.0));
    let server = server(2);
    let mut scene = Scene::new(&server, 343);
    let nodes = (0..343).step_by(3).chain([9999]).collect();
    let masks = Masks::default();
    let hint = Prefetch { model: scene.model, nodes, masks };
    scene.connection.send(&Request::Prefetch(hint)).unwrap();
    assert!(bits(scene.all("condensed", 1.0)) == plain);
}

#[test]
fn column_cache_smaller_than_one_grip_is_told_and_the_session_lives() {
    let small = ServerConfig { column_cache: 100_000, ..config(1) };
    let server = fea_server::start(small).unwrap();
    let mut scene = Scene::new(&server, 343);
    let asked = question(contacts(&scene.mesh, 1.0), "condensed");
    let request = asking(scene.model, asked);
    let (code, text) = refusal(&mut scene.connection, &request);
    assert_eq!(code, RejectCode::MemoryLimit);
    assert!(text.contains("100000") && text.contains("front"), "{text}");
    let left_to_the_server = scene.all("auto", 1.0).report;
    assert_eq!(left_to_the_server.method, "front");
    assert!(left_to_the_server.chosen_because.contains("cache"));
    assert_eq!(scene.all("front", 1.0).report.method, "front");
}

#[test]
fn forces_are_answered_by_condensed_as_by_a_factor() {
    let server = server(1);
    let mut scene = Scene::new(&server, 216);
    let mut asked = question(contacts(&scene.mesh, 1.0), "condensed");
    asked.forces = vec![DofValue { dof: 3 * 77, value: 2.0 }];
    let mut solved = ["condensed", "auto", "front"].map(|method| {
        asked.method = method.parse().unwrap();
        answer(&mut scene.connection, &asking(scene.model, asked.clone()))
    });
    let methods = solved.each_ref().map(|answer| answer.report.method.clone());
    assert_eq!(methods, ["condensed", "condensed", "front"]);
    let [by_columns, left_to_the_server, by_factor] = solved.each_mut().map(|answer| {
        std::mem::replace(&mut answer.displacements, Displacements::F64(Vec::new())).into_f64()
    });
    assert_eq!(by_columns, left_to_the_server);
    let pairs = by_columns.as_flattened().iter().zip(by_factor.as_flattened());
    let apart = pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    let largest = by_factor.as_flattened().iter().fold(0.0f64, |most, u| most.max(u.abs()));
    assert!(apart < 1e-10 * largest, "{apart:e} of {largest:e}");
}

#[test]
fn ten_node_elements_answer_for_the_corners_and_are_softer() {
    let server = server(2);
    let mut connection = client(&server);
    let mesh = cube(125);
    let mut solve = |element: ElementName| {
        let mut request = once(&mesh, "front");
        request.element = element.into();
        answer(&mut connection, &Request::from(request))
    };
    let (linear, quadratic) = (solve(ElementName::T4), solve(ElementName::T10));
    assert_eq!(quadratic.report.element, ElementName::T10);
    assert_eq!(quadratic.displacements.node_count(), 125);
    assert!(quadratic.report.unknown_dofs > 5 * linear.report.unknown_dofs);
    // The same known displacements cost less force when there is more freedom in between.
    let force = |answer: &Answer| answer.reactions.iter().map(|r| r.value.powi(2)).sum::<f64>();
    assert!(force(&quadratic) < force(&linear));
}

#[test]
fn frame_that_touches_nothing_on_a_fixed_body_is_answered_with_zeros() {
    let server = server(2);
    let mut connection = client(&server);
    let mesh = cube(64);
    // A face: three nodes that are not in line would do.
    let fixed = (0..48).collect();
    let model = UploadModel { fixed, ..upload(&mesh) };
    let hash = ModelHash::of(&model);
    connection.ask(&Request::UploadModel(model)).unwrap();
    for method in ["auto", "condensed", "front"] {
        let question = question(Vec::new(), method);
        let request = Request::from(Ask::new(hash, question));
        let found = answer(&mut connection, &request);
        assert_eq!(found.reactions.len(), 48, "{method}");
        assert!(found.reactions.iter().all(|r| r.value == 0.0), "{method}");
        let rows = found.displacements.into_f64();
        assert!(rows.len() == 64 && rows.iter().flatten().all(|u| *u == 0.0), "{method}");
    }
}
