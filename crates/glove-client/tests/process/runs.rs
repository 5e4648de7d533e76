//! `glove-client run` as a process: ticks that are accounted for, refusals that are told once.

use std::net::SocketAddr;

use fea_server::ServerConfig;
use serde_json::Value;

use crate::start::{Folder, run};

/// Checks that every tick was played or skipped, and every deforming tick answered or given a reason.
fn check_counts(report: &Value) {
    let count = |value: &Value| value.as_u64().unwrap();
    let summary = &report["summary"];
    let played = report["frames"].as_array().unwrap();
    assert_eq!(count(&report["ticks"]), played.len() as u64 + count(&summary["ticks_skipped"]));
    let reasons = summary["unanswered"].as_object().unwrap();
    let unanswered: u64 = reasons.values().map(count).sum();
    assert_eq!(count(&summary["deforming_ticks"]), count(&summary["solves"]) + unanswered);
    for (reason, ticks) in reasons {
        let told =
            played.iter().filter(|tick| tick["unanswered"] == reason.as_str()).count() as u64;
        assert!(told == count(ticks) || reason == "tick_skipped", "{reason}: {told} of {ticks}");
    }
    for tick in played {
        let deforms = tick["state"] == "Deforming";
        let told = !tick["solve"].is_null() || !tick["unanswered"].is_null();
        assert_eq!(deforms, told, "tick {}", tick["tick"]);
    }
}

#[test]
fn every_tick_of_a_real_time_run_is_accounted_for() {
    let folder = Folder::new();
    let report = folder.path("r.json");
    let flags = ["run", "--headless", "--rate", "400", "--grasp", "thesis", "--object", "cube"];
    // However busy the machine is, and so however many are skipped or late.
    run(&[&flags[..], &["--nodes", "64", "--report", &report]].concat());
    let report: Value = serde_json::from_str(&folder.read("r.json")).unwrap();
    assert_eq!(report["pace"], "free");
    check_counts(&report);
}

#[test]
fn refused_model_is_told_once_and_ends_with_exit_code_1() {
    let config = ServerConfig {
        listen: SocketAddr::from(([127, 0, 0, 1], 0)),
        threads: 1,
        memory_limit: 500_000,
        ..ServerConfig::default()
    };
    let server = fea_server::start(config).unwrap();
    let address = server.address().to_string();
    for rate in [&[][..], &["--rate", "400"]] {
        let folder = Folder::new();
        let report = folder.path("r.json");
        let flags = ["run", "--headless", "--object", "cube", "--nodes", "729"];
        let more = ["--hand", "scripted:squeeze", "--server", &address, "--report", &report];
        let said = run(&[&flags[..], &more, rate].concat());
        assert_eq!(said.status.code(), Some(1));
        let first = String::from_utf8(said.stderr).unwrap();
        let first = first.lines().next().unwrap_or("").to_owned();
        assert!(first.starts_with("glove-client: none of "), "{first}");
        assert!(first.contains("refused the model (MemoryLimit)"), "{first}");
        assert!(first.len() < 300, "{first}");
        let told = String::from_utf8(said.stdout).unwrap();
        let refusals = told.lines().filter(|line| line.contains("refused the model")).count();
        assert_eq!(refusals, 1, "{told}");
        let report: Value = serde_json::from_str(&folder.read("r.json")).unwrap();
        check_counts(&report);
        assert_eq!(report["summary"]["solves"], 0);
        // In real time a busy machine skips ticks too.
        if rate.is_empty() {
            let all = &report["summary"]["deforming_ticks"];
            assert!(all.as_u64().unwrap() > 10, "{all}");
            assert_eq!(report["summary"]["unanswered"]["refused"], *all);
        }
    }
}

#[test]
fn mouse_hand_without_a_window_is_refused_in_one_sentence() {
    let said = crate::start::fail(1, &["run", "--headless", "--hand", "mouse"]);
    assert_eq!(said.lines().count(), 1, "{said}");
    for part in ["needs the window", "--hand scripted"] {
        assert!(said.contains(part), "{said}");
    }
}
