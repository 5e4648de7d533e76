//! FEBio `.feb`: the nodes, elements and domains of a model; everything else is passed over.

use std::collections::BTreeMap;

use nalgebra::Point3;

use super::cell_kind::{CellKind, Shape};
use super::companion::FindCompanion;
use super::cursor::{Cursor, quote, words};
use super::error::MeshFileError;
use super::findings::Included;
use super::number::{parse_integer, parse_real};
use super::raw_mesh::RawMesh;
use super::xml::{Event, attribute, next_event};

/// The section whose children count.
#[derive(Clone, Debug, PartialEq, Eq)]
enum Section {
    Other,
    Nodes,
    Elements(Block),
}

/// What an `Elements` says about its elements.
#[derive(Clone, Debug, PartialEq, Eq)]
struct Block {
    /// Where it is left out, every element has a type as its name (versions 1 and 2.0).
    type_name: Option<String>,
    name: String,
    material: String,
}

/// An element of the document whose text is waited for.
#[derive(Clone, Debug, PartialEq, Eq)]
enum Open {
    Node(i64),
    Element { type_name: String, material: String },
}

/// State while the elements of a document go by.
struct Reader<'f, 'g> {
    raw: RawMesh,
    section: Section,
    open: Option<Open>,
    /// Number of each region by name and material.
    regions: BTreeMap<(String, String), i64>,
    /// Material of a domain (version 3 and 4), name of a material by its number.
    domain_materials: BTreeMap<String, String>,
    material_names: BTreeMap<String, String>,
    included: Included<'f, 'g>,
}

/// Reads a FEBio model of version 1.2 to 4; parts are regions.
///
/// # Errors
/// [`MeshFileError`]: a node or an element is not what it should be, or a file that a section is
/// read from is missing.
///
/// Source: FEBio User's Manual, "Geometry section" (2.5) and "Mesh section" (3.0, 4.0); the corners
/// of `tet10` come first.
pub(super) fn read(
    name: &str,
    bytes: &[u8],
    find: &mut FindCompanion,
) -> Result<RawMesh, MeshFileError> {
    let mut reader = Reader {
        raw: RawMesh::default(),
        section: Section::Other,
        open: None,
        regions: BTreeMap::new(),
        domain_materials: BTreeMap::new(),
        material_names: BTreeMap::new(),
        included: Included::new(find),
    };
    reader.read_file(&mut Cursor::new(name, bytes))?;
    reader.name_regions();
    Ok(reader.raw)
}

impl Reader<'_, '_> {
    fn read_file(&mut self, cursor: &mut Cursor) -> Result<(), MeshFileError> {
        let mut depth = 0_usize;
        while let Some(event) = next_event(cursor)? {
            match event {
                Event::Open { name, attributes, empty } => {
                    depth += usize::from(!empty);
                    self.read_open(cursor, name, attributes, empty)?;
                }
                Event::Close { name } => {
                    depth = depth.saturating_sub(1);
                    if let Some(open) = self.open.take() {
                        return Err(cursor.expected_instead(open.contents(), name));
                    }
                    if matches!(name, b"Nodes" | b"Elements") {
                        self.section = Section::Other;
                    }
                }
                Event::Text(text) => match self.open.take() {
                    Some(Open::Node(label)) => self.read_node(cursor, label, text)?,
                    Some(Open::Element { type_name, material }) => {
                        self.read_element(cursor, &type_name, material, text)?;
                    }
                    None => {}
                },
            }
        }
        match depth {
            0 => Ok(()),
            _ => Err(cursor.expected("the end of the document's elements")),
        }
    }

    fn read_open(
        &mut self,
        cursor: &Cursor,
        name: &[u8],
        attributes: &[u8],
        empty: bool,
    ) -> Result<(), MeshFileError> {
        let value = |key: &str| {
            let value = attribute(attributes, key).unwrap_or_default();
            String::from_utf8_lossy(value).into_owned()
        };
        match (name, &self.section) {
            (b"Geometry" | b"Mesh" | b"Nodes" | b"Elements" | b"MeshDomains", _)
                if attribute(attributes, "from").is_some() =>
            {
                return self.read_from(cursor, &value("from"));
            }
            (b"Nodes", _) if !empty => self.section = Section::Nodes,
            (b"Elements", _) if !empty => {
                let type_name = attribute(attributes, "type").map(|_| value("type"));
                self.section = Section::Elements(Block {
                    type_name,
                    name: value("name"),
                    material: value("mat"),
                });
            }
            (b"Instance", _) => {
                return Err(cursor.unsupported("a mesh of instances of parts"));
            }
            (b"SolidDomain", _) => {
                self.domain_materials.insert(value("name"), value("mat"));
            }
            (b"material", _) => {
                self.material_names.insert(value("id"), value("name"));
            }
            (b"node", Section::Nodes) => {
                let Some(label) = attribute(attributes, "id").and_then(parse_integer) else {
                    return Err(cursor.expected_instead("a node with id=\"number\"", attributes));
                };
                self.open = Some(Open::Node(label));
            }
            (_, Section::Elements(block)) => {
                let child = String::from_utf8_lossy(name).into_owned();
                let type_name = block.type_name.clone().unwrap_or(child);
                let material =
                    attribute(attributes, "mat").map_or(block.material.clone(), |_| value("mat"));
                self.open = Some(Open::Element { type_name, material });
            }
            _ => {}
        }
        match self.open.as_ref().filter(|_| empty) {
            Some(open) => Err(cursor.expected_instead(open.contents(), name)),
            None => Ok(()),
        }
    }

