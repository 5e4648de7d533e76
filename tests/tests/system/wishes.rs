//! Deadline, error budget and choice of the element: what `auto` chooses for them, and what the
//! report says when they cannot be kept.

use fea_server::ServerConfig;
use glove_client::ask::connection::ServerConnection;
use softgrasp_core::mesh::{BuiltIn, TetMesh};
use softgrasp_protocol::RejectCode::BadRequest;
use softgrasp_protocol::{
    Answer, Ask, DofValue, ElementChoice, ElementName, LargeAsk, Material, Reply, Request,
    UploadModel,
};
use softgrasp_tests::questions::{METHODS, Once, cube, frame, object, once, upload};

use crate::start::{answer, client, config, refusal, server};

fn ask(connection: &mut ServerConnection, change: impl Fn(&mut Once), mesh: &TetMesh) -> Answer {
    let mut request = once(mesh, "auto");
    change(&mut request);
    answer(connection, &Request::from(request))
}

fn norm(u: &[[f64; 3]]) -> f64 {
    u.iter().flatten().map(|x| x * x).sum::<f64>().sqrt()
}

fn error_rel(found: Answer, exact: &[[f64; 3]]) -> f64 {
    let found = found.displacements.into_f64();
    let difference: Vec<[f64; 3]> =
        found.iter().zip(exact).map(|(a, b)| [a[0] - b[0], a[1] - b[1], a[2] - b[2]]).collect();
    norm(&difference) / norm(exact)
}

fn warned(answer: &Answer, text: &str) -> bool {
    answer.report.warnings.iter().any(|warning| warning.text.contains(text))
}

#[test]
fn error_budget_is_kept_and_may_cost_less_than_exactness() {
    let server = server(2);
    let mut connection = client(&server);
    for mesh in [cube(216), object(BuiltIn::Strawberry, 1000)] {
        let exact = ask(&mut connection, |_| {}, &mesh);
        assert_eq!(exact.report.method, "front");
        let exact = exact.displacements.into_f64();
        for budget in [1e-2, 1e-4, 1e-8, 1e-12] {
            let found = ask(&mut connection, |r| r.question.max_error = Some(budget), &mesh);
            let report = &found.report;
            assert!(report.residual_rel <= budget, "{budget:e}: {:e}", report.residual_rel);
            assert!(report.chosen_because.contains("predicted"), "{}", report.chosen_because);
            assert!(!warned(&found, "given up"));
            let error = error_rel(found, &exact);
            assert!(error <= budget.max(1e-11), "{budget:e}: {error:e}");
        }
    }
}

#[test]
fn deadline_that_is_far_gets_the_exact_answer() {
    let server = server(2);
    let mut connection = client(&server);
    let mesh = cube(216);
    let exact = ask(&mut connection, |_| {}, &mesh).displacements.into_f64();
    let found = ask(&mut connection, |r| r.question.deadline_ms = Some(1e7), &mesh);
    assert!(
        found
            .report
            .warnings
            .iter()
            .all(|w| !w.text.contains("given up") && !w.text.contains("wanted"))
    );
    assert!(error_rel(found, &exact) <= 1e-12);
}

#[test]
fn deadline_and_budget_that_cannot_be_met_are_answered_and_told() {
    let server = server(1);
    let mut connection = client(&server);
    let mesh = cube(343);
    let exact = ask(&mut connection, |_| {}, &mesh).displacements.into_f64();
    let late = ask(&mut connection, |r| r.question.deadline_ms = Some(1e-3), &mesh);
    assert!(warned(&late, "the deadline was given up") && warned(&late, "wanted within 0.001 ms"));
    assert!(late.report.chosen_because.contains("the deadline was given up"));
    assert!(error_rel(late, &exact) <= 1e-5, "late, but right");
    let rough = ask(&mut connection, |r| r.question.max_error = Some(1e-30), &mesh);
    assert!(warned(&rough, "the error budget was given up") && warned(&rough, "wanted"));
    assert!(error_rel(rough, &exact) <= 1e-11);
    let wish = |r: &mut Once| {
        (r.question.deadline_ms, r.question.max_error) = (Some(1e-3), Some(1e-30));
    };
    let neither = ask(&mut connection, wish, &mesh);
    assert!(warned(&neither, "deadline and error budget were given up"));
    // The session lives.
    assert_eq!(ask(&mut connection, |_| {}, &mesh).report.method, "front");
}

