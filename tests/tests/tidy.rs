//! Rules of the repository that no compiler checks: form of files, layers, true documents.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

use softgrasp_tests::imports::Package;

/// Largest number of lines of a source file.
const LINES_MAX: usize = 500;
/// Longer files, each with its reason; there is none.
const LONGER_FILES: [(&str, &str); 0] = [];
/// Folders without sources of this repository.
const SKIPPED: [&str; 4] = ["target", "out", "node_modules", "proptest-regressions"];

/// Text file of the repository.
struct TextFile {
    /// Path from the root, with `/`.
    path: String,
    text: String,
}

impl TextFile {
    fn is_rust(&self) -> bool {
        self.path.ends_with(".rs")
    }

    /// Lines of the code that ships: no test file, and nothing behind the attribute of the test module.
    fn shipped_code(&self) -> impl Iterator<Item = (usize, &str)> {
        let is_test = self.path.starts_with("tests/")
            || self.path.contains("/tests")
            || self.path.ends_with("_tests.rs");
        let lines = self.text.lines().enumerate().map(|(i, line)| (i + 1, line));
        lines
            .take_while(move |(_, line)| !is_test && !line.starts_with("#[cfg(test)]"))
            .filter(|(_, line)| !is_comment(line))
    }
}

fn is_comment(line: &str) -> bool {
    line.trim_start().starts_with("//")
}

fn root() -> PathBuf {
    let manifest = Path::new(env!("CARGO_MANIFEST_DIR"));
    manifest.parent().expect("the package lies in a folder of the workspace").to_owned()
}

/// Every text file below the root, in path order.
fn text_files() -> Vec<TextFile> {
    let mut files = Vec::new();
    collect(&root(), "", &mut files);
    files.sort_by(|a, b| a.path.cmp(&b.path));
    let sources = files.iter().filter(|f| f.is_rust()).count();
    assert!(sources > 100, "only {sources} source files found: the walk is broken");
    files
}

fn collect(folder: &Path, prefix: &str, files: &mut Vec<TextFile>) {
    for entry in fs::read_dir(folder).expect("a folder of the repository can be read") {
        let entry = entry.expect("an entry can be read");
        let name = entry.file_name().to_string_lossy().into_owned();
        let hidden =
            name.starts_with('.') && ![".ci", ".gitignore", ".dockerignore"].contains(&&*name);
        if hidden || SKIPPED.contains(&&*name) {
            continue;
        }
        let path = format!("{prefix}{name}");
        if entry.path().is_dir() {
            collect(&entry.path(), &format!("{path}/"), files);
        } else if let Ok(text) = fs::read_to_string(entry.path()) {
            files.push(TextFile { path, text });
        }
    }
}

/// Fails with one line for each fault.
fn assert_none(rule: &str, faults: Vec<String>) {
    assert!(faults.is_empty(), "{rule}:\n  {}", faults.join("\n  "));
}

#[test]
fn every_source_file_begins_with_what_it_is() {
    let faults = text_files()
        .into_iter()
        .filter(TextFile::is_rust)
        .filter(|f| !f.text.lines().next().is_some_and(|l| l.starts_with("//! ") && l.len() > 12))
        .map(|f| f.path);
    assert_none("the first line must be `//! ` and a sentence", faults.collect());
}

#[test]
fn no_source_file_is_too_long_or_vaguely_named() {
    let mut faults = Vec::new();
    for file in text_files().iter().filter(|f| f.is_rust()) {
        let lines = file.text.lines().count();
        let allowed = LONGER_FILES.iter().any(|(path, _)| *path == file.path);
        if lines > LINES_MAX && !allowed {
            faults.push(format!("{}: {lines} lines, at most {LINES_MAX}", file.path));
        }
        let stem = file.path.rsplit('/').next().unwrap_or("").trim_end_matches(".rs");
        if ["util", "utils", "common", "helper", "helpers", "misc"].contains(&stem) {
            faults.push(format!("{}: the name says nothing; use a noun of the domain", file.path));
        }
    }
    for (path, _) in LONGER_FILES {
        if !root().join(path).exists() {
            faults.push(format!("{path}: listed as an exception but not there"));
        }
    }
    assert_none("files hold one noun each", faults);
}

