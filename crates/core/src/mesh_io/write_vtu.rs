//! Writes VTU with exact numbers (base64 of 64-bit values) and vector fields on the nodes.

use std::io::Write;

use super::base64;
use super::raw_mesh::mirrored;
use super::region_numbers::RegionNumbers;
use super::write_error::WriteError;
use crate::mesh::TetMesh;

/// A vector per node, such as displacement.
#[derive(Clone, Copy, Debug)]
pub struct PointField<'a> {
    /// Name shown by viewers.
    pub name: &'a str,
    /// One vector per node, orphans included.
    pub values: &'a [[f64; 3]],
}

/// Values at all nodes or in all elements, with the unit that viewers may show.
#[derive(Clone, Copy, Debug)]
pub struct VtuField<'a> {
    /// Name shown by viewers.
    pub name: &'a str,
    /// Unit of the values; empty where nothing is known of it.
    pub unit: &'a str,
    /// Numbers of one value: 1, 3 for a vector, 6 for a symmetric tensor `xx yy zz xy yz zx`.
    pub components: usize,
    /// Numbers of all values, those of one behind the other.
    pub values: &'a [f64],
}

/// The mesh as VTU; regions, if there are several, become the cell data `region`, by their labels
/// where all of `labels` are whole numbers, else numbered from 0.
///
/// Shapes: `labels` empty or one per region.
///
/// Corners are reordered to VTK's orientation, so that a file that was read comes out as it was.
///
/// # Errors
/// [`WriteError::FieldLength`] when a field has not one vector per node.
///
/// Source: VTK user's guide, section "XML file formats".
pub fn write_vtu_labelled(
    mesh: &TetMesh,
    labels: &[String],
    fields: &[PointField],
) -> Result<Vec<u8>, WriteError> {
    let of_nodes: Vec<VtuField<'_>> = fields
        .iter()
        .map(|&PointField { name, values }| {
            let values = values.as_flattened();
            VtuField { name, unit: "", components: 3, values }
        })
        .collect();
    write_vtu_fields(mesh, labels, &of_nodes, &[])
}

/// Mesh and fields as VTK's XML (VTU), with regions numbered from 0.
///
/// # Errors
/// As [`write_vtu_labelled`].
pub fn write_vtu(mesh: &TetMesh, fields: &[PointField]) -> Result<Vec<u8>, WriteError> {
    write_vtu_labelled(mesh, &[], fields)
}

/// The mesh as VTU with fields of nodes and of elements; their units are written as VTK's
/// `UNITS_LABEL`.
///
/// Shapes: `labels` empty or one per region; `of_nodes` a value per node, `of_elements` a value per
/// element.
///
/// # Errors
/// [`WriteError::FieldLength`] when a field has not one value per node or element.
///
/// Source: VTK user's guide, section "XML file formats".
pub fn write_vtu_fields(
    mesh: &TetMesh,
    labels: &[String],
    of_nodes: &[VtuField],
    of_elements: &[VtuField],
) -> Result<Vec<u8>, WriteError> {
    for (fields, count) in [(of_nodes, mesh.node_count()), (of_elements, mesh.tets().len())] {
        for field in fields {
            if field.values.len() != field.components * count {
                return Err(WriteError::FieldLength {
                    field: field.name.to_owned(),
                    expected: count,
                    found: field.values.len() / field.components.max(1),
                });
            }
        }
    }
    let mut out = Vec::new();
    write_document(&mut out, mesh, labels, (of_nodes, of_elements))
        .expect("writing to memory cannot fail");
    Ok(out)
}

