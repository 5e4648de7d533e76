//! Abaqus and CalculiX decks `.inp`: nodes, elements, sets, sections, parts, included files.

use nalgebra::{Point3, Vector3};

use super::cell_kind::{CellKind, Shape};
use super::companion::FindCompanion;
use super::cursor::{Cursor, quote};
use super::deck_assembly::{Instance, assemble};
use super::deck_keyword::{Keyword, deck_cell, fields};
use super::deck_part::{DeckPart, Member};
use super::error::MeshFileError;
use super::findings::Included;
use super::number::{parse_integer, parse_real};
use super::raw_mesh::RawMesh;

/// Keywords that make nodes or elements out of others, or move them.
const GENERATORS: [&str; 9] =
    ["NGEN", "NFILL", "NCOPY", "NMAP", "ELGEN", "ELCOPY", "SYSTEM", "IMPORT", "SUBSTRUCTURE"];

/// What the data lines after a keyword are.
#[derive(Clone, Debug)]
enum Section {
    /// A block whose lines are passed over.
    Ignored,
    Nodes,
    Elements(ElementBlock),
    /// Elements of a set.
    Set {
        set: usize,
        generate: bool,
    },
    /// Translation and rotation of an instance.
    Placing,
}

/// What an `*ELEMENT` says about the elements after it.
#[derive(Clone, Debug)]
struct ElementBlock {
    type_name: String,
    kind: Option<CellKind>,
    set: Option<usize>,
    /// Label and nodes of an element that is not complete yet.
    pending: Vec<i64>,
}

/// State while the lines of a deck and of the files it includes go by.
struct Reader<'f, 'g> {
    /// The first one has what stands in no part.
    parts: Vec<DeckPart>,
    instances: Vec<Instance>,
    /// The part, or the data of the instance, that lines belong to.
    scope: usize,
    section: Section,
    raw: RawMesh,
    included: Included<'f, 'g>,
}

/// Reads a deck; what stands in steps, materials and the like is skipped and named.
///
/// # Errors
/// [`MeshFileError`]: a line does not fit its keyword, an included file is missing, or the mesh is
/// made in a way that is not read.
///
/// Source: Abaqus Analysis User's Guide, "Input syntax rules", "Assembly definition"; CalculiX
/// CrunchiX User's Manual, "Input deck format".
pub(super) fn read(
    name: &str,
    bytes: &[u8],
    find: &mut FindCompanion,
) -> Result<RawMesh, MeshFileError> {
    let mut reader = Reader {
        parts: vec![DeckPart::default()],
        instances: Vec::new(),
        scope: 0,
        section: Section::Ignored,
        raw: RawMesh::default(),
        included: Included::new(find),
    };
    let mut cursor = Cursor::new(name, bytes);
    reader.read_file(&mut cursor)?;
    reader.end_section(&cursor)?;
    assemble(&cursor, reader.parts, reader.instances, reader.raw)
}

impl Reader<'_, '_> {
    fn read_file(&mut self, cursor: &mut Cursor) -> Result<(), MeshFileError> {
        while let Some(line) = cursor.line() {
            match line {
                [b'*', b'*', ..] => {}
                [b'*', ..] => {
                    let keyword = Keyword::read(line, cursor);
                    // The text of another file: data lines in it belong to what stands before.
                    if keyword.name == "INCLUDE" {
                        self.include(cursor, keyword.parameter("INPUT"))?;
                        continue;
                    }
                    self.end_section(cursor)?;
                    self.read_keyword(cursor, &keyword)?;
                }
                _ => self.read_line(cursor, line)?,
            }
        }
        Ok(())
    }

