//! Which source file imports which, read from the `use` lines and paths of a package.
//!
//! A name that a file only hands on (`pub use child::Name`) counts as imported from the file that
//! defines it, so a table of contents ties nothing. Methods that a file gives to a type of another file
//! (an inherent `impl`) tie both ways: whoever has the type has them, and they work on its fields. Code
//! behind `#[cfg(test)]` is left out.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::Path;

/// Files of one package by module path (`["plan", "once"]`), the root under an empty path.
pub struct Package {
    modules: BTreeMap<Vec<String>, Module>,
}

struct Module {
    /// Path of the file, from the folder given.
    file: String,
    /// Paths that the file names, from its own module on.
    paths: Vec<Vec<String>>,
    /// Names that the file brings into its own scope, each with the path behind it.
    names: BTreeMap<String, Vec<String>>,
    /// Modules of which the file brings all names into its scope.
    globs: Vec<Vec<String>>,
    /// Types that the file gives methods to.
    implemented: Vec<Vec<String>>,
}

impl Package {
    /// Reads the package whose root file is `lib.rs` or `main.rs` in `folder`.
    ///
    /// # Errors
    /// Error of the operating system if a file cannot be read.
    pub fn read(folder: &Path) -> std::io::Result<Self> {
        let mut modules = BTreeMap::new();
        collect(folder, &[], &mut modules)?;
        Ok(Self { modules })
    }

    /// Number of files.
    pub fn len(&self) -> usize {
        self.modules.len()
    }

    /// Whether the package has no file.
    pub fn is_empty(&self) -> bool {
        self.modules.is_empty()
    }

    /// For each file, the files that it imports from or has methods from.
    pub fn imports(&self) -> BTreeMap<&str, BTreeSet<&str>> {
        let of_module = |(at, module): (&Vec<String>, &Module)| {
            let found = module.paths.iter().filter_map(|path| self.definition(at, path, 0));
            let others = found.filter(|file| *file != module.file);
            (self.modules[at].file.as_str(), others.collect())
        };
        let mut imports: BTreeMap<&str, BTreeSet<&str>> =
            self.modules.iter().map(of_module).collect();
        for (at, module) in &self.modules {
            let defining =
                module.implemented.iter().filter_map(|path| self.definition(at, path, 0));
            for file in defining.filter(|file| *file != module.file) {
                imports.entry(file).or_default().insert(&module.file);
                imports.entry(&module.file).or_default().insert(file);
            }
        }
        imports
    }

    /// Circles of files that import each other.
    pub fn circles(&self) -> Vec<Vec<&str>> {
        let imports = self.imports();
        let reached: BTreeMap<&str, BTreeSet<&str>> =
            imports.keys().map(|&file| (file, reached_from(file, &imports))).collect();
        let mut circles: BTreeSet<Vec<&str>> = BTreeSet::new();
        for (&file, others) in &reached {
            if others.contains(file) {
                let is_mutual = |other: &&&str| reached[**other].contains(file);
                circles.insert(others.iter().filter(is_mutual).copied().collect());
            }
        }
        circles.into_iter().collect()
    }

