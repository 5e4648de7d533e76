//! Gmsh MSH 4.0 (text) and 4.1 (text and binary): nodes and elements in blocks by entity.

use std::collections::BTreeMap;

use nalgebra::Point3;

use super::cell_kind::{CellKind, Shape, gmsh_cell};
use super::cursor::Cursor;
use super::error::MeshFileError;
use super::msh1::{Header, end_section, read_integers};
use super::raw_mesh::RawMesh;
use super::scalar::ByteOrder;

/// First physical group of each volume entity, from `$Entities`.
#[derive(Debug, Default)]
pub(super) struct Entities {
    physical: BTreeMap<i64, i64>,
}

/// Numbers of a section, which are text or binary; the grammar is the same.
struct Values<'c, 'a> {
    cursor: &'c mut Cursor<'a>,
    binary: Option<ByteOrder>,
    size_bytes: i64,
}

impl<'c, 'a> Values<'c, 'a> {
    fn new(cursor: &'c mut Cursor<'a>, header: Header) -> Result<Self, MeshFileError> {
        if header.binary.is_some() {
            cursor.end_of_line()?;
        }
        Ok(Self { cursor, binary: header.binary, size_bytes: header.size_bytes })
    }

    /// A number of Gmsh's type `int`.
    fn int(&mut self, what: &str) -> Result<i64, MeshFileError> {
        match self.binary {
            None => self.cursor.integer(what),
            Some(order) => order.next_i32(self.cursor, what),
        }
    }

    /// `size_t`: counts and tags.
    fn size(&mut self, what: &str) -> Result<i64, MeshFileError> {
        match self.binary {
            None => self.cursor.integer(what),
            Some(order) if self.size_bytes == 4 => {
                self.cursor.take_array(what).map(|bytes| i64::from(order.i32(bytes) as u32))
            }
            Some(order) => {
                let value = order.u64(self.cursor.take_array(what)?);
                i64::try_from(value)
                    .map_err(|_| self.cursor.expected_instead(what, value.to_string().as_bytes()))
            }
        }
    }

    /// `size_t` that announces `array`, each item taking at least `values` numbers.
    fn count(&mut self, array: &str, values: usize) -> Result<usize, MeshFileError> {
        let count = self.size(array)?;
        let Ok(count) = usize::try_from(count) else {
            return Err(self.cursor.expected_instead("a count", count.to_string().as_bytes()));
        };
        let value_bytes = if self.binary.is_some() { 4 } else { 2 };
        self.cursor.check_count(count, values * value_bytes, array)?;
        Ok(count)
    }

    /// A number of Gmsh's type `double`.
    fn real(&mut self, what: &str) -> Result<f64, MeshFileError> {
        match self.binary {
            None => self.cursor.real(what),
            Some(order) => order.next_f64(self.cursor, what),
        }
    }

    fn skip_reals(&mut self, count: usize, what: &str) -> Result<(), MeshFileError> {
        (0..count).try_for_each(|_| self.real(what).map(drop))
    }
}

/// Reads the section `$Entities` for the physical groups of volumes.
pub(super) fn read_entities(
    cursor: &mut Cursor,
    header: Header,
) -> Result<Entities, MeshFileError> {
    let mut values = Values::new(cursor, header)?;
    let mut counts = [0; 4];
    for count in &mut counts {
        *count = values.count("geometric entities", 5)?;
    }
    let mut entities = Entities::default();
    for (dimension, count) in counts.into_iter().enumerate() {
        for _ in 0..count {
            let tag = values.int("an entity tag")?;
            // A point has its coordinates in 4.1 and a box like all others in 4.0.
            let reals = if dimension == 0 && header.minor > 0 { 3 } else { 6 };
            values.skip_reals(reals, "a bounding box")?;
            for i in 0..values.count("physical groups", 1)? {
                let physical = values.int("a physical group")?;
                if dimension == 3 && i == 0 {
                    entities.physical.insert(tag, physical);
                }
            }
            if dimension > 0 {
                for _ in 0..values.count("bounding entities", 1)? {
                    values.int("a bounding entity")?;
                }
            }
        }
    }
    end_section(cursor, "$EndEntities")?;
    Ok(entities)
}