    /// A section may stand in a file of its own.
    fn read_from(&mut self, cursor: &Cursor, file: &str) -> Result<(), MeshFileError> {
        let findings = &mut self.raw.findings;
        let bytes = self.included.bytes(file, "files of sections", cursor, findings)?;
        self.read_file(&mut Cursor::new(file, &bytes))
    }

    fn read_node(&mut self, cursor: &Cursor, label: i64, text: &[u8]) -> Result<(), MeshFileError> {
        let numbers: Option<Vec<f64>> = words(text).take(4).map(parse_real).collect();
        let Some(&[x, y, z]) = numbers.as_deref() else {
            return Err(cursor.expected_instead("the coordinates x, y, z of a node", text));
        };
        self.raw.node_labels.push(label);
        self.raw.points.push(Point3::new(x, y, z));
        Ok(())
    }

    fn read_element(
        &mut self,
        cursor: &Cursor,
        type_name: &str,
        material: String,
        text: &[u8],
    ) -> Result<(), MeshFileError> {
        let Some(kind) = febio_cell(type_name) else {
            let name = format!("elements of type {}", quote(type_name.as_bytes()));
            *self.raw.findings.other_cells.entry(name).or_default() += 1;
            return Ok(());
        };
        let nodes: Option<Vec<i64>> = words(text).take(kind.nodes + 1).map(parse_integer).collect();
        let Some(nodes) = nodes.filter(|nodes| nodes.len() == kind.nodes) else {
            let what = format!("the {} nodes of an element of type {type_name}", kind.nodes);
            return Err(cursor.expected_instead(&what, text));
        };
        let name = match &self.section {
            Section::Elements(block) => block.name.clone(),
            _ => String::new(),
        };
        let count = self.regions.len() as i64 + 1;
        let region = match kind.shape {
            Shape::Tetrahedron => *self.regions.entry((name, material)).or_insert(count),
            _ => 0,
        };
        self.raw.add_cell(kind, &nodes, [region, 0]);
        Ok(())
    }

    /// Part and material, as far as they are known.
    fn name_regions(&mut self) {
        for ((part, material), &number) in &self.regions {
            let material = match material.as_str() {
                "" => self.domain_materials.get(part).map_or("", String::as_str),
                number => self.material_names.get(number).map_or(number, String::as_str),
            };
            let name = match (part.as_str(), material) {
                ("", "") => "no part".to_owned(),
                ("", material) => material.to_owned(),
                (part, "") => part.to_owned(),
                (part, material) => format!("{part} ({material})"),
            };
            self.raw.region_names.insert(number, name);
        }
    }
}

impl Open {
    /// What the section's children are called.
    fn contents(&self) -> &'static str {
        match self {
            Self::Node(_) => "the coordinates of a node",
            Self::Element { .. } => "the nodes of an element",
        }
    }
}

/// Kind of an element by its type: letters, number of nodes, and perhaps a rule of integration.
fn febio_cell(name: &str) -> Option<CellKind> {
    let name = name.to_ascii_lowercase();
    let letters = name.find(|c: char| c.is_ascii_digit())?;
    let (shape, rest) = name.split_at(letters);
    let digits = rest.find(|c: char| !c.is_ascii_digit()).unwrap_or(rest.len());
    let nodes: usize = rest.get(..digits)?.parse().ok()?;
    let (shape, known): (Shape, &[usize]) = match shape {
        "tet" | "ut" => (Shape::Tetrahedron, &[4, 5, 10, 15, 20]),
        "hex" => (Shape::Hexahedron, &[8, 20, 27]),
        "penta" => (Shape::Prism, &[6, 15]),
        "pyra" => (Shape::Pyramid, &[5, 13]),
        "tri" => (Shape::Triangle, &[3, 6, 7, 10]),
        "quad" | "q" => (Shape::Quadrangle, &[4, 8, 9]),
        "line" | "truss" | "beam" => (Shape::Line, &[2, 3]),
        _ => return None,
    };
    known.contains(&nodes).then_some(CellKind::new(shape, nodes))
}
