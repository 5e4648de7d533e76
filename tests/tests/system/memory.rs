//! Memory: predicted and counted before it is taken, refused with numbers; the session lives on.

use fea_server::ServerConfig;
use glove_client::ask::connection::{LinkError, ServerConnection};
use softgrasp_core::mesh::{BuiltIn, TetMesh};
use softgrasp_core::model::{Element, Model};
use softgrasp_core::solve::memory::Need;
use softgrasp_core::solve::{Analysed, Method};
use softgrasp_protocol::RejectCode::MemoryLimit;
use softgrasp_protocol::{
    Answer, DofValue, ElementChoice, MeshData, ModelHash, Rejected, Reply, Request,
};
use softgrasp_tests::questions::{
    METHODS, Once, cube, frame, object, once, question, squeeze, upload,
};

use crate::start::{answer, client, config, refusal};

/// Counted memory needs of the squeezed mesh by `front` and `front-mixed`.
pub fn counted(mesh: &TetMesh, element: Element) -> [Need; 2] {
    counted_for(mesh, element, squeeze(mesh, 1.0).iter().map(|known| known.dof).collect())
}

fn counted_for(mesh: &TetMesh, element: Element, dofs: Vec<u32>) -> [Need; 2] {
    let material = softgrasp_core::fem::Material::try_new(1.0e5, 0.3).unwrap();
    let model = Model::try_new(mesh.clone(), element, &[material], vec![], &mut |_| {}).unwrap();
    let analysed: Analysed = model.analyse(&dofs, &mut |_| {}).unwrap();
    let blocks = model.stiffness().pattern().block_count();
    [Method::Front, Method::FrontMixed].map(|method| {
        let (way, held) = (method, model.bytes() as u64);
        Need::counted(element, way, held, blocks, analysed.analysis())
    })
}

fn within(memory_limit: u64) -> ServerConfig {
    ServerConfig { memory_limit, ..config(2) }
}

fn ask(connection: &mut ServerConnection, request: Once) -> Answer {
    answer(connection, &Request::from(request))
}

fn refused(connection: &mut ServerConnection, request: &Request) -> Rejected {
    match connection.ask(request) {
        Err(LinkError::Rejected(rejected)) => rejected,
        other => panic!("{:?} got {other:?}", request.kind()),
    }
}

#[test]
fn every_method_is_held_against_the_limit_and_the_session_lives() {
    let mesh = object(BuiltIn::Strawberry, 1000);
    let small = once(&cube(27), "auto");
    let server = fea_server::start(within(1 << 20)).unwrap();
    let mut connection = client(&server);
    for method in METHODS {
        let request = Request::from(once(&mesh, method));
        let Rejected { code, text, detail, .. } = refused(&mut connection, &request);
        assert_eq!(code, MemoryLimit, "{method}: {text}");
        for part in [method, "1.0 MiB", "1000 nodes", "--memory-limit", "fewer nodes", "allow"] {
            assert!(text.contains(part), "'{part}' is missing in: {text}");
        }
        assert!(detail.contains("limit_bytes=1048576") && detail.contains("factor_bytes="));
        assert!(!text.contains('\n'));
        ask(&mut connection, small.clone());
    }
    let mut quadratic = once(&mesh, "auto");
    quadratic.element = ElementChoice::T10;
    let (code, text) = refusal(&mut connection, &Request::from(quadratic));
    assert!(code == MemoryLimit && text.contains("front on t10"), "{text}");
    let (code, text) = refusal(&mut connection, &Request::UploadModel(upload(&mesh)));
    assert!(code == MemoryLimit && text.contains("condensed on t4"), "{text}");
    ask(&mut connection, small);
}

