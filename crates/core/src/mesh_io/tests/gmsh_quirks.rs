//! Tests of what Gmsh files of other programs do unexpectedly.

use super::samples::{
    Order, assert_is_sample, msh2, msh2_binary, msh41, msh41_binary, point_lines, read, refusal,
    tet_lines,
};
use crate::mesh_io::{Fault, Format};

/// Lines of `$Elements` with the sample's tetrahedra after others.
fn with_others(others: &[&str]) -> String {
    let count = others.len() + 2;
    let others: String = others.iter().map(|line| format!("{line}\n")).collect();
    msh2(&format!("{count}\n{others}{}", tet_lines("9# 4 2 0 1 ", 1, "")))
}

#[test]
fn q3_msh_1_has_no_format_section() {
    let text = format!(
        "$NOD\n5\n{}$ENDNOD\n$ELM\n3\n9 2 1 1 3 1 2 3\n{}$ENDELM\n",
        point_lines(Some(1)),
        tet_lines("# 4 1 1 4 ", 1, "")
    );
    let file = read(text).unwrap();
    assert_is_sample(&file, "MSH 1");
    assert_eq!(file.format, Format::GmshMsh1);
    assert_eq!(file.findings.other_cells["triangles"], 1);
}

#[test]
fn q4_node_ids_are_labels() {
    let mut text = msh2(&format!("2\n{}", tet_lines("# 4 2 0 1 ", 1, "")));
    // Labels 1 to 5 become 1, 2, 3, 4 and 900000.
    text = text.replace("\n5 1 1 0.25", "\n900000 1 1 0.25").replace("1 5 3 2 4", "1 900000 3 2 4");
    let file = read(&text).unwrap();
    assert_is_sample(&file, "sparse labels");
    assert!(file.findings.labels_mapped);
    let twice = text.replace("\n900000 1 1", "\n4 1 1");
    assert_eq!(read(twice).unwrap_err().fault, Fault::DuplicateLabel { label: 4 });
}

#[test]
fn q4_a_label_that_is_not_there_is_named() {
    let text = msh2("1\n1 4 2 0 1 1 2 3 77\n");
    let known = "f: tetrahedron 0 (from 0) names node 77, but there are 5 nodes, 1 to 5";
    assert_eq!(refusal(text), known);
}

#[test]
fn q5_no_newline_before_the_end_mark_of_a_binary_header() {
    for order in [Order::Little, Order::Big] {
        for gap in ["", "\n", "\r\n"] {
            let file = read(msh2_binary(order, gap)).unwrap();
            assert_is_sample(&file, gap);
            assert_eq!(file.findings.other_cells["points"], 1);
            assert!(file.findings.labels_mapped);
        }
    }
}

#[test]
fn q6_msh_4_without_entities_and_with_unknown_sections() {
    let text = format!("{}$Surface\n1\n2 3 4\n$EndSurface\n", msh41("$Mine\n$What\n$EndMine\n"));
    let file = read(text).unwrap();
    assert_is_sample(&file, "unknown sections");
    assert_eq!(file.findings.skipped_sections, ["Mine", "Surface"]);
}

#[test]
fn q6_comments_may_come_before_the_format() {
    let text = format!("$Comments\nmade by hand\n$EndComments\n{}", msh41(""));
    assert_is_sample(&read(text).unwrap(), "comments");
}

#[test]
fn q7_announced_tags_that_are_not_there() {
    let file = read(msh2(&format!("2\n{}", tet_lines("# 4 2 ", 1, "")))).unwrap();
    assert_is_sample(&file, "no tags");
    assert_eq!(file.findings.notes, ["2 elements announce tags and have none"]);
    let error = refusal(msh2("1\n1 4 2 0 1 1 2 3\n"));
    let known = "f: line 14: tags and nodes of an element of type 4: expected 6, found 5";
    assert_eq!(error, known);
}

#[test]
fn q8_physical_names_and_data_sections_are_no_obstacle() {
    let names = "$PhysicalNames\n2\n2 1 \"skin\"\n3 5 \"soft part\"\n$EndPhysicalNames\n";
    let elements = "2\n1 4 2 5 1 1 2 3 4\n2 4 2 6 1 5 3 2 4\n";
    let text = msh2(elements).replace("$Nodes", &format!("{names}$Nodes"));
    let text =
        text + "$NodeData\n1\n\"u\"\n0\n0\n$EndNodeData\n$ElementData\n1\n\"q\"\n$EndElementData\n";
    let file = read(&text).unwrap();
    assert_is_sample(&file, "names");
    assert_eq!(file.mesh.regions(), [0, 1]);
    assert_eq!(file.findings.region_labels, ["soft part", "6"]);
    assert_eq!(file.findings.skipped_sections, ["NodeData", "ElementData"]);
    // Data that is cut off leaves a mesh all the same, and says so.
    let file = read(text.replace("$EndElementData\n", "")).unwrap();
    assert_eq!(file.findings.notes, ["the file ends inside section $ElementData"]);
}

