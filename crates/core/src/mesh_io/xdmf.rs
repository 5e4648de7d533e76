//! XDMF: the uniform grids of a document, with numbers in the text or in raw files beside it.

use nalgebra::Point3;

use super::cell_kind::{CellKind, Shape};
use super::companion::FindCompanion;
use super::cursor::{Cursor, quote};
use super::error::{Fault, MeshFileError};
use super::raw_mesh::RawMesh;
use super::xdmf_item::{DataItem, ItemReader};
use super::xml::{Event, attribute, next_event};

/// Names of data on cells that are regions: ours, and what meshio calls Gmsh's and MEDIT's.
const REGION_NAMES: [&[u8]; 3] = [b"region", b"gmsh:physical", b"medit:ref"];

/// A uniform grid, before its numbers are read.
#[derive(Debug, Default)]
struct Grid<'a> {
    topology: Option<(&'a [u8], DataItem<'a>)>,
    geometry: Option<(&'a [u8], DataItem<'a>)>,
    regions: Option<DataItem<'a>>,
}

/// The element that a `DataItem` belongs to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Parent<'a> {
    Topology(&'a [u8]),
    Geometry(&'a [u8]),
    Regions,
    Other,
}

/// Reads an XDMF file; of a series in time its first grid.
///
/// # Errors
/// [`MeshFileError`]: data in HDF5, references and functions of data, or arrays that are not as
/// announced.
///
/// Source: "XDMF Model and Format", www.xdmf.org.
pub(super) fn read(
    name: &str,
    bytes: &[u8],
    find: &mut FindCompanion,
) -> Result<RawMesh, MeshFileError> {
    let mut cursor = Cursor::new(name, bytes);
    let mut raw = RawMesh::default();
    let grids = read_document(&mut cursor, &mut raw)?;
    let mut items = ItemReader::new(find);
    for grid in &grids {
        read_grid(grid, &mut items, &mut raw)?;
    }
    Ok(raw)
}

fn read_document<'a>(
    cursor: &mut Cursor<'a>,
    raw: &mut RawMesh,
) -> Result<Vec<Grid<'a>>, MeshFileError> {
    let mut grids: Vec<Grid> = Vec::new();
    let mut parent = Parent::Other;
    let (mut depth, mut has_series, mut later_grids) = (0_usize, false, 0_usize);
    while let Some(event) = next_event(cursor)? {
        match event {
            Event::Open { name, attributes, empty } => {
                depth += usize::from(!empty);
                match name {
                    b"Grid" if attribute(attributes, "CollectionType") == Some(b"Temporal") => {
                        has_series = true;
                    }
                    b"Grid" if !matches!(kind_of(attributes, "Grid"), b"Collection" | b"Tree") => {
                        later_grids += usize::from(has_series && !grids.is_empty());
                        if later_grids == 0 {
                            grids.push(Grid::default());
                        }
                    }
                    b"DataItem" if parent != Parent::Other && later_grids == 0 => {
                        let item = read_item(cursor, attributes, empty)?;
                        place(grids.last_mut(), parent, item, raw);
                    }
                    b"Topology" | b"Geometry" | b"Attribute" if !empty => {
                        parent = parent_of(name, attributes, raw);
                    }
                    _ => {}
                }
            }
            Event::Close { name } => {
                depth = depth.saturating_sub(1);
                if matches!(name, b"Topology" | b"Geometry" | b"Attribute") {
                    parent = Parent::Other;
                }
            }
            Event::Text(_) => {}
        }
    }
    if depth > 0 {
        return Err(cursor.expected("the end of the document's elements"));
    }
    if later_grids > 0 {
        raw.findings.note(format!("the first grid of a series; {later_grids} later ones not read"));
    }
    Ok(grids)
}

/// `GridType` and the like, or plain `Type` as some writers have it.
fn kind_of<'a>(attributes: &'a [u8], element: &str) -> &'a [u8] {
    attribute(attributes, &format!("{element}Type"))
        .or_else(|| attribute(attributes, "Type"))
        .unwrap_or_default()
}

fn parent_of<'a>(name: &[u8], attributes: &'a [u8], raw: &mut RawMesh) -> Parent<'a> {
    match name {
        b"Topology" => Parent::Topology(kind_of(attributes, "Topology")),
        b"Geometry" => Parent::Geometry(kind_of(attributes, "Geometry")),
        _ => {
            let name = attribute(attributes, "Name").unwrap_or_default();
            let on_cells = attribute(attributes, "Center") == Some(b"Cell");
            if on_cells && REGION_NAMES.contains(&name) {
                return Parent::Regions;
            }
            raw.findings.skip(name);
            Parent::Other
        }
    }
}