fn write_document(
    out: &mut Vec<u8>,
    mesh: &TetMesh,
    labels: &[String],
    (of_nodes, of_elements): (&[VtuField], &[VtuField]),
) -> std::io::Result<()> {
    let (nodes, cells) = (mesh.node_count(), mesh.tets().len());
    writeln!(out, "<?xml version=\"1.0\"?>")?;
    writeln!(
        out,
        "<VTKFile type=\"UnstructuredGrid\" version=\"1.0\" byte_order=\"LittleEndian\" \
         header_type=\"UInt64\">\n<UnstructuredGrid>"
    )?;
    writeln!(out, "<Piece NumberOfPoints=\"{nodes}\" NumberOfCells=\"{cells}\">\n<PointData>")?;
    of_nodes.iter().try_for_each(|field| write_field(out, field))?;
    writeln!(out, "</PointData>\n<CellData>")?;
    if !mesh.regions().is_empty() {
        let numbers = RegionNumbers::new(mesh, labels);
        let labels = mesh.regions().iter().map(|&region| numbers.of(region).to_le_bytes());
        write_array(out, "Int64", "region", 1, labels)?;
    }
    of_elements.iter().try_for_each(|field| write_field(out, field))?;
    writeln!(out, "</CellData>\n<Points>")?;
    let coordinates = mesh.vertices().iter().flat_map(|p| [p.x, p.y, p.z]);
    write_array(out, "Float64", "Points", 3, coordinates.map(f64::to_le_bytes))?;
    writeln!(out, "</Points>\n<Cells>")?;
    let corners = mesh.tets().iter().flat_map(|&tet| mirrored(tet)).map(i64::from);
    write_array(out, "Int64", "connectivity", 1, corners.map(i64::to_le_bytes))?;
    let ends = (1..=cells as i64).map(|cell| 4 * cell);
    write_array(out, "Int64", "offsets", 1, ends.map(i64::to_le_bytes))?;
    // 10 is VTK's number for a linear tetrahedron.
    write_array(out, "UInt8", "types", 1, (0..cells).map(|_| [10_u8]))?;
    writeln!(out, "</Cells>\n</Piece>\n</UnstructuredGrid>\n</VTKFile>")
}

/// One field with the names of its components and its unit.
fn write_field(out: &mut Vec<u8>, field: &VtuField) -> std::io::Result<()> {
    let names: &[&str] = match field.components {
        6 => &["XX", "YY", "ZZ", "XY", "YZ", "XZ"],
        _ => &[],
    };
    let names = names.iter().enumerate();
    let names: String = names.map(|(at, name)| format!("ComponentName{at}=\"{name}\" ")).collect();
    write_head(out, "Float64", &escaped(field.name), field.components, &names)?;
    write_values(out, field.values.iter().map(|value| value.to_le_bytes()));
    if !field.unit.is_empty() {
        let unit = escaped(field.unit);
        write!(
            out,
            "\n<InformationKey name=\"UNITS_LABEL\" location=\"vtkDataArray\">{unit}</InformationKey>"
        )?;
    }
    writeln!(out, "\n</DataArray>")
}

/// One inline array: length in bytes, then the values, as one base64 text.
fn write_array<const N: usize>(
    out: &mut Vec<u8>,
    number_type: &str,
    name: &str,
    components: usize,
    values: impl Iterator<Item = [u8; N]>,
) -> std::io::Result<()> {
    write_head(out, number_type, name, components, "")?;
    write_values(out, values);
    writeln!(out, "\n</DataArray>")
}

fn write_head(
    out: &mut Vec<u8>,
    number_type: &str,
    name: &str,
    components: usize,
    further: &str,
) -> std::io::Result<()> {
    write!(out, "<DataArray type=\"{number_type}\" Name=\"{name}\" ")?;
    writeln!(out, "NumberOfComponents=\"{components}\" {further}format=\"binary\">")
}

fn write_values<const N: usize>(out: &mut Vec<u8>, values: impl Iterator<Item = [u8; N]>) {
    let mut bytes = vec![0; 8];
    values.for_each(|value| bytes.extend_from_slice(&value));
    let length = bytes.len() as u64 - 8;
    bytes[..8].copy_from_slice(&length.to_le_bytes());
    out.extend(base64::encode(&bytes));
}

/// Text fit for an XML attribute.
fn escaped(name: &str) -> String {
    name.chars()
        .map(|c| match c {
            '&' => "&amp;".to_owned(),
            '<' => "&lt;".to_owned(),
            '>' => "&gt;".to_owned(),
            '"' => "&quot;".to_owned(),
            c if c.is_control() => " ".to_owned(),
            c => c.to_string(),
        })
        .collect()
}