#[test]
fn q8_a_file_of_nodes_and_triangles_has_no_tetrahedra() {
    let error = refusal(msh2("2\n1 2 2 0 1 1 2 3\n2 2 2 0 1 2 3 4\n"));
    assert_eq!(error, "f: no tetrahedra: 2 triangles");
}

#[test]
fn physical_groups_of_msh_4_come_from_entities() {
    let entities = "$Entities\n1 0 0 2\n1 0 0 0 0\n1 0 0 0 1 1 1 1 40 0\n\
                    2 0 0 0 1 1 1 2 50 60 1 -1\n$EndEntities\n";
    let text = msh41(entities)
        .replace("1 2 1 2\n3 1 4 2\n1 1 2 3 4\n2", "2 2 1 2\n3 1 4 1\n1 1 2 3 4\n3 2 4 1\n2");
    let file = read(text).unwrap();
    assert_is_sample(&file, "two entities");
    assert_eq!(file.findings.region_labels, ["40", "50"]);
}

#[test]
fn q9_corners_of_higher_order_tetrahedra_are_used() {
    for (number, nodes) in [(11, 10), (29, 20), (30, 35)] {
        let more = " 5".repeat(nodes - 4);
        let file =
            read(msh2(&format!("2\n{}", tet_lines(&format!("# {number} 2 0 1 "), 1, &more))));
        let file = file.unwrap();
        assert_is_sample(&file, "higher order");
        assert_eq!(file.findings.higher_order, 2);
    }
    let mut text = msh2(&format!("1\n1 11 2 0 1 1 2 3 4{}\n", " 5".repeat(6)));
    text = text.replace("\n5 1 1 0.25", "\n5 0.5 0 0");
    assert_eq!(read(text).unwrap().findings.orphans, 1);
}

#[test]
fn q15_other_cells_are_counted_by_kind() {
    let text = with_others(&[
        "1 15 2 0 1 1",
        "2 1 2 0 1 1 2",
        "3 2 2 0 1 1 2 3",
        "4 2 2 0 1 1 2 4",
        "5 5 2 0 1 1 2 3 4 5 1 2 3",
        "6 134 2 0 1 1",
    ]);
    let file = read(text).unwrap();
    assert_is_sample(&file, "mixed cells");
    let counts: Vec<_> = file.findings.other_cells.iter().map(|(k, &n)| (k.as_str(), n)).collect();
    let known = [
        ("cells of unknown type 134", 1),
        ("hexahedra", 1),
        ("lines", 1),
        ("points", 1),
        ("triangles", 2),
    ];
    assert_eq!(counts, known);
}

#[test]
fn announced_counts_that_lie_are_reported() {
    let good = msh41("");
    let cases = [
        (good.replace("1 5 1 5\n3", "1 6 1 5\n3"), "line 16: nodes: expected 6, found 5"),
        (good.replace("1 2 1 2\n3", "1 3 1 2\n3"), "line 22: elements: expected 3, found 2"),
        (
            good.replace("3 1 4 2", "3 1 4 99999999"),
            "line 20: elements of a block: expected 99999999, \
             found 34 bytes to the end of the file",
        ),
        (good.replace("3 1 0 5", "3 1 0 6"), "line 17: expected a coordinate, found \"$EndNodes\""),
        (
            good.replace("2 5 3 2 4", "2 5 3 2 4\n3 1 2 3 4"),
            "line 23: expected $EndElements, found \"3\"",
        ),
    ];
    for (text, known) in cases {
        let error = refusal(text);
        assert!(error.starts_with(&format!("f: {known}")), "{error}");
    }
}

#[test]
fn binary_faults_name_the_byte() {
    let mut bytes = msh41_binary(Order::Little);
    bytes.truncate(bytes.len() - 40);
    let known = "f: byte 544: expected a node of an element, found 6 bytes to the end of the file";
    assert_eq!(refusal(bytes), known);
    let error = refusal(msh2_binary(Order::Little, "\n").as_slice().split_at(60).0);
    assert!(error.contains("byte 49: nodes: expected 5, found 11 bytes"), "{error}");
}

#[test]
fn parametric_nodes_are_read_past_their_parameters() {
    let points = point_lines(None).replace('\n', " 0.5 0.5 0.5\n");
    let text = msh41("").replace("3 1 0 5", "3 1 1 5").replace(&point_lines(None), &points);
    assert_is_sample(&read(text).unwrap(), "parametric");
}

#[test]
fn other_versions_are_refused_by_name() {
    let error = refusal(msh41("").replace("4.1 0 8", "3.0 0 8"));
    assert!(error.contains("a Gmsh MSH file of a version other than 1, 2 and 4"), "{error}");
    assert!(
        refusal(msh41("").replace("4.1 0 8", "4.0 1 8")).contains("binary MSH 4.0 is not read")
    );
}
