//! Writes a mesh: Gmsh MSH 4.1, and VTU with fields at the nodes; refuses data that do not belong to it.

use std::io::Write;

use super::encoding;
use super::labels::RegionNumbers;
use crate::mesh::{TetMesh, mirrored, mirrored_middles};

/// Data for a file that does not fit the mesh.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum WriteError {
    /// A field has not one value per node or element.
    #[error("field {field}: expected {expected} values, found {found}")]
    FieldLength {
        /// Name of the field.
        field: String,
        /// Nodes or elements of the mesh.
        expected: usize,
        /// Values given.
        found: usize,
    },
    /// A triangle of the display list names a node that is not there.
    #[error("display triangle {triangle} names node {node}, but there are {node_count} nodes")]
    DisplayNode {
        /// Triangle index, from 0.
        triangle: usize,
        /// The node, from 0.
        node: u32,
        /// Nodes of the mesh.
        node_count: usize,
    },
}

/// The mesh as MSH 4.1 text: node tags are index + 1, one volume entity per region.
///
/// Shapes: `labels` empty or one per region. Labels that are numbers above 0 are the tags of the
/// entities; others become names of physical groups, and the tags are region + 1.
///
/// Elements keep their order: a new block begins wherever the region changes. Corners are
/// reordered to Gmsh's orientation, so that a file that was read comes out as it was.
///
/// Source: Gmsh reference manual, "MSH file format".
pub fn write_msh41_labelled(mesh: &TetMesh, labels: &[String]) -> Vec<u8> {
    let mut out = Vec::new();
    write_sections(&mut out, mesh, labels).expect("writing to memory cannot fail");
    out
}

/// Mesh as Gmsh MSH 4.1 in binary form, with regions numbered from 1.
pub fn write_msh41(mesh: &TetMesh) -> Vec<u8> {
    write_msh41_labelled(mesh, &[])
}

fn write_sections(out: &mut Vec<u8>, mesh: &TetMesh, labels: &[String]) -> std::io::Result<()> {
    let region_of = |tet: usize| mesh.regions().get(tet).copied().unwrap_or(0);
    let mut entities: Vec<u32> = mesh.regions().to_vec();
    entities.sort_unstable();
    entities.dedup();
    if entities.is_empty() {
        entities.push(0);
    }
    let numbers = RegionNumbers::new(mesh, labels);
    let by_number = numbers.are_labels && numbers.are_tags();
    let tag = |region: u32| match by_number {
        true => numbers.of(region),
        false => i64::from(region) + 1,
    };
    let name = |region: u32| labels.get(region as usize).filter(|_| !by_number);
    writeln!(out, "$MeshFormat\n4.1 0 8\n$EndMeshFormat")?;
    let named: Vec<(u32, &String)> =
        entities.iter().filter_map(|&region| Some((region, name(region)?))).collect();
    if !named.is_empty() {
        writeln!(out, "$PhysicalNames\n{}", named.len())?;
        for (region, name) in named {
            // A quote inside would end the name.
            writeln!(out, "3 {} \"{}\"", tag(region), name.replace('"', "'"))?;
        }
        writeln!(out, "$EndPhysicalNames")?;
    }
    let (low, high) = mesh.bounds();
    writeln!(out, "$Entities\n0 0 0 {}", entities.len())?;
    for &region in &entities {
        write!(out, "{} {:?} {:?} {:?}", tag(region), low.x, low.y, low.z)?;
        write!(out, " {:?} {:?} {:?} ", high.x, high.y, high.z)?;
        match name(region) {
            Some(_) => writeln!(out, "1 {} 0", tag(region))?,
            None => writeln!(out, "0 0")?,
        }
    }
    write_mesh(out, mesh, &region_of, &tag, entities.first().copied().unwrap_or(0))
}

/// The sections of nodes and elements.
fn write_mesh(
    out: &mut Vec<u8>,
    mesh: &TetMesh,
    region_of: &dyn Fn(usize) -> u32,
    tag: &dyn Fn(u32) -> i64,
    first: u32,
) -> std::io::Result<()> {
    let count = mesh.node_count();
    let first = tag(first);
    writeln!(out, "$EndEntities\n$Nodes\n1 {count} 1 {count}\n3 {first} 0 {count}")?;
    for node in 1..=count {
        writeln!(out, "{node}")?;
    }
    for p in mesh.vertices() {
        writeln!(out, "{:?} {:?} {:?}", p.x, p.y, p.z)?;
    }
    writeln!(out, "$EndNodes\n$Elements")?;
    let numbered: Vec<(usize, [u32; 4])> = mesh.tets().iter().copied().enumerate().collect();
    let same_region =
        |a: &(usize, [u32; 4]), b: &(usize, [u32; 4])| region_of(a.0) == region_of(b.0);
    let blocks = numbered.chunk_by(same_region).count();
    let count = numbered.len();
    writeln!(out, "{blocks} {count} 1 {count}")?;
    for block in numbered.chunk_by(same_region) {
        let region = block.first().map_or(0, |&(tet, _)| region_of(tet));
        // 4 is Gmsh's number for a tetrahedron of four nodes, 11 for one of ten.
        let number = if mesh.mid_edge_nodes().is_empty() { 4 } else { 11 };
        writeln!(out, "3 {} {number} {}", tag(region), block.len())?;
        for &(tet, corners) in block {
            let [a, b, c, d] = mirrored(corners).map(|node| u64::from(node) + 1);
            write!(out, "{} {a} {b} {c} {d}", tet + 1)?;
            if let Some(&middles) = mesh.mid_edge_nodes().get(tet) {
                let [e12, e23, e13, e14, e24, e34] = mirrored_middles(middles);
                for node in [e12, e23, e13, e14, e34, e24] {
                    write!(out, " {}", u64::from(node) + 1)?;
                }
            }
            writeln!(out)?;
        }
    }
    writeln!(out, "$EndElements")
}

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
    let middles = |tet: usize| mesh.mid_edge_nodes().get(tet).copied().map(mirrored_middles);
    let nodes = mesh.tets().iter().enumerate().flat_map(|(tet, &corners)| {
        mirrored(corners).into_iter().chain(middles(tet).into_iter().flatten())
    });
    let nodes = nodes.map(|node| i64::from(node).to_le_bytes());
    write_array(out, "Int64", "connectivity", 1, nodes)?;
    // VTK's numbers for a linear and a quadratic tetrahedron.
    let (per_cell, number) = if mesh.mid_edge_nodes().is_empty() { (4, 10) } else { (10, 24) };
    let ends = (1..=cells as i64).map(|cell| per_cell * cell);
    write_array(out, "Int64", "offsets", 1, ends.map(i64::to_le_bytes))?;
    write_array(out, "UInt8", "types", 1, (0..cells).map(|_| [number]))?;
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
    out.extend(encoding::encode(&bytes));
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