    fn read_keyword(&mut self, cursor: &Cursor, keyword: &Keyword) -> Result<(), MeshFileError> {
        let name = keyword.name.as_str();
        self.section = match name {
            "HEADING" | "PREPRINT" | "ASSEMBLY" | "ENDASSEMBLY" => Section::Ignored,
            "NODE" => self.nodes(cursor, keyword)?,
            "ELEMENT" => self.elements(cursor, keyword)?,
            "ELSET" => self.element_set(cursor, keyword)?,
            "SOLIDSECTION" => self.solid_section(keyword),
            "PART" => {
                self.scope = self.new_part(keyword.parameter("NAME").unwrap_or_default());
                Section::Ignored
            }
            "INSTANCE" => self.instance(keyword),
            "ENDPART" | "ENDINSTANCE" => {
                self.scope = 0;
                Section::Ignored
            }
            _ if GENERATORS.contains(&name) => {
                return Err(cursor.unsupported(&format!("a mesh made by *{name}")));
            }
            _ => {
                self.raw.findings.skip(name.as_bytes());
                Section::Ignored
            }
        };
        // The data lines of some keywords may stand in a file of their own.
        match keyword.parameter("INPUT") {
            file @ Some(_) if !matches!(self.section, Section::Ignored) => {
                self.include(cursor, file)
            }
            _ => Ok(()),
        }
    }

    fn part(&mut self) -> &mut DeckPart {
        self.parts.get_mut(self.scope).expect("a scope is made with its part")
    }

    fn new_part(&mut self, name: &str) -> usize {
        self.parts.push(DeckPart::named(name));
        self.parts.len() - 1
    }

    fn nodes(&mut self, cursor: &Cursor, keyword: &Keyword) -> Result<Section, MeshFileError> {
        match keyword.parameter("SYSTEM") {
            None | Some("" | "R" | "r") => Ok(Section::Nodes),
            Some(_) => Err(cursor.unsupported("*NODE in cylindrical or spherical coordinates")),
        }
    }

    fn elements(&mut self, cursor: &Cursor, keyword: &Keyword) -> Result<Section, MeshFileError> {
        let type_name = keyword.parameter("TYPE").filter(|name| !name.is_empty());
        let Some(type_name) = type_name else {
            return Err(cursor.expected_instead("TYPE=name of the elements", b"*ELEMENT"));
        };
        let set = keyword.parameter("ELSET").map(|name| self.part().set(name));
        Ok(Section::Elements(ElementBlock {
            type_name: type_name.to_ascii_uppercase(),
            kind: deck_cell(type_name),
            set,
            pending: Vec::new(),
        }))
    }

    fn element_set(
        &mut self,
        cursor: &Cursor,
        keyword: &Keyword,
    ) -> Result<Section, MeshFileError> {
        let Some(name) = keyword.parameter("ELSET") else {
            return Err(cursor.expected_instead("ELSET=name of the set", b"*ELSET"));
        };
        let set = self.part().set(name);
        Ok(Section::Set { set, generate: keyword.parameter("GENERATE").is_some() })
    }

    fn solid_section(&mut self, keyword: &Keyword) -> Section {
        if let Some(set) = keyword.parameter("ELSET") {
            let material = keyword.parameter("MATERIAL").unwrap_or_default();
            self.part().add_section(set, material);
        }
        Section::Ignored
    }

    fn instance(&mut self, keyword: &Keyword) -> Section {
        let name = keyword.parameter("NAME").unwrap_or_default();
        self.scope = self.new_part(name);
        self.instances.push(Instance {
            name: name.to_owned(),
            part: keyword.parameter("PART").unwrap_or_default().to_owned(),
            own: self.scope,
            shift: Vector3::zeros(),
            turn: None,
            lines: 0,
        });
        Section::Placing
    }

    /// An included file goes on where the line stands.
    fn include(&mut self, cursor: &Cursor, file: Option<&str>) -> Result<(), MeshFileError> {
        let Some(file) = file else {
            return Err(cursor.expected_instead("INPUT=file", b"*INCLUDE"));
        };
        let findings = &mut self.raw.findings;
        let bytes = self.included.bytes(file, "included files", cursor, findings)?;
        self.read_file(&mut Cursor::new(file, &bytes))
    }

    fn read_line(&mut self, cursor: &Cursor, line: &[u8]) -> Result<(), MeshFileError> {
        match &mut self.section {
            Section::Ignored => Ok(()),
            Section::Nodes => self.read_node(cursor, line),
            Section::Elements(block) => {
                let part = self.parts.get_mut(self.scope).expect("a scope is made with its part");
                block.read_line(cursor, line, part)
            }
            Section::Set { set, generate } => {
                let (set, generate) = (*set, *generate);
                self.read_members(cursor, line, set, generate)
            }
            Section::Placing => match self.instances.last_mut() {
                Some(instance) => instance.read_line(cursor, line),
                None => Ok(()),
            },
        }
    }