    /// File that defines what `path` names in the module `at`; `None` for other packages.
    fn definition(&self, at: &[String], path: &[String], depth: usize) -> Option<&str> {
        // Names that are handed on in a circle end here.
        if depth > 16 {
            return None;
        }
        let mut here = at.to_vec();
        let mut rest = path;
        match path.first().map(String::as_str)? {
            "crate" => {
                here.clear();
                rest = &path[1..];
            }
            "self" => rest = &path[1..],
            "super" => {
                while rest.first().is_some_and(|part| part == "super") {
                    here.pop()?;
                    rest = &rest[1..];
                }
            }
            // A child, or a name in scope; else another package or a local name.
            first => {
                let child = [here.as_slice(), &[first.to_owned()]].concat();
                let module = self.modules.get(&here)?;
                if !self.modules.contains_key(&child) && !module.names.contains_key(first) {
                    return None;
                }
            }
        }
        while let Some(part) = rest.first() {
            let child = [here.as_slice(), std::slice::from_ref(part)].concat();
            if self.modules.contains_key(&child) {
                here = child;
                rest = &rest[1..];
                continue;
            }
            let module = self.modules.get(&here)?;
            if let Some(behind) = module.names.get(part) {
                return self.definition(&here, behind, depth + 1);
            }
            let behind =
                |glob: &Vec<String>| [glob.as_slice(), std::slice::from_ref(part)].concat();
            let by_glob = module.globs.iter().filter_map(|glob| {
                let found = self.definition(&here, &behind(glob), depth + 1)?;
                // Found in the module itself, which need not define it.
                (self.definition(&here, glob, depth + 1) != Some(found)).then_some(found)
            });
            return by_glob.into_iter().next().or(Some(&module.file));
        }
        self.modules.get(&here).map(|module| module.file.as_str())
    }
}

fn reached_from<'a>(
    file: &str,
    imports: &BTreeMap<&'a str, BTreeSet<&'a str>>,
) -> BTreeSet<&'a str> {
    let mut reached = BTreeSet::new();
    let mut open: Vec<&str> = imports[file].iter().copied().collect();
    while let Some(next) = open.pop() {
        if reached.insert(next) {
            open.extend(&imports[next]);
        }
    }
    reached
}

fn collect(
    folder: &Path,
    at: &[String],
    modules: &mut BTreeMap<Vec<String>, Module>,
) -> std::io::Result<()> {
    for entry in fs::read_dir(folder)? {
        let path = entry?.path();
        let stem = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        let inside = |name: String| [at, &[name]].concat();
        if path.is_dir() {
            if stem != "tests" && stem != "bin" {
                collect(&path, &inside(stem), modules)?;
            }
        } else if path.extension().is_some_and(|end| end == "rs") {
            let is_test = stem == "tests" || stem.ends_with("_tests");
            let own = match stem.as_str() {
                "lib" | "mod" => at.to_vec(),
                // A program beside a library is a package of its own, of one file.
                "main" if folder.join("lib.rs").exists() => continue,
                "main" => at.to_vec(),
                _ => inside(stem),
            };
            if !is_test {
                modules.insert(own, Module::read(&path)?);
            }
        }
    }
    Ok(())
}

impl Module {
    fn read(path: &Path) -> std::io::Result<Self> {
        let code = without_comments_and_tests(&fs::read_to_string(path)?);
        let file = path.to_string_lossy().replace('\\', "/");
        let (mut paths, mut names, mut globs) = (Vec::new(), BTreeMap::new(), Vec::new());
        let mut rest = String::new();
        for (i, statement) in code.split(';').enumerate() {
            let begins = statement.rfind("use ").filter(|at| is_word_start(statement, *at));
            match begins {
                Some(at) => {
                    rest.push_str(&statement[..at]);
                    for (name, behind) in expanded(&statement[at + 4..]) {
                        paths.push(behind.clone());
                        match name.as_str() {
                            "*" => globs.push(behind),
                            _ => drop(names.insert(name, behind)),
                        }
                    }
                }
                None => rest.push_str(statement),
            }
            if i > 0 {
                rest.push(' ');
            }
        }
        paths.extend(inline_paths(&rest));
        let implemented = implemented(&code);
        Ok(Self { file, paths, names, globs, implemented })
    }
}

fn is_word_start(text: &str, at: usize) -> bool {
    !text[..at].ends_with(|c: char| c.is_alphanumeric() || c == '_' || c == '"')
}

