//! Meshes with mid-edge nodes of their own through a socket: what is prescribed there comes back there.

use std::time::Duration;

use glove_client::ask::connection::ServerConnection;
use softgrasp_core::mesh::{BuiltIn, TetMesh, mirrored, mirrored_middles};
use softgrasp_core::model::Model;
use softgrasp_core::solve::{Loads, Method};
use softgrasp_core::{Element, Material};
use softgrasp_protocol::RejectCode::BadRequest;
use softgrasp_protocol::{
    Answer, Ask, DofValue, ElementChoice, ElementName, Field, FieldSet, LargeAsk, Masks, ModelHash,
    Question, Reply, Request, UploadModel, Want,
};
use softgrasp_tests::curved::{round_sphere, with_middles};
use softgrasp_tests::questions::{MATERIAL, Once, object, once, question, squeeze, upload};
use softgrasp_tests::watchdog::until;

use crate::start::{answer, client, refusal, server};

fn ask(mesh: &TetMesh, known: Vec<DofValue>) -> Once {
    let question = question(known, "front");
    Once { element: ElementChoice::T10, question, ..once(mesh, "front") }
}

/// Held below, pushed above, mid-edge nodes with the corners.
fn known(mesh: &TetMesh) -> Vec<DofValue> {
    squeeze(mesh, 0.1)
}

/// Uploads the mesh as a model of ten-node elements; its name.
fn kept(connection: &mut ServerConnection, mesh: &TetMesh) -> ModelHash {
    let message = UploadModel { element: ElementName::T10, ..upload(mesh) };
    let name = ModelHash::of(&message);
    match connection.ask(&Request::UploadModel(message)) {
        Ok(Reply::ModelReady(ready)) => assert_eq!(ready.model, name),
        other => panic!("the upload got {other:?}"),
    }
    name
}

fn nodes_of(answer: &Answer) -> Vec<[f64; 3]> {
    answer.displacements.clone().into_f64()
}

fn in_process(mesh: &TetMesh, known: &[DofValue]) -> Vec<f64> {
    let material = Material::try_new(MATERIAL.young, MATERIAL.poisson).unwrap();
    let model =
        Model::try_new(mesh.clone(), Element::Tet10, &[material], vec![], &mut |_| {}).unwrap();
    let known = known.iter().map(|known| (known.dof, known.value)).collect();
    let known = model.known(known).unwrap();
    let factored = model.factor(&known.dofs, Method::SparseCholesky, &mut |_| {}).unwrap();
    let loads = Loads { q_known: &known.q_known, forces: &[], residual_rel: 0.0 };
    factored.solve(model.stiffness(), loads, &mut |_| {}).unwrap().displacement
}

#[track_caller]
fn assert_near(found: &[[f64; 3]], expected: &[f64], share: f64) {
    assert_eq!(found.as_flattened().len(), expected.len());
    let largest = expected.iter().fold(0.0, |most: f64, u| most.max(u.abs()));
    for (at, (a, b)) in found.as_flattened().iter().zip(expected).enumerate() {
        assert!((a - b).abs() < share * largest, "degree of freedom {at}: {a:e} and {b:e}");
    }
}

#[test]
fn what_is_prescribed_at_a_mid_edge_node_comes_back_at_it() {
    let server = server(2);
    let mut connection = client(&server);
    assert!(connection.welcome().capabilities.iter().any(|name| name == "mid-edge"));
    let mesh = round_sphere(150);
    let is_corner = mesh.is_corner();
    let known = known(&mesh);
    let at_middles = known.iter().filter(|known| !is_corner[known.dof as usize / 3]).count();
    assert!(at_middles > 30, "{at_middles} of {}", known.len());
    let found = answer(&mut connection, &ask(&mesh, known.clone()).into());
    let all = nodes_of(&found);
    assert_eq!(all.len(), mesh.node_count());
    for known in &known {
        assert_eq!(all.as_flattened()[known.dof as usize], known.value);
    }
    assert_near(&all, &in_process(&mesh, &known), 1e-9);
    assert!(found.reactions.iter().map(|r| r.dof).eq(known.iter().map(|known| known.dof)));
    for axis in 0..3 {
        let of_axis = found.reactions.iter().filter(|r| r.dof % 3 == axis).map(|r| r.value);
        let (sum, size) = of_axis.fold((0.0, 0.0), |(s, a), r| (s + r, a + r.abs()));
        assert!(sum.abs() < 1e-9 * size, "{sum:e} of {size:e}");
    }
    // A linear mesh with the same corners answers otherwise: the edges are curved.
    let straight = object(BuiltIn::Sphere, 150);
    assert_ne!(nodes_of(&answer(&mut connection, &once(&straight, "front").into())), all);
}

