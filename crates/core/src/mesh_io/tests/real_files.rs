//! The ten real files of the shared folder: counts, what is awkward in each, and round trips.

use std::path::{Path, PathBuf};

use crate::mesh_io::{Companion, Format, MeshFile, parse, write_msh41, write_vtu};

/// The shared folder with real data, if this machine has it; says so when it has not.
fn shared_meshes() -> Option<PathBuf> {
    let named = std::env::var_os("SOFTGRASP_SHARED").map(PathBuf::from);
    let above = Path::new(env!("CARGO_MANIFEST_DIR")).ancestors().map(|dir| dir.join("shared"));
    let found =
        named.into_iter().chain(above).map(|dir| dir.join("meshes")).find(|dir| dir.is_dir());
    if found.is_none() {
        println!("skipped: no folder shared/meshes with real mesh files here");
    }
    found
}

fn read(folder: &Path, name: &str) -> MeshFile {
    let path = folder.join(name);
    let bytes = std::fs::read(&path).unwrap();
    let mut companion = |wanted: &Companion| match wanted {
        Companion::Extension(extension) => std::fs::read(path.with_extension(extension)).ok(),
        Companion::FileName(_) => None,
    };
    parse(name, &bytes, &mut companion).unwrap()
}

/// Name, format, nodes and tetrahedra of each file.
const TABLE: [(&str, Format, usize, usize); 11] = [
    ("liver.msh1.msh", Format::GmshMsh1, 181, 596),
    ("banana.vtk", Format::VtkLegacy, 725, 2395),
    ("turtle.veg", Format::Vega, 347, 1185),
    ("armadillo_4k.node", Format::TetGen, 1180, 3717),
    ("armadillo_4k.ele", Format::TetGen, 1180, 3717),
    ("shark.binary22.msh", Format::GmshMsh2Binary, 429, 1073),
    ("hammer.v41.msh", Format::GmshMsh4Ascii, 2705, 9683),
    ("cylinder.medit.mesh", Format::Medit, 354, 1348),
    ("cube.appended.vtu", Format::Vtu, 152, 373),
    ("bunny.wrong-extension.vtk", Format::Vtu, 1911, 5897),
    ("six-tetra-one-inverted.msh", Format::GmshMsh2Ascii, 17, 6),
];

#[test]
fn real_files_have_the_counts_of_their_table() {
    let Some(folder) = shared_meshes() else { return };
    for (name, format, nodes, tets) in TABLE {
        let file = read(&folder, name);
        assert_eq!(file.format, format, "{name}");
        assert_eq!((file.mesh.node_count(), file.mesh.tets().len()), (nodes, tets), "{name}");
        assert_eq!((file.findings.file_nodes, file.findings.file_tets), (nodes, tets), "{name}");
        let flipped = if name.starts_with("six-tetra") { 1 } else { 0 };
        assert_eq!(file.findings.flipped.len(), flipped, "{name}");
        assert!(file.findings.degenerate.is_empty(), "{name}");
        assert_eq!(file.findings.orphans, 0, "{name}");
    }
}

#[test]
fn what_is_awkward_in_real_files_is_found() {
    let Some(folder) = shared_meshes() else { return };
    assert_eq!(read(&folder, "shark.binary22.msh").findings.skipped_sections, ["ElementData"]);
    assert_eq!(read(&folder, "hammer.v41.msh").findings.skipped_sections, ["Surface"]);
    let cube = read(&folder, "cube.appended.vtu").findings.other_cells;
    let cube: Vec<_> = cube.into_iter().collect();
    assert_eq!(cube, [("lines".to_owned(), 60), ("triangles".to_owned(), 300)]);
}

#[test]
fn both_halves_of_a_tetgen_mesh_give_the_same_mesh() {
    let Some(folder) = shared_meshes() else { return };
    let (node, ele) = (read(&folder, "armadillo_4k.node"), read(&folder, "armadillo_4k.ele"));
    assert_eq!(node.mesh, ele.mesh);
}

#[test]
fn real_meshes_survive_being_written_and_read() {
    let Some(folder) = shared_meshes() else { return };
    for (name, ..) in TABLE {
        let mesh = read(&folder, name).mesh;
        for bytes in [write_msh41(&mesh), write_vtu(&mesh, &[]).unwrap()] {
            let back = parse(name, &bytes, &mut |_| None).unwrap();
            assert_eq!(back.mesh, mesh, "{name}");
            assert!(back.findings.flipped.is_empty(), "{name}");
        }
    }
}
