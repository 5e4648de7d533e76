//! Small forms of the reports: their files and rows are there, and errors are small.

#![allow(clippy::unwrap_used, reason = "a test that fails says where")]

use softgrasp_bench::quick::Quick;
use softgrasp_bench::{ReportName, measure, scale};

fn quick(name: ReportName) -> Quick {
    Quick::make(|options| measure(name, options))
}

#[test]
fn collision_is_timed_and_nothing_is_missed() {
    let report = quick(ReportName::Collision);
    let competitors = report.column("collision.csv", "competitor");
    assert!(competitors.iter().any(|c| c == "sphere tree"));
    assert!(competitors.iter().any(|c| c.starts_with("parry3d")));
    assert!(report.numbers("collision.csv", "missed").iter().all(|&m| m == 0.0));
    // The check is worth something only if something was there to be missed.
    let inside = report.column("collision.csv", "inside_per_hand");
    assert!(inside.iter().filter(|v| !v.is_empty()).all(|v| v.parse::<f64>().unwrap() > 5.0));
    for file in ["collision-like.csv", "collision-triangles.csv"] {
        let contacts = report.numbers(file, "contacts_checked");
        assert!(contacts.iter().all(|&c| c > 0.0), "{file}: {contacts:?}");
        // The peer answers the same questions, and as well.
        let wrong = report.numbers(file, "missed_by_peer");
        assert!(wrong.iter().all(|&m| m == 0.0), "{file}: {wrong:?}");
        assert!(report.numbers(file, "ratio").iter().all(|&r| r > 0.0));
    }
}

#[test]
fn forces_are_felt_without_energy() {
    let report = quick(ReportName::Felt);
    assert_eq!(report.column("felt.csv", "rendered").len(), 8);
    let created = report.numbers("felt.csv", "created_mJ");
    assert!(created.chunks_exact(4).all(|ways| ways[3] <= 1.0 + 1e-6), "{created:?}");
    let rows = report.column("felt-rates.csv", "ticks");
    assert!(rows.iter().all(|ticks| ticks.parse::<u64>().unwrap() > 100), "{rows:?}");
}

#[test]
fn contacts_are_pressed_and_timed_with_small_errors() {
    let report = quick(ReportName::Contact);
    let contacts = report.column("contact.csv", "contact");
    assert_eq!(contacts, ["vertex", "vertex", "patch", "patch", "mask", "mask"]);
    assert!(report.numbers("contact.csv", "force_N").iter().all(|&force| force > 0.0));
    for file in ["contact.csv", "contact-frames.csv"] {
        let errors = report.numbers(file, "error_rel");
        assert!(errors.iter().all(|&e| e < 1e-9) && errors.len() >= 3, "{file}: {errors:?}");
    }
    assert_eq!(report.column("contact-frames.csv", "unknown_forces")[2], "15");
    assert!(report.has("contact.svg"));
    // Linear steps are timed with cold and warm columns, all others with warm ones.
    let phases = report.column("contact-steps.csv", "phase");
    assert_eq!(phases, ["settle", "pinch", "lift", "hold"].repeat(5));
    let columns = report.column("contact-steps.csv", "columns");
    assert_eq!(columns.iter().filter(|columns| *columns == "cold").count(), 4);
}

/// Warm frames are timed beside their echo, with small errors.
fn warm_frames(report: &Quick) {
    for (file, rows) in [("latency-frame.csv", 6), ("latency-frame-methods.csv", 18)] {
        for name in ["error_rel", "residual_rel"] {
            let errors = report.numbers(file, name);
            assert!(errors.iter().all(|&e| e < 1e-11), "{file} {name}: {errors:?}");
            assert!(errors.len() >= rows, "{file}: {errors:?}");
        }
    }
    assert_eq!(report.column("latency-frame.csv", "contact")[0], "mask");
    for name in ["alone_p50_ms", "echo_alone_p50_ms", "alone_over_echo_alone"] {
        assert!(report.numbers("latency-frame.csv", name).iter().all(|&x| x > 0.0), "{name}");
    }
    // Where an echo keeps a processor for itself, nothing takes turns with it.
    let in_turn = report.column("latency-frame.csv", "frame_over_echo");
    assert_eq!(in_turn.iter().filter(|ratio| ratio.is_empty()).count(), 2);
    // Warm frames reuse the factor of the first.
    assert!(report.numbers("latency-frame-stages.csv", "factor_ms").iter().all(|&ms| ms == 0.0));
}

