//! The same curved mesh of two ten-node tetrahedra in every format that has them, each in its own order.

use std::fmt::Write;

use nalgebra::Point3;

use super::samples::{POINTS, Sample, TETS, read};
use crate::fem::tet10::EDGES;
use crate::fem::{MidEdgeFault, QuadraticMesh, QuadraticMeshError};
use crate::mesh::TetMesh;
use crate::mesh_io::{Format, MeshFile, write_msh41, write_vtu};

/// Ends of the edges of nodes 5 … 13.
const MIDDLES: [[usize; 2]; 9] =
    [[0, 1], [1, 2], [0, 2], [0, 3], [1, 3], [2, 3], [2, 4], [1, 4], [3, 4]];

/// Orders of the last six nodes by the ends of their edges, as a format numbers the corners.
const VTK: [[usize; 2]; 6] = EDGES;
const GMSH: [[usize; 2]; 6] = [[0, 1], [1, 2], [0, 2], [0, 3], [2, 3], [1, 3]];
const TETGEN: [[usize; 2]; 6] = [[2, 3], [0, 3], [0, 1], [1, 2], [1, 3], [0, 2]];
const NETGEN: [[usize; 2]; 6] = [[0, 1], [0, 2], [0, 3], [1, 2], [1, 3], [2, 3]];

/// Corners, and a node beside the middle of every edge.
fn places() -> Vec<Point3<f64>> {
    let mut places: Vec<Point3<f64>> = POINTS.map(Point3::from).to_vec();
    for [a, b] in MIDDLES {
        let middle = nalgebra::center(&places[a], &places[b]);
        places.push(middle + nalgebra::Vector3::new(0.03125, -0.0625, 0.015625));
    }
    places
}

/// The nodes of a tetrahedron in the order of a format.
fn nodes(corners: [usize; 4], order: [[usize; 2]; 6]) -> Vec<usize> {
    let middle = |[a, b]: [usize; 2]| {
        let ends = [corners[a].min(corners[b]), corners[a].max(corners[b])];
        5 + MIDDLES.iter().position(|own| *own == ends).unwrap()
    };
    corners.into_iter().chain(order.map(middle)).collect()
}

/// One line for each element: `prefix` with `#` for its number, nodes from `base`, `suffix`.
fn lines(
    order: [[usize; 2]; 6],
    base: usize,
    between: &str,
    (prefix, suffix): (&str, &str),
) -> String {
    let mut text = String::new();
    for (tet, number) in TETS.into_iter().zip(1..) {
        let nodes = nodes(tet, order).into_iter().map(|node| (node + base).to_string());
        let nodes = nodes.collect::<Vec<_>>().join(between);
        writeln!(text, "{}{nodes}{suffix}", prefix.replace('#', &format!("{number}"))).unwrap();
    }
    text
}

fn point_lines(between: &str, label: impl Fn(usize) -> String, suffix: &str) -> String {
    let mut text = String::new();
    for (node, p) in places().iter().enumerate() {
        let label = label(node);
        writeln!(text, "{label}{}{between}{}{between}{}{suffix}", p.x, p.y, p.z).unwrap();
    }
    text
}

fn msh2() -> String {
    let points = point_lines(" ", |node| format!("{} ", node + 1), "");
    let elements = lines(GMSH, 1, " ", ("# 11 2 0 1 ", ""));
    format!(
        "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n14\n{points}$EndNodes\n\
         $Elements\n2\n{elements}$EndElements\n"
    )
}

fn netgen() -> String {
    // Netgen turns the corners round.
    let mut elements = String::new();
    for [a, b, c, d] in TETS {
        let nodes = nodes([a, b, d, c], NETGEN).into_iter().map(|n| format!(" {}", n + 1));
        writeln!(elements, "1 10{}", nodes.collect::<String>()).unwrap();
    }
    format!(
        "mesh3d\ndimension\n3\ngeomtype\n0\nvolumeelements\n2\n{elements}points\n14\n{}endmesh\n",
        point_lines(" ", |_| String::new(), "")
    )
}

fn vtk() -> String {
    format!(
        "# vtk DataFile Version 2.0\ntitle\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS 14 double\n{}\
         CELLS 2 22\n{}CELL_TYPES 2\n24\n24\n",
        point_lines(" ", |_| String::new(), ""),
        lines(VTK, 0, " ", ("10 ", ""))
    )
}

