//! Writes Gmsh MSH 4.1 text, with one volume entity per region.

use std::io::Write;

use super::raw_mesh::mirrored;
use super::region_numbers::RegionNumbers;
use crate::mesh::TetMesh;

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
        writeln!(out, "3 {} 4 {}", tag(region), block.len())?;
        for &(tet, corners) in block {
            let [a, b, c, d] = mirrored(corners).map(|node| u64::from(node) + 1);
            writeln!(out, "{} {a} {b} {c} {d}", tet + 1)?;
        }
    }
    writeln!(out, "$EndElements")
}
