//! Vega FEM `.veg`: `*` sections of a text, included files, materials by region.

use std::collections::{BTreeMap, BTreeSet};

use nalgebra::Point3;

use super::cell_kind::{CellKind, Shape};
use super::companion::FindCompanion;
use super::cursor::{Cursor, words};
use super::error::MeshFileError;
use super::findings::Included;
use super::number::{parse_integer, parse_real};
use super::raw_mesh::RawMesh;

/// What the lines after a `*` line are.
#[derive(Clone, Debug, PartialEq, Eq)]
enum Section {
    None,
    VerticesHeader,
    Vertices,
    ElementType,
    ElementsHeader(CellKind),
    Elements(CellKind),
    /// `*MATERIAL` and other names: not looked into.
    Ignored,
    Set(String),
    Region,
}

/// State while the lines of a file and of those it includes go by.
struct Reader<'f, 'g> {
    raw: RawMesh,
    section: Section,
    /// Label of each tetrahedron.
    element_labels: Vec<i64>,
    sets: BTreeMap<String, Vec<i64>>,
    /// Set and material of each region, in file order.
    regions: Vec<(String, String)>,
    /// Announced numbers of vertices and elements.
    announced: [Option<usize>; 2],
    found: [usize; 2],
    included: Included<'f, 'g>,
}

/// Reads a Vega mesh; materials are ignored, regions become labels.
///
/// # Errors
/// [`MeshFileError`]: a line does not fit its section, a count is not kept, or an included file
/// is missing.
///
/// Source: Vega FEM library user manual, ".veg file format".
pub(super) fn read(
    name: &str,
    bytes: &[u8],
    find: &mut FindCompanion,
) -> Result<RawMesh, MeshFileError> {
    let mut reader = Reader {
        raw: RawMesh::default(),
        section: Section::None,
        element_labels: Vec::new(),
        sets: BTreeMap::new(),
        regions: Vec::new(),
        announced: [None; 2],
        found: [0; 2],
        included: Included::new(find),
    };
    let mut cursor = Cursor::with_comments(name, bytes, b'#');
    reader.read_file(&mut cursor)?;
    for (what, (announced, found)) in
        ["*VERTICES", "*ELEMENTS"].iter().zip(reader.announced.iter().zip(reader.found))
    {
        if let Some(expected) = announced.filter(|&expected| expected != found) {
            return Err(cursor.count_fault(what, &expected.to_string(), &found.to_string()));
        }
    }
    reader.assign_regions();
    Ok(reader.raw)
}

impl Reader<'_, '_> {
    fn read_file(&mut self, cursor: &mut Cursor) -> Result<(), MeshFileError> {
        while let Some(line) = cursor.line() {
            match line.strip_prefix(b"*") {
                Some(keyword) => self.read_keyword(cursor, keyword)?,
                None => self.read_line(cursor, line)?,
            }
        }
        Ok(())
    }

    fn read_keyword(&mut self, cursor: &mut Cursor, line: &[u8]) -> Result<(), MeshFileError> {
        let mut fields = words(line);
        let keyword = fields.next().unwrap_or_default();
        let argument = line.get(keyword.len()..).unwrap_or_default().trim_ascii();
        self.section = match keyword.to_ascii_uppercase().as_slice() {
            b"VERTICES" => Section::VerticesHeader,
            b"ELEMENTS" => Section::ElementType,
            b"SET" => Section::Set(String::from_utf8_lossy(argument).into_owned()),
            b"REGION" => Section::Region,
            b"INCLUDE" => return self.include(cursor, argument),
            _ => {
                self.raw.findings.skip(keyword);
                Section::Ignored
            }
        };
        Ok(())
    }

    /// An included file goes on where the line stands, and its sections with it.
    fn include(&mut self, cursor: &Cursor, file_name: &[u8]) -> Result<(), MeshFileError> {
        let file_name = String::from_utf8_lossy(file_name);
        let findings = &mut self.raw.findings;
        let bytes = self.included.bytes(&file_name, "included files", cursor, findings)?;
        self.read_file(&mut Cursor::with_comments(&file_name, &bytes, b'#'))
    }