#[test]
fn nothing_is_left_half_done() {
    // Written in halves so that this file does not find itself.
    let banned = [
        concat!("to", "do!("),
        concat!("unimpl", "emented!("),
        concat!("#[", "ignore"),
        concat!("db", "g!("),
        concat!("TO", "DO"),
        concat!("FIX", "ME"),
        concat!("target-", "cpu=native"),
    ];
    let mut faults = Vec::new();
    for file in text_files().iter().filter(|f| f.is_rust() || f.path.ends_with(".toml")) {
        for (i, line) in file.text.lines().enumerate() {
            let found = banned.iter().filter(|b| line.contains(**b));
            faults.extend(found.map(|b| format!("{}:{}: {b}", file.path, i + 1)));
        }
    }
    assert_none("these have no place in the tree", faults);
}

/// Folders of the packages that ship.
fn packages() -> Vec<String> {
    let entries = fs::read_dir(root().join("crates")).expect("the folder can be read");
    let mut folders: Vec<String> = entries
        .map(|entry| entry.expect("an entry can be read"))
        .filter(|entry| entry.path().join("Cargo.toml").exists())
        .map(|entry| format!("crates/{}", entry.file_name().to_string_lossy()))
        .collect();
    folders.push("cluster/fea-worker".to_owned());
    folders.sort();
    assert!(folders.len() > 7, "only {} packages found", folders.len());
    folders
}

/// What each package may need of the others, and what it may not need at all.
const RULES: [(&str, &[&str], &[&str]); 13] = [
    // JSON is the text of glTF, no form of the wire: no type of core derives a form of it.
    ("crates/core", &[], &["tokio", "serde"]),
    ("crates/protocol", &[], &["nalgebra", "rayon"]),
    ("crates/os", &[], &["nalgebra", "rayon"]),
    ("crates/telemetry", &["softgrasp-protocol"], &["nalgebra", "rayon", "tokio"]),
    ("crates/grasp", &["softgrasp-core"], &["tokio", "serde", "serde_json"]),
    ("crates/hand", &["softgrasp-core", "softgrasp-grasp", "softgrasp-os"], &["tokio", "kiss3d"]),
    (
        "crates/window",
        &[
            "softgrasp-core",
            "softgrasp-grasp",
            "softgrasp-hand",
            "softgrasp-os",
            "softgrasp-protocol",
        ],
        &["tokio", "mcap", "serial2"],
    ),
    (
        "crates/xr",
        &["softgrasp-core", "softgrasp-grasp", "softgrasp-hand", "softgrasp-window"],
        &["kiss3d", "egui", "wgpu", "serial2"],
    ),
    (
        "crates/force",
        &["softgrasp-core", "softgrasp-os"],
        &["tokio", "kiss3d", "softgrasp-protocol"],
    ),
    ("crates/emulator", &["softgrasp-grasp", "softgrasp-hand"], &["tokio", "kiss3d"]),
    (
        "crates/fea-server",
        &["softgrasp-core", "softgrasp-os", "softgrasp-protocol", "softgrasp-telemetry"],
        &["kiss3d", "mcap", "serial2"],
    ),
    (
        "crates/glove-client",
        &[
            "softgrasp-core",
            "softgrasp-emulator",
            "softgrasp-force",
            "softgrasp-grasp",
            "softgrasp-hand",
            "softgrasp-os",
            "softgrasp-protocol",
            "softgrasp-telemetry",
            "softgrasp-window",
            "softgrasp-xr",
            "fea-server",
        ],
        &["tokio", "axum", "kiss3d", "egui", "wgpu"],
    ),
    (
        "cluster/fea-worker",
        &[
            "softgrasp-core",
            "softgrasp-os",
            "softgrasp-protocol",
            "softgrasp-telemetry",
            "fea-server",
        ],
        &["kiss3d", "mcap", "serial2", "mpi"],
    ),
];

