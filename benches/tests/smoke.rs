//! Small forms of the reports: their files and rows are there, and errors are small.

#![allow(clippy::unwrap_used, reason = "a test that fails says where")]

use std::path::Path;

use softgrasp_bench::{Options, ReportName, run};

/// Values of one column of a CSV file.
fn column(folder: &Path, file: &str, name: &str) -> Vec<String> {
    let text = std::fs::read_to_string(folder.join(file)).unwrap();
    assert!(text.starts_with("# command: "), "{file} does not say how it was made");
    let mut reader = csv::ReaderBuilder::new().comment(Some(b'#')).from_reader(text.as_bytes());
    let at = reader.headers().unwrap().iter().position(|h| h == name).unwrap();
    reader.records().map(|row| row.unwrap()[at].to_owned()).collect()
}

fn numbers(folder: &Path, file: &str, name: &str) -> Vec<f64> {
    column(folder, file, name).iter().map(|v| v.parse().unwrap()).collect()
}

/// Runs the small form of a report into a folder.
fn run_quick(name: ReportName, folder: &Path) {
    let options = Options {
        is_quick: true,
        out: folder.to_owned(),
        command: "smoke test".to_owned(),
        note: String::new(),
        meshes: Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/meshes"),
    };
    let (_, files) = run(name, &options).unwrap();
    assert!(files.iter().all(|file| file.is_file()), "{files:?}");
    let page = std::fs::read_to_string(folder.join(format!("{}.md", name.name()))).unwrap();
    for part in [
        "- command: ",
        "- commit: ",
        "- date: ",
        "- processor: ",
        "- processor maker: ",
        "- threads: ",
    ] {
        assert!(page.contains(part), "{part} is not in the head of {}", name.name());
    }
}

#[test]
fn collision_is_timed_and_nothing_is_missed() {
    let folder = tempfile::tempdir().unwrap();
    run_quick(ReportName::Collision, folder.path());
    let competitors = column(folder.path(), "collision.csv", "competitor");
    assert!(competitors.iter().any(|c| c == "sphere tree"));
    assert!(competitors.iter().any(|c| c.starts_with("parry3d")));
    assert!(numbers(folder.path(), "collision.csv", "missed").iter().all(|&m| m == 0.0));
    // The check is worth something only if something was there to be missed.
    let inside = column(folder.path(), "collision.csv", "inside_per_hand");
    assert!(inside.iter().filter(|v| !v.is_empty()).all(|v| v.parse::<f64>().unwrap() > 5.0));
    for file in ["collision-like.csv", "collision-triangles.csv"] {
        let contacts = numbers(folder.path(), file, "contacts_checked");
        assert!(contacts.iter().all(|&c| c > 0.0), "{file}: {contacts:?}");
        // The peer answers the same questions, and as well.
        let wrong = numbers(folder.path(), file, "missed_by_peer");
        assert!(wrong.iter().all(|&m| m == 0.0), "{file}: {wrong:?}");
        assert!(numbers(folder.path(), file, "ratio").iter().all(|&r| r > 0.0));
    }
}

#[test]
fn bound_is_never_below_the_true_error_of_random_grips() {
    let folder = tempfile::tempdir().unwrap();
    // A bound below the true error fails the report.
    run_quick(ReportName::Bound, folder.path());
    let of = |name| column(folder.path(), "bound.csv", name);
    let ratios: Vec<f64> = of("ratio_nearest").iter().filter_map(|r| r.parse().ok()).collect();
    assert!(ratios.len() > 30 && ratios.iter().all(|&r| r >= 1.0), "{ratios:?}");
    let grips: f64 = numbers(folder.path(), "bound.csv", "grips").iter().sum();
    assert!(grips > 300.0, "{grips}");
}

