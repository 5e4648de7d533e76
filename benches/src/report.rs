//! Report: its head, text, tables and figures, and the files that are written.

use std::path::{Path, PathBuf};
use std::time::Instant;

use crate::machine::{Machine, load_text};
use crate::table::Table;

pub use crate::report_error::ReportError;

/// Options of a report.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Options {
    /// Whether to make the small form: small sizes and few rounds, to see that it works.
    pub is_quick: bool,
    /// Folder for the report's files.
    pub out: PathBuf,
    /// Command line that makes the report, for its head.
    pub command: String,
    /// Remark for the head; may be empty.
    pub note: String,
    /// Folder with mesh files of other authors; missing files are left out, and the report says so.
    pub meshes: PathBuf,
}

/// Part of a report, in the order of the page.
#[derive(Clone, Debug, PartialEq)]
pub enum Section {
    /// Text in Markdown.
    Text(String),
    /// A table, also written as CSV.
    Table(Table),
    /// Table that is too long for the page: written as CSV, and named on the page.
    Records(Table),
    /// A figure, written as SVG.
    Figure {
        /// Name of its file, without `.svg`.
        stem: String,
        /// Caption of the figure.
        caption: String,
        /// Text of the SVG file.
        svg: String,
    },
}

/// Report with its head and sections.
#[derive(Clone, Debug, PartialEq)]
pub struct Report {
    stem: String,
    title: String,
    head: Vec<(&'static str, String)>,
    sections: Vec<Section>,
    faults: Vec<String>,
    begun: Instant,
}

impl Report {
    /// Report with its head; describes the machine, so it is to be called before measuring.
    pub fn begin(stem: &str, title: &str, threads: &str, options: &Options) -> Self {
        let mut head = vec![("command", options.command.clone())];
        head.extend(Machine::look().lines());
        head.push(("threads", threads.to_owned()));
        if options.is_quick {
            head.push(("form", "quick: small sizes, few rounds; not to be quoted".to_owned()));
        }
        if !options.note.is_empty() {
            head.push(("note", options.note.clone()));
        }
        Self {
            stem: stem.to_owned(),
            title: title.to_owned(),
            head,
            sections: Vec::new(),
            faults: Vec::new(),
            begun: Instant::now(),
        }
    }

    /// Notes the load at the end of the measurement, and the time that it took.
    fn end(&mut self) {
        let minutes = self.begun.elapsed().as_secs_f64() / 60.0;
        self.head.push(("took", format!("{minutes:.1} min")));
        self.head.push(("load after", load_text()));
    }

    /// Begins a chapter; what follows is below its heading.
    pub fn chapter(&mut self, heading: &str) {
        self.text(format!("## {heading}"));
    }

    /// Adds a paragraph.
    pub fn text(&mut self, markdown: impl Into<String>) {
        self.sections.push(Section::Text(markdown.into()));
    }

    /// Adds a table.
    pub fn table(&mut self, table: Table) {
        self.sections.push(Section::Table(table));
    }

    /// Adds a table that only its file contains.
    pub fn records(&mut self, table: Table) {
        self.sections.push(Section::Records(table));
    }

    /// Notes that a row did not keep its limit; the report is written, and then an error follows.
    pub fn fault(&mut self, row: impl Into<String>) {
        self.faults.push(row.into());
    }

    /// Checks that all rows kept their limits.
    ///
    /// # Errors
    /// [`ReportError::Failed`] with the rows.
    fn check_faults(&self) -> Result<(), ReportError> {
        match self.faults.is_empty() {
            true => Ok(()),
            false => Err(ReportError::Failed { rows: self.faults.clone() }),
        }
    }

    /// Adds a figure.
    pub fn figure(&mut self, stem: &str, caption: &str, svg: String) {
        let (stem, caption) = (stem.to_owned(), caption.to_owned());
        self.sections.push(Section::Figure { stem, caption, svg });
    }

    /// Tables of the report, in order.
    pub fn tables(&self) -> impl Iterator<Item = &Table> {
        self.sections.iter().filter_map(|section| match section {
            Section::Table(table) | Section::Records(table) => Some(table),
            _ => None,
        })
    }

    /// Text of the page.
    pub fn markdown(&self) -> String {
        let mut text = format!("# {}\n\n", self.title);
        for (name, value) in &self.head {
            let value = if *name == "command" { format!("`{value}`") } else { value.clone() };
            text.push_str(&format!("- {name}: {value}\n"));
        }
        if !self.faults.is_empty() {
            text.push_str("\nWhat was promised and did not hold:\n\n");
            self.faults.iter().for_each(|row| text.push_str(&format!("- {row}\n")));
        }
        for section in &self.sections {
            text.push('\n');
            match section {
                Section::Text(markdown) => text.push_str(&format!("{}\n", markdown.trim_end())),
                Section::Table(table) => {
                    text.push_str(&table.markdown());
                    text.push_str(&format!("\n[{0}.csv]({0}.csv)\n", table.stem));
                }
                Section::Records(table) => {
                    let (title, rows) = (&table.title, table.rows.len());
                    text.push_str(&format!("{title} ({rows}): [{0}.csv]({0}.csv)\n", table.stem));
                }
                Section::Figure { stem, caption, .. } => {
                    text.push_str(&format!("![{caption}]({stem}.svg)\n\n{caption}\n"));
                }
            }
        }
        text
    }

