//! Reports that README quotes are of a clean commit, and the reports' page lists those that are older
//! than the code that they measure.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use softgrasp_tests::quoting::items;

/// Code that a report measures, by the beginning of its file's name.
const MEASURED: [(&str, &[&str]); 8] = [
    ("latency-frame", &["crates/core/src/solve/condensed", "crates/protocol/src", ANSWERS]),
    ("latency-hold", &["crates/core/src/solve/condensed", "crates/protocol/src", ANSWERS]),
    ("latency-onset", &["crates/core/src/solve/condensed", "crates/core/src/solve/front", ANSWERS]),
    ("peers", &["crates/core/src/solve/front", "crates/core/src/solve/ordering"]),
    ("service-session", &["crates/core/src/solve/front", "crates/core/src/solve/ordering"]),
    ("scaling", &["crates/core/src/solve/front", "crates/core/src/fem/assembly.rs"]),
    ("scale", &["crates/core/src/solve/front", "crates/core/src/solve/multigrid", WORKER]),
    ("collision", &["crates/grasp/src/sphere_tree"]),
];
const ANSWERS: &str = "crates/fea-server/src/answer";
const WORKER: &str = "cluster/fea-worker/src";
/// Heading of the section that lists the reports older than the code they measure.
const OLDER: &str = "Older than the code they measure";

fn root() -> PathBuf {
    let manifest = Path::new(env!("CARGO_MANIFEST_DIR"));
    manifest.parent().expect("the package lies in a folder of the workspace").to_owned()
}

fn text(path: &str) -> String {
    fs::read_to_string(root().join(path)).unwrap_or_else(|error| panic!("{path}: {error}"))
}

/// Files of reports that README's comments name.
fn quoted() -> BTreeSet<String> {
    let items = items(&text("README.md"), "");
    let comments = items.into_iter().flat_map(|item| item.comments);
    comments.filter_map(|c| Some(c.split(" |").next()?.trim().to_owned())).collect()
}

/// Commit in the head of a report's file.
fn commit(file: &str) -> String {
    let text = text(&format!("reports/{file}"));
    let line = text.lines().find_map(|line| line.strip_prefix("# commit: "));
    line.unwrap_or_else(|| panic!("{file} does not say of which commit it is")).to_owned()
}

/// Number of commits since one that changed some paths; `None` if there is no history.
fn commits_since(commit: &str, paths: &[&str]) -> Option<usize> {
    let range = format!("{commit}..HEAD");
    let asked = ["rev-list", "--count", "--no-merges", &range, "--"];
    let told = Command::new("git").current_dir(root()).args(asked).args(paths).output().ok()?;
    let told = String::from_utf8_lossy(&told.stdout).trim().to_owned();
    told.parse().ok()
}

#[test]
fn reports_that_the_readme_quotes_are_of_a_clean_commit() {
    let quoted = quoted();
    assert!(quoted.len() > 4, "only {quoted:?} are quoted: the search is broken");
    for file in quoted {
        let commit = commit(&file);
        assert!(!commit.contains("changes"), "{file} is of {commit}");
        assert!(
            commit.len() >= 7 && commit.chars().all(|c| c.is_ascii_hexdigit()),
            "{file}: {commit}"
        );
    }
}

#[test]
fn report_that_is_older_than_its_code_is_listed_as_such() {
    let listed: Vec<String> =
        items(&text("reports/README.md"), OLDER).into_iter().flat_map(|item| item.links).collect();
    for file in quoted() {
        let paths = MEASURED.iter().find(|(begins, _)| file.starts_with(begins));
        let (_, paths) =
            paths.unwrap_or_else(|| panic!("{file}: say in MEASURED what it measures"));
        for path in *paths {
            assert!(root().join(path).exists(), "{path} has moved: {file} is said to measure it");
        }
        let Some(changes) = commits_since(&commit(&file), paths) else {
            println!("skipped: there is no history to ask for the commit of {file}");
            continue;
        };
        let is_listed = listed.contains(&file);
        assert!(
            changes == 0 || is_listed,
            "{file} is {changes} commits older than what it measures ({paths:?}): make it again, or list it \
             in reports/README.md under \"{OLDER}\" with what has changed since"
        );
        assert!(
            changes > 0 || !is_listed,
            "{file} is listed as older, but nothing has changed since"
        );
    }
}