    fn read_line(&mut self, cursor: &Cursor, line: &[u8]) -> Result<(), MeshFileError> {
        match &mut self.section {
            Section::VerticesHeader => {
                self.announced[0] = Some(announced(cursor, line)?);
                self.section = Section::Vertices;
            }
            Section::Vertices => self.read_vertex(cursor, line)?,
            Section::ElementType => {
                self.section = Section::ElementsHeader(element_kind(cursor, line)?);
            }
            Section::ElementsHeader(kind) => {
                self.section = Section::Elements(*kind);
                self.announced[1] = Some(announced(cursor, line)?);
            }
            &mut Section::Elements(kind) => self.read_element(cursor, line, kind)?,
            Section::Set(name) => {
                let set = self.sets.entry(name.clone()).or_default();
                for word in words(line) {
                    match parse_integer(word) {
                        Some(label) => set.push(label),
                        None => return Err(cursor.expected_instead("element numbers", line)),
                    }
                }
            }
            Section::Region => {
                let mut names = line
                    .splitn(2, |&b| b == b',')
                    .map(|part| String::from_utf8_lossy(part.trim_ascii()).into_owned());
                let set = names.next().unwrap_or_default();
                self.regions.push((set, names.next().unwrap_or_default()));
            }
            Section::None => return Err(cursor.expected_instead("a section (*…)", line)),
            Section::Ignored => {}
        }
        Ok(())
    }

    fn read_vertex(&mut self, cursor: &Cursor, line: &[u8]) -> Result<(), MeshFileError> {
        let mut fields = words(line);
        let label = fields.next().and_then(parse_integer);
        let mut real = || fields.next().and_then(parse_real);
        let (Some(label), Some(x), Some(y), Some(z)) = (label, real(), real(), real()) else {
            return Err(cursor.expected_instead("a vertex: number, x, y, z", line));
        };
        self.raw.node_labels.push(label);
        self.raw.points.push(Point3::new(x, y, z));
        self.found[0] += 1;
        Ok(())
    }

    fn read_element(
        &mut self,
        cursor: &Cursor,
        line: &[u8],
        kind: CellKind,
    ) -> Result<(), MeshFileError> {
        let mut fields = words(line).map(parse_integer);
        let mut nodes = [0; 8];
        let label = fields.next().flatten();
        let mut complete = label.is_some();
        for node in nodes.iter_mut().take(kind.nodes) {
            match fields.next().flatten() {
                Some(value) => *node = value,
                None => complete = false,
            }
        }
        let (true, Some(label)) = (complete && fields.next().is_none(), label) else {
            let what = format!("an element: number and {} vertices", kind.nodes);
            return Err(cursor.expected_instead(&what, line));
        };
        if kind.shape == Shape::Tetrahedron {
            self.element_labels.push(label);
        }
        self.raw.add_cell(kind, nodes.get(..kind.nodes).unwrap_or_default(), [0, 0]);
        self.found[1] += 1;
        Ok(())
    }

    /// Region of each tetrahedron: 1, 2 … by its set; a later region wins, 0 is in none.
    fn assign_regions(&mut self) {
        let mut by_label: Vec<(i64, usize)> =
            self.element_labels.iter().enumerate().map(|(tet, &label)| (label, tet)).collect();
        by_label.sort_unstable();
        // From the last region to the first, each set once: the first one to come stays.
        let mut done = BTreeSet::new();
        for (number, (set, material)) in self.regions.iter().enumerate().rev() {
            let label = number as i64 + 1;
            self.raw.region_names.insert(label, format!("{set} ({material})"));
            if !done.insert(set) {
                continue;
            }
            let region_slots = &mut self.raw.regions;
            let mut assign = |tet: usize| {
                if let Some(region) = region_slots.get_mut(tet).filter(|region| region[0] == 0) {
                    region[0] = label;
                }
            };
            match self.sets.get(set) {
                Some(elements) => {
                    for element in elements {
                        let at = by_label.partition_point(|pair| pair.0 < *element);
                        by_label
                            .get(at)
                            .filter(|pair| pair.0 == *element)
                            .iter()
                            .for_each(|p| assign(p.1));
                    }
                }
                None if set == "allElements" => (0..by_label.len()).for_each(assign),
                None => {
                    self.raw.findings.note(format!("region of unknown set {}", set.escape_debug()));
                }
            }
        }
    }
}

/// Count in front of a section; the numbers after it are the same in every file.
fn announced(cursor: &Cursor, line: &[u8]) -> Result<usize, MeshFileError> {
    words(line)
        .next()
        .and_then(parse_integer)
        .and_then(|count| usize::try_from(count).ok())
        .ok_or_else(|| cursor.expected_instead("a count", line))
}

fn element_kind(cursor: &Cursor, line: &[u8]) -> Result<CellKind, MeshFileError> {
    match line.to_ascii_uppercase().as_slice() {
        b"TET" | b"TETS" => Ok(CellKind::new(Shape::Tetrahedron, 4)),
        b"CUBIC" | b"CUBES" => Ok(CellKind::new(Shape::Hexahedron, 8)),
        _ => Err(cursor.expected_instead("TET, TETS or CUBIC", line)),
    }
}