    /// Ends the measurement and writes the files; returns their paths.
    ///
    /// # Errors
    /// [`ReportError::Write`]; [`ReportError::Failed`] after the files are written.
    pub fn finish(&mut self, folder: &Path) -> Result<Vec<PathBuf>, ReportError> {
        self.end();
        let files = self.write(folder)?;
        self.check_faults()?;
        Ok(files)
    }

    /// Writes the page, a CSV file for each table and an SVG file for each figure; returns the paths.
    ///
    /// # Errors
    /// [`ReportError::Write`] with the file.
    pub fn write(&self, folder: &Path) -> Result<Vec<PathBuf>, ReportError> {
        let write = |path: PathBuf, text: String| match std::fs::write(&path, text) {
            Ok(()) => Ok(path),
            Err(source) => Err(ReportError::Write { path, source }),
        };
        std::fs::create_dir_all(folder)
            .map_err(|source| ReportError::Write { path: folder.to_owned(), source })?;
        let head: Vec<String> =
            self.head.iter().map(|(name, value)| format!("{name}: {value}")).collect();
        let mut paths = vec![write(folder.join(format!("{}.md", self.stem)), self.markdown())?];
        for section in &self.sections {
            let (name, text) = match section {
                Section::Text(_) => continue,
                Section::Table(table) | Section::Records(table) => {
                    (format!("{}.csv", table.stem), table.csv(&head))
                }
                Section::Figure { stem, svg, .. } => (format!("{stem}.svg"), svg.clone()),
            };
            paths.push(write(folder.join(name), text)?);
        }
        Ok(paths)
    }
}

/// Refuses an error above `allowed`, or NaN.
///
/// # Errors
/// [`ReportError::Wrong`] if the error is refused.
pub fn check(what: impl FnOnce() -> String, error: f64, allowed: f64) -> Result<(), ReportError> {
    if error <= allowed {
        return Ok(());
    }
    Err(ReportError::Wrong { what: what(), error, allowed })
}

/// Prints on standard error what is being measured, since a report takes minutes.
pub fn progress(report: &str, what: &str) {
    eprintln!("{report}: {what}");
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_part_is_written_under_the_head() {
        let folder = tempfile::tempdir().unwrap();
        let options = Options {
            is_quick: true,
            out: folder.path().to_owned(),
            command: "bench --quick".to_owned(),
            note: "shared".to_owned(),
            ..Options::default()
        };
        let mut report = Report::begin("r", "Title", "2", &options);
        report.text("Words.");
        let mut table = Table::new("r-table", "T", &["x"]);
        table.push([1usize.into()]);
        report.table(table);
        report.figure("r-figure", "A line.", "<svg/>".to_owned());
        let paths = report.write(&options.out).unwrap();
        let names: Vec<_> = paths.iter().map(|p| p.file_name().unwrap().to_owned()).collect();
        assert_eq!(names, ["r.md", "r-table.csv", "r-figure.svg"]);
        let page = std::fs::read_to_string(&paths[0]).unwrap();
        for part in ["`bench --quick`", "- commit: ", "- note: shared", "Words.", "(r-figure.svg)"]
        {
            assert!(page.contains(part), "{part} is not in {page}");
        }
        let csv = std::fs::read_to_string(&paths[1]).unwrap();
        assert!(
            csv.starts_with("# command: bench --quick\n") && csv.ends_with("\nx\n1\n"),
            "{csv}"
        );
    }

    #[test]
    fn faults_are_an_error_that_names_them_and_long_tables_are_files() {
        let folder = tempfile::tempdir().unwrap();
        let options =
            Options { is_quick: true, out: folder.path().to_owned(), ..Options::default() };
        let mut report = Report::begin("r", "Title", "2", &options);
        let mut table = Table::new("r-rows", "Every row", &["x"]);
        table.push([7usize.into()]);
        report.records(table);
        assert!(report.check_faults().is_ok());
        report.fault("rod by front: no number");
        assert!(report.markdown().contains("- rod by front: no number"));
        let error = report.check_faults().unwrap_err();
        assert!(error.to_string().contains("1 of") && error.to_string().contains("rod by front"));
        assert!(report.markdown().contains("Every row (1): [r-rows.csv](r-rows.csv)"));
        let paths = report.write(&options.out).unwrap();
        assert!(std::fs::read_to_string(&paths[1]).unwrap().ends_with("\nx\n7\n"));
    }

    #[test]
    fn a_time_without_a_right_answer_is_refused() {
        assert!(check(|| "a".to_owned(), 1e-12, 1e-9).is_ok());
        for error in [1e-8, f64::NAN, f64::INFINITY] {
            assert!(matches!(check(String::new, error, 1e-9), Err(ReportError::Wrong { .. })));
        }
    }
}