#[test]
fn every_element_comes_nearer_to_closed_forms_on_finer_meshes() {
    let folder = tempfile::tempdir().unwrap();
    run_quick(ReportName::Accuracy, folder.path());
    let of = |name| column(folder.path(), "accuracy.csv", name);
    let (cases, elements, orders) = (of("case"), of("element"), of("order"));
    let errors = numbers(folder.path(), "accuracy.csv", "error_rel");
    for case in ["patch", "bar", "mirror"] {
        let of_case = cases.iter().zip(&errors).filter(|(c, _)| *c == case);
        let errors: Vec<f64> = of_case.map(|(_, e)| *e).collect();
        assert!(errors.len() >= 4 && errors.iter().all(|&e| e < 1e-11), "{case}: {errors:?}");
    }
    for case in ["cantilever", "membrane", "thick sphere", "indentation", "waves"] {
        for element in ["t4", "t10"] {
            let rows = cases.iter().zip(&elements).zip(&orders);
            let of_both = rows.filter(|((c, e), o)| *c == case && *e == element && !o.is_empty());
            let orders: Vec<f64> = of_both.map(|(_, o)| o.parse().unwrap()).collect();
            assert!(!orders.is_empty() && orders.iter().all(|&o| o > 0.0), "{case} {element}");
        }
    }
    for figure in ["accuracy-waves.svg", "accuracy-sphere.svg", "accuracy-cases.svg"] {
        assert!(folder.path().join(figure).is_file(), "{figure}");
    }
    large_deformation_is_beside_its_closed_forms(folder.path());
}

fn large_deformation_is_beside_its_closed_forms(folder: &Path) {
    let of = |name| column(folder, "accuracy-large.csv", name);
    let (cases, elements, errors) = (of("case"), of("element"), of("error_rel"));
    let errors_of = |case: &str, element: &str| -> Vec<f64> {
        let rows = cases.iter().zip(&elements).zip(&errors);
        let of_both = rows.filter(|((c, e), _)| *c == case && *e == element);
        of_both.map(|(_, error)| error.parse().unwrap()).collect()
    };
    for element in ["t4", "t4-anp", "t10"] {
        for (case, rows, error_max) in [
            ("uniaxial", 12, 1e-11),
            ("equibiaxial", 4, 1e-11),
            ("simple shear", 8, 1e-11),
            ("turned", 8, 1e-13),
        ] {
            let errors = errors_of(case, element);
            assert_eq!(errors.len(), rows, "{case} {element}");
            assert!(errors.iter().all(|&e| e < error_max), "{case} {element}: {errors:?}");
        }
    }
    for (case, error_max) in [
        ("torsion", 0.1),
        ("hollow sphere", 0.1),
        ("elastica", 1e-3),
        ("45° bend", 0.025),
        ("Cook's membrane", 0.25),
        ("compressed block", 0.25),
    ] {
        let errors = errors_of(case, "t10");
        assert!(!errors.is_empty() && errors.iter().all(|&e| e < error_max), "{case}: {errors:?}");
    }
    let orders = column(folder, "accuracy-large-torsion.csv", "order");
    let orders: Vec<f64> = orders.iter().filter_map(|o| o.parse().ok()).collect();
    assert!(orders.len() == 4 && orders.iter().all(|&o| o > 0.3), "{orders:?}");
    assert!(folder.join("accuracy-large.svg").is_file());
}

#[test]
fn contacts_are_pressed_and_timed_with_small_errors() {
    let folder = tempfile::tempdir().unwrap();
    run_quick(ReportName::Contact, folder.path());
    let contacts = column(folder.path(), "contact.csv", "contact");
    assert_eq!(contacts, ["vertex", "vertex", "patch", "patch", "mask", "mask"]);
    assert!(numbers(folder.path(), "contact.csv", "force_N").iter().all(|&force| force > 0.0));
    for file in ["contact.csv", "contact-frames.csv"] {
        let errors = numbers(folder.path(), file, "error_rel");
        assert!(errors.iter().all(|&e| e < 1e-9) && errors.len() >= 3, "{file}: {errors:?}");
    }
    assert_eq!(column(folder.path(), "contact-frames.csv", "unknown_forces")[2], "15");
    assert!(folder.path().join("contact.svg").is_file());
    let phases = column(folder.path(), "contact-steps.csv", "phase");
    assert_eq!(phases, ["settle", "pinch", "lift", "hold"].repeat(4));
}

