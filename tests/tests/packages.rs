//! The crates are ready for a registry: what it shows of them, their licences, examples and versions.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

use toml::{Table, Value};

/// Packages that belong to the repository only.
const PRIVATE: [&str; 5] = ["tests", "tests/verification", "benches", "fuzz", "cluster/fea-worker"];
/// Categories that our crates are in, as crates.io writes them (its file `categories.toml`, 2026-11-26).
const CATEGORIES: [&str; 14] = [
    "command-line-utilities",
    "concurrency",
    "emulators",
    "encoding",
    "hardware-support",
    "mathematics",
    "network-programming",
    "os",
    "parser-implementations",
    "rendering",
    "science",
    "science::robotics",
    "simulation",
    "visualization",
];
/// Those of the page for browsers.
const WEB_CATEGORIES: [&str; 2] = ["web-programming::http-server", "web-programming::websocket"];

fn root() -> PathBuf {
    let manifest = Path::new(env!("CARGO_MANIFEST_DIR"));
    manifest.parent().expect("the package lies in a folder of the workspace").to_owned()
}

fn read(path: &str) -> String {
    fs::read_to_string(root().join(path)).unwrap_or_else(|error| panic!("{path}: {error}"))
}

fn manifest(folder: &str) -> Table {
    toml::from_str(&read(&format!("{folder}/Cargo.toml"))).expect("a manifest")
}

/// Folders of the packages that are published.
fn published() -> Vec<String> {
    let entries = fs::read_dir(root().join("crates")).expect("the folder can be read");
    let names = entries.map(|entry| entry.expect("an entry can be read").file_name());
    let mut folders: Vec<String> =
        names.map(|name| format!("crates/{}", name.to_string_lossy())).collect();
    folders.sort();
    assert!(folders.len() > 7, "only {} packages found", folders.len());
    folders
}

fn texts(value: &Value) -> Vec<&str> {
    let texts = value.as_array().expect("a list").iter();
    texts.map(|text| text.as_str().expect("a text")).collect()
}

#[test]
fn every_published_package_says_what_it_is() {
    let mut descriptions = BTreeSet::new();
    for folder in published() {
        let package = &manifest(&folder)["package"];
        let description = package["description"].as_str().expect("a description").to_owned();
        assert!((20..=200).contains(&description.len()), "{folder}: {description}");
        assert!(descriptions.insert(description), "{folder} says what another one says");
        let keywords = texts(&package["keywords"]);
        assert!((3..=5).contains(&keywords.len()), "{folder}: {keywords:?}");
        for word in keywords {
            let plain = |c: char| c.is_ascii_alphanumeric() || c == '-';
            assert!(word.len() <= 20 && word.chars().all(plain), "{folder}: {word}");
        }
        let categories = texts(&package["categories"]);
        assert!((1..=5).contains(&categories.len()), "{folder}: {categories:?}");
        for name in categories {
            let is_known = CATEGORIES.contains(&name) || WEB_CATEGORIES.contains(&name);
            assert!(is_known, "{folder}: look whether crates.io has {name}");
        }
        for inherited in ["version", "license", "repository", "rust-version"] {
            assert_eq!(package[inherited]["workspace"].as_bool(), Some(true), "{folder}");
        }
        assert!(package.get("publish").is_none(), "{folder} cannot be published");
    }
}

#[test]
fn every_published_package_has_both_licences_and_their_texts_are_ours() {
    for folder in published() {
        for name in ["LICENSE-MIT", "LICENSE-APACHE"] {
            assert_eq!(read(&format!("{folder}/{name}")), read(name), "{folder}");
        }
        let included = manifest(&folder)["package"]["include"].clone();
        for wanted in ["src/**", "README.md", "LICENSE-*"] {
            assert!(texts(&included).contains(&wanted), "{folder}: {wanted}");
        }
    }
}

/// First block of Rust in a text of which each line begins with `before`.
fn example(text: &str, before: &str, fence: &str) -> Vec<String> {
    let lines = text.lines().map_while(|line| match before.is_empty() {
        true => Some(line),
        false => line.strip_prefix(before).map(|line| line.strip_prefix(' ').unwrap_or(line)),
    });
    let inside = lines.skip_while(|line| *line != fence).skip(1).take_while(|line| *line != "```");
    // Lines that rustdoc hides would be shown on the page of a registry.
    inside.filter(|line| !line.starts_with("# ")).map(str::to_owned).collect()
}

#[test]
fn example_of_each_readme_is_the_one_that_the_crate_is_tested_with() {
    for folder in published() {
        let shown = example(&read(&format!("{folder}/README.md")), "", "```rust");
        let tested = example(&read(&format!("{folder}/src/lib.rs")), "//!", "```");
        assert!(shown.len() > 4, "{folder}/README.md has no example");
        assert_eq!(shown, tested, "{folder}");
    }
}

#[test]
fn versions_beside_paths_are_that_of_the_workspace() {
    let workspace = manifest(".")["workspace"].clone();
    let version = &workspace["package"]["version"];
    let mut count = 0;
    for (name, dependency) in workspace["dependencies"].as_table().expect("a table") {
        let path = dependency.get("path").and_then(Value::as_str);
        if let Some(path) = path.filter(|path| path.starts_with("crates/")) {
            assert_eq!(dependency.get("version"), Some(version), "{name}");
            assert_eq!(manifest(path)["package"]["name"].as_str(), Some(name.as_str()));
            count += 1;
        }
    }
    assert_eq!(count, published().len());
    let python: Table = toml::from_str(&read("clients/python/pyproject.toml")).expect("a project");
    assert_eq!(&python["project"]["version"], version);
}

