//! Small forms of the reports: files are there, rows are there, errors are small.

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
    for part in ["- command: ", "- commit: ", "- date: ", "- processor: ", "- threads: "] {
        assert!(page.contains(part), "{part} is not in the head of {}", name.name());
    }
}

#[test]
fn methods_are_timed_with_small_errors() {
    let folder = tempfile::tempdir().unwrap();
    run_quick(ReportName::Methods, folder.path());
    let methods = column(folder.path(), "methods.csv", "method");
    assert!(methods.iter().any(|m| m == "gauss-jordan") && methods.len() >= 8);
    for name in ["error_rel", "residual_rel"] {
        let errors = numbers(folder.path(), "methods.csv", name);
        assert!(errors.iter().all(|&e| e < 1e-11), "{name}: {errors:?}");
    }
    assert!(numbers(folder.path(), "methods.csv", "total_ms").iter().all(|&ms| ms > 0.0));
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
    let contacts = numbers(folder.path(), "collision-ratios.csv", "contacts_checked");
    assert!(contacts.iter().all(|&c| c > 0.0), "{contacts:?}");
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
}

#[test]
fn frames_are_timed_beside_their_echo_with_small_errors() {
    let folder = tempfile::tempdir().unwrap();
    run_quick(ReportName::Frame, folder.path());
    for name in ["error_rel", "residual_rel"] {
        let errors = numbers(folder.path(), "frame.csv", name);
        assert!(errors.iter().all(|&e| e < 1e-11) && errors.len() >= 8, "{name}: {errors:?}");
    }
    let (frames, echoes) = (
        numbers(folder.path(), "frame.csv", "p50_ms"),
        numbers(folder.path(), "frame.csv", "echo_p50_ms"),
    );
    assert!(frames.iter().chain(&echoes).all(|&ms| ms > 0.0));
    // Warm frames reuse the factor of the first.
    assert!(numbers(folder.path(), "frame-stages.csv", "factor_ms").iter().all(|&ms| ms == 0.0));
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

#[test]
fn first_frames_of_grips_are_right_with_and_without_prefetch() {
    let folder = tempfile::tempdir().unwrap();
    run_quick(ReportName::Onset, folder.path());
    let of = |name| numbers(folder.path(), "onset.csv", name);
    for name in ["error_rel", "residual_rel"] {
        assert!(of(name).iter().all(|&e| e < 1e-10) && of(name).len() == 4, "{:?}", of(name));
    }
    assert!(of("compared").iter().chain(&of("sparse_solve_ms")).all(|&x| x > 0.0));
    assert!(folder.path().join("onset.svg").is_file());
}

#[test]
fn a_held_pace_is_counted_and_every_answer_compared() {
    let folder = tempfile::tempdir().unwrap();
    run_quick(ReportName::Hold, folder.path());
    let of = |name| numbers(folder.path(), "hold.csv", name)[0];
    assert_eq!(of("ticks"), 500.0);
    assert!((0.0..=100.0).contains(&of("late_percent")) && of("missed") <= 500.0);
    assert!(of("error_rel") < 1e-10 && of("residual_rel") < 1e-10);
    // Without a bound the pace would be held without the certificate.
    assert_eq!(of("with_bound_percent"), 100.0);
    assert!(of("error_bound_rel") > 0.0 && of("error_bound_rel") < 1e-4);
}