/// Warm frames are timed beside their echo, with small errors.
fn warm_frames(folder: &Path) {
    for (file, rows) in [("latency-frame.csv", 6), ("latency-frame-methods.csv", 18)] {
        for name in ["error_rel", "residual_rel"] {
            let errors = numbers(folder, file, name);
            assert!(errors.iter().all(|&e| e < 1e-11), "{file} {name}: {errors:?}");
            assert!(errors.len() >= rows, "{file}: {errors:?}");
        }
    }
    assert_eq!(column(folder, "latency-frame.csv", "contact")[0], "mask");
    for name in ["alone_p50_ms", "echo_alone_p50_ms", "alone_over_echo_alone"] {
        assert!(numbers(folder, "latency-frame.csv", name).iter().all(|&x| x > 0.0), "{name}");
    }
    // Where an echo keeps a processor for itself, nothing takes turns with it.
    let in_turn = column(folder, "latency-frame.csv", "frame_over_echo");
    assert_eq!(in_turn.iter().filter(|ratio| ratio.is_empty()).count(), 2);
    // Warm frames reuse the factor of the first.
    assert!(numbers(folder, "latency-frame-stages.csv", "factor_ms").iter().all(|&ms| ms == 0.0));
}

#[test]
fn scaling_is_timed_fitted_and_drawn_with_small_errors() {
    let folder = tempfile::tempdir().unwrap();
    run_quick(ReportName::Scaling, folder.path());
    for file in
        ["scaling.csv", "scaling-shapes.csv", "scaling-procedures.csv", "scaling-stages.csv"]
    {
        let errors = numbers(folder.path(), file, "error_rel");
        assert!(errors.iter().all(|&e| e < 1e-11) && !errors.is_empty(), "{file}: {errors:?}");
    }
    let vertices = std::fs::read_to_string(folder.path().join("scaling-vertices.svg")).unwrap();
    assert!(vertices.contains("gauss-jordan") && vertices.contains("1998"));
}

#[test]
fn frontier_marks_what_is_worth_its_time() {
    let folder = tempfile::tempdir().unwrap();
    run_quick(ReportName::Frontier, folder.path());
    let of = |name| numbers(folder.path(), "frontier.csv", name);
    let (algebraic, total) = (of("algebraic_error_rel"), of("total_error_rel"));
    assert!(algebraic.len() > 80 && algebraic.iter().all(|&e| e < 2e-3), "{algebraic:?}");
    assert!(total.iter().all(|&e| e > 1e-3 && e < 0.5), "{total:?}");
    assert!(of("warm_ms").iter().chain(&of("cold_ms")).all(|&ms| ms > 0.0));
    for name in ["best_by_algebraic_error", "best_by_total_error"] {
        let best = column(folder.path(), "frontier.csv", name);
        for time in ["warm", "cold"] {
            assert!(best.iter().any(|b| b.contains(time)), "no row is best {time}, {name}");
        }
        assert!(best.iter().any(String::is_empty), "every row is best: {name}");
    }
    let meshes = |name| numbers(folder.path(), "frontier-meshes.csv", name);
    for (t4, t10) in meshes("t4_error_rel").iter().zip(meshes("t10_error_rel")) {
        assert!(*t4 > 2.0 * t10, "{t4} {t10}");
    }
    for figure in ["frontier.svg", "frontier-cold.svg"] {
        let svg = std::fs::read_to_string(folder.path().join(figure)).unwrap();
        assert!(svg.contains("condensed") && svg.contains("toothpaste"), "{figure}");
    }
}

/// First frames of grips are right, with and without prefetch.
fn first_frames(folder: &Path) {
    let of = |name| numbers(folder, "latency-onset.csv", name);
    for name in ["error_rel", "residual_rel"] {
        assert!(of(name).iter().all(|&e| e < 1e-10) && of(name).len() == 4, "{:?}", of(name));
    }
    assert!(of("compared").iter().chain(&of("sparse_solve_ms")).all(|&x| x > 0.0));
    assert!(folder.join("latency-onset.svg").is_file());
}

/// A held pace is counted, and every answer compared.
fn held_pace(folder: &Path) {
    let (rights, asked) = ("real_time", "asked");
    let of = |name| column(folder, "latency-hold.csv", name);
    // The server and nobody, with real-time rights where the system grants them, and without.
    assert_eq!(of(asked)[..2], ["the server", "nobody"]);
    assert_eq!(of(rights).last().map(String::as_str), Some("no"));
    assert!(numbers(folder, "latency-hold.csv", "ticks").iter().all(|&ticks| ticks == 500.0));
    let late = numbers(folder, "latency-hold.csv", "late_percent");
    assert!(late.iter().all(|late| (0.0..=100.0).contains(late)), "{late:?}");
    let of_answers = |name| {
        let all: Vec<String> = of(name).into_iter().step_by(2).collect();
        all.iter().map(|v| v.parse::<f64>().unwrap()).collect::<Vec<_>>()
    };
    for name in ["error_rel", "residual_rel"] {
        assert!(of_answers(name).iter().all(|&e| e < 1e-10), "{name}: {:?}", of(name));
    }
    for (place, difference) in of_answers("late_above_control_percent").iter().enumerate() {
        assert!((late[2 * place] - late[2 * place + 1] - difference).abs() < 1e-3);
    }
    // Without a bound the pace would be held without the certificate.
    assert!(of_answers("with_bound_percent").iter().all(|&share| share == 100.0));
    assert!(of_answers("error_bound_rel").iter().all(|&bound| bound > 0.0 && bound < 1e-4));
}