#[test]
fn hopeless_mesh_is_refused_from_its_size_before_it_is_looked_at() {
    // No element of it has a volume, which would be the next thing to be refused.
    let nodes = 160_000u32;
    let tets = (0..900_000).map(|t| [0, 1, 2, 3].map(|c| (t + c) % nodes)).collect();
    let vertices = (0..nodes).map(|n| [f64::from(n), 0.0, 0.0]).collect();
    let mesh = MeshData { vertices, tets, ..MeshData::default() };
    let server = fea_server::start(within(1 << 29)).unwrap();
    let mut connection = client(&server);
    let mut request = once(&cube(27), "auto");
    request.mesh = mesh;
    let (code, text) = refusal(&mut connection, &Request::from(request));
    assert_eq!(code, MemoryLimit);
    for part in ["160000 nodes", "900000 tetrahedra", "front on t4", "front-mixed on t4", "GiB"] {
        assert!(text.contains(part), "'{part}' is missing in: {text}");
    }
    assert!(text.contains("predicted"), "{text}");
}

#[test]
fn auto_takes_single_precision_where_only_that_fits() {
    let mesh = object(BuiltIn::Sphere, 1500);
    let [double, single] = counted(&mesh, Element::Tet4).map(|need| need.bytes());
    let exact = ask(&mut client(&fea_server::start(within(8 << 30)).unwrap()), once(&mesh, "auto"));
    assert_eq!(exact.report.method, "front");
    let server = fea_server::start(within((double + single) / 2)).unwrap();
    let mut connection = client(&server);
    let found = ask(&mut connection, once(&mesh, "auto"));
    assert_eq!(found.report.method, "front-mixed");
    assert!(found.report.chosen_because.contains("larger than the memory allowed"));
    let (exact, found) = (exact.displacements.into_f64(), found.displacements.into_f64());
    let pairs = || exact.iter().flatten().zip(found.iter().flatten());
    let off = pairs().map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    let size = pairs().map(|(a, _)| a.abs()).fold(0.0, f64::max);
    assert!(size > 0.0 && off <= 1e-9 * size, "{off:e} of {size:e}");
    // Asked for by name it is refused, by its count, and told what would fit.
    let front = Request::from(once(&mesh, "front"));
    let (code, text) = refusal(&mut connection, &front);
    assert_eq!(code, MemoryLimit);
    assert!(text.contains("front on t4 needs") && !text.contains("predicted"), "{text}");
    // With a deadline the choice is among what fits.
    let mut hurried = once(&mesh, "auto");
    hurried.question.deadline_ms = Some(1e7);
    assert_eq!(ask(&mut connection, hurried).report.method, "front-mixed");
}

#[test]
fn auto_answers_without_a_factor_where_no_factor_fits() {
    let mesh = object(BuiltIn::Sphere, 20_000);
    let [_, single] = counted(&mesh, Element::Tet4).map(|need| need.bytes());
    let server = fea_server::start(within(single - single / 8)).unwrap();
    let mut connection = client(&server);
    let found = ask(&mut connection, once(&mesh, "auto")).report;
    assert_eq!(found.method, "multigrid", "{}", found.chosen_because);
    let told = found.error_estimate_rel.expect("an estimate");
    assert!(found.residual_rel < 1e-9 && told < 1e-6, "{found:?}");
    // Asked for by name a factor is refused as ever.
    let single = Request::from(once(&mesh, "front-mixed"));
    assert_eq!(refusal(&mut connection, &single).0, MemoryLimit);
}

#[test]
fn frames_go_to_single_precision_where_no_base_fits_and_keep_that_factor() {
    let mesh = object(BuiltIn::Sphere, 1500);
    let [double, single] = counted(&mesh, Element::Tet4).map(|need| need.bytes());
    let server = fea_server::start(within((double + single) / 2)).unwrap();
    let mut connection = client(&server);
    let ready = connection.ask(&Request::UploadModel(upload(&mesh))).unwrap();
    assert!(matches!(ready, Reply::ModelReady(_)));
    let request = Request::from(frame(&mesh, 1.0, "auto"));
    let first = answer(&mut connection, &request).report;
    assert_eq!(first.method, "front-mixed");
    assert!(first.chosen_because.contains("not condensed"), "{}", first.chosen_because);
    let second = answer(&mut connection, &request).report;
    assert!(second.factor_reused && !first.factor_reused);
    let (code, text) = refusal(&mut connection, &Request::from(frame(&mesh, 1.0, "condensed")));
    assert!(code == MemoryLimit && text.contains("condensed: the base factor"), "{text}");
    let (code, text) = refusal(&mut connection, &Request::from(frame(&mesh, 1.0, "front")));
    assert!(code == MemoryLimit && text.contains("front on t4 needs"), "{text}");
    assert!(answer(&mut connection, &request).report.factor_reused);
}