/// Names and paths of a `use` tree: `a::{b, c as d, self}`.
fn expanded(tree: &str) -> Vec<(String, Vec<String>)> {
    let tree = tree.trim();
    let Some((head, inner)) = tree.split_once('{') else {
        let (path, name) = match tree.split_once(" as ") {
            Some((path, name)) => (path, Some(name.trim().to_owned())),
            None => (tree, None),
        };
        let mut path: Vec<String> = path.split("::").map(|part| part.trim().to_owned()).collect();
        let is_glob = path.last().is_some_and(|last| last == "*");
        if is_glob || path.last().is_some_and(|last| last == "self") {
            path.pop();
        }
        let last = if is_glob { Some("*".to_owned()) } else { path.last().cloned() };
        return vec![(name.or(last).unwrap_or_default(), path)];
    };
    let inner = inner.trim_end().strip_suffix('}').unwrap_or(inner);
    let parts = split_outside_braces(inner).into_iter().filter(|part| !part.trim().is_empty());
    parts.flat_map(|part| expanded(&format!("{}{}", head.trim(), part.trim()))).collect()
}

fn split_outside_braces(text: &str) -> Vec<&str> {
    let (mut depth, mut start, mut parts) = (0, 0, Vec::new());
    for (at, c) in text.char_indices() {
        match c {
            '{' => depth += 1,
            '}' => depth -= 1,
            ',' if depth == 0 => {
                parts.push(&text[start..at]);
                start = at + 1;
            }
            _ => {}
        }
    }
    parts.push(&text[start..]);
    parts
}

/// The types of `impl` blocks without a trait, at the beginning of a line as rustfmt leaves them.
fn implemented(code: &str) -> Vec<Vec<String>> {
    let headers = code.lines().filter_map(|line| line.strip_prefix("impl"));
    let types = headers.filter_map(|header| {
        let header = match header.strip_prefix('<') {
            Some(_) => &header[closing(header, ['<', '>'])..],
            None => header,
        };
        let name = header.trim_start().split(['<', ' ', '{']).next()?;
        let is_of_trait = header.contains(" for ");
        let is_own = ["struct", "enum"].iter().any(|kind| {
            let ends = |rest: &str| !rest.starts_with(|c: char| c.is_alphanumeric() || c == '_');
            code.split(&format!("{kind} {name}")).skip(1).any(ends)
        });
        (!is_of_trait && !is_own && !name.is_empty())
            .then(|| name.split("::").map(str::to_owned).collect())
    });
    types.collect()
}

/// Paths in the code itself: words joined by `::`.
fn inline_paths(code: &str) -> Vec<Vec<String>> {
    let is_part = |c: char| c.is_alphanumeric() || c == '_' || c == ':';
    let words = code.split(|c: char| !is_part(c)).filter(|word| word.contains("::"));
    words
        .map(|word| word.split("::").map(str::to_owned).collect::<Vec<_>>())
        .filter(|path| !path[0].is_empty() && path[0] != "Self")
        .map(|path| path.into_iter().filter(|part| !part.is_empty()).collect())
        .collect()
}

/// Code without comments, and without items that are compiled for tests only.
fn without_comments_and_tests(text: &str) -> String {
    let lines = text.lines().map(|line| match line.find("//") {
        Some(at) if !line[..at].contains('"') => &line[..at],
        _ => line,
    });
    let mut code = lines.collect::<Vec<_>>().join("\n");
    let of_tests = |code: &str| {
        ["#[cfg(test)]", "#[cfg(all(test"].iter().filter_map(|text| code.find(text)).min()
    };
    while let Some(at) = of_tests(&code) {
        let item = &code[at..];
        let end = match (item.find(';'), item.find('{')) {
            (Some(semicolon), Some(brace)) if semicolon < brace => semicolon + 1,
            (Some(semicolon), None) => semicolon + 1,
            (_, Some(brace)) => brace + closing(&item[brace..], ['{', '}']),
            (None, None) => item.len(),
        };
        code.replace_range(at..at + end, "");
    }
    code
}