#[test]
fn scaling_is_timed_fitted_and_drawn_with_small_errors() {
    let report = quick(ReportName::Scaling);
    for file in
        ["scaling.csv", "scaling-shapes.csv", "scaling-procedures.csv", "scaling-stages.csv"]
    {
        let errors = report.numbers(file, "error_rel");
        assert!(errors.iter().all(|&e| e < 1e-11) && !errors.is_empty(), "{file}: {errors:?}");
    }
    let vertices = std::fs::read_to_string(report.folder().join("scaling-vertices.svg")).unwrap();
    assert!(vertices.contains("gauss-jordan") && vertices.contains("1998"));
}

/// Sizes that a test has time for; with and without a worker.
#[test]
fn scale_is_measured_in_processes_of_its_own() {
    let report = Quick::make(|options| scale::measure_sizes(options, &[1000, 2197, 4096]));
    let ways = report.column("scale.csv", "way");
    let steps = report.column("scale.csv", "steps");
    for (k, way) in ["front", "front-mixed", "multigrid"].into_iter().enumerate() {
        assert_eq!(ways.iter().filter(|w| *w == way).count(), 3, "{ways:?}");
        assert_eq!(steps[k].is_empty(), way != "multigrid");
    }
    assert!(report.column("scale.csv", "outcome").iter().all(|outcome| outcome == "answered"));
    assert!(report.numbers("scale.csv", "residual_rel").iter().all(|&e| e <= 1e-8));
    assert!(report.numbers("scale.csv", "peak_memory_gib").iter().all(|&gib| gib > 0.005));
    let off = report.column("scale.csv", "off_front_rel");
    assert_eq!(off.iter().filter(|off| off.is_empty()).count(), 3, "front has nothing beside it");
    assert!(report.numbers("scale-laws.csv", "sizes").iter().all(|&sizes| sizes == 3.0));
    let page = std::fs::read_to_string(report.folder().join("scale.md")).unwrap();
    let has_worker = ways.iter().any(|way| way.starts_with("worker"));
    assert_ne!(has_worker, page.contains("No worker was asked: "), "{page}");
    assert_eq!(has_worker, report.has("scale-machines.csv"));
    assert!(page.contains("4096 nodes, the largest size that `front` answered"), "{page}");
    assert!(report.has("scale-time.svg") && report.has("scale-memory.svg"));
}

#[test]
fn frontier_marks_what_is_worth_its_time() {
    let report = quick(ReportName::Frontier);
    let of = |name| report.numbers("frontier.csv", name);
    let (algebraic, total) = (of("algebraic_error_rel"), of("total_error_rel"));
    assert!(algebraic.len() > 80 && algebraic.iter().all(|&e| e < 2e-3), "{algebraic:?}");
    assert!(total.iter().all(|&e| e > 1e-3 && e < 0.5), "{total:?}");
    assert!(of("warm_ms").iter().chain(&of("cold_ms")).all(|&ms| ms > 0.0));
    for name in ["best_by_algebraic_error", "best_by_total_error"] {
        let best = report.column("frontier.csv", name);
        for time in ["warm", "cold"] {
            assert!(best.iter().any(|b| b.contains(time)), "no row is best {time}, {name}");
        }
        assert!(best.iter().any(String::is_empty), "every row is best: {name}");
    }
    let meshes = |name| report.numbers("frontier-meshes.csv", name);
    for (t4, t10) in meshes("t4_error_rel").iter().zip(meshes("t10_error_rel")) {
        assert!(*t4 > 2.0 * t10, "{t4} {t10}");
    }
    for figure in ["frontier.svg", "frontier-cold.svg"] {
        let svg = std::fs::read_to_string(report.folder().join(figure)).unwrap();
        assert!(svg.contains("condensed") && svg.contains("toothpaste"), "{figure}");
    }
}

