//! A tetrahedral mesh and its materials on the wire.

use wincode::{SchemaRead, SchemaWrite};

use crate::limits::check_count;
use crate::payload::{PayloadReader, PayloadWriter, count_of};
use crate::{DecodeError, EncodeError, Limits};

/// Nodes and elements (lists 1 and 2 of the thesis, Table 3.1).
///
/// Shapes: `vertices` N points; `tets` M × 4 indices into `vertices` from 0, in the order that
/// gives a positive volume; `regions` empty or M labels; `mid_edge` empty or M × 6 indices.
/// Units: m. Nothing of this is checked here except the lengths.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct MeshData {
    /// Coordinates `x y z` of each node at rest, m.
    pub vertices: Vec<[f64; 3]>,
    /// Nodes at the four corners of each element.
    pub tets: Vec<[u32; 4]>,
    /// Region label of each element; empty if there is one material for all.
    pub regions: Vec<u32>,
    /// Nodes of each element between its corners 12, 23, 13, 14, 24, 34; empty where the server shall make
    /// those that it needs. A server without the capability `mid-edge` refuses them.
    pub mid_edge: Vec<[u32; 6]>,
}

/// Isotropic linear elastic material; a table of them has one entry, or one for each region.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Material {
    /// Young's modulus, Pa.
    pub young: f64,
    /// Poisson's ratio.
    pub poisson: f64,
}

/// Announces the arrays that [`write_mesh`] writes.
#[derive(Clone, Copy, Debug, SchemaRead, SchemaWrite)]
pub(super) struct MeshPart {
    node_count: u32,
    tet_count: u32,
    arrays: u8,
    material_count: u32,
}

const MID_EDGE_NODES: &str = "mid-edge nodes of tetrahedra";
/// Bit of [`MeshPart`] for region labels.
const REGIONS: u8 = 1;
/// Bit of [`MeshPart`] for mid-edge nodes.
const MID_EDGE: u8 = 2;

impl MeshPart {
    pub(super) fn of(mesh: &MeshData, materials: &[Material]) -> Result<Self, EncodeError> {
        let expected = mesh.tets.len();
        let mut arrays = 0;
        for (what, bit, count) in [
            ("region labels", REGIONS, mesh.regions.len()),
            (MID_EDGE_NODES, MID_EDGE, mesh.mid_edge.len()),
        ] {
            if count > 0 && count != expected {
                return Err(EncodeError::CountMismatch { what, count, expected });
            }
            arrays |= if count > 0 { bit } else { 0 };
        }
        Ok(Self {
            node_count: count_of("vertices", mesh.vertices.len())?,
            tet_count: count_of("tetrahedra", mesh.tets.len())?,
            arrays,
            material_count: count_of("materials", materials.len())?,
        })
    }

    pub(super) fn check(&self, limits: &Limits) -> Result<(), DecodeError> {
        check_count("vertices", self.node_count, limits.node_count_max)?;
        check_count("tetrahedra", self.tet_count, limits.tet_count_max)?;
        check_count("materials", self.material_count, limits.material_count_max)?;
        match self.arrays & !(REGIONS | MID_EDGE) {
            0 => Ok(()),
            _ => Err(DecodeError::UnknownArrays { bits: self.arrays }),
        }
    }
}

/// Writes the arrays: vertices, corners, labels if any, pairs of Young's modulus and Poisson's ratio,
/// mid-edge nodes if any.
pub(super) fn write_mesh(writer: &mut PayloadWriter<'_>, mesh: &MeshData, materials: &[Material]) {
    writer.array(&mesh.vertices);
    writer.array(&mesh.tets);
    writer.array(&mesh.regions);
    let table: Vec<[f64; 2]> = materials.iter().map(|m| [m.young, m.poisson]).collect();
    writer.array(&table);
    writer.array(&mesh.mid_edge);
}

/// Reads the arrays that [`write_mesh`] wrote; the counts have been checked.
pub(super) fn read_mesh(
    reader: &mut PayloadReader<'_>,
    part: &MeshPart,
) -> Result<(MeshData, Vec<Material>), DecodeError> {
    let vertices = reader.array("vertices", part.node_count as usize)?;
    let tets = reader.array("tetrahedra", part.tet_count as usize)?;
    let count_of = |bit: u8| if part.arrays & bit == 0 { 0 } else { part.tet_count as usize };
    let regions = reader.array("region labels", count_of(REGIONS))?;
    let table: Vec<[f64; 2]> = reader.array("materials", part.material_count as usize)?;
    let materials = table.iter().map(|&[young, poisson]| Material { young, poisson }).collect();
    let mid_edge = reader.array(MID_EDGE_NODES, count_of(MID_EDGE))?;
    Ok((MeshData { vertices, tets, regions, mid_edge }, materials))
}
