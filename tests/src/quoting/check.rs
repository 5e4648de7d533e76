//! Checks that every figure of a text is in the reports, and every named column is quoted.

use super::figure::{Figure, figures};
use super::item::{Item, items};
use super::source::{Column, Source};

/// The files of all reports, by name.
pub trait Reports {
    /// Text of a file in the folder of reports; `None` if it does not exist.
    fn file(&self, name: &str) -> Option<String>;
}

impl<F: Fn(&str) -> Option<String>> Reports for F {
    fn file(&self, name: &str) -> Option<String> {
        self(name)
    }
}

/// Words that would hide a figure from this check.
const HIDDEN: [&str; 8] =
    [" half ", " quarter", " a third", " a fifth", " a tenth", " twice", " ten times", " tenfold"];

/// Disagreements between a page and the reports: of all items of the section, and of every other item
/// that names a source.
pub fn faults(page: &str, section: &str, reports: &impl Reports) -> Vec<String> {
    let strict = items(page, section);
    let all = items(page, "");
    let named = all.iter().filter(|item| !item.comments.is_empty() && !strict.contains(item));
    let mut faults: Vec<String> = Vec::new();
    if strict.iter().all(|item| figures(&item.text).is_empty()) {
        faults.push(format!("section {section:?} quotes no figure"));
    }
    for item in strict.iter().chain(named) {
        let begin: String = item.text.trim().chars().take(60).collect();
        faults.extend(
            item_faults(item, reports).into_iter().map(|fault| format!("{begin}…: {fault}")),
        );
    }
    faults
}

/// Disagreements between one item and the reports.
pub fn item_faults(item: &Item, reports: &impl Reports) -> Vec<String> {
    let mut faults = Vec::new();
    let mut columns = Vec::new();
    let mut constants: Vec<f64> = Vec::new();
    for comment in &item.comments {
        let found = Source::parse(comment).and_then(|source| {
            constants.extend(source.constants());
            is_linked(item, &source, reports)?;
            let csv = reports.file(&source.file);
            source.select(&csv.ok_or_else(|| format!("there is no reports/{}", source.file))?)
        });
        match found {
            Ok(found) => columns.extend(found),
            Err(fault) => faults.push(fault),
        }
    }
    let figures = figures(&item.text);
    for figure in &figures {
        if !is_constant(figure, &constants) && !columns.iter().any(|c| stands_in(figure, c)) {
            faults.push(format!("{} is in no report that is named", figure.written));
        }
    }
    for column in &columns {
        faults.extend(unquoted(column, &figures));
    }
    let text = format!(" {} ", item.text.to_lowercase().replace('\n', " "));
    for word in HIDDEN.iter().filter(|word| !columns.is_empty() && text.contains(**word)) {
        faults.push(format!("{:?} hides a figure; write digits", word.trim()));
    }
    faults
}

/// Checks that the report is linked, and that the file belongs to it.
fn is_linked(item: &Item, source: &Source, reports: &impl Reports) -> Result<(), String> {
    let of_file = format!("({})", source.file);
    let mut pages = item.links.iter().filter_map(|link| link.strip_prefix("reports/"));
    match pages.any(|page| reports.file(page).is_some_and(|text| text.contains(&of_file))) {
        true => Ok(()),
        false => Err(format!("no report is linked here that has {}", source.file)),
    }
}

fn is_constant(figure: &Figure, constants: &[f64]) -> bool {
    !figure.is_limit && constants.contains(&figure.value)
}

/// Whether one of the column's numbers, rounded, is the figure; for a limit, the largest number.
fn stands_in(figure: &Figure, column: &Column) -> bool {
    let quotes =
        |number: f64| column.unit.convert(number, figure.unit).is_some_and(|n| figure.quotes(n));
    match figure.is_limit {
        true => quotes(largest(column)),
        false => column.numbers.iter().any(|number| quotes(*number)),
    }
}

