//! Fields over the wire: asked for by bits, for every method, and sent to nobody else.

use glove_client::ask::connection::ServerConnection;
use softgrasp_core::mesh::{BuiltIn, generate};
use softgrasp_protocol::{
    Answer, Ask, Body, Deformation, DofValue, ElementChoice, ElementName, Field, FieldSet,
    LargeAsk, Material, MeshData, MethodName, NodeChoice, Question, RejectCode, Reply, Request,
    Subject, UploadModel, Want,
};
use softgrasp_tests::questions::{METHODS, mesh_data};

use crate::start::{client, refusal, server};

fn all() -> FieldSet {
    Field::ALL.into_iter().filter(|field| !field.is_of_contact()).collect()
}

fn mesh() -> MeshData {
    mesh_data(&generate(BuiltIn::Strawberry, 150).unwrap())
}

/// Known displacements: low nodes held, high ones pushed aside.
fn known(mesh: &MeshData, push: f64) -> Vec<DofValue> {
    let heights = mesh.vertices.iter().map(|place| place[2]);
    let (low, high) = heights
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), z| (low.min(z), high.max(z)));
    let mut known = Vec::new();
    for (node, place) in (0u32..).zip(&mesh.vertices) {
        let share = (place[2] - low) / (high - low);
        let moved = match share {
            s if s < 0.15 => [0.0; 3],
            s if s > 0.9 => [0.4 * push, 0.0, -push],
            _ => continue,
        };
        known.extend(
            (0u32..).zip(moved).map(|(axis, value)| DofValue { dof: 3 * node + axis, value }),
        );
    }
    known
}

fn body(mesh: &MeshData, element: ElementChoice) -> Body {
    let materials = vec![Material { young: 2e4, poisson: 0.4 }];
    Body { mesh: mesh.clone(), materials, element }
}

fn asked(known: Vec<DofValue>, fields: FieldSet) -> Question {
    let want = Want { reactions: true, fields, ..Want::default() };
    Question { known, want, ..Question::default() }
}

fn answer(connection: &mut ServerConnection, ask: Ask) -> Answer {
    match connection.ask(&Request::from(ask)) {
        Ok(Reply::Answer(answer)) => *answer,
        other => panic!("{other:?}"),
    }
}

/// Work of the reactions along the known displacements, J.
fn work(known: &[DofValue], answer: &Answer) -> f64 {
    let of =
        |dof: u32| known.iter().find(|known| known.dof == dof).map_or(0.0, |known| known.value);
    answer.reactions.iter().map(|reaction| reaction.value * of(reaction.dof)).sum()
}

#[test]
fn stored_energy_is_half_the_work_of_the_reactions_by_every_method() {
    let server = server(2);
    let mut connection = client(&server);
    let mesh = mesh();
    let elements = [ElementChoice::T4, ElementChoice::T4Anp, ElementChoice::T10];
    for element in elements {
        let mut reference: Option<Answer> = None;
        for method in METHODS {
            if element == ElementChoice::T10 && !["front", "multigrid"].contains(&method) {
                continue;
            }
            let known = known(&mesh, 1e-3);
            let mut question = asked(known.clone(), all());
            question.method = MethodName::try_new(method).unwrap();
            let found = answer(&mut connection, Ask::new(body(&mesh, element), question));
            let [fields] = &found.fields[..] else { panic!("{} fields", found.fields.len()) };
            let half = 0.5 * work(&known, &found);
            assert!((fields.energy / half - 1.0).abs() < 1e-8, "{element:?}, {method}");
            let sum: f64 = fields.get(Field::ElementEnergy).unwrap().iter().sum();
            assert!((sum / fields.energy - 1.0).abs() < 1e-12);
            assert!(fields.error_rel > 0.01 && fields.error_rel < 0.9, "{}", fields.error_rel);
            for field in all().iter() {
                let places = match field.place() {
                    softgrasp_protocol::FieldPlace::Elements => mesh.tets.len(),
                    softgrasp_protocol::FieldPlace::Nodes => mesh.vertices.len(),
                };
                assert_eq!(fields.get(field).unwrap().len(), field.components() * places);
            }
            let first = reference.get_or_insert_with(|| found.clone());
            for field in [Field::ElementStress, Field::NodeStress, Field::NodeVonMises] {
                let (own, other) =
                    (fields.get(field).unwrap(), first.fields[0].get(field).unwrap());
                let most = other.iter().fold(0.0, |most: f64, x| most.max(x.abs()));
                let off = own.iter().zip(other).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
                assert!(off < 1e-6 * most, "{element:?}, {method}, {field}: {off} of {most}");
            }
        }
    }
}