/// First frames of grips are right, with and without prefetch.
fn first_frames(report: &Quick) {
    let of = |name| report.numbers("latency-onset.csv", name);
    for name in ["error_rel", "residual_rel"] {
        assert!(of(name).iter().all(|&e| e < 1e-10) && of(name).len() == 4, "{:?}", of(name));
    }
    assert!(of("compared").iter().chain(&of("sparse_solve_ms")).all(|&x| x > 0.0));
    assert!(report.has("latency-onset.svg"));
}

/// A held pace is counted, and every answer compared.
fn held_pace(report: &Quick) {
    let (rights, asked) = ("real_time", "asked");
    let of = |name| report.column("latency-hold.csv", name);
    // The server and nobody, with real-time rights where the system grants them, and without.
    assert_eq!(of(asked)[..2], ["the server", "nobody"]);
    assert_eq!(of(rights).last().map(String::as_str), Some("no"));
    assert!(report.numbers("latency-hold.csv", "ticks").iter().all(|&ticks| ticks == 500.0));
    let late = report.numbers("latency-hold.csv", "late_percent");
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
fn session(report: &Quick) {
    let of = |name| report.numbers("service-session.csv", name);
    assert_eq!(of("runs"), [1.0, 1.0, 2.0]);
    assert!(of("ticks").iter().all(|&ticks| ticks > 0.0), "{:?}", of("ticks"));
    // Every deforming tick is answered or has a reason, however slow the machine is.
    let why = |name| report.column("service-session-unanswered.csv", name);
    for (server, (deforming, answered)) in report
        .column("service-session.csv", "server")
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
    let ages = report.column("service-session.csv", "age_max_ms");
    for (age, answered) in ages.iter().zip(of("answered")) {
        assert!(answered == 0.0 || age.parse::<f64>().unwrap() > 0.0, "{age}");
    }
    let outcomes = report.column("service-session-large.csv", "outcome");
    assert_eq!(outcomes[0], "answered");
    assert!(report.numbers("service-session-large.csv", "nodes").iter().all(|&n| n > 900.0));
}

/// Clients at an even pace get right answers; a wrong one fails the report.
fn clients(report: &Quick) {
    let answers = report.numbers("service-load.csv", "answers");
    assert!(answers.iter().all(|&count| count > 20.0), "{answers:?}");
    assert_eq!(report.numbers("service-load.csv", "clients"), [1.0, 2.0]);
}

/// Questions beside long work are right, and a crowd that sends is counted.
fn beside(report: &Quick) {
    assert!(report.numbers("service-beside.csv", "asked").iter().all(|&asked| asked > 0.0));
    let solves = report.numbers("service-pace.csv", "solves_beside");
    assert!(solves.iter().all(|&solves| solves >= 2.0), "{solves:?}");
    let refused = report.numbers("service-receiving.csv", "refused");
    let done = report.numbers("service-receiving.csv", "done");
    assert!(refused.iter().zip(&done).all(|(refused, done)| refused + done == 8.0));
}

/// Both clients get right answers, where Python is installed with what its client needs.
fn python(report: &Quick) {
    if !report.has("service-python.csv") {
        eprintln!("skipped: the client in Python, for which something is not installed here");
        return;
    }
    assert_eq!(report.column("service-python.csv", "client"), ["Rust", "Python"]);
    let of = |name| report.numbers("service-python.csv", name);
    assert!(of("frames").iter().all(|&frames| frames >= 25.0));
    assert!(of("rate_hz").iter().chain(&of("rate_rel")).all(|&rate| rate > 0.0));
    assert!(of("error_rel").iter().all(|&error| error < 1e-9));
}

/// Hostile connections and restarts cost no right answer.
fn hostile(report: &Quick) {
    let (what, measured) = (
        report.column("service-trust.csv", "what"),
        report.numbers("service-trust.csv", "measured"),
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
    let report = quick(ReportName::Latency);
    warm_frames(&report);
    first_frames(&report);
    held_pace(&report);
}

#[test]
fn users_of_one_server_get_right_answers() {
    let report = quick(ReportName::Service);
    session(&report);
    beside(&report);
    clients(&report);
    python(&report);
    hostile(&report);
}
