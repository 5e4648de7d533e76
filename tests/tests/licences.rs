//! Every package of the lock file is under a licence that `deny.toml` allows, and the documents say so.

#![allow(clippy::print_stdout, reason = "a helper says what is skipped")]

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::process::Command;

use serde_json::Value;

/// Licences that `deny.toml` allows.
struct Allowed {
    all: BTreeSet<String>,
    /// Licences that it allows for single packages besides.
    exceptions: BTreeMap<String, BTreeSet<String>>,
}

impl Allowed {
    fn read() -> Self {
        let deny: toml::Table = toml::from_str(&read("deny.toml")).expect("deny.toml");
        let licences = &deny["licenses"];
        let texts = |value: &toml::Value| -> BTreeSet<String> {
            let texts = value.as_array().expect("a list").iter();
            texts.map(|text| text.as_str().expect("a licence").to_owned()).collect()
        };
        let exceptions = licences["exceptions"].as_array().expect("a list").iter();
        let exceptions = exceptions.map(|exception| {
            let name = exception["crate"].as_str().expect("the name of a package");
            (name.to_owned(), texts(&exception["allow"]))
        });
        Self { all: texts(&licences["allow"]), exceptions: exceptions.collect() }
    }

    /// Allowed licences by which a package can be used, or the reason why it cannot.
    fn of(&self, package: &Package) -> Result<BTreeSet<String>, String> {
        let Package { name, version, licence } = package;
        let expression = spdx::Expression::parse_mode(licence, spdx::ParseMode::LAX)
            .map_err(|error| format!("{name} {version}: {licence:?} ({})", error.reason))?;
        let exceptions = self.exceptions.get(name);
        let mut used = BTreeSet::new();
        let is_allowed = expression.evaluate(|wanted| {
            let id = wanted.license.id().map(|id| id.name.to_owned());
            let id = id.filter(|_| wanted.addition.is_none()).filter(|id| {
                self.all.contains(id) || exceptions.is_some_and(|more| more.contains(id))
            });
            let is_allowed = id.is_some();
            used.extend(id);
            is_allowed
        });
        match is_allowed {
            true => Ok(used),
            false => Err(format!("{name} {version}: {licence}")),
        }
    }
}

/// Package of the lock file.
struct Package {
    name: String,
    version: String,
    licence: String,
}

fn root() -> PathBuf {
    let manifest = Path::new(env!("CARGO_MANIFEST_DIR"));
    manifest.parent().expect("the package lies in a folder of the workspace").to_owned()
}

fn read(path: &str) -> String {
    std::fs::read_to_string(root().join(path)).expect(path)
}

/// Packages that cargo lists with these arguments; `None` if it cannot, because some are not on this
/// machine.
fn packages(arguments: &[&str]) -> Option<Vec<Package>> {
    let cargo = std::env::var("CARGO").unwrap_or_else(|_| "cargo".to_owned());
    let output = Command::new(cargo)
        .args(["metadata", "--format-version", "1", "--locked", "--offline"])
        .args(arguments)
        .current_dir(root())
        .output()
        .expect("cargo");
    let told: Value = serde_json::from_slice(&output.stdout).ok()?;
    let text = |package: &Value, key: &str| package[key].as_str().unwrap_or("").to_owned();
    let packages = told["packages"].as_array()?.iter().map(|package| Package {
        name: text(package, "name"),
        version: text(package, "version"),
        licence: text(package, "license"),
    });
    Some(packages.collect())
}

/// All packages, or those of this machine's platform without further features if the others are missing; and
/// whether it is all.
fn packages_that_are_there() -> (Vec<Package>, bool) {
    if let Some(packages) = packages(&["--all-features"]) {
        return (packages, true);
    }
    println!(
        "partly skipped: packages of other systems and features are not here (cargo fetch --locked)"
    );
    let host = Command::new("rustc").arg("-vV").output().expect("rustc").stdout;
    let host = String::from_utf8(host).expect("text");
    let host = host.lines().find_map(|line| line.strip_prefix("host: ")).expect("a platform");
    let packages = packages(&["--filter-platform", host]);
    (packages.expect("the packages that this test was built with"), false)
}

#[test]
fn every_package_is_under_an_allowed_licence_and_every_allowed_one_is_needed() {
    let allowed = Allowed::read();
    let (packages, is_all) = packages_that_are_there();
    assert!(packages.len() > 100, "only {} packages found", packages.len());
    let mut used = BTreeSet::new();
    let mut faults = Vec::new();
    for package in &packages {
        match allowed.of(package) {
            Ok(licences) => used.extend(licences),
            Err(fault) => faults.push(fault),
        }
    }
    assert!(faults.is_empty(), "look at these, then at deny.toml:\n  {}", faults.join("\n  "));
    if is_all {
        let unused: Vec<_> = allowed.all.difference(&used).collect();
        assert!(unused.is_empty(), "deny.toml allows what no package has: {unused:?}");
        for name in allowed.exceptions.keys() {
            assert!(packages.iter().any(|package| package.name == *name), "{name} is not used");
        }
    }
}

#[test]
fn licence_that_is_not_allowed_is_found_whatever_it_is_joined_to() {
    let allowed = Allowed::read();
    let of = |name: &str, licence: &str| {
        let (name, licence) = (name.to_owned(), licence.to_owned());
        allowed.of(&Package { name, version: "1.0.0".to_owned(), licence }).is_ok()
    };
    for licence in ["MIT", "MIT/Apache-2.0", "GPL-3.0-only OR MIT", "(MIT OR GPL-2.0) AND ISC"] {
        assert!(of("a", licence), "{licence}");
    }
    for licence in ["GPL-3.0-only", "MIT AND MPL-2.0", "LGPL-2.1-or-later", "", "mine", "NCSA"] {
        assert!(!of("a", licence), "{licence}");
    }
    assert!(of("libfuzzer-sys", "(MIT OR Apache-2.0) AND NCSA"));
}

#[test]
fn decisions_name_the_licences_that_are_allowed_and_no_others() {
    let allowed = Allowed::read();
    let mut wanted = allowed.all;
    for (name, licences) in allowed.exceptions {
        wanted.insert(name);
        wanted.extend(licences);
    }
    let decisions = read("docs/decisions.md");
    let begins = "Every package of the lock file";
    let sentence = decisions.lines().find(|line| line.starts_with(begins)).expect(begins);
    let words = sentence.split(|c: char| !(c.is_ascii_alphanumeric() || "-._".contains(c)));
    let words = words.map(|word| word.trim_matches('.').to_owned());
    let is_meant = |word: &String| {
        spdx::license_id(word).is_some() || word.contains(['_', '-']) || wanted.contains(word)
    };
    let named: BTreeSet<String> = words.filter(is_meant).collect();
    assert_eq!(named, wanted, "{sentence}");
}

#[test]
fn ci_asks_cargo_deny_where_it_is_there() {
    assert!(read(".ci/run").lines().any(|line| line.trim() == "step cargo deny check"));
}
