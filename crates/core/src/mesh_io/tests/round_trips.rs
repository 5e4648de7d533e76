//! What is written is read back: the same mesh in other bytes.

use nalgebra::Point3;
use proptest::prelude::*;

use super::samples::read;
use crate::mesh::TetMesh;
use crate::mesh_io::{Format, PointField, WriteError, write_msh41, write_thesis_lists, write_vtu};

/// Meshes of separate tetrahedra with any coordinates and any regions, orphans between them.
fn meshes() -> impl Strategy<Value = TetMesh> {
    let tet = (prop::array::uniform3(-1e3..1e3_f64), 0.01..10.0_f64, 0_u32..3);
    prop::collection::vec(tet, 1..12).prop_map(|tets| {
        let mut vertices = Vec::new();
        let mut corners = Vec::new();
        for &([x, y, z], edge, _) in &tets {
            let first = vertices.len() as u32;
            vertices.push(Point3::new(x, y, z));
            vertices.push(Point3::new(x + edge, y, z));
            vertices.push(Point3::new(x, y + edge, z / 3.0));
            vertices.push(Point3::new(x, y, z + 2.0 * edge + 1e3));
            vertices.push(Point3::new(x, y, -z));
            let right = [first, first + 1, first + 2, first + 3];
            let volume = |t: [u32; 4]| {
                let [a, b, c, d] = t.map(|node| vertices[node as usize]);
                (a - d).dot(&(b - d).cross(&(c - d)))
            };
            corners.push(if volume(right) > 0.0 {
                right
            } else {
                [right[1], right[0], right[2], right[3]]
            });
        }
        let mut regions: Vec<u32> = tets.iter().map(|tet| tet.2).collect();
        // As a reader numbers them: by appearance, none for a single region.
        let mut seen: Vec<u32> = Vec::new();
        for region in &mut regions {
            let number = seen.iter().position(|r| r == region).unwrap_or_else(|| {
                seen.push(*region);
                seen.len() - 1
            });
            *region = number as u32;
        }
        if seen.len() == 1 {
            regions.clear();
        }
        TetMesh::try_new(vertices, corners, regions).unwrap()
    })
}

proptest! {
    #[test]
    fn msh_41_brings_the_mesh_back(mesh in meshes()) {
        let file = read(write_msh41(&mesh)).unwrap();
        prop_assert_eq!(file.format, Format::GmshMsh4Ascii);
        prop_assert!(file.findings.flipped.is_empty());
        prop_assert_eq!(file.mesh, mesh);
    }

    #[test]
    fn vtu_brings_the_mesh_back(mesh in meshes()) {
        let file = read(write_vtu(&mesh, &[]).unwrap()).unwrap();
        prop_assert_eq!(file.format, Format::Vtu);
        prop_assert!(file.findings.flipped.is_empty());
        prop_assert!(file.findings.skipped_sections.is_empty());
        prop_assert_eq!(file.mesh, mesh);
    }

    #[test]
    fn thesis_lists_bring_the_mesh_back(mesh in meshes()) {
        let display: Vec<[u32; 3]> = mesh.tets().iter().map(|t| [t[0], t[1], t[2]]).collect();
        let file = read(write_thesis_lists(&mesh, &display).unwrap()).unwrap();
        prop_assert_eq!(file.format, Format::ThesisLists);
        prop_assert!(file.findings.flipped.is_empty());
        prop_assert_eq!(file.findings.other_cells["display triangles"], display.len());
        prop_assert_eq!(file.mesh, mesh);
    }
}

fn one_tet() -> TetMesh {
    let points = [[0.0; 3], [0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.1, 1e-300, 3.0]];
    TetMesh::try_new(points.map(Point3::from).to_vec(), vec![[0, 1, 2, 3]], vec![]).unwrap()
}

#[test]
fn lists_are_written_as_documented() {
    let text = String::from_utf8(write_thesis_lists(&one_tet(), &[[0, 1, 2]]).unwrap()).unwrap();
    let known = "softgrasp-lists 1\n# thesis Table 3.1; indices count from 0\nvertices 4\n\
                 0.0 0.0 0.0\n0.0 1.0 0.0\n1.0 0.0 0.0\n0.1 1e-300 3.0\nelements 1\n0 1 2 3\n\
                 display 1\n0 1 2\n";
    assert_eq!(text, known);
}

#[test]
fn displacements_travel_beside_the_mesh() {
    let values = [[0.0, 0.1, 0.2], [1.0; 3], [2.0; 3], [-3.0; 3]];
    let field = PointField { name: "displacement <m>", values: &values };
    let bytes = write_vtu(&one_tet(), &[field]).unwrap();
    let text = String::from_utf8(bytes.clone()).unwrap();
    assert!(text.contains("Name=\"displacement &lt;m&gt;\" NumberOfComponents=\"3\""));
    let data: Vec<u8> = values.as_flattened().iter().flat_map(|v| v.to_le_bytes()).collect();
    let packed = crate::mesh_io::encoding::encode(&[&96_u64.to_le_bytes()[..], &data].concat());
    assert!(text.contains(std::str::from_utf8(&packed).unwrap()));
    let file = read(bytes).unwrap();
    assert_eq!(file.mesh, one_tet());
    assert_eq!(file.findings.skipped_sections, ["PointData"]);
}

#[test]
fn data_that_does_not_fit_the_mesh_is_not_written() {
    let field = PointField { name: "u", values: &[[0.0; 3]] };
    let error = write_vtu(&one_tet(), &[field]).unwrap_err();
    assert_eq!(error, WriteError::FieldLength { field: "u".to_owned(), expected: 4, found: 1 });
    let error = write_thesis_lists(&one_tet(), &[[0, 1, 2], [0, 4, 1]]).unwrap_err();
    assert_eq!(error, WriteError::DisplayNode { triangle: 1, node: 4, node_count: 4 });
}

#[test]
fn an_inverted_element_of_the_lists_is_turned() {
    let text = "softgrasp-lists 1\nvertices 4\n0 0 0\n0 1 0\n1 0 0\n0 0 1\nelements 1\n1 0 2 3\n";
    let file = read(text).unwrap();
    assert_eq!(file.findings.flipped, [0]);
    assert_eq!(file.mesh.tets(), [[1, 0, 3, 2]]);
}

#[test]
fn the_example_of_the_documentation_is_read() {
    let page = include_str!("../../../../../docs/files.md");
    let start = page.find("softgrasp-lists 1\n").unwrap();
    let end = start + page[start..].find("```").unwrap();
    let file = read(&page[start..end]).unwrap();
    assert_eq!((file.mesh.node_count(), file.mesh.tets()), (4, &[[0, 1, 2, 3]][..]));
    assert!(file.findings.flipped.is_empty());
}
