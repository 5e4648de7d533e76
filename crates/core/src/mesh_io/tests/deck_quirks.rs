//! Tests of Abaqus and CalculiX decks: sets, sections, parts, included files, what is refused.

use std::fmt::Write;

use nalgebra::Point3;

use super::samples::{POINTS, TETS, assert_is_sample, read, refusal};
use crate::mesh_io::{Companion, MeshFile, parse};

/// Lines of the sample's nodes with labels from `first` in steps of `step`.
fn node_lines(first: usize, step: usize) -> String {
    let mut text = String::new();
    for (i, [x, y, z]) in POINTS.iter().enumerate() {
        writeln!(text, "{}, {x:e}, {y}, {z}", first + i * step).unwrap();
    }
    text
}

/// Lines of the sample's tetrahedra, labelled 11 and 12.
fn element_lines(first: usize, step: usize) -> String {
    let mut text = String::new();
    for (i, tet) in TETS.iter().enumerate() {
        let [a, b, c, d] = tet.map(|node| first + node * step);
        writeln!(text, "{}, {a}, {b}, {c}, {d}", 11 + i).unwrap();
    }
    text
}

/// A deck of the sample with `tail` behind it.
pub(super) fn deck(tail: &str) -> String {
    format!(
        "** by hand\n*Heading\n any text, *not a keyword\n*NODE, NSET=Nall\n{}\
         *Element, type=C3D4, ELSET=Eall\n{}{tail}",
        node_lines(1, 1),
        element_lines(1, 1)
    )
}

#[track_caller]
fn regions(tail: &str, numbers: &[u32], labels: &[&str]) {
    let file = read(deck(tail)).unwrap();
    assert_is_sample(&file, tail);
    assert_eq!(file.mesh.regions(), numbers, "{tail}");
    assert_eq!(file.findings.region_labels, labels, "{tail}");
}

#[test]
fn labels_may_have_gaps_and_fields_may_be_empty() {
    let text = format!(
        "*node\n7, , , \n{}*ELEMENT,ELSET=e,TYPE=C3D4H\n{}",
        node_lines(1_000_007, 1_000_000).replace("1000007, 0e0, 0, 0\n", ""),
        element_lines(1_000_007, 1_000_000).replace("1000007,", "7,")
    );
    let file = read(text).unwrap();
    assert_is_sample(&file, "gaps");
    assert!(file.findings.labels_mapped);
}

#[test]
fn q20_elements_of_ten_nodes_go_on_in_the_next_line() {
    let lines = element_lines(1, 1).replace('\n', ", 5, 5,\n 5, 5, 5, 5\n");
    let file = read(deck("").replace("C3D4", "C3D10M").replace(&element_lines(1, 1), &lines));
    let file = file.unwrap();
    assert_is_sample(&file, "C3D10M");
    assert_eq!(file.findings.higher_order, 2);
    let cut = deck("").replace("C3D4", "C3D10");
    assert!(refusal(cut).contains("nodes of an element of type C3D10: expected 10"));
    let odd = deck("").replace("C3D4", "C3D10\n** a comment between") + "1, 5, 5\n";
    assert!(refusal(odd).contains("nodes of an element of type C3D10: expected 10, found 12"));
}

#[test]
fn sections_make_regions_by_their_sets() {
    regions("*SOLID SECTION, ELSET=EALL, MATERIAL=Steel\n,\n", &[], &[]);
    let tail = "*ELSET, ELSET=top\n12\n*Elset, elset=both, generate\n11, 12, 1\n\
                *Solid Section, elset=Both, material=soft\n1.,\n\
                *Solid Section, elset=top, material=hard\n";
    regions(tail, &[0, 1], &["both (soft)", "top (hard)"]);
    let tail =
        "*ELSET, ELSET=top\n12\n*ELSET, ELSET=more\ntop\n*SOLIDSECTION,ELSET=more,MATERIAL=m\n";
    regions(tail, &[0, 1], &["in no set", "more (m)"]);
}

#[test]
fn without_sections_sets_that_hold_each_tetrahedron_once_are_regions() {
    regions("*ELSET,ELSET=a\n11,\n*ELSET,ELSET=b\n12\n", &[0, 1], &["a", "b"]);
    // Sets that overlap are there for loads and output.
    regions("*ELSET,ELSET=a\n11,\n*ELSET,ELSET=b\n11, 12\n", &[], &[]);
    let two = format!("12, {}", element_lines(1, 1).split_once("12, ").unwrap().1);
    let text = deck("").replace(&two, &format!("*ELEMENT, TYPE=C3D4, ELSET=Second\n{two}"));
    assert_eq!(read(text).unwrap().findings.region_labels, ["Eall", "Second"]);
}

