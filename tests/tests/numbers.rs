//! Every figure of the sections "Numbers" of README, of the reports' own page and of the paper stands in
//! a committed report.

use std::fs;
use std::path::{Path, PathBuf};

use softgrasp_tests::quoting::{Figure, faults, figures, item_faults, items};

/// Heading of the section whose figures must all have a source.
const SECTION: &str = "Numbers";

fn root() -> PathBuf {
    let manifest = Path::new(env!("CARGO_MANIFEST_DIR"));
    manifest.parent().expect("the package lies in a folder of the workspace").to_owned()
}

fn readme() -> String {
    fs::read_to_string(root().join("README.md")).expect("README.md can be read")
}

/// Page in the folder of reports, with its links counted from the root.
fn page_of_reports() -> String {
    let page = report("README.md").expect("reports/README.md can be read");
    page.replace("](", "](reports/")
}

/// Paper, with its links to reports counted from the root.
fn paper() -> String {
    let page = fs::read_to_string(root().join("docs/paper.md")).expect("docs/paper.md can be read");
    page.replace("](../reports/", "](reports/")
}

/// Text of a committed file of a report.
fn report(name: &str) -> Option<String> {
    fs::read_to_string(root().join("reports").join(name)).ok()
}

#[test]
fn every_figure_of_the_readme_is_in_a_report() {
    let pages =
        [("README", readme()), ("reports/README", page_of_reports()), ("docs/paper", paper())];
    for (name, page) in pages {
        let found = faults(&page, SECTION, &report);
        assert!(found.is_empty(), "{name} and reports differ:\n  {}", found.join("\n  "));
    }
}

#[test]
fn readme_is_a_page_and_a_half() {
    let bytes = readme().len();
    assert!(bytes <= 8192, "README.md has {bytes} bytes");
}

/// Figure with its last digit one larger, in the same form.
fn changed(figure: &Figure) -> String {
    let (digits, exponent) = match figure.written.split_once('e') {
        Some((digits, exponent)) => (digits, format!("e{exponent}")),
        None => (figure.written.as_str(), String::new()),
    };
    let mut changed: Vec<char> = digits.chars().collect();
    // Nine becomes eight: another figure of the same length.
    if let Some(last) = changed.iter_mut().rfind(|c| c.is_ascii_digit()) {
        let digit = last.to_digit(10).unwrap_or(0);
        *last = char::from_digit(if digit == 9 { 8 } else { digit + 1 }, 10).unwrap_or('0');
    }
    changed.into_iter().collect::<String>() + &exponent
}

#[test]
fn a_figure_of_the_readme_that_is_changed_is_noticed() {
    let mut count = 0;
    let pages = [readme(), page_of_reports(), paper()];
    for item in pages.iter().flat_map(|page| items(page, SECTION)) {
        for figure in figures(&item.text) {
            let mut altered = item.clone();
            altered
                .text
                .replace_range(figure.at..figure.at + figure.written.len(), &changed(&figure));
            assert_ne!(altered.text, item.text);
            let found = item_faults(&altered, &report);
            assert!(!found.is_empty(), "a figure was changed and nothing was said:\n{altered:?}");
            count += 1;
        }
    }
    assert!(count > 10, "only {count} figures were tried");
}
