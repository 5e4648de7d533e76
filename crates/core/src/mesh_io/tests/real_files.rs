//! The ten real files of the shared folder: counts, what is awkward in each, and round trips.

use std::path::{Path, PathBuf};

use crate::mesh_io::{Companion, Format, MeshFile, PointField, parse, write_msh41, write_vtu};

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

#[test]
fn real_files_have_the_counts_of_their_table() {
    let Some(folder) = shared_meshes() else { return };
    let table = [
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
    for (name, format, nodes, tets) in table {
        let file = read(&folder, name);
        println!("{name}: {:?}", file.findings.flipped.len());
        println!("   {:?}", Findings { flipped: vec![], ..file.findings.clone() });
        assert_eq!(file.format, format, "{name}");
        assert_eq!((file.mesh.node_count(), file.mesh.tets().len()), (nodes, tets), "{name}");
    }
}
use crate::mesh_io::Findings;