    /// Label and up to three coordinates; those left out are zero.
    fn read_node(&mut self, cursor: &Cursor, line: &[u8]) -> Result<(), MeshFileError> {
        let mut fields = fields(line).into_iter();
        let label = fields.next().and_then(parse_integer);
        let mut coordinate = || match fields.next() {
            None | Some(b"") => Some(0.0),
            Some(field) => parse_real(field),
        };
        let (Some(label), Some(x), Some(y), Some(z)) =
            (label, coordinate(), coordinate(), coordinate())
        else {
            return Err(cursor.expected_instead("a node: label, x, y, z", line));
        };
        let part = self.part();
        part.node_labels.push(label);
        part.points.push(Point3::new(x, y, z));
        Ok(())
    }

    fn read_members(
        &mut self,
        cursor: &Cursor,
        line: &[u8],
        set: usize,
        generate: bool,
    ) -> Result<(), MeshFileError> {
        let fields = fields(line);
        if generate {
            let numbers: Option<Vec<i64>> =
                fields.iter().map(|field| parse_integer(field)).collect();
            let (first, last, step) = match numbers.as_deref() {
                Some(&[first, last]) => (first, last, 1),
                Some(&[first, last, step]) if step > 0 => (first, last, step),
                _ => return Err(cursor.expected_instead("first label, last label, step", line)),
            };
            self.part().add_member(set, Member::Labels { first, last, step });
            return Ok(());
        }
        for field in fields.into_iter().filter(|field| !field.is_empty()) {
            let member = match parse_integer(field) {
                Some(label) => Member::Label(label),
                None => {
                    let name = field.strip_prefix(b"\"").unwrap_or(field);
                    let name = name.strip_suffix(b"\"").unwrap_or(name);
                    Member::Set(String::from_utf8_lossy(name).to_uppercase())
                }
            };
            self.part().add_member(set, member);
        }
        Ok(())
    }

    /// Checks that the last element is complete.
    fn end_section(&mut self, cursor: &Cursor) -> Result<(), MeshFileError> {
        match &self.section {
            Section::Elements(block) if !block.pending.is_empty() => {
                let nodes = block.kind.map_or(0, |kind| kind.nodes);
                let array = format!("nodes of an element of type {}", block.type_name);
                let found = (block.pending.len() - 1).to_string();
                Err(cursor.count_fault(&array, &nodes.to_string(), &found))
            }
            _ => Ok(()),
        }
    }
}

impl ElementBlock {
    /// Label and nodes, which may go on in the next line.
    fn read_line(
        &mut self,
        cursor: &Cursor,
        line: &[u8],
        part: &mut DeckPart,
    ) -> Result<(), MeshFileError> {
        let Some(kind) = self.kind else {
            // Elements of unknown kinds are records that end where no comma does.
            if !line.ends_with(b",") {
                let name = format!("elements of type {}", quote(self.type_name.as_bytes()));
                *part.odd_cells.entry(name).or_default() += 1;
            }
            return Ok(());
        };
        for field in fields(line) {
            let Some(number) = parse_integer(field) else {
                let what = format!("an element: label and {} nodes", kind.nodes);
                return Err(cursor.expected_instead(&what, line));
            };
            self.pending.push(number);
        }
        match self.pending.len() {
            n if n <= kind.nodes => Ok(()),
            // Some decks name more nodes for a brick than it has; CalculiX passes them over.
            n if n == kind.nodes + 1 || kind.shape != Shape::Tetrahedron => {
                let (label, nodes) = (self.pending[0], &self.pending[1..]);
                part.add_element(kind, label, nodes, self.set);
                self.pending.clear();
                Ok(())
            }
            n => {
                let array = format!("nodes of an element of type {}", self.type_name);
                Err(cursor.count_fault(&array, &kind.nodes.to_string(), &(n - 1).to_string()))
            }
        }
    }
}
