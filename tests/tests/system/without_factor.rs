//! Models whose factor does not fit the server's memory, in either precision: frames, contact frames and large
//! deformation are answered by multigrid, say so, and agree with a server that has the memory.

use fea_server::{RunningServer, ServerConfig};
use softgrasp_core::mesh::{BuiltIn, TetMesh};
use softgrasp_core::model::Element;
use softgrasp_protocol::RejectCode::{BadRequest, MemoryLimit};
use softgrasp_protocol::{
    Answer, Ask, ContactAnswer, Deformation, DofValue, LargeAsk, ModelHash, PathChoice, Reply,
    Request,
};
use softgrasp_tests::questions::{frame, object, once, question, upload};

use crate::contact_frames::{played_in, played_of, scene_of};
use crate::memory::counted;
use crate::start::{answer, client, config, refusal};

const NODES: usize = 8000;

fn sphere() -> TetMesh {
    object(BuiltIn::Sphere, NODES)
}

/// A server with seven eighths of the memory that a factor in single precision takes.
fn tight(mesh: &TetMesh) -> RunningServer {
    let [_, single] = counted(mesh, Element::Tet4).map(|need| need.bytes());
    fea_server::start(ServerConfig { memory_limit: single - single / 8, ..config(2) }).unwrap()
}

fn roomy() -> RunningServer {
    fea_server::start(config(2)).unwrap()
}

/// Frame question about six nodes far apart, five of them moved.
fn gripped(mesh: &TetMesh, push: f64, method: &str) -> Ask {
    let step = mesh.node_count() as u32 / 6;
    let known = (0..6).flat_map(|k| {
        (0..3).map(move |axis| DofValue {
            dof: 3 * k * step + axis,
            value: 1e-3 * push * f64::from(k * (axis + 1) % 5),
        })
    });
    Ask::new(ModelHash::of(&upload(mesh)), question(known.collect(), method))
}

/// Euclidean norm of what two answers differ by, over that of the second.
fn off(a: &Answer, b: &Answer) -> f64 {
    let (a, b) = (a.displacements.clone().into_f64(), b.displacements.clone().into_f64());
    let (a, b) = (a.as_flattened(), b.as_flattened());
    let norm = |v: &mut dyn Iterator<Item = f64>| v.map(|x| x * x).sum::<f64>().sqrt();
    norm(&mut a.iter().zip(b).map(|(a, b)| a - b)) / norm(&mut b.iter().copied())
}

#[test]
fn frames_of_a_model_too_large_to_factor_come_from_columns_by_multigrid() {
    let mesh = sphere();
    let servers = [tight(&mesh), roomy()];
    let [small, large] = servers.each_ref().map(|server| {
        let mut connection = client(server);
        let ready = connection.ask(&Request::UploadModel(upload(&mesh))).unwrap();
        assert!(matches!(ready, Reply::ModelReady(_)), "{ready:?}");
        connection
    });
    let (mut small, mut large) = (small, large);
    for (tick, push) in [0.4, 1.0].into_iter().enumerate() {
        let asked = Request::from(gripped(&mesh, push, "auto"));
        let (found, exact) = (answer(&mut small, &asked), answer(&mut large, &asked));
        let report = &found.report;
        assert_eq!((&*report.method, &*exact.report.method), ("condensed", "condensed"));
        assert!(report.chosen_because.contains("conjugate gradients with multigrid"), "{report:?}");
        assert!(report.error_bound_rel.is_none());
        let why = report.error_bound_why.as_deref().unwrap();
        assert!(why.contains("no bound is proven"), "{why}");
        let (error, told) = (off(&found, &exact), report.error_estimate_rel.unwrap());
        assert!(error <= told && told < 1e-6, "off by {error:e}, told {told:e}");
        assert!(report.residual_rel < 1e-9, "{report:?}");
        assert_eq!(report.factor_reused, tick > 0, "columns are kept");
    }
    // Other nodes, with a load beside them.
    let mut other = gripped(&mesh, 0.3, "auto");
    other.question.known.drain(..3);
    other.question.forces = vec![DofValue { dof: 3 * 4000 + 1, value: -0.2 }];
    let asked = Request::from(other);
    let (found, exact) = (answer(&mut small, &asked), answer(&mut large, &asked));
    let told = found.report.error_estimate_rel.unwrap();
    assert!(off(&found, &exact) <= told && told < 1e-6, "{told:e}");
    // By name a factor is refused as ever, and nothing else is asked for by another name.
    let front = Request::from(frame(&mesh, 1.0, "front"));
    assert_eq!(refusal(&mut small, &front).0, MemoryLimit);
}