/// Reads the section `$Nodes`.
pub(super) fn read_nodes(
    cursor: &mut Cursor,
    header: Header,
    raw: &mut RawMesh,
) -> Result<(), MeshFileError> {
    let mut values = Values::new(cursor, header)?;
    let blocks = values.count("node blocks", 4)?;
    let total = values.count("nodes", 4)?;
    let is_40 = header.minor == 0;
    if !is_40 {
        values.size("the smallest node tag")?;
        values.size("the largest node tag")?;
    }
    raw.points.reserve(total);
    raw.node_labels.reserve(total);
    let before = raw.points.len();
    for _ in 0..blocks {
        let (first, second) = (values.int("a dimension")?, values.int("an entity tag")?);
        let dimension = if is_40 { second } else { first };
        let parametric = values.int("the parametric flag")?;
        let count = values.count("nodes of a block", 4)?;
        let extra = match (parametric, usize::try_from(dimension)) {
            (0, _) => 0,
            (_, Ok(dimension @ 0..=3)) => dimension,
            _ => return Err(values.cursor.expected("a dimension from 0 to 3 in a block")),
        };
        if !is_40 {
            for _ in 0..count {
                raw.node_labels.push(values.size("a node tag")?);
            }
        }
        for _ in 0..count {
            if is_40 {
                raw.node_labels.push(values.int("a node tag")?);
            }
            let x = values.real("a coordinate")?;
            let y = values.real("a coordinate")?;
            let z = values.real("a coordinate")?;
            values.skip_reals(extra, "a parametric coordinate")?;
            raw.points.push(Point3::new(x, y, z));
        }
    }
    let found = raw.points.len() - before;
    if found != total {
        return Err(cursor.count_fault("nodes", &total.to_string(), &found.to_string()));
    }
    end_section(cursor, "$EndNodes")
}

/// Reads the section `$Elements`.
pub(super) fn read_elements(
    cursor: &mut Cursor,
    header: Header,
    entities: &Entities,
    raw: &mut RawMesh,
) -> Result<(), MeshFileError> {
    let mut values = Values::new(cursor, header)?;
    let blocks = values.count("element blocks", 4)?;
    let total = values.count("elements", 2)?;
    let is_40 = header.minor == 0;
    if !is_40 {
        values.size("the smallest element tag")?;
        values.size("the largest element tag")?;
    }
    let mut found = 0_usize;
    for _ in 0..blocks {
        let (first, second) = (values.int("a dimension")?, values.int("an entity tag")?);
        let tag = if is_40 { first } else { second };
        let number = values.int("an element type")?;
        let count = values.count("elements of a block", 2)?;
        let region = [entities.physical.get(&tag).copied().unwrap_or(0), tag];
        read_block(&mut values, number, count, region, raw)?;
        found = found.saturating_add(count);
    }
    if found != total {
        return Err(cursor.count_fault("elements", &total.to_string(), &found.to_string()));
    }
    end_section(cursor, "$EndElements")
}

fn read_block(
    values: &mut Values,
    number: i64,
    count: usize,
    region: [i64; 2],
    raw: &mut RawMesh,
) -> Result<(), MeshFileError> {
    let Some(kind) = gmsh_cell(number) else {
        return skip_unknown_block(values, number, count, raw);
    };
    let is_tetrahedron = kind.shape == Shape::Tetrahedron;
    let mut nodes = Vec::with_capacity(kind.nodes);
    for _ in 0..count {
        values.size("an element tag")?;
        nodes.clear();
        for _ in 0..kind.nodes {
            nodes.push(values.size("a node of an element")?);
        }
        if is_tetrahedron {
            raw.add_gmsh_cell(kind, &nodes, region);
        }
    }
    if !is_tetrahedron {
        raw.count_cells(kind, count);
    }
    Ok(())
}

/// In a text file an element of any type is a line; in a binary file its length must be known.
fn skip_unknown_block(
    values: &mut Values,
    number: i64,
    count: usize,
    raw: &mut RawMesh,
) -> Result<(), MeshFileError> {
    if values.binary.is_some() {
        return Err(values.cursor.unsupported(&format!("Gmsh element type {number}")));
    }
    let mut fields = Vec::new();
    for _ in 0..count {
        read_integers(values.cursor, &mut fields, "an element line: tag, nodes")?;
    }
    raw.count_cells(CellKind::new(Shape::Unknown(number), fields.len().saturating_sub(1)), count);
    Ok(())
}
