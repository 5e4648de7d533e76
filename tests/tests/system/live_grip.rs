//! The first frames of a live grip are answered in time by linear elasticity, which says how far it may
//! be off, while the equilibrium at large deformation is made beside them.

use std::time::Duration;

use glove_client::ask::connection::ServerConnection;
use softgrasp_core::mesh::{BuiltIn, TetMesh};
use softgrasp_protocol::{Answer, Ask, Deformation, LargeAsk, ModelHash, Pace, Reply, Request};
use softgrasp_tests::questions::{object, question, squeeze, upload};

use crate::start::{client, server};

/// Relative error that is asked for.
const WANTED: f64 = 2e-3;

fn ask(connection: &mut ServerConnection, mesh: &TetMesh, ask: LargeAsk, live: bool) -> Answer {
    let mut question = question(squeeze(mesh, 1.5), "auto");
    question.max_error = Some(WANTED);
    question.deadline_ms = live.then_some(5.0);
    let large = LargeAsk { deformation: Deformation::Auto, ..ask };
    let frame = Ask { large: Some(large), ..Ask::new(ModelHash::of(&upload(mesh)), question) };
    match connection.ask(&Request::from(frame)) {
        Ok(Reply::Answer(answer)) => *answer,
        other => panic!("{other:?}"),
    }
}

/// Whether linear elasticity gave the answer.
fn is_linear(answer: &Answer) -> bool {
    answer.large.expect("a report of large deformation").is_linear
}

fn displacements(answer: &Answer) -> Vec<[f64; 3]> {
    answer.displacements.clone().into_f64()
}

#[test]
fn first_frame_of_a_live_grip_does_not_wait_for_the_factor_and_says_what_it_may_be_off_by() {
    let mesh = object(BuiltIn::Strawberry, 300);
    let server = server(2);
    let mut connection = client(&server);
    connection.ask(&Request::UploadModel(upload(&mesh))).unwrap();
    let timely = || LargeAsk { pace: Pace::Timely, ..LargeAsk::default() };
    let first = ask(&mut connection, &mesh, timely(), true);
    let report = &first.report;
    assert!(is_linear(&first));
    assert!(!first.large.unwrap().settled && report.chosen_because.contains("is being prepared"));
    let told = report.error_estimate_rel.expect("an estimate");
    assert!(told > WANTED && report.warnings[0].text.contains("may be off by"), "{report:?}");
    // The frames that follow are the equilibrium's, once it is there.
    let live = (0..500).find_map(|_| {
        std::thread::sleep(Duration::from_millis(10));
        let answer = ask(&mut connection, &mesh, timely(), true);
        (!is_linear(&answer)).then_some(answer)
    });
    let live = live.expect("the path is made");
    // What asks without a deadline, in a session of its own, is the equilibrium from the first frame on.
    let exact = ask(&mut client(&server), &mesh, LargeAsk::default(), false);
    assert!(!is_linear(&exact));
    let size = displacements(&exact).iter().flatten().fold(0.0, |most: f64, u| most.max(u.abs()));
    for answer in [&first, &live] {
        let pairs = displacements(answer).into_iter().flatten().collect::<Vec<_>>();
        let exact = displacements(&exact).into_iter().flatten().collect::<Vec<_>>();
        let off = pairs.iter().zip(&exact).fold(0.0, |most: f64, (a, b)| most.max((a - b).abs()));
        let told = answer.report.error_estimate_rel.expect("an estimate");
        assert!(off <= told * size + WANTED * size, "off by {:e}, told {told:e}", off / size);
    }
}
