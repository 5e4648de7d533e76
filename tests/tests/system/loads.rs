//! Forces, weight and pressure in frames of a kept model: the answers of one request, their bounds, what is
//! kept, and what is refused.

use glove_client::ask::connection::ServerConnection;
use softgrasp_core::mesh::{Surface, TetMesh};
use softgrasp_protocol::RejectCode::BadRequest;
use softgrasp_protocol::{
    Answer, Ask, DofValue, ElementChoice, ElementName, LargeAsk, Masks, ModelHash, NodeChoice,
    PathChoice, Precision, Question, Reply, Request, SpreadLoads, SurfacePressure, UploadModel,
};
use softgrasp_tests::questions::{Once, cube, once, question, squeeze, upload};

use crate::start::{answer, client, refusal, server};

/// Triangles of the boundary whose corners all lie in the highest tenth.
fn lid(mesh: &TetMesh) -> Vec<[u32; 3]> {
    let (low, high) = mesh.bounds();
    let is_high = |node: &u32| mesh.vertices()[*node as usize].y > high.y - 0.1 * (high.y - low.y);
    let all = Surface::from_mesh(mesh).triangles;
    all.into_iter().filter(|corners| corners.iter().all(is_high)).collect()
}

/// Weight and pressure on the lid.
fn spread(mesh: &TetMesh, turn: f64) -> SpreadLoads {
    SpreadLoads {
        gravity: [9.81 * turn.sin(), -9.81 * turn.cos(), 0.3],
        densities: vec![1100.0],
        pressures: vec![SurfacePressure { pressure: 40.0 + turn, triangles: lid(mesh) }],
    }
}

/// Degrees of freedom of the nodes in the lowest tenth.
fn bottom(mesh: &TetMesh) -> Vec<u32> {
    let (low, high) = mesh.bounds();
    let nodes = (0u32..).zip(mesh.vertices());
    let low = nodes.filter(|(_, p)| p.y < low.y + 0.1 * (high.y - low.y));
    low.flat_map(|(node, _)| 3 * node..3 * node + 3).collect()
}

/// Forces on some nodes that nothing else holds.
fn forces(mesh: &TetMesh, nodes: &[u32], factor: f64) -> Vec<DofValue> {
    let known = squeeze(mesh, 1.0);
    let is_known = |dof: u32| known.iter().any(|known| known.dof == dof);
    let dofs = nodes.iter().flat_map(|node| 3 * node..3 * node + 3).filter(|dof| !is_known(*dof));
    dofs.map(|dof| DofValue { dof, value: factor * (1.7 * f64::from(dof)).sin() }).collect()
}

fn keep(connection: &mut ServerConnection, upload: UploadModel) -> ModelHash {
    match connection.ask(&Request::UploadModel(upload)) {
        Ok(Reply::ModelReady(ready)) => ready.model,
        other => panic!("the upload got {other:?}"),
    }
}

fn apart(a: &Answer, b: &Answer) -> (f64, f64) {
    let (a, b) = (a.displacements.clone().into_f64(), b.displacements.clone().into_f64());
    let pairs = a.as_flattened().iter().zip(b.as_flattened());
    let apart = pairs.map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt();
    (apart, b.as_flattened().iter().map(|b| b * b).sum::<f64>().sqrt())
}

fn assert_same_reactions(a: &Answer, b: &Answer) {
    let largest = b.reactions.iter().fold(0.0f64, |most, r| most.max(r.value.abs()));
    assert_eq!(a.reactions.len(), b.reactions.len());
    for (a, b) in a.reactions.iter().zip(&b.reactions) {
        assert_eq!(a.dof, b.dof);
        assert!((a.value - b.value).abs() < 1e-8 * largest, "{a:?} and {b:?}");
    }
}

