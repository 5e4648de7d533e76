//! Numbers that can never work are refused with the option's name and exit code 2.

use crate::start::{fail, succeed};

const RUN: &[&str] = &["run", "--headless", "--object", "cube", "--nodes", "64"];
const SOLVE: &[&str] = &["solve", "--mesh", "no.msh", "--known", "no.csv", "--out", "never.csv"];
const MESH: &[&str] = &["mesh", "cube", "--out", "never.msh"];
const INSPECT: &[&str] = &["inspect", "no.msh"];

#[test]
fn negative_and_impossible_numbers_are_refused_by_name_and_not_taken_for_options() {
    let refused: &[(&[&str], &str, &[&str])] = &[
        (RUN, "--young", &["-1", "0", "nan", "-2e4", "soft"]),
        (RUN, "--poisson", &["0.5", "-1", "-1.5", "nan"]),
        (RUN, "--rate", &["-100", "0", "inf"]),
        (RUN, "--object-size", &["-0.1", "0"]),
        (RUN, "--threads", &["-1", "0"]),
        (RUN, "--ticks", &["-1", "many"]),
        (SOLVE, "--young", &["-1", "0"]),
        (SOLVE, "--poisson", &["0.5", "-1"]),
        (SOLVE, "--threads", &["-1", "0"]),
        (SOLVE, "--deadline", &["-3"]),
        (SOLVE, "--max-error", &["-1e-6", "0"]),
        (SOLVE, "--memory-limit", &["-1"]),
        (MESH, "--nodes", &["-64", "0", "1.5"]),
        (INSPECT, "--memory-limit", &["-1"]),
    ];
    for (command, option, values) in refused {
        for value in *values {
            let said = fail(2, &[command, &[*option, *value][..]].concat());
            let first = said.lines().next().unwrap_or("");
            assert!(first.starts_with("error: invalid value"), "{option} {value}: {said}");
            assert!(first.contains(option) && first.contains(value), "{option} {value}: {said}");
        }
    }
}

#[test]
fn nodes_of_a_run_are_refused_by_name_too() {
    let said = fail(2, &["run", "--headless", "--object", "cube", "--nodes", "-64"]);
    assert!(said.starts_with("error: invalid value '-64' for '--nodes <N>'"), "{said}");
}

#[test]
fn ticks_are_counted_under_either_name() {
    for option in ["--frames", "--ticks"] {
        let told = succeed(&[RUN, &[option, "3"]].concat());
        assert!(told.contains("ticks               3\n"), "{option}: {told}");
    }
}
