//! A tetrahedral mesh and its materials on the wire.

use wincode::{SchemaRead, SchemaWrite};

use crate::limits::check_count;
use crate::payload::{PayloadReader, PayloadWriter, count_of};
use crate::{DecodeError, EncodeError, Limits};

/// Nodes and elements (lists 1 and 2 of the thesis, Table 3.1).
///
/// Shapes: `vertices` N points; `tets` M × 4 indices into `vertices` from 0, in the order that
/// gives a positive volume; `regions` empty or M labels.
/// Units: m. Nothing of this is checked here except the lengths.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct MeshData {
    /// Coordinates `x y z` of each node at rest, m.
    pub vertices: Vec<[f64; 3]>,
    /// Nodes at the four corners of each element.
    pub tets: Vec<[u32; 4]>,
    /// Region label of each element; empty if there is one material for all.
    pub regions: Vec<u32>,
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
    has_regions: bool,
    material_count: u32,
}

impl MeshPart {
    pub(super) fn of(mesh: &MeshData, materials: &[Material]) -> Result<Self, EncodeError> {
        let has_regions = !mesh.regions.is_empty();
        if has_regions && mesh.regions.len() != mesh.tets.len() {
            let (count, expected) = (mesh.regions.len(), mesh.tets.len());
            return Err(EncodeError::CountMismatch { what: "region labels", count, expected });
        }
        Ok(Self {
            node_count: count_of("vertices", mesh.vertices.len())?,
            tet_count: count_of("tetrahedra", mesh.tets.len())?,
            has_regions,
            material_count: count_of("materials", materials.len())?,
        })
    }

    pub(super) fn check(&self, limits: &Limits) -> Result<(), DecodeError> {
        check_count("vertices", self.node_count, limits.node_count_max)?;
        check_count("tetrahedra", self.tet_count, limits.tet_count_max)?;
        check_count("materials", self.material_count, limits.material_count_max)?;
        Ok(())
    }
}

/// Writes the arrays: vertices, corners, labels if any, pairs of Young's modulus and Poisson's ratio.
pub(super) fn write_mesh(writer: &mut PayloadWriter<'_>, mesh: &MeshData, materials: &[Material]) {
    writer.array(&mesh.vertices);
    writer.array(&mesh.tets);
    writer.array(&mesh.regions);
    let table: Vec<[f64; 2]> = materials.iter().map(|m| [m.young, m.poisson]).collect();
    writer.array(&table);
}

/// Reads the arrays that [`write_mesh`] wrote; the counts have been checked.
pub(super) fn read_mesh(
    reader: &mut PayloadReader<'_>,
    part: &MeshPart,
) -> Result<(MeshData, Vec<Material>), DecodeError> {
    let vertices = reader.array("vertices", part.node_count as usize)?;
    let tets = reader.array("tetrahedra", part.tet_count as usize)?;
    let region_count = if part.has_regions { part.tet_count } else { 0 };
    let regions = reader.array("region labels", region_count as usize)?;
    let table: Vec<[f64; 2]> = reader.array("materials", part.material_count as usize)?;
    let materials = table.iter().map(|&[young, poisson]| Material { young, poisson }).collect();
    Ok((MeshData { vertices, tets, regions }, materials))
}