/// `auto` may take another method where memory is short; the answer says so, and the method that it
/// names gives those very bits on a server with more memory.
#[test]
fn a_method_that_is_named_gives_the_same_bits_whatever_memory_the_server_has() {
    let mesh = object(BuiltIn::Sphere, 1500);
    let [double, single] = counted(&mesh, Element::Tet4).map(|need| need.bytes());
    let [small, large] = [(double + single) / 2, 8 << 30].map(|limit| {
        let server = fea_server::start(within(limit)).unwrap();
        let mut connection = client(&server);
        connection.ask(&Request::UploadModel(upload(&mesh))).unwrap();
        (server, connection)
    });
    let (_small_server, mut small) = small;
    let (_large_server, mut large) = large;
    let by_auto = Request::from(frame(&mesh, 1.0, "auto"));
    let tight = answer(&mut small, &by_auto);
    let roomy = answer(&mut large, &by_auto);
    assert_eq!((&*tight.report.method, &*roomy.report.method), ("front-mixed", "condensed"));
    assert_ne!(tight.report.chosen_because, roomy.report.chosen_because);
    assert_ne!(tight.displacements, roomy.displacements, "rounding differs, as the page says");
    let named = answer(&mut large, &Request::from(frame(&mesh, 1.0, &tight.report.method)));
    assert_eq!(named.displacements, tight.displacements);
}

#[test]
fn kept_models_make_room_for_a_request_that_needs_it() {
    let (kept, large) = (cube(343), object(BuiltIn::Sphere, 1500));
    let [double, _] = counted(&large, Element::Tet4).map(|need| need.bytes());
    let server = fea_server::start(within(double + (1 << 10))).unwrap();
    let mut connection = client(&server);
    connection.ask(&Request::UploadModel(upload(&kept))).unwrap();
    let known = Request::HaveModel(ModelHash::of(&upload(&kept)));
    assert_eq!(connection.ask(&known).unwrap(), Reply::ModelState { known: true });
    // While the server still proves the bound of the kept model, that work holds its memory.
    let made_room = (0..200).any(|_| {
        let took = ask(&mut connection, once(&large, "auto")).report.method;
        took == "front" || {
            std::thread::sleep(std::time::Duration::from_millis(20));
            false
        }
    });
    assert!(made_room, "the kept model never made room");
    assert_eq!(connection.ask(&known).unwrap(), Reply::ModelState { known: false });
}

#[test]
fn proof_of_the_bound_is_left_out_where_it_does_not_fit() {
    let mesh = cube(343);
    let (low, high) = mesh.bounds();
    let is_end = |p: f64, low: f64, high: f64| p <= low || p >= high;
    let corners = (0u32..).zip(mesh.vertices()).filter(|(_, p)| {
        is_end(p.x, low.x, high.x) && is_end(p.y, low.y, high.y) && is_end(p.z, low.z, high.z)
    });
    let known: Vec<DofValue> = corners
        .flat_map(|(node, _)| 3 * node..3 * node + 3)
        .map(|dof| DofValue { dof, value: 1e-4 * f64::from(dof % 7) })
        .collect();
    let with = |limit: u64| {
        let server = fea_server::start(within(limit)).unwrap();
        let mut request = once(&mesh, "condensed");
        request.question = question(known.clone(), "condensed");
        ask(&mut client(&server), request).report
    };
    assert!(with(8 << 30).error_bound_rel.is_some());
    // The base's factor, of nearly all degrees of freedom, and an eighth: not a second factor.
    let held = known.iter().take(9).map(|known| known.dof).collect();
    let [double, _] = counted_for(&mesh, Element::Tet4, held).map(|need| need.bytes());
    let tight = with(double + double / 8);
    assert_eq!(tight.method, "condensed");
    assert_eq!(tight.error_bound_rel, None);
    assert!(tight.residual_rel < 1e-9);
}
