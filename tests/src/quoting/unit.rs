//! The units of figures and columns, and the conversion between them.

/// Unit of a number, with its factor to the base unit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Unit {
    /// Number without a unit: a count, a ratio, a relative error.
    Plain,
    /// Per cent.
    Percent,
    /// Time; the factor to seconds.
    Time(f64),
    /// Memory; the factor to bytes.
    Bytes(f64),
    /// Length; the factor to metres.
    Length(f64),
}

impl Unit {
    /// Unit by the word behind a figure or at the end of a column's name; `None` for other words.
    pub fn of(word: &str) -> Option<Self> {
        Some(match word {
            "rel" | "×" | "times" => Self::Plain,
            "%" | "percent" => Self::Percent,
            "µs" | "us" => Self::Time(1e-6),
            "ms" => Self::Time(1e-3),
            "s" => Self::Time(1.0),
            "min" => Self::Time(60.0),
            "bytes" => Self::Bytes(1.0),
            "GB" => Self::Bytes(1e9),
            "MiB" | "mib" => Self::Bytes(1_048_576.0),
            "GiB" | "gib" => Self::Bytes(1_073_741_824.0),
            "mm" => Self::Length(1e-3),
            "m" => Self::Length(1.0),
            _ => return None,
        })
    }

    /// Number of this unit converted to another one; `None` if they are of different kinds.
    pub fn convert(self, number: f64, to: Self) -> Option<f64> {
        match (self, to) {
            (Self::Plain, Self::Plain) | (Self::Percent, Self::Percent) => Some(number),
            (Self::Plain, Self::Percent) => Some(100.0 * number),
            (Self::Time(a), Self::Time(b))
            | (Self::Bytes(a), Self::Bytes(b))
            | (Self::Length(a), Self::Length(b)) => Some(number * a / b),
            _ => None,
        }
    }
}
