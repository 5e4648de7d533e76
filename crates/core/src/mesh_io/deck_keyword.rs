//! Keyword lines and data lines of Abaqus and CalculiX decks, and what the elements are called there.

use super::cell_kind::{CellKind, Shape};
use super::cursor::{Cursor, words};

/// A keyword line, `*ELEMENT, TYPE=C3D4, ELSET=Skin`, with the lines that continue it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Keyword {
    /// Capitals without blanks and star: `SOLIDSECTION`.
    pub(super) name: String,
    /// Parameters in capitals and their values as they stand, without quotes.
    parameters: Vec<(String, String)>,
}

impl Keyword {
    /// From a line that begins with a star; a line after a last comma belongs to it, unless that
    /// is data.
    ///
    /// Source: Abaqus Analysis User's Guide, "Input syntax rules".
    pub(super) fn read(line: &[u8], cursor: &mut Cursor) -> Self {
        let mut parts: Vec<&[u8]> = split_at_commas(line);
        while parts.last().is_some_and(|part| part.is_empty()) {
            let before = cursor.clone();
            let next =
                cursor.line().filter(|next| next.first().is_some_and(u8::is_ascii_alphabetic));
            let Some(next) = next else {
                *cursor = before;
                break;
            };
            parts.pop();
            parts.extend(split_at_commas(next));
        }
        let mut parts = parts.into_iter();
        let name = parts.next().unwrap_or_default();
        let name = capitals(name.strip_prefix(b"*").unwrap_or(name));
        let parameters = parts.map(|part| {
            let equals = part.iter().position(|&b| b == b'=').unwrap_or(part.len());
            let value = part.get(equals + 1..).unwrap_or_default().trim_ascii();
            let value = value.strip_prefix(b"\"").unwrap_or(value);
            let value = value.strip_suffix(b"\"").unwrap_or(value);
            (capitals(&part[..equals]), String::from_utf8_lossy(value).into_owned())
        });
        Self { name, parameters: parameters.collect() }
    }

    /// Value of a parameter; empty for a bare one such as `GENERATE`.
    pub(super) fn parameter(&self, name: &str) -> Option<&str> {
        self.parameters.iter().find(|pair| pair.0 == name).map(|pair| pair.1.as_str())
    }
}

/// Letters in capitals, without blanks.
fn capitals(word: &[u8]) -> String {
    let letters: Vec<u8> = word.iter().filter(|b| !b.is_ascii_whitespace()).copied().collect();
    String::from_utf8_lossy(&letters).to_ascii_uppercase()
}

/// Pieces between commas that are not inside quotes, without surrounding blanks.
fn split_at_commas(line: &[u8]) -> Vec<&[u8]> {
    let mut quoted = false;
    let pieces = line.split(|&byte| {
        quoted ^= byte == b'"';
        byte == b',' && !quoted
    });
    pieces.map(<[u8]>::trim_ascii).collect()
}

/// The fields of a data line; one may be empty between commas, the last one may not.
pub(super) fn fields(line: &[u8]) -> Vec<&[u8]> {
    if !line.contains(&b',') {
        return words(line).collect();
    }
    let mut fields: Vec<&[u8]> = line.split(|&b| b == b',').map(<[u8]>::trim_ascii).collect();
    if fields.last().is_some_and(|field| field.is_empty()) {
        fields.pop();
    }
    fields
}