#[test]
fn crates_depend_downwards_only() {
    let mut faults = Vec::new();
    let folders = RULES.map(|(folder, _, _)| folder.to_owned());
    let unruled = packages().into_iter().filter(|folder| !folders.contains(folder));
    faults.extend(unruled.map(|folder| format!("{folder} has no rule")));
    for (folder, allowed, forbidden) in RULES {
        let manifest = fs::read_to_string(root().join(folder).join("Cargo.toml"))
            .expect("every crate has a manifest");
        // Tests may need a package above: the drivers are tested against the emulator.
        let shipped = manifest.split("[dev-dependencies]").next().unwrap_or("");
        for line in shipped.lines() {
            let name = line.split(['.', ' ', '=']).next().unwrap_or("");
            let is_ours = name.starts_with("softgrasp-")
                || ["fea-server", "fea-worker", "glove-client"].contains(&name);
            if forbidden.contains(&name) || (is_ours && !allowed.contains(&name)) {
                faults.push(format!("{folder} depends on {name}"));
            }
        }
    }
    assert_none("layers", faults);
}

#[test]
fn no_file_imports_a_file_that_imports_it() {
    let folders = packages().into_iter().map(|folder| format!("{folder}/src"));
    let folders =
        folders.chain(["benches/src", "tests/src", "tests/verification/src"].map(String::from));
    let mut faults = Vec::new();
    let mut files = 0;
    for folder in folders {
        let package = Package::read(&root().join(&folder)).expect("sources can be read");
        files += package.len();
        let short = |file: &str| file.rsplit("/src/").next().unwrap_or(file).to_owned();
        faults.extend(package.circles().into_iter().map(|circle| {
            let circle: Vec<String> = circle.into_iter().map(short).collect();
            format!("{folder}: {}", circle.join(", "))
        }));
    }
    assert!(files > 200, "only {files} files read: the walk is broken");
    assert_none("these import each other in a circle", faults);
}

/// Files that may hold a once-cell or a bare mutex, each with the reason why it cannot hang.
const WAITING_FILES: [(&str, &str); 5] = [
    ("crates/core/src/solve/worked_out.rs", "set only when the work is done; nobody waits"),
    ("crates/core/src/solve/front/blocks.rs", "look-ups and changes of a list under it"),
    ("crates/core/src/solve/condensed/columns.rs", "look-ups and changes of a map under it"),
    ("crates/core/src/solve/condensed/free_tangent.rs", "look-ups and changes of a map under it"),
    ("crates/fea-server/src/lock.rs", "closures only; work that begins under it panics"),
];

#[test]
fn no_lock_or_once_cell_can_be_held_across_parallel_work() {
    let banned = ["OnceLock", "OnceCell", "LazyLock", "Mutex", "RwLock", "Condvar"];
    let mut faults = Vec::new();
    for file in text_files() {
        let is_solving = ["crates/core/src/", "crates/grasp/src/", "crates/fea-server/src/"]
            .iter()
            .any(|f| file.path.starts_with(f));
        if !is_solving || WAITING_FILES.iter().any(|(path, _)| *path == file.path) {
            continue;
        }
        for (line, text) in file.shipped_code() {
            // Those of tokio wait without a thread.
            let is_asynchronous = file.path.ends_with("/uploads.rs");
            let found = banned.iter().filter(|b| !is_asynchronous && text.contains(**b));
            faults.extend(found.map(|b| format!("{}:{line}: {b}", file.path)));
        }
    }
    assert_none("a thread that waits in a parallel loop takes other work: use Lock", faults);
}

#[test]
fn client_touches_the_server_crate_in_one_file() {
    let mut faults = Vec::new();
    let mut seen = false;
    for file in text_files().iter().filter(|f| f.path.starts_with("crates/glove-client/src/")) {
        for (line, text) in file.shipped_code() {
            if text.contains("fea_server") {
                seen |= file.path.ends_with("/connection.rs");
                // The page is encrypted by what encrypts the server; nothing is solved by it.
                let is_tls = file.path.ends_with("/run_page.rs") && text.contains("Encryption");
                if !file.path.ends_with("/connection.rs") && !is_tls {
                    faults.push(format!("{}:{line}: {}", file.path, text.trim()));
                }
            }
        }
    }
    assert!(seen, "connection.rs no longer starts the embedded server: change this rule");
    assert_none("everything but connection.rs goes over the wire", faults);
}

