//! Rotation, strain and stretch of a frame are its own or left out, never another frame's.

use softgrasp_core::fem::Material;
use softgrasp_core::fem::hyperelastic::Law;
use softgrasp_core::mesh::TetMesh;
use softgrasp_core::model::{Element, Model};
use softgrasp_protocol::{Ask, DofValue, LargeAsk, ModelHash, Pace, Reply, Request};
use softgrasp_tests::questions::{cube, question, upload};

use crate::start::{answer, client, server};

/// Known displacements: the bottom held, a corner of the top moved aside.
fn pushed(mesh: &TetMesh, push: f64) -> Vec<DofValue> {
    let top = mesh.node_count() as u32 - 1;
    let (low, _) = mesh.bounds();
    let bottom = (0u32..).zip(mesh.vertices()).filter(|(_, place)| place.z < low.z + 1e-9);
    let rest = bottom
        .flat_map(|(n, _)| (0..3).map(move |axis| DofValue { dof: 3 * n + axis, value: 0.0 }));
    let moved = (0..3).map(|axis| DofValue {
        dof: 3 * top + axis,
        value: [push, 0.3 * push, -push][axis as usize],
    });
    rest.chain(moved).collect()
}

fn model_of(mesh: &TetMesh) -> Model {
    let materials: Vec<Material> = upload(mesh)
        .materials
        .iter()
        .map(|m| Material::try_new(m.young, m.poisson).unwrap())
        .collect();
    Model::try_new(mesh.clone(), Element::Tet4, &materials, Vec::new(), &mut |_| {}).unwrap()
}

fn large(
    model: ModelHash,
    mesh: &TetMesh,
    push: f64,
    pace: Pace,
    deadline: Option<f64>,
) -> Request {
    let mut question = question(pushed(mesh, push), "auto");
    question.max_error = Some(2e-3);
    question.deadline_ms = deadline;
    let large = LargeAsk { pace, ..LargeAsk::default() };
    Request::from(Ask { large: Some(large), ..Ask::new(model, question) })
}

#[test]
fn a_large_frame_never_tells_the_stretch_of_an_older_frame() {
    let server = server(2);
    let mesh = cube(64);
    let mut connection = client(&server);
    let Ok(Reply::ModelReady(ready)) = connection.ask(&Request::UploadModel(upload(&mesh))) else {
        panic!("the upload is refused");
    };
    let elements = model_of(&mesh).hyperelastic(Law::NeoHookean).unwrap();
    let mut told = 0;
    let deadlines = [(Pace::Repeatable, None), (Pace::Timely, None), (Pace::Timely, Some(1e-9))];
    for (pace, deadline) in deadlines {
        for push in [0.02, 0.2, 0.05, 0.25, 0.01] {
            let asked = large(ready.model, &mesh, push * mesh.size(), pace, deadline);
            let Ok(Reply::Answer(answer)) = connection.ask(&asked) else {
                panic!("a frame is refused");
            };
            let own = elements.summary(answer.displacements.clone().into_f64().as_flattened());
            let report = &answer.report;
            let pairs = [
                (answer.large.unwrap().max_stretch, own.stretch_max),
                (report.max_rotation_deg, own.rotation_max.to_degrees()),
                (report.max_strain, own.strain_max),
            ];
            for (said, own) in pairs {
                assert!(
                    said.is_nan() || (said - own).abs() <= 1e-9,
                    "push {push}: {said}, not {own}"
                );
                assert!(
                    pace == Pace::Timely || !said.is_nan(),
                    "push {push}: repeatable and left out"
                );
                told += usize::from(!said.is_nan());
            }
        }
    }
    assert!(told >= 30, "without a deadline all are told: {told}");
}

#[test]
fn a_linear_frame_never_tells_the_strain_of_another_frame() {
    let server = server(2);
    let mesh = cube(64);
    let mut connection = client(&server);
    let Ok(Reply::ModelReady(ready)) = connection.ask(&Request::UploadModel(upload(&mesh))) else {
        panic!("the upload is refused");
    };
    let model = model_of(&mesh);
    for round in 0..40 {
        // Every push is asked for twice, so that a strain that is worked out beside may be told.
        let push = 1e-3 * mesh.size() * f64::from(1 + round / 2);
        let asked = question(pushed(&mesh, push), "condensed");
        let asked = Request::from(Ask::new(ready.model, asked));
        let answer = answer(&mut connection, &asked);
        let own = model.strain(answer.displacements.into_f64().as_flattened(), &mut || {});
        let said = answer.report.max_strain;
        assert!(said.is_nan() || (said - own.strain_max).abs() <= 1e-9 * own.strain_max, "{said}");
    }
}