#[test]
fn what_is_built_without_being_asked_for_needs_nothing_outside_rust() {
    let worker = "cluster/fea-worker";
    let workspace = manifest(".")["workspace"].clone();
    let members = texts(&workspace["members"]);
    let mut built = texts(&workspace["default-members"]);
    built.push(worker);
    assert_eq!(built, members, "all members but the worker, in the same order");
    for folder in members.iter().filter(|folder| **folder != worker) {
        let manifest = manifest(folder);
        for kind in ["dependencies", "dev-dependencies", "build-dependencies"] {
            let needed = manifest.get(kind).and_then(Value::as_table);
            for name in needed.into_iter().flat_map(Table::keys) {
                let outside = ["fea-worker", "cc", "pkg-config", "mpi", "mpi-sys"];
                assert!(!outside.contains(&name.as_str()), "{folder} needs {name}");
            }
        }
    }
}

#[test]
fn packages_of_the_repository_only_cannot_be_published() {
    let workspace = manifest(".")["workspace"]["package"]["publish"].clone();
    assert_eq!(workspace.as_bool(), Some(false));
    for folder in PRIVATE {
        let publish = manifest(folder)["package"]["publish"].clone();
        let is_inherited = publish.get("workspace").and_then(Value::as_bool) == Some(true);
        assert!(is_inherited || publish.as_bool() == Some(false), "{folder}");
    }
}

#[test]
fn no_published_package_needs_a_private_one() {
    let private: Vec<String> = PRIVATE
        .iter()
        .map(|folder| manifest(folder)["package"]["name"].as_str().expect("a name").to_owned())
        .collect();
    for folder in published() {
        let manifest = manifest(&folder);
        for kind in ["dependencies", "dev-dependencies"] {
            let Some(table) = manifest.get(kind).and_then(Value::as_table) else { continue };
            let found: Vec<_> = table.keys().filter(|name| private.contains(name)).collect();
            assert!(found.is_empty(), "{folder} needs {found:?}");
        }
    }
}

/// Packages that the manifest in `folder` always depends on, by their name in a lock file.
fn needed(folder: &str) -> BTreeSet<String> {
    let manifest = manifest(folder);
    let tables = manifest.get("dependencies").and_then(Value::as_table).into_iter();
    let always = tables
        .flatten()
        .filter(|(_, wanted)| wanted.get("optional").and_then(Value::as_bool) != Some(true));
    let named = always.map(|(name, wanted)| match wanted.get("package").and_then(Value::as_str) {
        Some(package) => package.to_owned(),
        None => name.clone(),
    });
    named.collect()
}

/// Symptom: the fuzz targets took newer versions than everything else, which were loaded and compiled for them alone.
#[test]
fn fuzz_targets_take_the_versions_of_the_workspace_and_build_them_in_the_same_way() {
    let locked = |file: &str| -> BTreeSet<(String, String)> {
        let lock: Table = toml::from_str(&read(file)).expect("a lock file");
        let packages = lock["package"].as_array().expect("packages").iter();
        let text = |package: &toml::Value, key: &str| {
            package.get(key).and_then(toml::Value::as_str).unwrap_or_default().to_owned()
        };
        packages.map(|package| (text(package, "name"), text(package, "version"))).collect()
    };
    let (ours, of_fuzz) = (locked("Cargo.lock"), locked("fuzz/Cargo.lock"));
    assert!(of_fuzz.len() > 200, "only {} packages", of_fuzz.len());
    let other: Vec<_> = of_fuzz.difference(&ours).filter(|p| p.0 != "softgrasp-fuzz").collect();
    let fix = "cp Cargo.lock fuzz/Cargo.lock && cargo metadata --manifest-path fuzz/Cargo.toml";
    assert!(other.is_empty(), "{other:?} are of other versions: run `{fix}`");
    let profile = |folder: &str| manifest(folder)["profile"]["dev"].clone();
    let (ours, of_fuzz) = (profile("."), profile("fuzz"));
    for (key, value) in of_fuzz.as_table().expect("a profile") {
        let Some(packages) = value.as_table() else {
            assert_eq!(ours.get(key), Some(value), "{key} of the fuzz targets' profile");
            continue;
        };
        for (package, settings) in packages {
            assert_eq!(ours[key].get(package), Some(settings), "{package} in fuzz/Cargo.toml");
        }
    }
}

/// Symptom: `cargo check --locked` of the fuzz targets failed, because a crate of ours had a new dependency.
#[test]
fn lock_file_of_the_fuzz_targets_has_what_our_crates_need() {
    let lock: Table = toml::from_str(&read("fuzz/Cargo.lock")).expect("a lock file");
    let mut seen = 0;
    for folder in published() {
        let name = manifest(&folder)["package"]["name"].as_str().expect("a name").to_owned();
        let packages = lock["package"].as_array().expect("packages");
        let Some(locked) = packages.iter().find(|package| package["name"].as_str() == Some(&name))
        else {
            continue;
        };
        seen += 1;
        let dependencies = locked.get("dependencies").map(texts).unwrap_or_default();
        // A version stands behind the name where two versions of a package are there.
        let names: BTreeSet<&str> =
            dependencies.iter().map(|text| text.split(' ').next().unwrap_or(text)).collect();
        for package in needed(&folder) {
            let fix = "cargo metadata --manifest-path fuzz/Cargo.toml";
            assert!(names.contains(package.as_str()), "{name} needs {package}: run `{fix}`");
        }
    }
    assert!(seen > 5, "only {seen} of our crates are in the lock file");
}