#[test]
fn frames_with_loads_are_the_answers_of_one_request_within_their_bound() {
    let server = server(2);
    let mut connection = client(&server);
    let mesh = cube(343);
    let few = forces(&mesh, &[170, 171], 0.02);
    let many = forces(&mesh, &(120..200).collect::<Vec<u32>>(), 0.002);
    for (element, choice) in
        [(ElementName::T4, ElementChoice::T4), (ElementName::T4Anp, ElementChoice::T4Anp)]
    {
        for fixed in [Vec::new(), bottom(&mesh)] {
            let model = UploadModel { element, fixed: fixed.clone(), ..upload(&mesh) };
            let model = keep(&mut connection, model);
            let mut known = squeeze(&mesh, 0.3);
            known.retain(|known| fixed.binary_search(&known.dof).is_err());
            for (spread, forces) in [
                (spread(&mesh, 0.4), few.clone()),
                (SpreadLoads::default(), few.clone()),
                (SpreadLoads::default(), many.clone()),
                (spread(&mesh, 0.4), Vec::new()),
            ] {
                let asked = Question { spread, forces, ..question(known.clone(), "auto") };
                let frame = Request::from(Ask::new(model, asked.clone()));
                let found = answer(&mut connection, &frame);
                assert_eq!(found.report.method, "condensed", "{}", found.report.chosen_because);
                let whole = squeeze(&mesh, 0.3);
                let whole = Question { known: whole, method: "front".parse().unwrap(), ..asked };
                let whole = Once { element: choice, question: whole, ..once(&mesh, "front") };
                let expected = answer(&mut connection, &whole.into());
                let (apart, size) = apart(&found, &expected);
                assert!(apart < 1e-9 * size, "{apart:e} of {size:e}");
                if let Some(bound) = found.report.error_bound_rel {
                    assert!(apart <= bound * size && bound < 1e-3, "{apart:e}, bound {bound:e}");
                }
                assert_same_reactions(&found, &expected);
            }
        }
    }
}

#[test]
fn a_bound_is_proven_for_an_answer_with_loads_or_a_reason_is_said() {
    let server = server(2);
    let mut connection = client(&server);
    let mesh = cube(216);
    let asked =
        Question { spread: spread(&mesh, 0.2), ..question(squeeze(&mesh, 0.2), "condensed") };
    // One request waits for the proof.
    let once = Once { question: asked.clone(), ..once(&mesh, "condensed") };
    let found = answer(&mut connection, &once.into());
    assert_eq!(found.report.method, "condensed");
    let bound = found.report.error_bound_rel.unwrap();
    assert!(bound > 0.0 && bound < 1e-5 && found.report.error_bound_why.is_none(), "{bound:e}");
    // Nothing is known and nothing acts: a body that stays.
    let fixed = UploadModel { fixed: bottom(&mesh), ..upload(&mesh) };
    let model = keep(&mut connection, fixed);
    let still = answer(&mut connection, &Ask::new(model, question(Vec::new(), "auto")).into());
    assert!(still.report.error_bound_rel.is_none() && still.report.error_bound_why.is_some());
    let hanging = Question { spread: asked.spread, ..question(Vec::new(), "auto") };
    let found = answer(&mut connection, &Ask::new(model, hanging).into());
    assert!(found.report.error_bound_rel.is_some() || found.report.error_bound_why.is_some());
    assert!(found.displacements.into_f64().as_flattened().iter().any(|u| *u != 0.0));
}