#[test]
fn nobody_is_sent_fields_that_were_not_asked_for() {
    let server = server(2);
    let mut connection = client(&server);
    let mesh = mesh();
    let known = known(&mesh, 1e-3);
    let plain = asked(known.clone(), FieldSet::NONE);
    let bare = answer(&mut connection, Ask::new(body(&mesh, ElementChoice::T4), plain));
    assert!(bare.fields.is_empty());
    // Bits of a later version are passed over, alone and beside others.
    let later = asked(known.clone(), FieldSet::from_bits(1 << 30));
    let found = answer(&mut connection, Ask::new(body(&mesh, ElementChoice::T4), later));
    assert!(found.fields.is_empty());
    let some = FieldSet::from_bits(1 << 30).with(Field::NodeVonMises);
    let found =
        answer(&mut connection, Ask::new(body(&mesh, ElementChoice::T4), asked(known, some)));
    let [fields] = &found.fields[..] else { panic!("{} fields", found.fields.len()) };
    assert_eq!(fields.arrays.len(), 1);
    assert!(fields.error_rel.is_nan() && fields.energy > 0.0);
    assert_eq!(found.displacements, bare.displacements);
}

#[test]
fn kept_models_answer_fields_in_frames_cases_and_at_large_deformation() {
    let server = server(2);
    let mut connection = client(&server);
    let mesh = mesh();
    let upload = UploadModel {
        mesh: mesh.clone(),
        materials: vec![Material { young: 2e4, poisson: 0.4 }],
        element: ElementName::T4,
        fixed: vec![],
    };
    let Ok(Reply::ModelReady(ready)) = connection.ask(&Request::UploadModel(upload)) else {
        panic!("no model")
    };
    let known = known(&mesh, 1e-3);
    let subject = Subject::from(ready.model);
    let nodes = vec![7, 3, 7, 0];
    let mut listed = asked(known.clone(), all());
    listed.want.nodes = NodeChoice::Nodes(nodes.clone());
    let all_nodes = answer(&mut connection, Ask::new(subject.clone(), asked(known.clone(), all())));
    assert_eq!(all_nodes.report.method, "condensed");
    for _ in 0..3 {
        let some = answer(&mut connection, Ask::new(subject.clone(), listed.clone()));
        let (own, whole) = (&some.fields[0], &all_nodes.fields[0]);
        assert_eq!(own.get(Field::ElementStress), whole.get(Field::ElementStress));
        let stress = whole.get(Field::NodeStress).unwrap();
        let chosen: Vec<f64> =
            nodes.iter().flat_map(|&node| stress[6 * node as usize..][..6].to_vec()).collect();
        assert_eq!(own.get(Field::NodeStress).unwrap(), chosen);
    }
    let values = |factor: f64| known.iter().map(|known| factor * known.value).collect();
    let cases = vec![values(-2.0), values(0.5)];
    let several =
        answer(&mut connection, Ask { cases, ..Ask::new(subject.clone(), listed.clone()) });
    let energies: Vec<f64> = several.fields.iter().map(|fields| fields.energy).collect();
    let [first, second, third] = energies[..] else { panic!("{energies:?}") };
    assert!((second / first - 4.0).abs() < 1e-7 && (third / first - 0.25).abs() < 1e-8);
    let large = LargeAsk { deformation: Deformation::Large, ..LargeAsk::default() };
    let found = answer(
        &mut connection,
        Ask { large: Some(large), ..Ask::new(subject.clone(), asked(known.clone(), all())) },
    );
    let (energy, linear) = (found.fields[0].energy, all_nodes.fields[0].energy);
    assert!((energy / linear - 1.0).abs() < 0.2 && energy != linear, "{energy} beside {linear}");
    let auto = LargeAsk { deformation: Deformation::Auto, ..large };
    let little: Vec<DofValue> =
        known.iter().map(|known| DofValue { value: 1e-3 * known.value, ..*known }).collect();
    let found = answer(
        &mut connection,
        Ask { large: Some(auto), ..Ask::new(subject, asked(little, all())) },
    );
    assert!((found.fields[0].energy / (1e-6 * linear) - 1.0).abs() < 0.01);
}

#[test]
fn what_cannot_be_answered_is_refused_with_a_reason() {
    let server = server(2);
    let mut connection = client(&server);
    let mesh = mesh();
    let contact = FieldSet::NONE.with(Field::ContactPressure);
    let question = asked(known(&mesh, 1e-3), contact);
    let request = Request::from(Ask::new(body(&mesh, ElementChoice::T4), question));
    let (code, text) = refusal(&mut connection, &request);
    assert_eq!(code, RejectCode::BadRequest);
    assert!(text.contains("contact_pressure of nodes"), "{text}");
    // More cases than an answer holds fields of.
    let known = known(&mesh, 1e-3);
    let values: Vec<f64> = known.iter().map(|known| known.value).collect();
    let ask = Ask {
        cases: vec![values; 3000],
        ..Ask::new(body(&mesh, ElementChoice::T4), asked(known, all()))
    };
    let (code, text) = refusal(&mut connection, &Request::from(ask));
    assert_eq!(code, RejectCode::TooLarge, "{text}");
    assert!(text.contains("ask for fewer"), "{text}");
}
