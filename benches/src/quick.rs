//! Small forms of reports for tests: made in a folder of their own, and their files read again.

use std::path::Path;

use crate::report::{Options, Report, ReportError};

/// Small form of a report, in a folder that is removed with it.
pub struct Quick {
    folder: tempfile::TempDir,
}

impl Quick {
    /// Makes a report in its small form, and checks that its page has the whole head.
    ///
    /// # Panics
    /// On any error, and if a file or a line of the head is missing.
    pub fn make(measure: impl FnOnce(&Options) -> Result<Report, ReportError>) -> Self {
        let folder = tempfile::tempdir().expect("a folder for the report");
        let options = Options {
            is_quick: true,
            out: folder.path().to_owned(),
            command: "smoke test".to_owned(),
            note: String::new(),
            meshes: Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/meshes"),
        };
        let mut report = measure(&options).unwrap_or_else(|error| panic!("{error}"));
        // A row that fails is an error that names it.
        let files = report.finish(&options.out).unwrap_or_else(|error| panic!("{error}"));
        assert!(files.iter().all(|file| file.is_file()), "{files:?}");
        let page = report.markdown();
        for part in ["command", "commit", "date", "processor", "processor maker", "threads"] {
            assert!(page.contains(&format!("- {part}: ")), "{part} is not in the head:\n{page}");
        }
        Self { folder }
    }

    /// Folder of the report's files.
    pub fn folder(&self) -> &Path {
        self.folder.path()
    }

    /// Whether a file was written.
    pub fn has(&self, file: &str) -> bool {
        self.folder().join(file).is_file()
    }

    /// Values of one column of a CSV file, as text.
    ///
    /// # Panics
    /// If the file or the column is missing, or the file does not say how it was made.
    pub fn column(&self, file: &str, name: &str) -> Vec<String> {
        let text = std::fs::read_to_string(self.folder().join(file))
            .unwrap_or_else(|error| panic!("{file}: {error}"));
        assert!(text.starts_with("# command: "), "{file} does not say how it was made");
        let mut reader = csv::ReaderBuilder::new().comment(Some(b'#')).from_reader(text.as_bytes());
        let at = reader.headers().ok().and_then(|h| h.iter().position(|h| h == name));
        let at = at.unwrap_or_else(|| panic!("{file} has no column {name}"));
        let rows = reader.records().map(|row| row.expect("a row that can be read"));
        rows.map(|row| row[at].to_owned()).collect()
    }

    /// Values of one column of a CSV file, all of which are numbers.
    ///
    /// # Panics
    /// The same as those of [`Self::column`], and if a value is no number.
    pub fn numbers(&self, file: &str, name: &str) -> Vec<f64> {
        let number = |v: &String| v.parse().unwrap_or_else(|_| panic!("{file}: {name}: {v}"));
        self.column(file, name).iter().map(number).collect()
    }
}