/// Other amounts of the same loads cost no solve and go the short way; other loads are made once.
#[test]
fn loads_are_kept_and_other_amounts_of_them_are_products() {
    let server = server(2);
    let mut connection = client(&server);
    let mesh = cube(343);
    let model = keep(&mut connection, upload(&mesh));
    let nodes = NodeChoice::Nodes(vec![0, 7, 170, 342]);
    for tick in 0..6 {
        let turn = 0.1 * f64::from(tick);
        let mut asked = question(squeeze(&mesh, 0.2 + 0.01 * turn), "auto");
        asked.want.nodes = nodes.clone();
        asked.want.precision = Precision::F32Quantised;
        asked.spread = spread(&mesh, turn);
        asked.forces = forces(&mesh, &[170], turn);
        let found = answer(&mut connection, &Ask::new(model, asked.clone()).into());
        assert_eq!(found.report.factor_reused, tick > 0, "tick {tick}");
        let mut whole = Once { question: asked, ..once(&mesh, "front") };
        whole.question.method = "front".parse().unwrap();
        let expected = answer(&mut connection, &whole.into());
        let (apart, size) = apart(&found, &expected);
        assert!(apart < 1e-6 * size, "{apart:e} of {size:e}");
    }
    // Without loads the frame is that of a model that never had any.
    let plain = |connection: &mut ServerConnection| {
        let asked = question(squeeze(&mesh, 0.2), "auto");
        answer(connection, &Ask::new(model, asked).into())
    };
    let after = plain(&mut connection);
    let fresh = crate::start::server(1);
    let mut other = client(&fresh);
    assert_eq!(keep(&mut other, upload(&mesh)), model);
    let before = plain(&mut other);
    assert_eq!(after.displacements, before.displacements);
    assert_eq!(after.reactions, before.reactions);
}

#[test]
fn masks_and_loads_hold_a_body_together() {
    let server = server(2);
    let mut connection = client(&server);
    let mesh = cube(216);
    let model = keep(&mut connection, upload(&mesh));
    let mut masks = Masks::default();
    for nodes in [[0, 1, 6], [5, 4, 11], [210, 211, 204]] {
        masks.push(&nodes.map(|node| (node, 1.0)));
    }
    let asked = Question {
        mask_displacements: vec![[1e-4, 0.0, 0.0], [0.0, 2e-4, 0.0], [0.0; 3]],
        masks,
        spread: spread(&mesh, 0.0),
        forces: vec![DofValue { dof: 300, value: 0.01 }],
        ..question(Vec::new(), "auto")
    };
    let found = answer(&mut connection, &Ask::new(model, asked.clone()).into());
    assert_eq!(found.report.method, "condensed");
    // What draws the body down is what the masks hold it by.
    let volume: f64 = (0..mesh.tets().len()).map(|tet| mesh.signed_volume(tet).abs()).sum();
    let area: f64 = lid(&mesh)
        .iter()
        .map(|corners| {
            let [a, b, c] = corners.map(|node| mesh.vertices()[node as usize]);
            0.5 * (b - a).cross(&(c - a)).norm()
        })
        .sum();
    let down = 9.81 * 1100.0 * volume + 40.0 * area;
    let held: f64 = found.mask_forces.iter().map(|force| force[1]).sum();
    assert!((held - down).abs() < 1e-9 * down, "{held} N for {down} N");
    let along: f64 = found.mask_forces.iter().map(|force| force[0]).sum();
    assert!((along + 0.01).abs() < 1e-9, "{along} N");
}