fn xdmf() -> String {
    format!(
        "<?xml version=\"1.0\"?><Xdmf Version=\"3.0\"><Domain><Grid><Geometry GeometryType=\"XYZ\">\
         <DataItem DataType=\"Float\" Dimensions=\"14 3\" Format=\"XML\" Precision=\"8\">{}</DataItem>\
         </Geometry><Topology TopologyType=\"Tetrahedron_10\" NumberOfElements=\"2\"><DataItem \
         NumberType=\"Int\" Dimensions=\"2 10\" Format=\"XML\">{}</DataItem></Topology></Grid></Domain>\
         </Xdmf>",
        point_lines(" ", |_| String::new(), ""),
        lines(VTK, 0, " ", ("", ""))
    )
}

fn febio() -> String {
    format!(
        "<febio_spec version=\"4.0\"><Mesh><Nodes>{}</Nodes><Elements type=\"tet10\" name=\"P\">{}\
         </Elements></Mesh></febio_spec>",
        point_lines(",", |node| format!("<node id=\"{}\">", node + 1), "</node>"),
        lines(VTK, 1, ",", ("<elem id=\"#\">", "</elem>"))
    )
}

fn deck(tail: &str) -> String {
    format!(
        "*NODE\n{}*ELEMENT, TYPE=C3D10, ELSET=E\n{}{tail}",
        point_lines(", ", |node| format!("{}, ", node + 1), ""),
        lines(VTK, 1, ", ", ("#, ", ""))
    )
}

fn medit() -> String {
    format!(
        "MeshVersionFormatted 2\nDimension 3\nVertices\n14\n{}TetrahedraP2\n2\n{}End\n",
        point_lines(" ", |_| String::new(), " 0"),
        lines(VTK, 1, " ", ("", " 0"))
    )
}

/// Every format, its own order of the nodes within.
fn files() -> Vec<Sample> {
    let points = point_lines(" ", |node| format!("{} ", node + 1), "");
    let mut tetgen = Sample::new("TetGen", Format::TetGen, format!("14 3 0 0\n{points}"));
    let elements = lines(TETGEN, 1, " ", ("# ", ""));
    tetgen.companion = Some(format!("2 10 0\n{elements}").into_bytes());
    let elements = lines(GMSH, 1, " ", ("# 11 1 1 10 ", ""));
    let msh1 = format!("$NOD\n14\n{points}$ENDNOD\n$ELM\n2\n{elements}$ENDELM\n");
    vec![
        Sample::new("MSH 1", Format::GmshMsh1, msh1),
        Sample::new("MSH 2", Format::GmshMsh2Ascii, msh2()),
        Sample::new("MSH 4", Format::GmshMsh4Ascii, write_msh41(&mesh())),
        Sample::new("VTK", Format::VtkLegacy, vtk()),
        Sample::new("VTU", Format::Vtu, write_vtu(&mesh(), &[]).unwrap()),
        Sample::new("XDMF", Format::Xdmf, xdmf()),
        Sample::new("FEBio", Format::Febio, febio()),
        Sample::new("deck", Format::Deck, deck("")),
        Sample::new("MEDIT", Format::Medit, medit()),
        Sample::new("Netgen", Format::Netgen, netgen()),
        tetgen,
    ]
}

/// The mesh that all of them hold, with corners as the thesis counts them.
fn mesh() -> TetMesh {
    let all = TETS.map(|[a, b, c, d]| nodes([a, b, d, c], VTK));
    let node = |tet: usize, local: usize| all[tet][local] as u32;
    let tets = [0, 1].map(|tet| std::array::from_fn(|i| node(tet, i)));
    let middles = [0, 1].map(|tet| std::array::from_fn(|i| node(tet, 4 + i)));
    let mesh = TetMesh::try_new(places(), tets.to_vec(), vec![]).unwrap();
    mesh.with_mid_edge_nodes(middles.to_vec()).unwrap()
}

#[test]
fn every_format_gives_the_same_curved_mesh() {
    let mesh = mesh();
    assert!(QuadraticMesh::try_new(&mesh).unwrap().is_curved());
    for sample in files() {
        let file = sample.read().unwrap();
        assert_eq!(file.format, sample.format, "{}", sample.label);
        assert_eq!(file.mesh, mesh, "{}", sample.label);
        let MeshFile { findings, .. } = file;
        assert_eq!((findings.higher_order, findings.orphans), (2, 9), "{}", sample.label);
        assert!(findings.flipped.is_empty() && findings.notes.is_empty(), "{}", sample.label);
    }
}