#[test]
fn a_kept_model_answers_as_one_request_does_and_its_name_covers_its_middles() {
    let server = server(2);
    let mut connection = client(&server);
    let mesh = round_sphere(100);
    let known = known(&mesh);
    let name = kept(&mut connection, &mesh);
    let straight = with_middles(&object(BuiltIn::Sphere, 100), nalgebra::center);
    let straight = UploadModel { element: ElementName::T10, ..upload(&straight) };
    assert_ne!(ModelHash::of(&straight), name);
    let of_once = nodes_of(&answer(&mut connection, &ask(&mesh, known.clone()).into()));
    let frame = Ask::new(name, question(known.clone(), "front"));
    let of_frame = nodes_of(&answer(&mut connection, &frame.into()));
    assert_near(&of_frame, of_once.as_flattened(), 1e-9);
    // At a small motion large deformation gives the same, and fields have values at every node.
    let little = known.iter().map(|known| DofValue { value: 1e-6 * known.value, ..*known });
    let little: Vec<DofValue> = little.collect();
    let fields: FieldSet = [Field::NodeStress].into_iter().collect();
    let asked = question(little.clone(), "auto");
    let asked = Question { want: Want { fields, ..asked.want.clone() }, ..asked };
    let large = Ask { large: Some(LargeAsk::default()), ..Ask::new(name, asked) };
    let large = answer(&mut connection, &large.into());
    let linear: Vec<f64> = of_once.as_flattened().iter().map(|u| 1e-6 * u).collect();
    assert_near(&nodes_of(&large), &linear, 1e-5);
    let stress = large.fields[0].get(Field::NodeStress).unwrap();
    assert_eq!(stress.len(), 6 * mesh.node_count());
    assert!(stress.chunks_exact(6).all(|stress| stress.iter().any(|s| *s != 0.0)));
}

#[test]
fn frames_of_ten_node_elements_are_condensed_with_masks_and_a_bound_above_their_error() {
    let server = server(2);
    let mut connection = client(&server);
    let mesh = round_sphere(60);
    let known = known(&mesh);
    let name = kept(&mut connection, &mesh);
    let mut by = |question: Question| answer(&mut connection, &Ask::new(name, question).into());
    let exact = nodes_of(&by(question(known.clone(), "front")));
    let mut bound = None;
    // The bound is proven beside the frames.
    until(Duration::from_secs(60), "a bound", || {
        let found = by(question(known.clone(), "auto"));
        assert_eq!(found.report.method, "condensed", "{}", found.report.chosen_because);
        let found_nodes = nodes_of(&found);
        assert_near(&found_nodes, exact.as_flattened(), 1e-9);
        let off = found_nodes.as_flattened().iter().zip(exact.as_flattened());
        let off = off.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        bound = found.report.error_bound_rel.map(|bound| (bound, off));
        bound.is_some()
    });
    let largest = exact.as_flattened().iter().fold(0.0, |most: f64, u| most.max(u.abs()));
    let (bound, off) = bound.unwrap();
    assert!(bound < 1e-6 && off <= (bound + 1e-12) * largest, "{bound:e} {off:e} of {largest:e}");
    // A mask of one mid-edge node is that node.
    let middle = known.iter().rfind(|known| !mesh.is_corner()[known.dof as usize / 3]).unwrap();
    let node = middle.dof / 3;
    let (of_node, others): (Vec<DofValue>, Vec<DofValue>) =
        known.iter().partition(|known| known.dof / 3 == node);
    let mut masks = Masks::default();
    masks.push(&[(node, 1.0)]);
    let moved = std::array::from_fn(|axis| of_node[axis].value);
    let held = Question { masks, mask_displacements: vec![moved], ..question(others, "auto") };
    assert_near(&nodes_of(&by(held)), exact.as_flattened(), 1e-9);
}

#[test]
fn elements_may_come_in_either_order() {
    let server = server(2);
    let mut connection = client(&server);
    let mesh = round_sphere(100);
    let known = known(&mesh);
    let mut turned = ask(&mesh, known.clone());
    turned.mesh.tets.iter_mut().for_each(|tet| *tet = mirrored(*tet));
    turned.mesh.mid_edge.iter_mut().for_each(|nodes| *nodes = mirrored_middles(*nodes));
    let expected = nodes_of(&answer(&mut connection, &ask(&mesh, known).into()));
    assert_eq!(nodes_of(&answer(&mut connection, &turned.into())), expected);
}

#[test]
fn mid_edge_nodes_that_do_not_fit_are_refused_by_name() {
    let server = server(2);
    let mut connection = client(&server);
    let mesh = round_sphere(100);
    let mut text = |spoil: &dyn Fn(&mut Once)| {
        let mut asked = ask(&mesh, known(&mesh));
        spoil(&mut asked);
        let (code, text) = refusal(&mut connection, &asked.into());
        assert_eq!(code, BadRequest, "{text}");
        text
    };
    let none = mesh.node_count() as u32;
    let far = text(&|asked| asked.mesh.mid_edge[3][2] = none);
    assert!(far.contains(&format!("tetrahedron 3 refers to node {none}")), "{far}");
    let corner = mesh.tets()[0][0];
    let wrong = text(&|asked| asked.mesh.mid_edge[0][5] = corner);
    assert!(wrong.contains(&format!("node {corner}")), "{wrong}");
    let folded = text(&|asked| {
        let node = asked.mesh.mid_edge[0][0] as usize;
        asked.mesh.vertices[node] = [1.0, 2.0, 3.0];
    });
    assert!(folded.contains("curved too much"), "{folded}");
    // Linear elements have no node there.
    let linear = text(&|asked| asked.element = ElementChoice::T4);
    assert!(linear.contains("node"), "{linear}");
    assert!(!nodes_of(&answer(&mut connection, &ask(&mesh, known(&mesh)).into())).is_empty());
}
