//! Tests of FEBio models: versions, parts, sections in files of their own, what is refused.

use std::fmt::Write;

use super::samples::{POINTS, TETS, assert_is_sample, read, refusal};
use crate::mesh_io::{Companion, parse};

fn nodes(tag: &str) -> String {
    let mut text = format!("<Nodes{tag}>\n");
    for (i, [x, y, z]) in POINTS.iter().enumerate() {
        writeln!(text, "<node id=\"{}\"> {x:e}, {y},{z}</node>", 10 + i).unwrap();
    }
    text + "</Nodes>\n"
}

/// The tetrahedron `which` as an element of the name given, with more nodes behind its corners.
fn element(name: &str, which: usize, more: &str) -> String {
    let [a, b, c, d] = TETS[which].map(|node| node + 10);
    format!("<{name} id=\"{}\">{a}, {b},{c} ,{d}{more}</{name}>\n", which + 1)
}

/// A model of version 4 with the sample in one part.
pub(super) fn febio() -> String {
    let elements = [0, 1].map(|which| element("elem", which, "")).concat();
    format!(
        "<?xml version=\"1.0\" encoding=\"ISO-8859-1\"?>\n<!-- \u{b5}m -->\n\
         <febio_spec version=\"4.0\">\n<Mesh>\n{}\
         <Elements type=\"tet4\" name=\"Part1\">\n{elements}</Elements>\n\
         <NodeSet name=\"s\">10,11</NodeSet>\n</Mesh>\n</febio_spec>\n",
        nodes(" name=\"Object1\"")
    )
}

#[test]
fn version_2_has_materials_at_its_elements() {
    let parts = [0, 1].map(|which| {
        format!(
            "<Elements type=\"tet10\" mat=\"{}\" name=\"P{which}\">{}</Elements>",
            which + 1,
            element("elem", which, ",14,14,14,14,14,14")
        )
    });
    let text = format!(
        "<febio_spec version=\"2.5\"><Material><material id=\"2\" name=\"stone\" type=\"x\"/>\
         </Material><Geometry>{}{}<Elements type=\"hex8\" mat=\"1\" name=\"h\">\
         <elem id=\"9\">10,10,10,10,10,10,10,10</elem></Elements><Elements type=\"odd\">\
         <elem id=\"10\">x</elem></Elements></Geometry></febio_spec>",
        nodes(""),
        parts.concat()
    );
    let file = read(text).unwrap();
    assert_is_sample(&file, "2.5");
    assert_eq!(file.findings.higher_order, 2);
    assert_eq!(file.findings.region_labels, ["P0 (1)", "P1 (stone)"]);
    let others: Vec<_> = file.findings.other_cells.into_iter().collect();
    assert_eq!(others, [("elements of type \"odd\"".to_owned(), 1), ("hexahedra".to_owned(), 1)]);
}

#[test]
fn versions_3_and_4_name_materials_by_domain() {
    let text = febio().replace(
        "</elem>\n<elem id=\"2\"",
        "</elem>\n</Elements><Elements type=\"tet4\" name=\"Part2\"><elem id=\"2\"",
    );
    let domains = "</Mesh><MeshDomains><SolidDomain name=\"Part1\" mat=\"Soft\"/>\
                   <SolidDomain name=\"Part2\" mat=\"Hard\"/></MeshDomains>";
    let file = read(text.replace("</Mesh>", domains)).unwrap();
    assert_is_sample(&file, "4.0");
    assert_eq!(file.mesh.regions(), [0, 1]);
    assert_eq!(file.findings.region_labels, ["Part1 (Soft)", "Part2 (Hard)"]);
}

#[test]
fn version_1_names_elements_by_their_type() {
    let elements = element("tet4", 0, "").replace("<tet4", "<tet4 mat=\"1\"")
        + &element("tet4", 1, "").replace("<tet4", "<tet4 mat=\"2\"");
    let text = format!(
        "<febio_spec version=\"1.2\"><Geometry>{}<Elements>{elements}</Elements></Geometry>\
         </febio_spec>",
        nodes("")
    );
    let file = read(text).unwrap();
    assert_is_sample(&file, "1.2");
    assert_eq!(file.findings.region_labels, ["1", "2"]);
}

#[test]
fn sections_in_files_of_their_own_are_asked_for() {
    let outer = "<febio_spec version=\"2.5\"><Geometry from=\"geo.feb\"/></febio_spec>";
    let file = parse("f", outer.as_bytes(), &mut |wanted| {
        assert_eq!(*wanted, Companion::FileName("geo.feb".to_owned()));
        Some(febio().into())
    });
    assert_is_sample(&file.unwrap(), "from");
    assert!(refusal(outer).contains("the included file \"geo.feb\" is needed as well"));
    let error = parse("f", outer.as_bytes(), &mut |_| Some(outer.into())).unwrap_err().to_string();
    assert!(error.contains("files of sections: expected at most 64, found more"), "{error}");
}

#[test]
fn febio_faults_name_line_and_finding() {
    let cases = [
        (febio().replace(" 1e0, 0,0<", "1,0<"), "f: line 7: expected the coordinates x, y, z"),
        (
            febio().replace(",13</elem>", "</elem>"),
            "expected the 4 nodes of an element of type tet4",
        ),
        (febio().replace("<node id=\"12\">", "<node>"), "expected a node with id=\"number\""),
        (febio().replace("</febio_spec>", ""), "expected the end of the document's elements"),
        (
            febio().replace("<Mesh>", "<Mesh><Instance/>"),
            "a mesh of instances of parts is not read",
        ),
    ];
    for (text, known) in cases {
        let error = refusal(&text);
        assert!(error.contains(known) || text == febio(), "{known}: {error}");
        assert!(text != febio(), "{known}: the change did not match");
    }
}
