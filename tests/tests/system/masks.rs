//! Contacts held by a weighted mean of nodes: right answers, kept sets, clear refusals.

use fea_server::RunningServer;
use glove_client::ask::connection::ServerConnection;
use softgrasp_protocol::RejectCode::{BadRequest, MemoryLimit, RigidMotionFree, UnknownMethod};
use softgrasp_protocol::{
    Answer, Ask, DofValue, ElementChoice, ElementName, Masks, ModelHash, Prefetch, Question,
    RejectCode, Reply, Request, UploadModel,
};
use softgrasp_tests::questions::{MATERIAL, Once, cube, mesh_data, question, upload};

use crate::start::{answer, client, config, refusal, server};

/// Four masks around corners and faces of the cube of 216 nodes; the first two overlap.
const FOUR: [&[(u32, f64)]; 4] = [
    &[(0, 2.0), (1, 1.0), (6, 1.0), (36, 0.5)],
    &[(1, 1.0), (2, 3.0), (7, 1.0)],
    &[(210, 1.0), (211, 1.0), (204, 2.0)],
    &[(35, 1.0), (71, 1.0), (34, 2.0)],
];

fn masks_of(lists: &[&[(u32, f64)]]) -> Masks {
    let mut masks = Masks::default();
    lists.iter().for_each(|list| masks.push(list));
    masks
}

/// Question with the masks, each with its own displacement, and no other known displacements.
fn holding(lists: &[&[(u32, f64)]], method: &str) -> Question {
    let push = |i: usize| [1e-3 * (i as f64).sin(), -2e-3, 1e-3 * (i as f64).cos()];
    Question {
        masks: masks_of(lists),
        mask_displacements: (0..lists.len()).map(push).collect(),
        ..question(Vec::new(), method)
    }
}

struct Scene {
    model: ModelHash,
    connection: ServerConnection,
}

impl Scene {
    fn new(server: &RunningServer, upload: UploadModel) -> Self {
        let mut connection = client(server);
        match connection.ask(&Request::UploadModel(upload)) {
            Ok(Reply::ModelReady(ready)) => Self { model: ready.model, connection },
            other => panic!("the upload got {other:?}"),
        }
    }

    fn ask(&mut self, question: Question) -> Answer {
        let request = self.frame(question);
        answer(&mut self.connection, &request)
    }

    fn frame(&self, question: Question) -> Request {
        Request::from(Ask::new(self.model, question))
    }

    /// Checks that the question is refused with words, and that a valid one is then answered.
    fn refuses(&mut self, question: Question, code: RejectCode, says: &[&str]) {
        let request = self.frame(question);
        let (found, text) = refusal(&mut self.connection, &request);
        assert_eq!(found, code, "{text}");
        for part in says {
            assert!(text.contains(part), "'{part}' is missing in: {text}");
        }
        assert!(!text.contains('\n'), "one line: {text}");
        self.ask(holding(&FOUR, "auto"));
    }
}

#[test]
fn means_are_as_asked_and_forces_balance() {
    let server = server(2);
    let mut scene = Scene::new(&server, upload(&cube(216)));
    for method in ["condensed", "auto"] {
        let asked = holding(&FOUR, method);
        let found = scene.ask(asked.clone());
        assert_eq!(found.report.method, "condensed");
        assert_eq!((found.report.known_dofs, found.report.unknown_dofs), (12, 636));
        assert!(found.report.residual_rel < 1e-11);
        let u = found.displacements.into_f64();
        for (list, q) in FOUR.iter().zip(&asked.mask_displacements) {
            let sum: f64 = list.iter().map(|e| e.1).sum();
            for axis in 0..3 {
                let mean: f64 = list.iter().map(|e| e.1 / sum * u[e.0 as usize][axis]).sum();
                assert!((mean - q[axis]).abs() < 1e-14, "{mean} for {}", q[axis]);
            }
        }
        assert_eq!(found.mask_forces.len(), 4);
        let largest = found.mask_forces.iter().flatten().fold(0.0f64, |m, f| m.max(f.abs()));
        for axis in 0..3 {
            let sum: f64 = found.mask_forces.iter().map(|f| f[axis]).sum();
            assert!(largest > 0.0 && sum.abs() < 1e-10 * largest);
        }
    }
    let said = scene.ask(holding(&FOUR, "auto")).report.chosen_because;
    assert!(said.contains("masks"), "{said}");
}