/// Length of a text up to the bracket that closes the first one.
fn closing(text: &str, [opens, closes]: [char; 2]) -> usize {
    let mut depth = 0;
    for (at, c) in text.char_indices() {
        if c == opens {
            depth += 1;
        } else if c == closes {
            depth -= 1;
        }
        if depth == 0 {
            return at + 1;
        }
    }
    text.len()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn package(files: &[(&str, &str)]) -> (tempfile::TempDir, Package) {
        let folder = tempfile::tempdir().unwrap();
        for (path, text) in files {
            let path = folder.path().join(path);
            fs::create_dir_all(path.parent().unwrap()).unwrap();
            fs::write(path, text).unwrap();
        }
        let package = Package::read(folder.path()).unwrap();
        (folder, package)
    }

    fn ends(circles: Vec<Vec<&str>>) -> Vec<Vec<String>> {
        let name = |file: &str| file.rsplit('/').next().unwrap().to_owned();
        circles.into_iter().map(|circle| circle.into_iter().map(name).collect()).collect()
    }

    #[test]
    fn table_of_contents_ties_nothing_and_a_circle_around_it_is_found() {
        let table = "mod a;\nmod b;\npub use a::{A, One as Two};\npub use b::B;\n";
        let (_folder, package) = package(&[
            ("lib.rs", "mod part;\nuse part::A;\n"),
            ("part/mod.rs", table),
            ("part/a.rs", "pub struct A;\npub struct One;\n// use super::B;\n"),
            ("part/b.rs", "use super::{A, Two};\npub struct B;\n"),
        ]);
        assert_eq!(package.len(), 4);
        assert_eq!(package.circles(), Vec::<Vec<&str>>::new());

        let (_folder, package) = self::package(&[
            ("lib.rs", "mod part;\n"),
            ("part/mod.rs", table),
            ("part/a.rs", "pub struct A;\npub struct One;\nfn f() { super::b::g(); }\n"),
            ("part/b.rs", "use crate::part::Two;\npub struct B;\npub fn g() {}\n"),
        ]);
        assert_eq!(ends(package.circles()), [["a.rs", "b.rs"]]);
    }

    #[test]
    fn methods_for_a_type_of_another_file_are_a_circle_but_a_trait_for_it_is_none() {
        let files = |b: &str| {
            let lib = "mod a;\nmod b;\nmod c;\n";
            let a = "pub struct A<T>(T);\nimpl<T> A<T> {\n}\n";
            let c = "pub use crate::a::A;\n";
            self::package(&[("lib.rs", lib), ("a.rs", a), ("b.rs", b), ("c.rs", c)])
        };
        let (_folder, package) = files("use crate::c::A;\nimpl<T: Into<u8>> A<T> {\n}\n");
        assert_eq!(ends(package.circles()), [["a.rs", "b.rs"]]);
        let (_folder, package) = files("impl crate::a::A<u8> {\n    fn f() {}\n}\n");
        assert_eq!(ends(package.circles()), [["a.rs", "b.rs"]]);
        let (_folder, package) = files(
            "use crate::a::A;\ntrait Own {}\nimpl<T> Own for A<T> {\n}\nimpl Local {\n}\nstruct Local;\n",
        );
        assert_eq!(package.circles(), Vec::<Vec<&str>>::new());
    }

    #[test]
    fn parent_that_uses_a_child_which_uses_the_parent_is_a_circle_but_not_for_tests() {
        let child = "use super::Parent;\npub fn child(_: Parent) {}\n";
        let parent = "mod child;\nuse child::child;\npub struct Parent;\n";
        let (_folder, package) =
            package(&[("lib.rs", "mod a;"), ("a.rs", parent), ("a/child.rs", child)]);
        assert_eq!(ends(package.circles()), [["a.rs", "child.rs"]]);
        let tested =
            "mod child;\npub struct Parent;\n#[cfg(test)]\nmod tests {\n    use child::child;\n}\n";
        let (_folder, package) =
            self::package(&[("lib.rs", "mod a;"), ("a.rs", tested), ("a/child.rs", child)]);
        assert_eq!(package.circles(), Vec::<Vec<&str>>::new());
    }
}
