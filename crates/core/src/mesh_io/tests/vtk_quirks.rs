//! Tests of what VTK legacy and XML files of other programs do unexpectedly.

use super::samples::{
    assert_is_sample, point_lines, read, refusal, tet_lines, vtk_binary, vtk_head,
};
use super::vtu_samples::vtu_text;
use crate::mesh_io::Format;

const CONNECTIVITY: &str = "0 1 2 3 4 2 1 3";

fn vtk_with_cells(cells: &str) -> String {
    format!("{}POINTS 5 double\n{}{cells}", vtk_head("4.2", "ASCII"), point_lines(None))
}

#[test]
fn q1_xml_under_another_name_is_read_as_xml() {
    let text = vtu_text(&point_lines(None), CONNECTIVITY, "4 8", "10 10");
    let file = crate::mesh_io::parse("Bunny.vtk", text.as_bytes(), &mut |_| None).unwrap();
    assert_eq!(file.format, Format::Vtu);
    assert_is_sample(&file, "vtu named vtk");
}

#[test]
fn q2_surfaces_say_that_there_are_no_tetrahedra() {
    let poly =
        vtk_head("3.0", "BINARY").replace("UNSTRUCTURED_GRID", "POLYDATA") + "POINTS 9 float\n\0\0";
    assert_eq!(refusal(poly), "f: no tetrahedra: a POLYDATA surface");
    let poly = "<VTKFile type=\"PolyData\"><PolyData/></VTKFile>";
    assert_eq!(refusal(poly), "f: no tetrahedra: a PolyData data set");
    let hexahedron = "CELLS 1 9\n8 0 1 2 3 4 0 1 2\nCELL_TYPES 1\n12\n";
    assert_eq!(refusal(vtk_with_cells(hexahedron)), "f: no tetrahedra: 1 hexahedra");
}

#[test]
fn q15_mixed_cells_leave_the_tetrahedra() {
    let cells =
        format!("CELLS 4 16\n1 0\n3 0 1 2\n{}CELL_TYPES 4\n1 5 10 10\n", tet_lines("4 ", 0, ""));
    let file = read(vtk_with_cells(&cells)).unwrap();
    assert_is_sample(&file, "mixed cells");
    let known: Vec<_> = file.findings.other_cells.into_iter().collect();
    assert_eq!(known, [("points".to_owned(), 1), ("triangles".to_owned(), 1)]);
}

#[test]
fn q9_quadratic_cells_give_their_corners() {
    let cells = "CELLS 1 11\n10 0 1 2 3 4 4 4 4 4 4\nCELL_TYPES 1\n24\n";
    let file = read(vtk_with_cells(cells)).unwrap();
    assert_eq!((file.findings.higher_order, file.findings.orphans), (1, 1));
}

#[test]
fn q16_field_data_and_metadata_stand_where_they_like() {
    let cells = format!("CELLS 2 10\n{}CELL_TYPES 2\n10\n10\n", tet_lines("4 ", 0, ""));
    let field = "FIELD FieldData 2\nTIME 1 1 double\n0.5\nname 1 1 string\nsome%20text\n\
                 METADATA\nINFORMATION 0\n\n";
    let text = vtk_head("4.2", "ASCII") + field + "POINTS 5 double\n" + &point_lines(None) + &cells;
    assert_is_sample(&read(&text).unwrap(), "field before points");
    let text = text
        .replace("DATASET UNSTRUCTURED_GRID\nFIELD", "FIELD")
        .replace("INFORMATION 0\n\n", "INFORMATION 0\n\nDATASET UNSTRUCTURED_GRID\n");
    assert_is_sample(&read(&text).unwrap(), "field before the data set");
}

#[test]
fn q16_binary_field_data_is_passed_over() {
    let field =
        b"FIELD FieldData 1\nTIME 1 1 double\n\x40\x0a\x0a\x0a\x0a\x0a\x0a\x0a\nPOINTS".to_vec();
    let bytes = vtk_binary(false);
    let at = crate::mesh_io::cursor::find(&bytes, b"POINTS").unwrap();
    let bytes = [&bytes[..at], &field, &bytes[at + 6..]].concat();
    assert_is_sample(&read(bytes).unwrap(), "binary field");
}

#[test]
fn q16_declarations_comments_and_padding_change_nothing() {
    let text = vtu_text(&point_lines(None), CONNECTIVITY, "4 8", "10 10");
    assert_is_sample(&read(&text).unwrap(), "no declaration, padded counts");
    let text = format!("<?xml version=\"1.0\"?>\n<!-- made > by hand -->\n{text}");
    assert_is_sample(&read(text).unwrap(), "declaration");
}

#[test]
fn pieces_are_joined() {
    let text = vtu_text(&point_lines(None), CONNECTIVITY, "4 8", "10 10");
    let (start, end) = (text.find("<Piece").unwrap(), text.find("</UnstructuredGrid>").unwrap());
    let twice = format!("{}{}{}", &text[..end], &text[start..end], &text[end..]);
    let file = read(twice).unwrap();
    assert_eq!((file.mesh.node_count(), file.mesh.tets().len()), (10, 4));
    assert_eq!(file.mesh.tets()[2], file.mesh.tets()[0].map(|node| node + 5));
}

