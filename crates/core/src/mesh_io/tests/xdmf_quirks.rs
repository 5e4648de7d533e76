//! Tests of XDMF: data in the text and in raw files, mixed cells, series, what is refused.

use super::samples::{POINTS, TETS, assert_is_sample, point_lines, read, refusal, tet_lines};
use crate::mesh_io::{Companion, Foreign, Sniffed, parse, sniff};

const HEAD: &str = "<?xml version=\"1.0\"?>\n<!DOCTYPE Xdmf SYSTEM \"Xdmf.dtd\" []>\n\
                    <Xdmf Version=\"3.0\"><Domain>";

/// A grid with the topology and what else is given.
fn grid(topology: &str, more: &str) -> String {
    format!(
        "<Grid Name=\"Grid\" GridType=\"Uniform\">\n<Geometry GeometryType=\"XYZ\">\n\
         <DataItem DataType=\"Float\" Dimensions=\"5 3\" Format=\"XML\" Precision=\"8\">\n{}\
         </DataItem></Geometry>\n{topology}{more}</Grid>\n",
        point_lines(None)
    )
}

fn tets() -> String {
    format!(
        "<Topology TopologyType=\"Tetrahedron\" NumberOfElements=\"2\"><DataItem \
         NumberType=\"Int\" Dimensions=\"2 4\" Format=\"XML\" Precision=\"8\">\n{}</DataItem>\
         </Topology>\n",
        tet_lines("", 0, "")
    )
}

fn document(grids: &str) -> String {
    format!("{HEAD}{grids}</Domain></Xdmf>\n")
}

/// The sample with its numbers in the text.
pub(super) fn xdmf() -> String {
    document(&grid(&tets(), ""))
}

#[test]
fn whole_numbers_on_cells_are_regions() {
    let on_cells = |name: &str, kind: &str| {
        format!(
            "<Attribute Name=\"{name}\" AttributeType=\"Scalar\" Center=\"Cell\"><DataItem \
             DataType=\"{kind}\" Dimensions=\"2\" Format=\"XML\" Precision=\"4\">4 9</DataItem>\
             </Attribute>"
        )
    };
    for name in ["region", "gmsh:physical"] {
        let file = read(document(&grid(&tets(), &on_cells(name, "Int")))).unwrap();
        assert_is_sample(&file, name);
        assert_eq!(file.findings.region_labels, ["4", "9"]);
    }
    let file = read(document(&grid(&tets(), &on_cells("stress", "Float")))).unwrap();
    assert!(file.mesh.regions().is_empty());
    assert_eq!(file.findings.skipped_sections, ["stress"]);
}

#[test]
fn raw_bytes_are_asked_for_by_name() {
    let item = |kind: &str, more: &str, file: &str| {
        format!("<DataItem Format=\"Binary\" {kind} Endian=\"Big\" {more}>\n{file}\n</DataItem>")
    };
    let text = document(&format!(
        "<Grid><Topology Type=\"Tet\">{}</Topology><Geometry Type=\"XYZ\">{}</Geometry></Grid>",
        item("DataType=\"UInt\"", "Dimensions=\"2 4\" Seek=\"3\"", "t.bin"),
        item("DataType=\"Float\" Precision=\"8\"", "Dimensions=\"15\"", "p.bin")
    ));
    let points: Vec<u8> = POINTS.as_flattened().iter().flat_map(|c| c.to_be_bytes()).collect();
    let mut tets = b"xxx".to_vec();
    tets.extend(TETS.as_flattened().iter().flat_map(|&node| (node as u32).to_be_bytes()));
    let give = |length: usize| {
        parse("f", text.as_bytes(), &mut |wanted| match wanted {
            Companion::FileName(name) if name == "p.bin" => Some(points.clone()),
            Companion::FileName(name) if name == "t.bin" => Some(tets[..length].to_vec()),
            _ => None,
        })
    };
    assert_is_sample(&give(35).unwrap(), "raw");
    let error = give(34).unwrap_err().to_string();
    assert!(
        error.contains("expected 32 bytes, found 34 in the included file \"t.bin\""),
        "{error}"
    );
    assert!(refusal(&text).contains("\"p.bin\" is needed as well"));
}

#[test]
fn mixed_cells_and_several_grids_are_joined() {
    let mixed = "<Topology TopologyType=\"Mixed\"><DataItem NumberType=\"Int\" Format=\"XML\">\
                 1 1 0 4 0 1 2 6 0 1 2 3 38 4 2 1 3 0 0 0 0 0 0</DataItem></Topology>";
    let file = read(document(&grid(mixed, ""))).unwrap();
    assert_is_sample(&file, "mixed");
    assert_eq!(file.findings.higher_order, 1);
    assert_eq!(file.findings.other_cells["triangles"], 1);
    let pieces = format!(
        "<Grid GridType=\"Collection\" CollectionType=\"Spatial\">{}{}</Grid>",
        grid(&tets(), ""),
        grid(&tets(), "")
    );
    let file = read(document(&pieces)).unwrap();
    assert_eq!((file.mesh.node_count(), file.mesh.tets().len()), (10, 4));
    let file = read(document(&pieces.replace("Spatial", "Temporal"))).unwrap();
    assert_is_sample(&file, "series");
    assert_eq!(file.findings.notes, ["the first grid of a series; 1 later ones not read"]);
}

#[test]
fn what_xdmf_is_not_read_is_refused_by_name() {
    let hdf = xdmf().replace("Format=\"XML\"", "Format=\"HDF\"");
    assert!(refusal(hdf).contains("data in HDF5 (0 0 0"), "names the place of the data");
    let other = xdmf().replace("<DataItem DataType", "<DataItem ItemType=\"Function\" DataType");
    assert!(refusal(other).contains("a DataItem of type \"Function\" is not read here"));
    let far = xdmf().replace("0 1 2 3\n", "0 1 2 5\n");
    assert!(refusal(far).contains("names node 5, but its grid has 5 nodes, from 0"));
    let lie = xdmf().replace("\"2 4\"", "\"3 4\"");
    assert!(refusal(lie).contains("a DataItem: expected 12, found 8"));
    let plane = xdmf().replace("\"XYZ\"", "\"XY\"");
    assert_eq!(refusal(plane), "f: no tetrahedra: a plane mesh");
    let dolfin = "<dolfin xmlns:dolfin=\"http://fenicsproject.org\">";
    assert_eq!(sniff(dolfin.as_bytes()), Some(Sniffed::Foreign(Foreign::DolfinXml)));
}
