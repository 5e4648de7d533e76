//! Files of other programs: real ones that are read, and ones that hold no tetrahedra.

use std::path::{Path, PathBuf};

use super::samples::{read, refusal};
use crate::mesh_io::{
    Companion, Fault, Foreign, Format, MeshFile, Sniffed, parse, sniff, write_msh41, write_vtu,
};

/// The shared folder with real data, if this machine has it; says so when it has not.
pub(crate) fn shared_meshes() -> Option<PathBuf> {
    let named = std::env::var_os("SOFTGRASP_SHARED").map(PathBuf::from);
    let above = Path::new(env!("CARGO_MANIFEST_DIR")).ancestors().map(|dir| dir.join("shared"));
    let found =
        named.into_iter().chain(above).map(|dir| dir.join("meshes")).find(|dir| dir.is_dir());
    if found.is_none() {
        println!("skipped: no folder shared/meshes with real mesh files here");
    }
    found
}

fn read_file(folder: &Path, name: &str) -> MeshFile {
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
        let file = read_file(&folder, name);
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
    assert_eq!(read_file(&folder, "shark.binary22.msh").findings.skipped_sections, ["ElementData"]);
    assert_eq!(read_file(&folder, "hammer.v41.msh").findings.skipped_sections, ["Surface"]);
    let cube = read_file(&folder, "cube.appended.vtu").findings.other_cells;
    let cube: Vec<_> = cube.into_iter().collect();
    assert_eq!(cube, [("lines".to_owned(), 60), ("triangles".to_owned(), 300)]);
}

#[test]
fn both_halves_of_a_tetgen_mesh_give_the_same_mesh() {
    let Some(folder) = shared_meshes() else { return };
    let (node, ele) =
        (read_file(&folder, "armadillo_4k.node"), read_file(&folder, "armadillo_4k.ele"));
    assert_eq!(node.mesh, ele.mesh);
}

#[test]
fn real_meshes_survive_being_written_and_read() {
    let Some(folder) = shared_meshes() else { return };
    for (name, ..) in TABLE {
        let mesh = read_file(&folder, name).mesh;
        for bytes in [write_msh41(&mesh), write_vtu(&mesh, &[]).unwrap()] {
            let back = parse(name, &bytes, &mut |_| None).unwrap();
            assert_eq!(back.mesh, mesh, "{name}");
            assert!(back.findings.flipped.is_empty(), "{name}");
        }
    }
}

#[test]
fn q1_foreign_formats_are_recognised_by_content() {
    let mut stl = vec![b's'; 80];
    stl.extend(2_u32.to_le_bytes());
    stl.extend([0; 100]);
    let mut mujoco: Vec<u8> = [3_u32, 0, 0, 1].iter().flat_map(|v| v.to_le_bytes()).collect();
    mujoco.extend([7; 48]);
    let files: [(&[u8], Foreign); 19] = [
        (b"MFEM mesh v1.0\n\n#\n# MFEM Geometry Types\n", Foreign::Mfem),
        (&mujoco, Foreign::MujocoLegacy),
        (b"# header\n# ndim npoint ncell\n3 8 5\n\n# points\n", Foreign::Gemlab),
        (b"(0 \"GAMBIT to Fluent File\")\n(2 3)\n", Foreign::Fluent),
        (b"(2 3)\n(10 (0 1 8 0 3))\n", Foreign::Fluent),
        (b"$MeshFormat\n3 0 8\n$EndMeshFormat\n", Foreign::GmshOther),
        (b"#usda 1.0\ndef TetMesh \"m\" {}\n", Foreign::Usd),
        (b"PXR-USDC\0\x08\0\0", Foreign::Usd),
        (&stl, Foreign::Stl),
        (b"solid x\n facet normal 0 0 1\n", Foreign::Stl),
        (b"# Blender\nmtllib x.mtl\nv 0 0 0\nf 1 2 3\n", Foreign::Obj),
        (b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", Foreign::Obj),
        (b"ply\nformat ascii 1.0\n", Foreign::Ply),
        (b"OFF\n4 4 6\n", Foreign::Off),
        (b"<dolfin xmlns:dolfin=\"http://fenicsproject.org\">", Foreign::DolfinXml),
        (b"CDF\x01\0\0", Foreign::NetCdf),
        (b"\x89HDF\r\n\x1a\n", Foreign::Hdf5),
        (b"PK\x03\x04\x14", Foreign::Zip),
        (b"\xfd7zXZ\0", Foreign::OtherCompression),
    ];
    for (bytes, foreign) in files {
        let start = bytes.get(..30).unwrap_or(bytes).escape_ascii();
        assert_eq!(sniff(bytes), Some(Sniffed::Foreign(foreign)), "{start}");
        assert_eq!(read(bytes).unwrap_err().fault, Fault::Foreign { what: foreign });
    }
}

#[test]
fn refusals_are_one_line_with_advice() {
    let error = refusal("MFEM mesh v1.0\n");
    let known = "f: this is an MFEM mesh, which is not read here; \
                 convert it with Gmsh or meshio to MSH 4.1";
    assert_eq!(error, known);
    assert!(refusal("ply\n").contains("it has no tetrahedra; `glove-client fill`"));
    assert!(refusal(b"PK\x03\x04\x14").contains("unpack it first"));
}

#[test]
fn empty_and_unknown_files_are_refused() {
    for bytes in ["", " \r\n\t", "\u{feff}"] {
        assert_eq!(refusal(bytes), "f: the file is empty");
    }
    for bytes in ["hello world", "1 2", "{\"json\": 1}", "*", "<html>", "1\n\0"] {
        let error = refusal(bytes);
        assert!(error.starts_with("f: no mesh format known here begins with \""), "{error}");
        assert!(!error.contains('\n'));
    }
}