#[test]
fn core_and_grasp_have_no_files_sockets_clock_or_threads() {
    let banned =
        ["std::fs", "std::net", "std::time", "std::thread", "std::process", "std::env", "println!"];
    let mut faults = Vec::new();
    let is_pure = |file: &&TextFile| {
        ["crates/core/src/", "crates/grasp/src/"].iter().any(|f| file.path.starts_with(f))
    };
    for file in text_files().iter().filter(is_pure) {
        for (line, text) in file.shipped_code() {
            let found = banned.iter().filter(|b| text.contains(**b));
            faults.extend(found.map(|b| format!("{}:{line}: {b}", file.path)));
        }
    }
    assert_none("core and grasp are mathematics", faults);
}

/// Texts between single backticks on each line, code blocks left out.
fn quoted(text: &str) -> impl Iterator<Item = (usize, &str)> {
    let mut in_block = false;
    text.lines().enumerate().flat_map(move |(i, line)| {
        let fence = line.trim_start().starts_with("```");
        in_block ^= fence;
        let line = if in_block || fence { "" } else { line };
        line.split('`').skip(1).step_by(2).map(move |quote| (i + 1, quote))
    })
}

/// Whether a quoted text looks like a path of this repository.
fn looks_like_a_path(quote: &str) -> bool {
    let plain = quote.chars().all(|c| c.is_ascii_alphanumeric() || "._-/".contains(c));
    let folders = ["crates/", "tests/", "benches/", "docs/", "scenes/", "reports/", ".ci/"];
    let ends = [".rs", ".md", ".yml", ".sh"];
    plain
        && (folders.iter().any(|f| quote.starts_with(f)) || ends.iter().any(|e| quote.ends_with(e)))
}

#[test]
fn paths_in_the_documents_exist() {
    let files = text_files();
    let mut faults = Vec::new();
    let mut count = 0;
    for document in files.iter().filter(|f| f.path.ends_with(".md")) {
        for (line, quote) in quoted(&document.text).filter(|(_, q)| looks_like_a_path(q)) {
            count += 1;
            let suffix = format!("/{quote}");
            let exists = root().join(quote).exists()
                || files.iter().any(|f| f.path.ends_with(&suffix) || f.path == quote);
            if !exists {
                faults.push(format!("{}:{line}: `{quote}`", document.path));
            }
        }
        let folder = document.path.rsplit_once('/').map_or("", |(folder, _)| folder);
        for target in document.text.split("](").skip(1).filter_map(|rest| rest.split(')').next()) {
            let target = target.split('#').next().unwrap_or("");
            if !target.is_empty()
                && !target.contains("://")
                && !root().join(folder).join(target).exists()
            {
                faults.push(format!("{}: link to {target}", document.path));
            }
        }
    }
    assert!(count > 50, "only {count} paths found in the documents: the search is broken");
    assert_none("these do not exist", faults);
}

/// Equation numbers in the form `(3.43a)` or `(A.1)`.
fn equations(text: &str) -> BTreeSet<&str> {
    let inside = text.split('(').skip(1).filter_map(|rest| rest.split_once(')'));
    inside.map(|(number, _)| number).filter(|n| is_equation_number(n)).collect()
}

fn is_equation_number(text: &str) -> bool {
    let Some((chapter, number)) = text.split_once('.') else { return false };
    let digits = number.trim_end_matches(['a', 'b']);
    matches!(chapter, "3" | "4" | "6" | "A" | "B" | "C")
        && number.len() - digits.len() <= 1
        && (1..=2).contains(&digits.len())
        && digits.chars().all(|c| c.is_ascii_digit())
        && !digits.starts_with('0')
}

#[test]
fn equation_numbers_are_recognised() {
    let text = "as (3.43a), (4.10)–(4.9) and (A.1), not (3.5 mm), (3.05), (2.1), 4.5 or (1, 0)";
    assert_eq!(equations(text).into_iter().collect::<Vec<_>>(), ["3.43a", "4.10", "4.9", "A.1"]);
}