/// A `DataItem` with its text; the cursor stands before its end.
fn read_item<'a>(
    cursor: &mut Cursor<'a>,
    attributes: &'a [u8],
    empty: bool,
) -> Result<DataItem<'a>, MeshFileError> {
    let item_type = attribute(attributes, "ItemType").unwrap_or(b"Uniform");
    if item_type != b"Uniform" {
        let what = format!("a DataItem of type {}", quote(item_type));
        return Err(cursor.unsupported(&what));
    }
    if empty || attribute(attributes, "Reference").is_some() {
        return Err(cursor.unsupported("a DataItem by reference"));
    }
    let mut ahead = cursor.clone();
    match next_event(&mut ahead)? {
        Some(Event::Text(text)) => {
            cursor.skip_space();
            Ok(DataItem { cursor: cursor.clone(), attributes, text })
        }
        Some(Event::Close { .. }) => Ok(DataItem { cursor: cursor.clone(), attributes, text: b"" }),
        _ => Err(cursor.expected("the numbers of a DataItem")),
    }
}

fn place<'a>(
    grid: Option<&mut Grid<'a>>,
    parent: Parent<'a>,
    item: DataItem<'a>,
    raw: &mut RawMesh,
) {
    let Some(grid) = grid else { return };
    match parent {
        // The first item counts; a geometry of three has one for each axis.
        Parent::Topology(kind) if grid.topology.is_none() => grid.topology = Some((kind, item)),
        Parent::Geometry(kind) if grid.geometry.is_none() => grid.geometry = Some((kind, item)),
        Parent::Regions if item.is_whole() => grid.regions = Some(item),
        Parent::Regions => raw.findings.skip(b"regions that are no whole numbers"),
        _ => {}
    }
}

fn read_grid(grid: &Grid, items: &mut ItemReader, raw: &mut RawMesh) -> Result<(), MeshFileError> {
    let (Some((topology, cells)), Some((geometry, points))) = (&grid.topology, &grid.geometry)
    else {
        raw.findings.note("a grid without Topology or Geometry of its own");
        return Ok(());
    };
    match geometry.to_ascii_uppercase().as_slice() {
        b"" | b"XYZ" => {}
        b"XY" => {
            let found = "a plane mesh".to_owned();
            return Err(points.cursor.fault(Fault::NoTetrahedra { found }));
        }
        other => {
            let what = format!("a Geometry of type {}", quote(other));
            return Err(points.cursor.unsupported(&what));
        }
    }
    let coordinates = items.reals(points)?;
    if coordinates.len() % 3 != 0 {
        let found = coordinates.len().to_string();
        return Err(points.cursor.count_fault("coordinates", "a multiple of 3", &found));
    }
    let first = raw.points.len();
    raw.points.extend(coordinates.chunks_exact(3).map(|c| Point3::new(c[0], c[1], c[2])));
    let numbers = items.integers(cells)?;
    let regions = match &grid.regions {
        Some(item) => items.integers(item)?,
        None => Vec::new(),
    };
    let mut cells = Cells { cursor: &cells.cursor, first, regions, cell: 0 };
    if topology.eq_ignore_ascii_case(b"Mixed") {
        return cells.read_mixed(&numbers, raw);
    }
    match xdmf_cell(topology) {
        Some(kind) if numbers.len() % kind.nodes == 0 => {
            numbers.chunks_exact(kind.nodes).try_for_each(|nodes| cells.add(kind, nodes, raw))
        }
        Some(kind) => {
            let expected = format!("a multiple of {}", kind.nodes);
            Err(cells.cursor.count_fault("nodes of cells", &expected, &numbers.len().to_string()))
        }
        None => {
            let name = format!("numbers of a Topology of type {}", quote(topology));
            *raw.findings.other_cells.entry(name).or_default() += numbers.len();
            Ok(())
        }
    }
}

/// The cells of a grid while they are added.
struct Cells<'c, 'a> {
    cursor: &'c Cursor<'a>,
    /// Number of the grid's first point.
    first: usize,
    regions: Vec<i64>,
    cell: usize,
}