#[test]
fn other_elements_are_counted_by_kind_or_name() {
    let tail = "*ELEMENT, TYPE=S3\n21, 1, 2, 3\n*ELEMENT, TYPE=SPRINGA\n22, 1, 2\n23, 1,\n 3\n\
                *ELEMENT, TYPE=C3D8R\n31,1,2,3,4,5,1,2,3,4,5,\n*STEP\n*STATIC\n0.1, 1.\n*END STEP\n";
    let file = read(deck(tail)).unwrap();
    assert_is_sample(&file, "others");
    let counts: Vec<_> = file.findings.other_cells.iter().map(|(k, &n)| (k.as_str(), n)).collect();
    let known = [("elements of type \"SPRINGA\"", 2), ("hexahedra", 1), ("triangles", 1)];
    assert_eq!(counts, known);
    assert_eq!(file.findings.skipped_sections, ["STEP", "STATIC", "ENDSTEP"]);
    let text = "*NODE\n1,0,0,0\n*ELEMENT, TYPE=C3D8R\n31,1,1,1,1,1,1,1,1\n";
    assert_eq!(refusal(text), "f: no tetrahedra: 1 hexahedra");
}

#[test]
fn included_files_are_asked_for_by_name() {
    let outer = "*INCLUDE, INPUT=parts\\mesh.inp\n*ELEMENT, TYPE=C3D4, INPUT=\"my tets.txt\"\n";
    let file = parse("f", outer.as_bytes(), &mut |wanted| match wanted {
        Companion::FileName(name) if name == "parts\\mesh.inp" => {
            Some(format!("*NODE\n{}", node_lines(1, 1)).into())
        }
        Companion::FileName(name) if name == "my tets.txt" => Some(element_lines(1, 1).into()),
        _ => None,
    });
    assert_is_sample(&file.unwrap(), "included");
    let error = refusal(outer);
    assert!(error.contains("the included file \"parts\\\\mesh.inp\" is needed"), "{error}");
    let data =
        format!("*NODE\n*INCLUDE, INPUT=n.txt\n*ELEMENT, TYPE=C3D4\n{}", element_lines(1, 1));
    let file = parse("f", data.as_bytes(), &mut |_| Some(node_lines(1, 1).into()));
    assert_is_sample(&file.unwrap(), "included data lines");
    assert!(refusal("*NODE\n*INCLUDE, FILE=a\n").contains("expected INPUT=file"));
    let own = "*INCLUDE, INPUT=me.inp\n";
    let error = parse("f", own.as_bytes(), &mut |_| Some(own.into())).unwrap_err().to_string();
    assert!(error.contains("included files: expected at most 64, found more"), "{error}");
}

/// A deck of one part and the lines of its assembly.
fn assembly(lines: &str) -> String {
    format!(
        "*Heading\n*Part, name=Block\n*Node\n{}*Element, type=C3D4\n{}*Elset, elset=low\n11\n\
         *Elset, elset=high\n12\n*End Part\n*Assembly, name=A\n{lines}*End Assembly\n",
        node_lines(3, 2),
        element_lines(3, 2)
    )
}

fn first_points(file: &MeshFile) -> [Point3<f64>; 2] {
    [file.mesh.vertices()[1], file.mesh.vertices()[6]]
}

#[test]
fn one_instance_is_its_part_where_it_stands() {
    let file =
        read(assembly("*Instance, name=Block-1, part=BLOCK\n*End Instance\n*Node\n1,9,9,9\n"));
    let file = file.unwrap();
    assert_is_sample(&file, "one instance");
    assert_eq!(file.findings.region_labels, ["low", "high"]);
    let moved = assembly("*Instance, name=Block-1, part=Block\n10., 0., -1.\n*End Instance\n");
    assert_eq!(read(moved).unwrap().mesh.vertices()[1], Point3::new(11.0, 0.0, -1.0));
    let bare = assembly("");
    assert_is_sample(&read(bare).unwrap(), "a part without instances");
}

#[test]
fn several_instances_are_moved_and_turned() {
    let file = read(assembly(
        "*Instance, name=I, part=Block\n*End Instance\n*Instance, name=J, part=Block\n\
         5., 0., 0.\n5., 0., 0., 5., 0., 1., 90.\n*End Instance\n",
    ))
    .unwrap();
    assert_eq!((file.mesh.node_count(), file.mesh.tets().len()), (10, 4));
    let [own, turned] = first_points(&file);
    assert_eq!(own, Point3::new(1.0, 0.0, 0.0));
    assert!((turned - Point3::new(5.0, 1.0, 0.0)).norm() < 1e-15, "{turned}");
    assert_eq!(file.findings.region_labels, ["I.low", "I.high", "J.low", "J.high"]);
    assert_eq!(file.findings.notes, ["2 instances, nodes are not joined"]);
}

#[test]
fn what_makes_meshes_in_other_ways_is_refused_by_name() {
    let cases = [
        ("*NGEN\n1,5\n", "a mesh made by *NGEN is not read here"),
        ("*Node, system=C\n1,1,2,3\n", "cylindrical or spherical coordinates is not read here"),
        ("*NODE\n1, x\n", "expected a node: label, x, y, z, found \"1, x\""),
        ("*ELSET, ELSET=a, GENERATE\n1, 2, 0\n", "expected first label, last label, step"),
        ("*ELEMENT\n1,1,2,3,4\n", "expected TYPE=name of the elements"),
        ("*INSTANCE, NAME=i, PART=p\n*END INSTANCE\n", "instance i of part p, which is not in"),
    ];
    for (tail, known) in cases {
        let error = refusal(deck(tail));
        assert!(error.contains(known), "{error}");
    }
    let two = assembly("").repeat(2);
    assert!(refusal(two).contains("a deck of several parts without instances is not read here"));
}