/// A mask of one node is the same as that node, also where the model fixes nodes; support forces too.
#[test]
fn masks_of_one_node_answer_as_known_displacements_do() {
    let server = server(1);
    let fixed = (0..9).chain(96..99).collect();
    let mut scene = Scene::new(&server, UploadModel { fixed, ..upload(&cube(216)) });
    let nodes = [100u32, 215, 180];
    let lists = nodes.map(|n| [(n, 3.0)]);
    let by_masks = holding(&lists.each_ref().map(|l| l.as_slice()), "condensed");
    let pairs = nodes.iter().zip(&by_masks.mask_displacements);
    let known = pairs.flat_map(|(n, q)| [0, 1, 2].map(|a| (3 * n + a as u32, q[a])));
    let known = known.map(|(dof, value)| DofValue { dof, value }).collect();
    let by_nodes = scene.ask(question(known, "condensed"));
    let by_masks = scene.ask(by_masks);
    let (a, b) = (by_nodes.displacements.into_f64(), by_masks.displacements.into_f64());
    for (a, b) in a.iter().flatten().zip(b.iter().flatten()) {
        assert!((a - b).abs() < 1e-15);
    }
    let force = |dof: u32| by_nodes.reactions.iter().find(|r| r.dof == dof).unwrap().value;
    let largest = by_nodes.reactions.iter().fold(0.0f64, |m, r| m.max(r.value.abs()));
    for (node, mask_force) in nodes.iter().zip(&by_masks.mask_forces) {
        for axis in 0..3 {
            assert!((force(3 * node + axis as u32) - mask_force[axis]).abs() < 1e-9 * largest);
        }
    }
    assert_eq!(by_masks.reactions.len(), 12, "the fixed degrees of freedom");
    for support in &by_masks.reactions {
        assert!((support.value - force(support.dof)).abs() < 1e-9 * largest);
    }
}

/// The force of a mask on a fixed node does not count as the support's force.
#[test]
fn supports_carry_what_the_masks_press() {
    let server = server(1);
    let fixed = (0..9).chain(96..99).collect();
    let mut scene = Scene::new(&server, UploadModel { fixed, ..upload(&cube(216)) });
    let over_fixed: [&[(u32, f64)]; 1] = [&[(1, 1.0), (2, 1.0), (3, 1.0), (4, 2.0)]];
    let found = scene.ask(holding(&over_fixed, "auto"));
    for axis in 0..3 {
        let supports = found.reactions.iter().filter(|r| r.dof % 3 == axis).map(|r| r.value);
        let pressed = found.mask_forces[0][axis as usize];
        assert!(pressed != 0.0 && (supports.sum::<f64>() + pressed).abs() < 1e-9 * pressed.abs());
    }
}

#[test]
fn sets_of_masks_are_kept_by_their_exact_weights() {
    let server = server(1);
    let mut scene = Scene::new(&server, upload(&cube(216)));
    let reused = |scene: &mut Scene, lists: &[&[(u32, f64)]]| {
        scene.ask(holding(lists, "auto")).report.factor_reused
    };
    assert!(!reused(&mut scene, &FOUR));
    assert!(reused(&mut scene, &FOUR));
    let mut other = FOUR;
    other[3] = &[(35, 1.0), (71, 1.0), (34, 2.5)];
    assert!(!reused(&mut scene, &other) && reused(&mut scene, &FOUR));
    assert!(!reused(&mut scene, &FOUR[..3]));
    // Masks and nodes together are another set, too.
    let mut mixed = holding(&FOUR, "auto");
    mixed.known.push(DofValue { dof: 300, value: 1e-3 });
    let report = scene.ask(mixed).report;
    assert!(!report.factor_reused && report.known_dofs == 13);
}

#[test]
fn prefetched_masks_change_no_bit_and_bad_ones_are_passed_over() {
    let bits = |answer: Answer| -> Vec<u64> {
        let u = answer.displacements.into_f64();
        u.iter().flatten().map(|x| x.to_bits()).collect()
    };
    let plain = bits(Scene::new(&server(2), upload(&cube(216))).ask(holding(&FOUR, "auto")));
    let server = server(2);
    let mut scene = Scene::new(&server, upload(&cube(216)));
    let mut masks = masks_of(&[&[], &[(0, -1.0)], &[(999, 1.0)], &[(u32::MAX, f64::NAN)]]);
    masks.append(&masks_of(&FOUR));
    let hint = Prefetch { model: scene.model, nodes: vec![7, 9999], masks };
    scene.connection.send(&Request::Prefetch(hint)).unwrap();
    assert!(bits(scene.ask(holding(&FOUR, "auto"))) == plain);
}