/// A session of the real programs is read from its reports.
fn session(folder: &Path) {
    let of = |name| numbers(folder, "service-session.csv", name);
    assert_eq!(of("runs"), [1.0, 1.0, 2.0]);
    assert!(of("ticks").iter().all(|&ticks| ticks > 0.0), "{:?}", of("ticks"));
    // Every deforming tick is answered or has a reason, however slow the machine is.
    let why = |name| column(folder, "service-session-unanswered.csv", name);
    for (server, (deforming, answered)) in column(folder, "service-session.csv", "server")
        .iter()
        .zip(of("deforming").into_iter().zip(of("answered")))
    {
        let rows = why("object").into_iter().zip(why("server")).zip(why("ticks"));
        let rows = rows.filter(|((object, of), _)| object == "strawberry" && of == server);
        let of_server = rows.map(|(_, n)| n.parse::<f64>().unwrap());
        assert_eq!(deforming, answered + of_server.sum::<f64>(), "{server}");
    }
    assert!(of("residual_rel").iter().all(|&e| e < 1e-9));
    // What was answered is shown for a while, and nothing is shown that is not old.
    let ages = column(folder, "service-session.csv", "age_max_ms");
    for (age, answered) in ages.iter().zip(of("answered")) {
        assert!(answered == 0.0 || age.parse::<f64>().unwrap() > 0.0, "{age}");
    }
    let outcomes = column(folder, "service-session-large.csv", "outcome");
    assert_eq!(outcomes[0], "answered");
    assert!(numbers(folder, "service-session-large.csv", "nodes").iter().all(|&n| n > 900.0));
}

/// Clients at an even pace get right answers; a wrong one fails the report.
fn clients(folder: &Path) {
    let answers = numbers(folder, "service-load.csv", "answers");
    assert!(answers.iter().all(|&count| count > 20.0), "{answers:?}");
    assert_eq!(numbers(folder, "service-load.csv", "clients"), [1.0, 2.0]);
}

/// Questions beside long work are right, and a crowd that sends is counted.
fn beside(folder: &Path) {
    assert!(numbers(folder, "service-beside.csv", "asked").iter().all(|&asked| asked > 0.0));
    let solves = numbers(folder, "service-pace.csv", "solves_beside");
    assert!(solves.iter().all(|&solves| solves >= 2.0), "{solves:?}");
    let refused = numbers(folder, "service-receiving.csv", "refused");
    let done = numbers(folder, "service-receiving.csv", "done");
    assert!(refused.iter().zip(&done).all(|(refused, done)| refused + done == 8.0));
}

/// Hostile connections and restarts cost no right answer.
fn hostile(folder: &Path) {
    let (what, measured) = (
        column(folder, "service-trust.csv", "what"),
        numbers(folder, "service-trust.csv", "measured"),
    );
    // Times and memory of so short a form say little; what is counted must be right.
    let counted = what.iter().zip(&measured).filter(|(what, _)| {
        what.starts_with("wrong answers") || what.starts_with("connections of the soak")
    });
    let counted: Vec<_> = counted.collect();
    assert!(counted.len() >= 3 && counted.iter().all(|(_, count)| **count == 0.0), "{counted:?}");
}

#[test]
fn frames_are_timed_with_small_errors() {
    let folder = tempfile::tempdir().unwrap();
    run_quick(ReportName::Latency, folder.path());
    warm_frames(folder.path());
    first_frames(folder.path());
    held_pace(folder.path());
}

#[test]
fn users_of_one_server_get_right_answers() {
    let folder = tempfile::tempdir().unwrap();
    run_quick(ReportName::Service, folder.path());
    session(folder.path());
    beside(folder.path());
    clients(folder.path());
    hostile(folder.path());
}
