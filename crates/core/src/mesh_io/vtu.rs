//! VTK XML unstructured grids (VTU): the elements that describe the grid, one or more pieces.

use nalgebra::Point3;

use super::cursor::{Cursor, find};
use super::error::{Fault, MeshFileError};
use super::number::parse_integer;
use super::raw_mesh::RawMesh;
use super::scalar::ByteOrder;
use super::vtk_legacy::VtkCells;
use super::vtu_array::{Appended, BinaryRules, Budget, Compressor, DataArray};
use super::xml::{Event, attribute, next_event};

/// One `Piece` with the arrays that make its grid.
#[derive(Debug)]
struct Piece<'a> {
    points: Option<usize>,
    cells: Option<usize>,
    coordinates: Option<DataArray<'a>>,
    connectivity: Option<DataArray<'a>>,
    offsets: Option<DataArray<'a>>,
    types: Option<DataArray<'a>>,
    /// Cell data of whole numbers called `region`.
    regions: Option<DataArray<'a>>,
}

/// Everything found in the document, before any array is decoded.
#[derive(Debug)]
struct Document<'a> {
    rules: BinaryRules,
    pieces: Vec<Piece<'a>>,
    appended: Appended<'a>,
    skipped: Vec<&'static str>,
}

/// Reads a VTU file; of the data on points and cells only the cell data `region` is looked into.
///
/// # Errors
/// [`MeshFileError`]: not an unstructured grid, or the arrays are not as announced.
///
/// Source: VTK user's guide, section "XML file formats".
pub(super) fn read(mut cursor: Cursor) -> Result<RawMesh, MeshFileError> {
    let file_bytes = cursor.rest().len();
    let document = read_document(&mut cursor)?;
    let mut budget = Budget::new(document.rules, file_bytes);
    let mut raw = RawMesh::default();
    for section in &document.skipped {
        raw.findings.skip(section.as_bytes());
    }
    for piece in &document.pieces {
        read_piece(piece, &document, &cursor, &mut budget, &mut raw)?;
    }
    Ok(raw)
}

fn read_document<'a>(cursor: &mut Cursor<'a>) -> Result<Document<'a>, MeshFileError> {
    let rules = read_root(cursor)?;
    let mut document =
        Document { rules, pieces: Vec::new(), appended: Appended::default(), skipped: Vec::new() };
    // The element whose DataArray children count.
    let mut section = Section::Other;
    while let Some(event) = next_event(cursor)? {
        match event {
            Event::Open { name: b"Piece", attributes, .. } => {
                document.pieces.push(Piece::announced(attributes, cursor)?);
            }
            Event::Open { name: b"Points", .. } => section = Section::Points,
            Event::Open { name: b"Cells", .. } => section = Section::Cells,
            Event::Open {
                name: name @ (b"PointData" | b"CellData" | b"FieldData"), empty, ..
            } => {
                section = if empty { Section::Other } else { Section::Data(data_name(name)) };
            }
            Event::Open { name: b"DataArray", attributes, empty } => {
                let array = read_array(cursor, attributes, empty)?;
                if let Section::Data(name) = section
                    && !document.skipped.contains(&name)
                    && !is_region(section, &array)
                {
                    document.skipped.push(name);
                }
                if let Some(piece) = document.pieces.last_mut() {
                    piece.place(section, array);
                }
            }
            Event::Open { name: b"AppendedData", attributes, .. } => {
                document.appended = read_appended(cursor, attributes)?;
                // What follows may be raw bytes, which are no XML.
                break;
            }
            Event::Close { name: b"Points" | b"Cells" | b"PointData" | b"CellData" } => {
                section = Section::Other;
            }
            Event::Open { .. } | Event::Close { .. } | Event::Text(_) => {}
        }
    }
    Ok(document)
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Section {
    Points,
    Cells,
    Data(&'static str),
    Other,
}

/// Whether an array holds a region label per cell, as [`super::write_vtu`] writes it.
fn is_region(section: Section, array: &DataArray) -> bool {
    let is_whole = attribute(array.attributes, "type")
        .is_some_and(|kind| kind.starts_with(b"Int") || kind.starts_with(b"UInt"));
    section == Section::Data("CellData")
        && is_whole
        && attribute(array.attributes, "Name") == Some(b"region")
}

fn data_name(name: &[u8]) -> &'static str {
    match name {
        b"PointData" => "PointData",
        b"CellData" => "CellData",
        _ => "FieldData",
    }
}

/// The root element `VTKFile`.
fn read_root(cursor: &mut Cursor) -> Result<BinaryRules, MeshFileError> {
    let Some(Event::Open { name: b"VTKFile", attributes, .. }) = next_event(cursor)? else {
        return Err(cursor.expected("<VTKFile …>"));
    };
    match attribute(attributes, "type").unwrap_or_default() {
        b"UnstructuredGrid" => {}
        b"PUnstructuredGrid" => {
            return Err(cursor.unsupported("a parallel index (PUnstructuredGrid) of other files"));
        }
        other => {
            let found = format!("a {} data set", other.escape_ascii());
            return Err(cursor.fault(Fault::NoTetrahedra { found }));
        }
    }
    let order = match attribute(attributes, "byte_order") {
        Some(b"BigEndian") => ByteOrder::Big,
        _ => ByteOrder::Little,
    };
    let header_bytes = match attribute(attributes, "header_type") {
        Some(b"UInt64") => 8,
        _ => 4,
    };
    let compressor = match attribute(attributes, "compressor") {
        None | Some(b"") => Compressor::None,
        Some(b"vtkZLibDataCompressor") => Compressor::Zlib,
        Some(b"vtkLZ4DataCompressor") => Compressor::Lz4,
        Some(other) => {
            return Err(cursor.unsupported(&format!("compression {}", other.escape_ascii())));
        }
    };
    Ok(BinaryRules { order, header_bytes, compressor })
}