#[test]
fn instances_of_a_deck_keep_their_own_mid_edge_nodes() {
    let deck = format!(
        "*PART, NAME=A\n{}*END PART\n*ASSEMBLY, NAME=S\n*INSTANCE, NAME=I, PART=A\n*END INSTANCE\n\
         *INSTANCE, NAME=J, PART=A\n10., 0., 0.\n*END INSTANCE\n*END ASSEMBLY\n",
        deck("")
    );
    let file = read(deck).unwrap();
    let middles = file.mesh.mid_edge_nodes();
    assert_eq!(middles[..2], *mesh().mid_edge_nodes());
    assert_eq!(middles[2..], [middles[0].map(|n| n + 14), middles[1].map(|n| n + 14)]);
    assert!(QuadraticMesh::try_new(&file.mesh).is_ok());
}

#[test]
fn an_element_that_is_turned_has_its_mid_edge_nodes_turned() {
    let whole = lines(VTK, 0, " ", ("10 ", ""));
    let [a, b, c, d] = TETS[1];
    let other = nodes([a, b, d, c], VTK).iter().map(|n| format!(" {n}")).collect::<String>();
    let first = whole.lines().next().unwrap();
    let file = read(vtk().replace(&whole, &format!("{first}\n10{other}\n"))).unwrap();
    assert_eq!(file.findings.flipped, [1]);
    assert_eq!(file.mesh, mesh());
}

#[test]
fn flat_elements_go_with_their_mid_edge_nodes() {
    let flat = "10 0 1 2 2 5 6 7 7 6 2\n";
    let whole = lines(VTK, 0, " ", ("10 ", ""));
    let text = vtk().replace("CELLS 2 22", "CELLS 3 33").replace(&whole, &format!("{flat}{whole}"));
    let file = read(text.replace("CELL_TYPES 2\n", "CELL_TYPES 3\n24\n")).unwrap();
    assert_eq!(file.findings.degenerate, [0]);
    assert_eq!(file.mesh, mesh());
}

#[test]
fn corners_are_used_alone_where_an_element_has_four_nodes() {
    let first = lines(GMSH, 1, " ", ("# 11 2 0 1 ", "")).lines().next().unwrap().to_owned();
    let four = "1 4 2 0 1 1 2 3 4";
    let file = read(msh2().replace(&first, four)).unwrap();
    assert_eq!(file.findings.higher_order, 1);
    assert_eq!(file.mesh, mesh().without_mid_edge_nodes());
}

#[test]
fn a_mid_edge_node_that_is_not_there_is_noted_and_corners_are_used() {
    let file = read(febio().replace(",10</elem>", ",99</elem>")).unwrap();
    assert_eq!(file.mesh, mesh().without_mid_edge_nodes());
    assert!(file.findings.notes[0].contains("names node 99"), "{:?}", file.findings.notes);
}

#[test]
fn neighbours_with_different_nodes_on_their_edge_are_refused_by_ten_node_elements() {
    // Edge 1 – 3 has node 9, of the second element node 8 now.
    let second = lines(VTK, 0, " ", ("10 ", "")).lines().nth(1).unwrap().to_owned();
    let spoilt = second.replace(" 9", " 8");
    assert_ne!(spoilt, second);
    let file = read(vtk().replace(&second, &spoilt)).unwrap();
    let error = QuadraticMesh::try_new(&file.mesh).unwrap_err();
    let expected =
        MidEdgeFault::TwoMiddles { edge: [1, 3], tet: 0, middle: 9, other_tet: 1, other: 8 };
    assert_eq!(error, QuadraticMeshError::MidEdge(expected));
    assert!(error.to_string().contains("node 1 to node 3"), "{error}");
}

#[test]
fn damaged_files_give_an_error_or_a_mesh_that_is_seen_through() {
    let check = |sample: &Sample| {
        if let Ok(file) = sample.read() {
            let is_whole = file.mesh.mid_edge_nodes().len() == file.mesh.tets().len();
            assert!(is_whole || file.mesh.mid_edge_nodes().is_empty());
            // Either is right: what matters is that it ends, and names what it refuses.
            match QuadraticMesh::try_new(&file.mesh) {
                Ok(mesh) => assert_eq!(mesh.is_curved(), is_whole),
                Err(error) => assert!(error.to_string().contains("0-based"), "{error}"),
            }
        }
    };
    for sample in files() {
        for at in 0..sample.bytes.len() {
            check(&Sample { bytes: sample.bytes[..at].to_vec(), ..sample.clone() });
            let mut changed = sample.clone();
            changed.bytes[at] = if changed.bytes[at] == b'1' { b'7' } else { b'1' };
            check(&changed);
        }
    }
}