#[test]
fn frames_tell_of_wishes_they_miss_and_stay_exact() {
    let server = server(1);
    let mut connection = client(&server);
    let mesh = cube(216);
    connection.ask(&Request::UploadModel(upload(&mesh))).unwrap();
    let mut asked = frame(&mesh, 1.0, "auto");
    asked.question.deadline_ms = Some(1e-6);
    asked.question.max_error = Some(1e-30);
    let missed = answer(&mut connection, &Request::from(asked));
    assert!(warned(&missed, "wanted within") && warned(&missed, "wanted"));
    assert!(missed.report.residual_rel < 1e-11);
}

#[test]
fn wishes_that_are_no_numbers_are_refused_and_the_session_lives() {
    let server = server(1);
    let mut connection = client(&server);
    let mesh = cube(64);
    for value in [f64::NAN, f64::INFINITY, 0.0, -1.0] {
        let mut late = once(&mesh, "auto");
        late.question.deadline_ms = Some(value);
        let request = Request::from(late);
        let (code, text) = refusal(&mut connection, &request);
        assert!(code == BadRequest && text.contains("the deadline is"), "{text}");
        let mut rough = frame(&mesh, 1.0, "front");
        rough.question.max_error = Some(value);
        connection.ask(&Request::UploadModel(upload(&mesh))).unwrap();
        let (code, text) = refusal(&mut connection, &Request::from(rough));
        assert!(code == BadRequest && text.contains("the error budget is"), "{text}");
    }
    assert_eq!(ask(&mut connection, |_| {}, &mesh).report.method, "front");
}

fn of_poisson(poisson: f64) -> impl Fn(&mut Once) {
    move |request| {
        request.element = ElementChoice::Auto;
        request.materials = vec![Material { young: 1.0e5, poisson }];
    }
}

#[test]
fn auto_takes_ten_nodes_where_linear_elements_lock_and_says_so() {
    let server = server(2);
    let mut connection = client(&server);
    let mesh = cube(125);
    let soft = ask(&mut connection, of_poisson(0.3), &mesh);
    assert_eq!(soft.report.element, ElementName::T4);
    assert!(soft.report.chosen_because.contains("linear elements"));
    let rubber = ask(&mut connection, of_poisson(0.49), &mesh);
    assert_eq!(
        (rubber.report.element, rubber.report.method.as_str()),
        (ElementName::T10.into(), "front")
    );
    assert!(rubber.report.chosen_because.contains("lock"), "{}", rubber.report.chosen_because);
    assert!(!warned(&rubber, "lock"));
    // The same answer as when ten nodes are asked for.
    let asked_for = ask(
        &mut connection,
        |r| {
            of_poisson(0.49)(r);
            r.element = ElementChoice::T10;
        },
        &mesh,
    );
    assert_eq!(rubber.displacements, asked_for.displacements);
    // Methods that are asked for keep their name.
    for method in METHODS.iter().filter(|m| **m != "condensed") {
        let mut request = once(&mesh, method);
        of_poisson(0.49)(&mut request);
        let found = answer(&mut connection, &Request::from(request));
        assert_eq!(
            (found.report.element, &*found.report.method),
            (ElementName::T10.into(), *method)
        );
    }
}

#[test]
fn linear_elements_that_lock_are_warned_of() {
    let small = ServerConfig { memory_limit: 3 << 20, ..config(1) };
    let server = fea_server::start(small).unwrap();
    let mut connection = client(&server);
    let mesh = cube(343);
    let no_memory = ask(&mut connection, of_poisson(0.49), &mesh);
    assert_eq!(no_memory.report.element, ElementName::T4);
    assert!(warned(&no_memory, "more memory than is allowed"));
    let no_time = ask(
        &mut connection,
        |r| {
            of_poisson(0.49)(r);
            r.question.deadline_ms = Some(1e-3);
        },
        &cube(27),
    );
    assert_eq!(no_time.report.element, ElementName::T4Anp, "the cheapest that does not lock");
    assert!(warned(&no_time, "the deadline was given up") && !warned(&no_time, "lock"));
    let asked_for = ask(
        &mut connection,
        |r| {
            of_poisson(0.49)(r);
            r.element = ElementChoice::T4;
        },
        &mesh,
    );
    assert!(warned(&asked_for, "linear elements lock at a Poisson's ratio of 0.49"));
}

#[test]
fn linear_elements_that_lock_are_warned_of_at_large_deformation_too() {
    let server = server(1);
    let mut connection = client(&server);
    for (element, poisson, is_warned) in [
        (ElementChoice::T4, 0.46, true),
        (ElementChoice::T4, 0.4, false),
        (ElementChoice::T4Anp, 0.46, false),
    ] {
        let materials = vec![Material { young: 1.0e5, poisson }];
        let once = Once { materials, element, ..once(&cube(27), "auto") };
        let request = Ask { large: Some(LargeAsk::default()), ..once.into() };
        let reply = connection.ask(&Request::from(request)).unwrap();
        let Reply::Answer(large) = reply else { panic!("an answer") };
        let locks = warned(&large, "linear elements lock at a Poisson's ratio of 0.46");
        assert_eq!(locks, is_warned, "{element:?} {poisson}: {:?}", large.report.warnings);
    }
}