#[test]
fn contact_frames_of_a_model_too_large_to_factor_press_and_weigh_as_with_a_factor() {
    let mesh = object(BuiltIn::Strawberry, NODES);
    let [found, exact] = [tight(&mesh), roomy()].map(|server| played_of(&server, &mesh, 5));
    for (step, (found, exact)) in found.iter().zip(&exact).enumerate() {
        assert!(found.answer.report.residual_rel < 1e-9, "step {step}");
        let close = |a: f64, b: f64, of: f64| (a - b).abs() <= 1e-5 * of.max(1e-9);
        for (found, exact) in found.loads.iter().zip(&exact.loads) {
            let size = exact.normal_force.abs().max(1e-3);
            assert!((0..3).all(|k| close(found.force[k], exact.force[k], size)), "step {step}");
        }
        let off = off(&found.answer, &exact.answer);
        assert!(off < 1e-5, "step {step}: {off:e}");
    }
    assert!(exact.last().unwrap().loads[0].normal_force > 0.0, "it lies on the table");
}

/// `auto` stays with linear elasticity where large deformation cannot be, and warns where that is too little.
#[test]
fn contact_by_auto_goes_on_linear_and_warns_where_no_factor_fits() {
    let mesh = object(BuiltIn::Strawberry, NODES);
    let [without, with] = [tight(&mesh), roomy()].map(|server| {
        let mut connection = client(&server);
        let scene = scene_of(&mut connection, mesh.clone(), Some(Deformation::Auto));
        played_in(&mut connection, &scene, 5).pop().unwrap()
    });
    let warned = |answer: &ContactAnswer| {
        let texts = answer.answer.report.warnings.iter().map(|warning| warning.text.as_str());
        texts.into_iter().any(|text| text.contains("linear elasticity answers"))
    };
    assert!(!without.contact.is_large && warned(&without), "{:?}", without.answer.report);
    assert!(with.contact.is_large && !warned(&with), "{:?}", with.answer.report);
}

#[test]
fn contact_at_large_deformation_is_refused_in_a_sentence_where_no_factor_fits() {
    let mesh = object(BuiltIn::Strawberry, NODES);
    let server = tight(&mesh);
    let mut connection = client(&server);
    let scene = scene_of(&mut connection, mesh.clone(), Some(Deformation::Large));
    let asked =
        scene.frame(softgrasp_protocol::ObjectState::at_rest([0., 0., 0., 1., 0., 0., 0.]), 9);
    let (_, text) = refusal(&mut connection, &Request::ContactFrame(Box::new(asked)));
    assert!(text.contains("takes a factor of the base, which does not fit the memory"), "{text}");
    // The session lives.
    answer(&mut connection, &Request::from(frame(&mesh, 1.0, "auto")));
}

#[test]
fn large_deformation_without_room_for_a_factor_is_found_by_multigrid() {
    let mesh = sphere();
    let (tight, roomy) = (tight(&mesh), roomy());
    let large = LargeAsk { deformation: Deformation::Large, ..LargeAsk::default() };
    let asked = |method: &str| {
        let whole = Ask { large: Some(large), ..Ask::from(once(&mesh, method)) };
        Request::from(whole)
    };
    let (mut small, mut large_memory) = (client(&tight), client(&roomy));
    let exact = answer(&mut large_memory, &asked("front"));
    let found = answer(&mut small, &asked("auto"));
    assert!(found.report.chosen_because.contains("by conjugate gradients with multigrid"));
    assert!(found.large.as_ref().unwrap().settled, "{:?}", found.large);
    assert!(off(&found, &exact) < 1e-8, "{:e}", off(&found, &exact));
    // By name: where there is room for a factor too.
    let named = answer(&mut large_memory, &asked("multigrid"));
    assert!(off(&named, &exact) < 1e-8 && !named.report.chosen_because.contains("too short"));
    let (code, text) = refusal(&mut small, &asked("front-mixed"));
    assert!(code == MemoryLimit && text.contains("front-mixed on t4"), "{text}");
    // Frames go on from a factor, which is kept.
    let from_rest = LargeAsk { path: PathChoice::FromRest, ..large };
    let kept = Ask { large: Some(from_rest), ..frame(&mesh, 0.3, "multigrid") };
    large_memory.ask(&Request::UploadModel(upload(&mesh))).unwrap();
    let (code, text) = refusal(&mut large_memory, &Request::from(kept));
    assert!(code == BadRequest && text.contains("multigrid cannot"), "{text}");
}