/// Moves past the array's end tag; children such as `InformationKey` are passed over.
fn read_array<'a>(
    cursor: &mut Cursor<'a>,
    attributes: &'a [u8],
    empty: bool,
) -> Result<DataArray<'a>, MeshFileError> {
    let mut array = DataArray { cursor: cursor.clone(), attributes, text: &[] };
    let mut depth = usize::from(!empty);
    while depth > 0 {
        cursor.skip_space();
        let before = cursor.clone();
        match next_event(cursor)? {
            Some(Event::Open { empty, .. }) => depth += usize::from(!empty),
            Some(Event::Close { .. }) => depth -= 1,
            Some(Event::Text(text)) if depth == 1 && array.text.is_empty() => {
                array.text = text;
                array.cursor = before;
            }
            Some(Event::Text(_)) => {}
            None => return Err(cursor.expected("</DataArray>")),
        }
    }
    Ok(array)
}

/// The bytes after the underscore; raw ones go on to the end of the file.
fn read_appended<'a>(
    cursor: &mut Cursor<'a>,
    attributes: &'a [u8],
) -> Result<Appended<'a>, MeshFileError> {
    let is_base64 = match attribute(attributes, "encoding") {
        Some(b"raw") => false,
        None | Some(b"base64") => true,
        Some(other) => return Err(cursor.expected_instead("encoding raw or base64", other)),
    };
    cursor.word("_")?;
    let rest = cursor.rest();
    let end = if is_base64 { find(rest, b"<").unwrap_or(rest.len()) } else { rest.len() };
    Ok(Appended { bytes: rest.get(..end).unwrap_or_default(), is_base64 })
}

impl<'a> Piece<'a> {
    fn announced(attributes: &[u8], cursor: &Cursor) -> Result<Self, MeshFileError> {
        let count = |name: &str| match attribute(attributes, name) {
            None => Ok(None),
            Some(text) => match parse_integer(text).and_then(|n| usize::try_from(n).ok()) {
                Some(count) => Ok(Some(count)),
                None => Err(cursor.expected_instead(&format!("{name} as a count"), text)),
            },
        };
        Ok(Self {
            points: count("NumberOfPoints")?,
            cells: count("NumberOfCells")?,
            coordinates: None,
            connectivity: None,
            offsets: None,
            types: None,
            regions: None,
        })
    }

    fn place(&mut self, section: Section, array: DataArray<'a>) {
        let slot = match (section, attribute(array.attributes, "Name")) {
            (Section::Points, _) => &mut self.coordinates,
            (Section::Cells, Some(b"connectivity")) => &mut self.connectivity,
            (Section::Cells, Some(b"offsets")) => &mut self.offsets,
            (Section::Cells, Some(b"types")) => &mut self.types,
            _ if is_region(section, &array) => &mut self.regions,
            _ => return,
        };
        *slot = Some(array);
    }
}

fn read_piece(
    piece: &Piece,
    document: &Document,
    cursor: &Cursor,
    budget: &mut Budget,
    raw: &mut RawMesh,
) -> Result<(), MeshFileError> {
    let first_node = raw.points.len();
    let (rules, appended) = (document.rules, document.appended);
    if let Some(array) = &piece.coordinates {
        let values = array.reals(rules, appended, budget)?;
        let points = piece.points.unwrap_or(values.len() / 3);
        check_length(array, "Points", points.saturating_mul(3), values.len())?;
        raw.points.extend(values.chunks_exact(3).map(|p| Point3::new(p[0], p[1], p[2])));
    } else if piece.points.is_some_and(|points| points > 0) {
        return Err(cursor.expected("an array in <Points>"));
    }
    let (Some(connectivity), Some(offsets), Some(types)) =
        (&piece.connectivity, &piece.offsets, &piece.types)
    else {
        return if piece.cells.is_some_and(|cells| cells > 0) {
            Err(cursor.expected("arrays connectivity, offsets and types in <Cells>"))
        } else {
            Ok(())
        };
    };
    let cells = VtkCells {
        connectivity: connectivity.integers(rules, appended, budget)?,
        ends: offsets.integers(rules, appended, budget)?,
        types: types.integers(rules, appended, budget)?,
        regions: match &piece.regions {
            Some(array) => array.integers(rules, appended, budget)?,
            None => Vec::new(),
        },
    };
    if let Some(array) = &piece.regions {
        check_length(array, "region", cells.types.len(), cells.regions.len())?;
    }
    if let Some(count) = piece.cells {
        check_length(offsets, "offsets", count, cells.ends.len())?;
        check_length(types, "types", count, cells.types.len())?;
    }
    cells.add_to(raw, first_node, &connectivity.cursor)
}

fn check_length(
    array: &DataArray,
    name: &str,
    expected: usize,
    found: usize,
) -> Result<(), MeshFileError> {
    if expected == found {
        return Ok(());
    }
    let array_name = format!("array {name}");
    Err(array.cursor.count_fault(&array_name, &format!("{expected} numbers"), &found.to_string()))
}