/// Kind of an element by its name; `None` for one whose number of nodes is not known here.
///
/// The four corners of a tetrahedron come first, ordered as Gmsh and VTK order them.
///
/// Source: Abaqus Elements Guide, "Three-dimensional solid element library"; CalculiX CrunchiX
/// User's Manual, "Element types".
pub(super) fn deck_cell(name: &str) -> Option<CellKind> {
    let name = name.to_ascii_uppercase();
    // Letters at the end say how an element is integrated and what else it carries.
    let digits_end = name.rfind(|c: char| c.is_ascii_digit())? + 1;
    let core = match name.find("HS").filter(|&at| at > 3) {
        Some(at) => name.get(..at)?,
        None => name.get(..digits_end)?,
    };
    let digits = core.len() - core.bytes().rev().take_while(u8::is_ascii_digit).count();
    let (family, number) = core.split_at(digits);
    let nodes: usize = number.parse().ok()?;
    let shape = match (family, nodes) {
        ("C3D" | "DC3D" | "AC3D" | "DCC3D" | "EC3D" | "F3D" | "FC3D" | "Q3D" | "QC3D", _) => {
            match nodes {
                4 | 10 => Shape::Tetrahedron,
                5 | 13 => Shape::Pyramid,
                6 | 15 | 18 => Shape::Prism,
                8 | 20 | 21 | 27 => Shape::Hexahedron,
                _ => return None,
            }
        }
        ("SC", 6) => Shape::Prism,
        ("SC", 8) => Shape::Hexahedron,
        ("STRI", 65) => return Some(CellKind::new(Shape::Triangle, 6)),
        (
            "S" | "STRI" | "DS" | "M3D" | "SFM3D" | "R3D" | "CPS" | "CPE" | "CAX" | "DC2D" | "AC2D",
            _,
        ) => match nodes {
            3 | 6 => Shape::Triangle,
            4 | 8 | 9 => Shape::Quadrangle,
            _ => return None,
        },
        ("T3D" | "T2D", 2 | 3) => Shape::Line,
        ("B", 21 | 23 | 31 | 33) => return Some(CellKind::new(Shape::Line, 2)),
        ("B", 22 | 32) => return Some(CellKind::new(Shape::Line, 3)),
        _ => return None,
    };
    Some(CellKind::new(shape, nodes))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keywords_are_read_in_any_case_and_over_lines() {
        let mut cursor =
            Cursor::new("f", b" * Solid  section , ELSET = \"My, set\",\nMaterial=m\n1.,\n");
        let line = cursor.line().unwrap();
        let keyword = Keyword::read(line, &mut cursor);
        assert_eq!(keyword.name, "SOLIDSECTION");
        assert_eq!(keyword.parameter("ELSET"), Some("My, set"));
        assert_eq!(keyword.parameter("MATERIAL"), Some("m"));
        assert_eq!(keyword.parameter("GENERATE"), None);
        assert_eq!(cursor.line(), Some(&b"1.,"[..]));
    }

    #[test]
    fn a_comma_before_data_continues_nothing() {
        let mut cursor = Cursor::new("f", b"*NODE,\n1, 0., 0.\n");
        let line = cursor.line().unwrap();
        assert_eq!(Keyword::read(line, &mut cursor).name, "NODE");
        assert_eq!(cursor.line(), Some(&b"1, 0., 0."[..]));
    }

    #[test]
    fn elements_are_known_by_their_names() {
        let kind = |name| deck_cell(name).map(|kind| kind.to_string());
        for name in ["C3D4", "c3d4h", "DC3D4", "F3D4"] {
            assert_eq!(kind(name).as_deref(), Some("tetrahedra"), "{name}");
        }
        for name in ["C3D10", "C3D10M", "C3D10MHT", "C3D10HS", "C3D10T"] {
            assert_eq!(kind(name).as_deref(), Some("tetrahedra (10 nodes)"), "{name}");
        }
        assert_eq!(kind("C3D20R").as_deref(), Some("hexahedra (20 nodes)"));
        assert_eq!(kind("S3R").as_deref(), Some("triangles"));
        assert_eq!(kind("STRI65").as_deref(), Some("triangles (6 nodes)"));
        assert_eq!(kind("B31").as_deref(), Some("lines"));
        for name in ["", "MASS", "C3D", "C3D99", "SPRINGA", "U12345678901234567890"] {
            assert_eq!(kind(name), None, "{name}");
        }
    }

    #[test]
    fn fields_may_be_empty_between_commas() {
        assert_eq!(fields(b"1, , 2.5,"), [&b"1"[..], b"", b"2.5"]);
        assert_eq!(fields(b"1 2\t3"), [b"1", b"2", b"3"]);
    }
}
