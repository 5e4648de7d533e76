//! Writes Gmsh MSH 4.1 text, with one volume entity per region.

use std::io::Write;

use super::raw_mesh::mirrored;
use crate::mesh::TetMesh;

/// The mesh as MSH 4.1 text: node tags are index + 1, entity tags region + 1.
///
/// Elements keep their order: a new block begins wherever the region changes. Corners are
/// reordered to Gmsh's orientation, so that a file that was read comes out as it was.
///
/// Source: Gmsh reference manual, "MSH file format".
pub fn write_msh41(mesh: &TetMesh) -> Vec<u8> {
    let mut out = Vec::new();
    write_sections(&mut out, mesh).expect("writing to memory cannot fail");
    out
}

fn write_sections(out: &mut Vec<u8>, mesh: &TetMesh) -> std::io::Result<()> {
    let region_of = |tet: usize| mesh.regions().get(tet).copied().unwrap_or(0);
    let mut entities: Vec<u32> = mesh.regions().to_vec();
    entities.sort_unstable();
    entities.dedup();
    if entities.is_empty() {
        entities.push(0);
    }
    let (low, high) = mesh.bounds();
    writeln!(out, "$MeshFormat\n4.1 0 8\n$EndMeshFormat")?;
    writeln!(out, "$Entities\n0 0 0 {}", entities.len())?;
    for &region in &entities {
        write!(out, "{} {:?} {:?} {:?}", u64::from(region) + 1, low.x, low.y, low.z)?;
        writeln!(out, " {:?} {:?} {:?} 0 0", high.x, high.y, high.z)?;
    }
    let count = mesh.node_count();
    let first = entities.first().map_or(1, |&region| u64::from(region) + 1);
    writeln!(out, "$EndEntities\n$Nodes\n1 {count} 1 {count}\n3 {first} 0 {count}")?;
    for tag in 1..=count {
        writeln!(out, "{tag}")?;
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
        writeln!(out, "3 {} 4 {}", u64::from(region) + 1, block.len())?;
        for &(tet, corners) in block {
            let [a, b, c, d] = mirrored(corners).map(|node| u64::from(node) + 1);
            writeln!(out, "{} {a} {b} {c} {d}", tet + 1)?;
        }
    }
    writeln!(out, "$EndElements")
}