#[test]
fn masks_that_make_no_sense_are_refused_by_number_and_the_session_lives() {
    let server = server(1);
    let mut scene = Scene::new(&server, upload(&cube(216)));
    let mut refuses = |fourth: &[(u32, f64)], says: &[&str]| {
        let lists = [FOUR[0], FOUR[1], FOUR[2], fourth];
        scene.refuses(holding(&lists, "auto"), BadRequest, &[&["mask 3"], says].concat());
    };
    refuses(&[], &["weight above 0"]);
    refuses(&[(7, 0.0), (8, 0.0)], &["weight above 0"]);
    refuses(&[(7, 1.0), (8, -0.5)], &["node 8", "-0.5", "not negative"]);
    refuses(&[(7, f64::NAN)], &["node 7", "NaN", "finite"]);
    refuses(&[(7, f64::INFINITY)], &["node 7", "inf"]);
    refuses(&[(7, 1.0), (8, 1.0), (7, 1.0)], &["node 7", "twice"]);
    refuses(&[(216, 1.0)], &["node 216", "216 nodes"]);
    refuses(&[(u32::MAX, 1.0)], &["node 4294967295"]);
    refuses(FOUR[1], &["says what other", "leave it out"]);
    let mut asked = holding(&FOUR, "auto");
    asked.mask_displacements[2][1] = f64::NAN;
    scene.refuses(asked, BadRequest, &["mask 2", "NaN", "finite"]);
    let mut asked = holding(&FOUR, "auto");
    let node = asked.masks.clone();
    assert_eq!(node.len(), 4);
    asked.masks.push(&[(100, 1.0)]);
    asked.mask_displacements.push([0.0; 3]);
    asked.known = (300..303).map(|dof| DofValue { dof, value: 1e-3 }).collect();
    scene.refuses(asked, BadRequest, &["mask 4", "touched nodes"]);
}

#[test]
fn masks_that_do_not_hold_the_body_are_refused_with_the_motion() {
    let server = server(1);
    let mut scene = Scene::new(&server, upload(&cube(216)));
    let says = ["2 masks", "turn about the axis", "nodes or masks"];
    scene.refuses(holding(&FOUR[2..], "condensed"), RigidMotionFree, &says);
    scene.refuses(holding(&FOUR[..1], "auto"), RigidMotionFree, &["1 mask)"]);
}

#[test]
fn what_cannot_be_condensed_is_refused_with_masks_and_says_what_to_do() {
    let server = server(1);
    let mut scene = Scene::new(&server, upload(&cube(216)));
    for method in ["front", "gauss-jordan", "pcg"] {
        let says = [method, "condensed or auto"];
        scene.refuses(holding(&FOUR, method), BadRequest, &says);
    }
    scene.refuses(holding(&FOUR, "cramers-rule"), UnknownMethod, &["cramers-rule"]);
    let crowd: Vec<[(u32, f64); 1]> = (0..201).map(|n| [(n, 1.0)]).collect();
    let crowd: Vec<&[(u32, f64)]> = crowd.iter().map(|l| l.as_slice()).collect();
    scene.refuses(holding(&crowd, "auto"), BadRequest, &["603", "600", "fixing"]);
    let quadratic = UploadModel { element: ElementName::T10, ..upload(&cube(64)) };
    let mut quadratic = Scene::new(&server, quadratic);
    let request = quadratic.frame(holding(&[FOUR[0]], "auto"));
    let (code, text) = refusal(&mut quadratic.connection, &request);
    assert!(code == BadRequest && text.contains("masks") && text.contains("linear"), "{text}");
}

#[test]
fn masks_larger_than_the_cache_are_told() {
    let small = fea_server::ServerConfig { column_cache: 50_000, ..config(1) };
    let server = fea_server::start(small).unwrap();
    let mut scene = Scene::new(&server, upload(&cube(216)));
    let request = scene.frame(holding(&FOUR, "auto"));
    let (code, text) = refusal(&mut scene.connection, &request);
    assert!(code == MemoryLimit && text.contains("50000") && text.contains("4 touched"), "{text}");
}

#[test]
fn one_request_with_masks_is_condensed_and_carries_its_bound() {
    let server = server(1);
    let mut connection = client(&server);
    let mesh = cube(216);
    let once = Once {
        mesh: mesh_data(&mesh),
        materials: vec![MATERIAL],
        element: ElementName::T4.into(),
        question: holding(&FOUR, "auto"),
    };
    let asked = |question: Question| {
        let once = Once { question, ..once.clone() };
        Request::from(once)
    };
    let found = answer(&mut connection, &asked(holding(&FOUR, "auto")));
    assert_eq!(found.report.method, "condensed");
    let bound = found.report.error_bound_rel.unwrap();
    assert!(bound < 1e-5, "{bound:e}");
    let (code, text) = refusal(&mut connection, &asked(holding(&FOUR, "front")));
    assert!(code == BadRequest && text.contains("condensed or auto"), "{text}");
}

#[test]
fn masks_are_not_forgotten_where_the_element_is_left_open() {
    let server = server(2);
    let mut connection = client(&server);
    let mut by_element = |element| {
        let request = Once {
            mesh: mesh_data(&cube(216)),
            materials: vec![MATERIAL],
            element,
            question: holding(&FOUR, "auto"),
        };
        answer(&mut connection, &Request::from(request))
    };
    let given = by_element(ElementChoice::T4);
    let open = by_element(ElementChoice::Auto);
    assert_eq!(
        (open.report.method.as_str(), open.report.element),
        ("condensed", ElementName::T4.into())
    );
    assert_eq!(open.displacements, given.displacements);
    assert_eq!(open.mask_forces.len(), FOUR.len());
}