#[test]
fn q17_counts_that_lie_name_array_expectation_and_finding() {
    let points = point_lines(None);
    let cases = [
        (
            vtu_text("0 0 0", CONNECTIVITY, "4 8", "10 10"),
            "array Points: expected 15 numbers, found 3",
        ),
        (
            vtu_text(&points, CONNECTIVITY, "4 8 12", "10 10"),
            "array offsets: expected 2 numbers, found 3",
        ),
        (vtu_text(&points, CONNECTIVITY, "4 8", "10"), "array types: expected 2 numbers, found 1"),
        (
            vtu_text(&points, "0 1 2 3 4 2 1", "4 8", "10 10"),
            "offset of cell 1 in connectivity: expected 4 to 7, found 8",
        ),
        (
            vtu_text(&points, "0 1 2 3 4 2 1 3 0", "4 8", "10 10"),
            "connectivity: expected 8, found 9",
        ),
        (
            vtu_text(&points, CONNECTIVITY, "5 8", "10 10"),
            "nodes of tetrahedron in cell 0: expected 4, found 5",
        ),
        (
            vtk_with_cells("CELLS 2 9\n4 0 1 2 3 4 4 2 1\n"),
            "CELLS: expected 2 cells, found 1 complete cells",
        ),
        (
            vtk_with_cells("CELLS 1 6\n4 0 1 2 3 4\n"),
            "CELLS: expected 6, found 1 numbers more than 1 cells have",
        ),
        (vtk_with_cells("CELLS 1 5\n4 0 1 2 3\nCELL_TYPES 0\n"), "cell types: expected 1, found 0"),
        (vtk_with_cells("CELLS 4000000000 4000000000\n"), "CELLS: expected 4000000000, found"),
    ];
    for (text, known) in cases {
        let error = refusal(text);
        assert!(error.starts_with("f: line ") && error.contains(known), "{error}");
    }
}

#[test]
fn a_wrong_word_in_an_array_names_its_line() {
    let text = vtu_text(&point_lines(None), "0 1 2 3\n4 2 x 3", "4 8", "10 10");
    let line = 1 + text[..text.find("2 x 3").unwrap()].matches('\n').count();
    assert_eq!(refusal(&text), format!("f: line {line}: expected an integer, found \"x\""));
}

#[test]
fn compression_that_is_not_read_is_named() {
    let text = vtu_text(&point_lines(None), CONNECTIVITY, "4 8", "10 10");
    let text = text.replace("version=\"0.1\"", "compressor=\"vtkLZMADataCompressor\"");
    assert!(refusal(text).contains("compression vtkLZMADataCompressor is not read here"));
    let index = "<VTKFile type=\"PUnstructuredGrid\"></VTKFile>";
    assert!(refusal(index).contains("a parallel index"));
}

#[test]
fn packed_lengths_that_lie_are_refused_before_unpacking() {
    // 2³² − 1 bytes announced, or as many blocks, or as many bytes out of one LZ4 block.
    let array = |compressor: &str, header: &[u32]| {
        let bytes: Vec<u8> = header.iter().flat_map(|v| v.to_le_bytes()).collect();
        let text = crate::mesh_io::encoding::encode(&bytes);
        let text = format!("{}AAAA", String::from_utf8(text).unwrap());
        vtu_text(&text, CONNECTIVITY, "4 8", "10 10")
            .replace("format=\"ascii\">AAA", "format=\"binary\">AAA")
            .replacen("format=\"ascii\"", "format=\"binary\"", 1)
            .replace("byte_order=\"BigEndian\"", compressor)
    };
    for text in [
        array("", &[u32::MAX]),
        array("compressor=\"vtkZLibDataCompressor\"", &[u32::MAX, 16, 0, 4]),
        array("compressor=\"vtkZLibDataCompressor\"", &[1, u32::MAX, 0, 3]),
        array("compressor=\"vtkLZ4DataCompressor\"", &[1, 1 << 30, 0, 3]),
    ] {
        assert!(refusal(text).contains("array Points: expected"));
    }
}

#[test]
fn many_pieces_on_one_array_do_not_multiply_it() {
    let piece = "<Piece><Points>\
                 <DataArray type=\"UInt8\" format=\"appended\" offset=\"0\"/></Points></Piece>";
    let file = |pieces: usize| {
        let mut bytes = format!(
            "<VTKFile type=\"UnstructuredGrid\" byte_order=\"LittleEndian\">{}\
             <AppendedData encoding=\"raw\">_",
            piece.repeat(pieces)
        )
        .into_bytes();
        bytes.extend(30_000_u32.to_le_bytes());
        bytes.extend(vec![1; 30_000]);
        bytes
    };
    assert_eq!(refusal(file(1)), "f: no tetrahedra: 10000 nodes and no cells");
    let error = refusal(file(20));
    assert!(error.contains("array Points: expected at most"), "{error}");
}

/// VTK itself reads the text of a `Float32` array into single precision; a reader that keeps more
/// digits models a slightly different object and differs in the seventh digit of every answer.
#[test]
fn text_of_a_float_array_has_the_values_of_single_precision() {
    let lines = point_lines(None).replacen('0', "0.1000000001", 1);
    let in_single = f64::from(0.1f32);
    let float = vtu_text(&lines, CONNECTIVITY, "4 8", "10 10").replace("Float64", "Float32");
    let cells = format!("CELLS 2 10\n{}CELL_TYPES 2\n10\n10\n", tet_lines("4 ", 0, ""));
    let legacy = format!("{}POINTS 5 float\n{lines}{cells}", vtk_head("4.2", "ASCII"));
    for text in [float, legacy.clone()] {
        assert_eq!(read(text).unwrap().mesh.vertices()[0].x, in_single);
    }
    let double = legacy.replace("5 float", "5 double");
    assert_eq!(read(double).unwrap().mesh.vertices()[0].x, 0.1000000001);
}
