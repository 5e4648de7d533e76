//! Tables of a report, as CSV for programs and as Markdown for people.

use std::fmt::Write;

/// One entry of a table.
#[derive(Clone, Debug, PartialEq)]
pub enum Cell {
    /// Words.
    Text(String),
    /// Exact count.
    Count(u64),
    /// Measured number.
    Number(f64),
    /// Empty: not measured, or not applicable.
    Blank,
}

/// A table; each becomes one CSV file.
///
/// Shapes: every row has as many cells as there are columns. Units are in the columns' names.
#[derive(Clone, Debug, PartialEq)]
pub struct Table {
    /// Name of its CSV file, without `.csv`.
    pub stem: String,
    /// Heading in the report.
    pub title: String,
    /// Names of the columns, `name_unit`.
    pub columns: Vec<&'static str>,
    /// Rows of cells.
    pub rows: Vec<Vec<Cell>>,
}

impl Table {
    /// A table without rows.
    pub fn new(
        stem: impl Into<String>,
        title: impl Into<String>,
        columns: &[&'static str],
    ) -> Self {
        Self { stem: stem.into(), title: title.into(), columns: columns.to_vec(), rows: Vec::new() }
    }

    /// Adds a row; missing cells at its end are blank, further ones are cut.
    pub fn push(&mut self, row: impl IntoIterator<Item = Cell>) {
        let mut row: Vec<Cell> = row.into_iter().collect();
        row.resize(self.columns.len(), Cell::Blank);
        self.rows.push(row);
    }

    /// Table as CSV: `#` lines of `head`, names of the columns, rows.
    pub fn csv(&self, head: &[String]) -> String {
        let mut text: String = head.iter().map(|line| format!("# {line}\n")).collect();
        let lines = std::iter::once(self.columns.iter().map(|c| (*c).to_owned()).collect())
            .chain(self.rows.iter().map(|row| row.iter().map(Cell::csv).collect::<Vec<_>>()));
        for line in lines {
            text.push_str(&line.join(","));
            text.push('\n');
        }
        text
    }

    /// Table as Markdown under its title.
    pub fn markdown(&self) -> String {
        let mut text = format!("### {}\n\n|", self.title);
        for column in &self.columns {
            let _ = write!(text, " {} |", column.replace('_', " "));
        }
        text.push_str("\n|");
        for index in 0..self.columns.len() {
            let is_text = self
                .rows
                .first()
                .and_then(|r| r.get(index))
                .is_some_and(|c| matches!(c, Cell::Text(_)));
            text.push_str(if is_text { " :-- |" } else { " --: |" });
        }
        for row in &self.rows {
            text.push_str("\n|");
            for cell in row {
                let _ = write!(text, " {} |", cell.markdown());
            }
        }
        text.push('\n');
        text
    }
}

impl Cell {
    fn csv(&self) -> String {
        match self {
            Self::Text(text) if text.contains([',', '"', '\n']) => {
                format!("\"{}\"", text.replace('"', "\"\""))
            }
            Self::Text(text) => text.clone(),
            Self::Count(count) => count.to_string(),
            Self::Number(x) => format!("{x:.5e}"),
            Self::Blank => String::new(),
        }
    }

    fn markdown(&self) -> String {
        match self {
            Self::Text(text) => text.replace('|', "\\|"),
            Self::Count(count) => count.to_string(),
            Self::Number(x) => three_digits(*x),
            Self::Blank => "–".to_owned(),
        }
    }
}

impl From<&str> for Cell {
    fn from(text: &str) -> Self {
        Self::Text(text.to_owned())
    }
}

impl From<String> for Cell {
    fn from(text: String) -> Self {
        Self::Text(text)
    }
}

impl From<usize> for Cell {
    fn from(count: usize) -> Self {
        Self::Count(count as u64)
    }
}

impl From<f64> for Cell {
    fn from(x: f64) -> Self {
        Self::Number(x)
    }
}

impl From<Option<f64>> for Cell {
    fn from(x: Option<f64>) -> Self {
        x.map_or(Self::Blank, Self::Number)
    }
}

/// Number with three significant digits; with a power of ten outside 0.001 … 100 000.
pub fn three_digits(x: f64) -> String {
    let size = x.abs();
    if x == 0.0 {
        return "0".to_owned();
    }
    if !(1e-3..1e5).contains(&size) {
        return format!("{x:.1e}");
    }
    let before_point = size.log10().floor() as i32 + 1;
    let decimals = usize::try_from(3 - before_point).unwrap_or(0);
    format!("{x:.decimals$}")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn table() -> Table {
        let mut table = Table::new("t", "A table", &["method", "nodes", "total_ms", "error_rel"]);
        table.push(["a, \"b\"".into(), 27usize.into(), 12.3456.into(), 1.25e-15.into()]);
        table.push(["c|d".into(), 64usize.into()]);
        table
    }

    #[test]
    fn csv_reads_back_with_its_comments_passed_over() {
        let text = table().csv(&["made by: x, y".to_owned()]);
        let mut reader = csv::ReaderBuilder::new().comment(Some(b'#')).from_reader(text.as_bytes());
        assert_eq!(reader.headers().unwrap(), vec!["method", "nodes", "total_ms", "error_rel"]);
        let rows: Vec<csv::StringRecord> = reader.records().map(Result::unwrap).collect();
        assert_eq!(rows[0], vec!["a, \"b\"", "27", "1.23456e1", "1.25000e-15"]);
        assert_eq!(rows[0][2].parse::<f64>().unwrap(), 12.3456);
        assert_eq!(rows[1], vec!["c|d", "64", "", ""]);
    }

    #[test]
    fn markdown_has_a_cell_for_every_column() {
        let text = table().markdown();
        let lines: Vec<&str> = text.lines().skip(2).collect();
        assert_eq!(lines.len(), 4);
        assert_eq!(lines[0], "| method | nodes | total ms | error rel |");
        assert_eq!(lines[2], "| a, \"b\" | 27 | 12.3 | 1.2e-15 |");
        assert_eq!(lines[3], "| c\\|d | 64 | – | – |");
    }

    #[test]
    fn three_digits_count() {
        for (x, text) in [
            (0.0, "0"),
            (0.001234, "0.00123"),
            (0.999, "0.999"),
            (1.0, "1.00"),
            (99.94, "99.9"),
            (1234.5, "1234"),
            (-12.0, "-12.0"),
            (1.0e5, "1.0e5"),
            (3.21e-7, "3.2e-7"),
        ] {
            assert_eq!(three_digits(x), text);
        }
    }
}
