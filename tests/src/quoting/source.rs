//! Source of figures: rows and columns of one file of a report.

use super::unit::Unit;

/// Source that a comment names.
#[derive(Clone, Debug, PartialEq)]
pub struct Source {
    /// Name of the file.
    pub file: String,
    /// Columns that select rows, each with the wanted values.
    pub keys: Vec<(String, Vec<String>)>,
    /// Columns that are quoted, with their units.
    pub columns: Vec<(String, Unit)>,
}

/// Column that is quoted.
#[derive(Clone, Debug, PartialEq)]
pub struct Column {
    /// Name of the column.
    pub name: String,
    /// Unit of its numbers.
    pub unit: Unit,
    /// Its numbers in the selected rows.
    pub numbers: Vec<f64>,
}

impl Source {
    /// Parses a comment.
    ///
    /// # Errors
    /// Fault of the comment, in words.
    pub fn parse(comment: &str) -> Result<Self, String> {
        let (left, right) = comment
            .split_once("->")
            .ok_or_else(|| format!("{comment:?} does not say `-> column, …`"))?;
        let mut parts = left.split('|').map(str::trim).filter(|part| !part.is_empty());
        let file = parts.next().ok_or_else(|| format!("{comment:?} names no file"))?.to_owned();
        let key = |part: &str| {
            let (name, values) = part
                .split_once('=')
                .ok_or_else(|| format!("{part:?} of {comment:?} is not `column = value`"))?;
            let values = values.split('/').map(|value| value.trim().to_owned()).collect();
            Ok((name.trim().to_owned(), values))
        };
        let keys = parts.map(key).collect::<Result<_, String>>()?;
        let columns = right.split(',').map(column).collect::<Result<_, String>>()?;
        Ok(Self { file, keys, columns })
    }

    /// Quoted columns, with their numbers in the selected rows.
    ///
    /// # Errors
    /// Missing column or row, in words.
    pub fn select(&self, csv: &str) -> Result<Vec<Column>, String> {
        let mut reader = csv::ReaderBuilder::new().comment(Some(b'#')).from_reader(csv.as_bytes());
        let headers = reader.headers().map_err(|error| format!("{}: {error}", self.file))?.clone();
        let place = |name: &str| {
            headers
                .iter()
                .position(|header| header == name)
                .ok_or_else(|| format!("{} has no column {name:?}", self.file))
        };
        let keys: Vec<(usize, &Vec<String>)> = self
            .keys
            .iter()
            .map(|(name, values)| Ok((place(name)?, values)))
            .collect::<Result<_, String>>()?;
        let mut columns: Vec<(usize, Column)> = Vec::new();
        for (name, unit) in &self.columns {
            let column = Column { name: name.clone(), unit: *unit, numbers: Vec::new() };
            columns.push((place(name)?, column));
        }
        let mut count = 0;
        for row in reader.records() {
            let row = row.map_err(|error| format!("{}: {error}", self.file))?;
            let cell = |at: usize| row.get(at).unwrap_or("");
            if !keys.iter().all(|(at, values)| values.iter().any(|v| is_same(v, cell(*at)))) {
                continue;
            }
            count += 1;
            for (at, column) in &mut columns {
                let text = cell(*at);
                let number = text.parse().map_err(|_| {
                    format!("{}: {:?} in {} is no number", self.file, text, column.name)
                })?;
                column.numbers.push(number);
            }
        }
        match count {
            0 => Err(format!("{} has no row with {:?}", self.file, self.keys)),
            _ => Ok(columns.into_iter().map(|(_, column)| column).collect()),
        }
    }

    /// Constants that a text may name: keys' values that are numbers, and numbers in the names of quoted
    /// columns (21 in `solve_21_ms`).
    pub fn constants(&self) -> impl Iterator<Item = f64> + '_ {
        let values = self.keys.iter().flat_map(|(_, values)| values).map(String::as_str);
        let in_names = self.columns.iter().flat_map(|(name, _)| name.split('_'));
        values.chain(in_names).filter_map(|word| word.parse().ok())
    }
}

/// Whether both texts are the same words, or the same number.
fn is_same(wanted: &str, cell: &str) -> bool {
    let number = |text: &str| text.parse::<f64>().ok();
    wanted == cell || number(wanted).is_some_and(|wanted| number(cell) == Some(wanted))
}

/// Parses `name`, or `name [unit]` if the name does not end with its unit.
fn column(text: &str) -> Result<(String, Unit), String> {
    let text = text.trim();
    if let Some((name, unit)) = text.strip_suffix(']').and_then(|text| text.split_once('[')) {
        let unit = unit.trim();
        let known = Unit::of(unit).ok_or_else(|| format!("{unit:?} is no unit that is known"))?;
        return Ok((name.trim().to_owned(), known));
    }
    let last = text.rsplit('_').next().unwrap_or("");
    Ok((text.to_owned(), Unit::of(last).unwrap_or(Unit::Plain)))
}

#[cfg(test)]
mod tests {
    use super::*;

    const CSV: &str = "# command: x\nname,nodes,p50_ms,ratio\n\"a, b\",27,1.5e0,2e0\nc,27,3,4\n";

    #[test]
    fn rows_are_selected_by_words_and_numbers() {
        let source = Source::parse("f.csv | name = a, b | nodes = 27 | -> p50_ms, ratio [s]");
        let columns = source.unwrap().select(CSV).unwrap();
        assert_eq!(columns[0].numbers, [1.5]);
        assert_eq!((columns[0].unit, columns[1].unit), (Unit::Time(1e-3), Unit::Time(1.0)));
        let both = Source::parse("f.csv | name = a, b / c | -> ratio").unwrap();
        assert_eq!(both.select(CSV).unwrap()[0].numbers, [2.0, 4.0]);
        let named = Source::parse("f.csv | nodes = 27 | -> solve_21_ms, p99_ms").unwrap();
        assert_eq!(named.constants().collect::<Vec<_>>(), [27.0, 21.0]);
        let all = Source::parse("f.csv -> ratio").unwrap();
        assert_eq!(all.select(CSV).unwrap()[0].numbers, [2.0, 4.0]);
    }

    #[test]
    fn what_is_not_there_is_said() {
        let select = |text: &str| Source::parse(text).and_then(|source| source.select(CSV));
        for (text, word) in [
            ("f.csv | nodes = 28 | -> ratio", "no row"),
            ("f.csv | nodes = 27 | -> speed", "speed"),
            ("f.csv | nodes | -> ratio", "column = value"),
            ("f.csv | nodes = 27", "->"),
            ("f.csv -> name", "no number"),
            ("f.csv -> ratio [furlong]", "furlong"),
        ] {
            let error = select(text).unwrap_err();
            assert!(error.contains(word), "{error}");
        }
    }
}