impl Cells<'_, '_> {
    fn add(
        &mut self,
        kind: CellKind,
        nodes: &[i64],
        raw: &mut RawMesh,
    ) -> Result<(), MeshFileError> {
        let region = self.regions.get(self.cell).copied().unwrap_or(0);
        self.cell += 1;
        let (Shape::Tetrahedron, Some((corners, further))) =
            (kind.shape, nodes.split_first_chunk::<4>())
        else {
            raw.count_cells(kind, 1);
            return Ok(());
        };
        let count = raw.points.len() - self.first;
        for &label in corners {
            if usize::try_from(label).is_ok_and(|index| index < count) {
                continue;
            }
            let nodes = format!("its grid has {count} nodes, from 0");
            return Err(self.cursor.fault(Fault::UnknownNode {
                tet: raw.tets.len(),
                label,
                nodes,
            }));
        }
        // Beyond its own grid a mid-edge node is none, also where a further grid would have one there.
        let in_file = |label: i64| match usize::try_from(label).is_ok_and(|index| index < count) {
            true => label + self.first as i64,
            false => -1,
        };
        let further: Vec<i64> = further.iter().map(|&label| in_file(label)).collect();
        raw.add_tet(corners.map(in_file), &further);
        raw.regions.push([region, 0]);
        Ok(())
    }

    /// Numbers of cells with their type in front.
    fn read_mixed(&mut self, numbers: &[i64], raw: &mut RawMesh) -> Result<(), MeshFileError> {
        let mut rest = numbers;
        while let Some((&number, after)) = rest.split_first() {
            let (kind, after) = match (mixed_cell(number), after.split_first()) {
                (Some(kind), _) => (kind, after),
                // Points, lines and polygons say how many nodes they have.
                (None, Some((&nodes, after))) if matches!(number, 1..=3) => {
                    let shape = [Shape::Point, Shape::Line, Shape::Polygon][number as usize - 1];
                    let nodes = usize::try_from(nodes).unwrap_or(usize::MAX);
                    (CellKind::new(shape, nodes), after)
                }
                _ => {
                    let what = format!("a cell of XDMF type {number}");
                    return Err(self.cursor.unsupported(&what));
                }
            };
            let Some((nodes, after)) = after.split_at_checked(kind.nodes) else {
                let (expected, found) = (kind.nodes.to_string(), after.len().to_string());
                return Err(self.cursor.count_fault("nodes of a cell", &expected, &found));
            };
            self.add(kind, nodes, raw)?;
            rest = after;
        }
        Ok(())
    }
}

/// Kind by the name of a topology: `Tetrahedron`, `Tet_10`, `Hexahedron_20`.
///
/// The corners of `Tetrahedron_10` come first.
fn xdmf_cell(name: &[u8]) -> Option<CellKind> {
    let name = String::from_utf8_lossy(name).to_ascii_lowercase();
    let letters = name.find(|c: char| !c.is_ascii_alphabetic()).unwrap_or(name.len());
    let (shape, linear) = match name.get(..letters)? {
        "polyvertex" => (Shape::Point, 1),
        "edge" | "polyline" => (Shape::Line, 2),
        "triangle" | "tri" => (Shape::Triangle, 3),
        "quadrilateral" | "quad" => (Shape::Quadrangle, 4),
        "tetrahedron" | "tet" => (Shape::Tetrahedron, 4),
        "pyramid" => (Shape::Pyramid, 5),
        "wedge" => (Shape::Prism, 6),
        "hexahedron" | "hex" => (Shape::Hexahedron, 8),
        _ => return None,
    };
    let digits = name.get(letters..)?.trim_start_matches('_');
    let nodes = if digits.is_empty() { linear } else { digits.parse().ok()? };
    (linear..=100).contains(&nodes).then_some(CellKind::new(shape, nodes))
}

/// Kind by the number in front of a cell of a mixed topology.
fn mixed_cell(number: i64) -> Option<CellKind> {
    let (shape, nodes) = match number {
        4 => (Shape::Triangle, 3),
        5 => (Shape::Quadrangle, 4),
        6 => (Shape::Tetrahedron, 4),
        7 => (Shape::Pyramid, 5),
        8 => (Shape::Prism, 6),
        9 => (Shape::Hexahedron, 8),
        34 => (Shape::Line, 3),
        35 => (Shape::Quadrangle, 9),
        36 => (Shape::Triangle, 6),
        37 => (Shape::Quadrangle, 8),
        38 => (Shape::Tetrahedron, 10),
        39 => (Shape::Pyramid, 13),
        40 => (Shape::Prism, 15),
        41 => (Shape::Prism, 18),
        48 => (Shape::Hexahedron, 20),
        49 => (Shape::Hexahedron, 24),
        50 => (Shape::Hexahedron, 27),
        _ => return None,
    };
    Some(CellKind::new(shape, nodes))
}
