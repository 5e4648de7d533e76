//! Files that are recognised and refused, each with one line that says what it is.

use super::samples::{read, refusal};
use crate::mesh_io::{Fault, Foreign, Sniffed, sniff};

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