#[test]
fn large_frames_and_large_requests_take_the_same_loads() {
    let server = server(2);
    let mut connection = client(&server);
    let mesh = cube(125);
    let large = LargeAsk { path: PathChoice::FromRest, ..LargeAsk::default() };
    for (element, choice) in
        [(ElementName::T4, ElementChoice::T4), (ElementName::T10, ElementChoice::T10)]
    {
        let model = UploadModel { element, fixed: bottom(&mesh), ..upload(&mesh) };
        let model = keep(&mut connection, model);
        let mut spread = spread(&mesh, 0.5);
        spread.pressures[0].pressure = 2000.0;
        let fixed = bottom(&mesh).into_iter().map(|dof| DofValue { dof, value: 0.0 }).collect();
        let asked = Question { spread, ..question(Vec::new(), "auto") };
        let frame = Ask { large: Some(large), ..Ask::new(model, asked.clone()) };
        let found = answer(&mut connection, &frame.into());
        assert!(!found.large.unwrap().is_linear);
        let whole = Once {
            element: choice,
            question: Question { known: fixed, ..asked.clone() },
            ..once(&mesh, "auto")
        };
        let whole = Ask { large: Some(large), ..Ask::from(whole) };
        let expected = answer(&mut connection, &whole.into());
        let (off, size) = apart(&found, &expected);
        assert!(off < 1e-6 * size, "{off:e} of {size:e}");
        // The pressed body is not the linear one, and its supports carry all of the loads.
        let linear = answer(&mut connection, &Ask::new(model, asked).into());
        assert!(apart(&found, &linear).0 > 1e-3 * size);
        for (a, b) in [(&found, &expected), (&found, &linear)] {
            for axis in 0..3 {
                let sum = |answer: &Answer| {
                    let of_axis = answer.reactions.iter().filter(|r| r.dof % 3 == axis);
                    of_axis.map(|reaction| reaction.value).sum::<f64>()
                };
                let scale = sum(b).abs().max(1e-3);
                assert!((sum(a) - sum(b)).abs() < 1e-6 * scale, "{} and {}", sum(a), sum(b));
            }
        }
    }
}

#[test]
fn a_path_at_large_deformation_follows_loads_that_change() {
    let server = server(2);
    let mut connection = client(&server);
    let mesh = cube(125);
    let model = UploadModel { fixed: bottom(&mesh), ..upload(&mesh) };
    let model = keep(&mut connection, model);
    let ask = |path: PathChoice, turn: f64| {
        let mut spread = spread(&mesh, turn);
        spread.pressures[0].pressure = 1500.0 * (1.0 + turn);
        let large = LargeAsk { path, ..LargeAsk::default() };
        let asked = Question { spread, ..question(Vec::new(), "auto") };
        Request::from(Ask { large: Some(large), ..Ask::new(model, asked) })
    };
    for tick in 0..4 {
        let turn = 0.2 * f64::from(tick);
        let followed = answer(&mut connection, &ask(PathChoice::Continue, turn));
        let mut other = client(&server);
        let found = answer(&mut other, &ask(PathChoice::FromRest, turn));
        let (off, size) = apart(&followed, &found);
        assert!(off < 1e-6 * size, "tick {tick}: {off:e} of {size:e}");
    }
}

/// What makes loads that do not fit of those that do.
type Change = fn(&mut SpreadLoads);

#[test]
fn loads_that_do_not_fit_are_refused_and_the_session_lives() {
    let server = server(1);
    let mut connection = client(&server);
    let mesh = cube(64);
    let model = keep(&mut connection, upload(&mesh));
    let known = squeeze(&mesh, 0.2);
    let sound = Question { spread: spread(&mesh, 0.0), ..question(known, "auto") };
    let changes: [(Change, &str); 6] = [
        (|s| s.pressures[0].triangles.push([0, 1, 64]), "no face of the boundary"),
        (|s| s.pressures[0].triangles = vec![[0, 0, 0]], "no face of the boundary"),
        (|s| s.pressures[0].pressure = f64::NAN, "the pressure is NaN"),
        (|s| s.densities = vec![1.0, 2.0], "2 densities"),
        (|s| s.densities = vec![-1.0], "density is -1"),
        (|s| s.gravity[1] = f64::INFINITY, "acceleration is inf"),
    ];
    for (change, says) in changes {
        for method in ["auto", "condensed", "front"] {
            let mut asked = Question { method: method.parse().unwrap(), ..sound.clone() };
            change(&mut asked.spread);
            let whole = Once { question: asked.clone(), ..once(&mesh, "auto") };
            for request in [Ask::new(model, asked).into(), Request::from(whole)] {
                let (code, text) = refusal(&mut connection, &request);
                assert!(code == BadRequest && text.contains(says), "{code:?}: {text}");
            }
        }
    }
    answer(&mut connection, &Ask::new(model, sound).into());
}