/// Numbers that a text should quote and does not: the smallest and the largest of a column, or a limit.
fn unquoted(column: &Column, figures: &[Figure]) -> Vec<String> {
    let quoted = |number: f64| {
        let alone = Column { numbers: vec![number], ..column.clone() };
        figures.iter().any(|figure| !figure.is_limit && stands_in(figure, &alone))
    };
    if figures.iter().any(|figure| figure.is_limit && stands_in(figure, column)) {
        return Vec::new();
    }
    let smallest = column.numbers.iter().copied().fold(f64::INFINITY, f64::min);
    let ends = [smallest, largest(column)];
    let missing = ends.iter().take(if ends[0] == ends[1] { 1 } else { 2 }).filter(|n| !quoted(**n));
    missing
        .map(|n| format!("{} is {n:.4e} in the report, which is not quoted", column.name))
        .collect()
}

fn largest(column: &Column) -> f64 {
    column.numbers.iter().copied().fold(f64::NEG_INFINITY, f64::max)
}

#[cfg(test)]
mod tests {
    use super::*;

    const CSV: &str = "# x\nnodes,p50_ms,late_percent,ratio,error_rel\n\
                       27,0.1138,0.07,1.431,3.4e-13\n64,2.5,0.4,0.262,1.1e-12\n";

    fn reports(name: &str) -> Option<String> {
        match name {
            "a.md" => Some("[a.csv](a.csv)".to_owned()),
            "b.md" => Some("words".to_owned()),
            "a.csv" => Some(CSV.to_owned()),
            _ => None,
        }
    }

    const RIGHT: &str = "## Numbers\n\n- With 27 nodes 0.11 ms, 1.4 times an echo, 0.07 % late, \
                         errors below 4e-13 ([a](reports/a.md)). \
                         <!-- a.csv | nodes = 27 | -> p50_ms, ratio, late_percent, error_rel -->\n\
                         - Ratios 0.26 to 1.43 ([a](reports/a.md)). <!-- a.csv -> ratio -->\n";

    #[test]
    fn figures_that_are_in_the_report_are_no_faults() {
        assert_eq!(faults(RIGHT, "Numbers", &reports), Vec::<String>::new());
    }

    #[test]
    fn a_figure_that_was_changed_is_a_fault() {
        for (right, wrong) in [
            ("27 nodes", "28 nodes"),
            ("0.11 ms", "0.12 ms"),
            ("0.11 ms", "0.11 s"),
            ("0.11 ms", "0.110 ms"),
            ("1.4 times", "1.5 times"),
            ("0.07 %", "0.08 %"),
            ("4e-13", "3e-13"),
            ("4e-13", "5e-13"),
            ("0.26 to", "0.27 to"),
            ("1.43 (", "1.44 ("),
            ("errors below 4e-13", "errors small"),
            ("1.4 times", "twice"),
            ("(reports/a.md)). <!-- a.csv | n", "(reports/b.md)). <!-- a.csv | n"),
            ("nodes = 27", "nodes = 64"),
        ] {
            // The second bullet stays right.
            let page = RIGHT.replacen(right, wrong, 1);
            assert!(page != RIGHT, "{right} is not in the text");
            let found = faults(&page, "Numbers", &reports);
            assert!(!found.is_empty(), "{right} became {wrong} and nothing was said");
        }
    }

    #[test]
    fn figures_without_a_source_and_empty_sections_are_faults() {
        let page = "## Numbers\n\n- It takes 5 ms.\n";
        assert!(faults(page, "Numbers", &reports)[0].contains("5 is in no report"));
        assert!(faults("## Numbers\n\nWords.\n", "Numbers", &reports)[0].contains("no figure"));
        // Elsewhere only what names a source is looked at.
        let page = format!("{RIGHT}## Other\n\n- 5 ms.\n- 6 ms <!-- a.csv -> p50_ms -->\n");
        assert!(faults(&page, "Numbers", &reports).iter().all(|fault| fault.contains("6 ms")));
    }
}