#[test]
fn averaged_nodal_pressure_is_one_answer_by_all_methods_and_softer_than_plain_elements() {
    let server = server(2);
    let mut connection = client(&server);
    let mesh = cube(125);
    let mut by = |method: &str, element| {
        let mut request = once(&mesh, method);
        of_poisson(0.4999)(&mut request);
        request.element = element;
        request.question.want.reactions = true;
        answer(&mut connection, &Request::from(request))
    };
    let work = |answer: &Answer, known: &[DofValue]| -> f64 {
        answer.reactions.iter().zip(known).map(|(f, q)| f.value * q.value).sum()
    };
    let known = once(&mesh, "front").question.known;
    let plain = by("front", ElementChoice::T4);
    let reference = by("front", ElementChoice::T4Anp);
    assert!(work(&reference, &known) < 0.8 * work(&plain, &known));
    let exact = reference.displacements.into_f64();
    let largest = exact.iter().flatten().fold(0.0f64, |m, u| m.max(u.abs()));
    for method in METHODS {
        let found = by(method, ElementChoice::T4Anp);
        assert_eq!(
            (found.report.element, &*found.report.method),
            (ElementName::T4Anp.into(), method)
        );
        let estimate = found.report.error_estimate_rel.expect("no deadline, so it was estimated");
        let pairs = found.displacements.into_f64().into_iter().zip(&exact);
        let off = pairs.flat_map(|(a, b)| [0, 1, 2].map(|i| (a[i] - b[i]).abs()));
        let off = off.fold(0.0, f64::max) / largest;
        assert!(off <= 1e-9 && off <= 2.0 * estimate + 1e-13, "{method}: {off:e}, {estimate:e}");
    }
}

/// Conjugate gradients and single precision on a body of hard and soft parts, nearly
/// incompressible: the budget holds all the same.
#[test]
fn error_budget_holds_on_hard_materials() {
    let server = server(2);
    let mut connection = client(&server);
    let mesh = cube(343);
    let hard = |r: &mut Once| {
        r.mesh.regions = (0..r.mesh.tets.len() as u32).map(|t| t % 2).collect();
        r.materials = vec![
            Material { young: 1.0e9, poisson: 0.3 },
            Material { young: 1.0e3, poisson: 0.499 },
        ];
    };
    let exact = ask(&mut connection, hard, &mesh).displacements.into_f64();
    for budget in [1e-3, 1e-6] {
        let found = ask(
            &mut connection,
            |r| {
                hard(r);
                r.question.max_error = Some(budget);
            },
            &mesh,
        );
        let told = warned(&found, "wanted");
        let error = error_rel(found, &exact);
        assert!(error <= budget || told, "{budget:e}: {error:e}");
    }
}

/// Single precision is all rounding here: its factor preconditions nothing, and an answer by it would
/// be refused as uncertain although double precision has one.
#[test]
fn auto_goes_on_in_double_precision_where_single_leaves_no_digit() {
    let server = server(2);
    let mut connection = client(&server);
    let mesh = cube(125);
    for poisson in [0.49999, 0.499_999_99, 0.499_999_999_9] {
        let rubber = |r: &mut Once| {
            r.materials = vec![Material { young: 1.0e5, poisson }];
        };
        let exact = ask(&mut connection, rubber, &mesh);
        assert_eq!(exact.report.method, "front");
        let found = ask(
            &mut connection,
            |r| {
                rubber(r);
                r.question.max_error = Some(1e-3);
            },
            &mesh,
        );
        let told = warned(&found, "wanted") || warned(&found, "off by up to");
        let because = found.report.chosen_because.clone();
        let error = error_rel(found, &exact.displacements.into_f64());
        assert!(error <= 1e-3 || told, "{poisson}: {error:e}, {because}");
    }
}

#[test]
fn kept_models_are_made_of_the_element_they_name() {
    let server = server(1);
    let mut connection = client(&server);
    let quadratic = UploadModel { element: ElementName::T10, ..upload(&cube(64)) };
    let hash = softgrasp_protocol::ModelHash::of(&quadratic);
    connection.ask(&Request::UploadModel(quadratic)).unwrap();
    let asked = Ask { subject: hash.into(), ..frame(&cube(64), 1.0, "auto") };
    let found = answer(&mut connection, &Request::from(asked));
    assert_eq!((found.report.element, &*found.report.method), (ElementName::T10.into(), "front"));
    assert!(found.report.chosen_because.contains("ten-node"));
}