#[test]
fn every_thesis_equation_is_in_the_notation() {
    let notation = fs::read_to_string(root().join("docs/notation.md")).expect("notation.md");
    let listed = equations(&notation);
    let mut wanted: BTreeSet<String> = BTreeSet::new();
    wanted.extend((8..=50).filter(|n| ![42, 43].contains(n)).map(|n| format!("3.{n}")));
    wanted
        .extend(["3.7", "3.42a", "3.42b", "3.43a", "3.43b", "6.1", "A.1", "A.2"].map(String::from));
    wanted.extend((1..=10).map(|n| format!("4.{n}")));
    wanted.extend((1..=5).map(|n| format!("C.{n}")));
    let faults = wanted.iter().filter(|n| !listed.contains(n.as_str())).map(|n| format!("({n})"));
    assert_none("docs/notation.md has no row for", faults.collect());
}

#[test]
fn equations_cited_in_the_code_are_in_the_notation() {
    let notation = fs::read_to_string(root().join("docs/notation.md")).expect("notation.md");
    let listed = equations(&notation);
    let mut faults = Vec::new();
    let mut count = 0;
    for file in text_files().iter().filter(|f| f.is_rust() && f.path.starts_with("crates/")) {
        for (i, line) in file.text.lines().enumerate().filter(|(_, line)| is_comment(line)) {
            for number in equations(line) {
                count += 1;
                // (3.43) stands for (3.43a) and (3.43b).
                let half = format!("{number}a");
                if !listed.contains(number) && !listed.contains(half.as_str()) {
                    faults.push(format!("{}:{}: ({number})", file.path, i + 1));
                }
            }
        }
    }
    assert!(count > 50, "only {count} citations found: the search is broken");
    assert_none("docs/notation.md does not know", faults);
}

#[test]
fn names_in_the_notation_are_in_the_files_beside_them() {
    let notation = fs::read_to_string(root().join("docs/notation.md")).expect("notation.md");
    let mut faults = Vec::new();
    let mut count = 0;
    for row in notation.lines().filter(|line| line.starts_with("| ")) {
        let quotes = || row.split('`').skip(1).step_by(2);
        let texts: Vec<String> = quotes()
            .filter(|q| q.ends_with(".rs"))
            .filter_map(|path| fs::read_to_string(root().join(path)).ok())
            .collect();
        for quote in quotes().filter(|q| !looks_like_a_path(q)) {
            for name in quote.split("::").filter_map(|part| part.split(['(', ' ']).next()) {
                count += 1;
                if !texts.iter().any(|text| text.contains(name)) && name != "fem" {
                    faults.push(format!("{name}: {row}"));
                }
            }
        }
    }
    assert!(count > 50, "only {count} names found in the tables: the search is broken");
    assert_none("no file of the row has the name", faults);
}

#[test]
fn no_file_names_a_place_on_one_machine() {
    // Written in halves so that this file does not find itself.
    let places = [
        concat!("/ho", "me/"),
        concat!("/ro", "ot/"),
        concat!("/wo", "rk/"),
        concat!("/Us", "ers/"),
        concat!("C:", "\\"),
    ];
    let mut faults = Vec::new();
    for file in text_files() {
        for (i, line) in file.text.lines().enumerate() {
            let found = places.iter().filter(|p| line.contains(**p));
            faults.extend(found.map(|p| format!("{}:{}: {p}", file.path, i + 1)));
        }
    }
    assert_none("absolute paths", faults);
}

#[test]
fn ci_runs_the_test_command_of_the_readme() {
    let command = "cargo test --workspace";
    let read = |path: &str| fs::read_to_string(root().join(path)).expect("the file is there");
    let has_line = |text: &str, line: &str| text.lines().any(|l| l.trim() == line);
    assert!(has_line(&read(".ci/run"), &format!("step {command}")), ".ci/run");
    let shown = read("README.md").lines().any(|l| l.starts_with(command));
    assert!(shown, "README.md does not show `{command}`");
}
