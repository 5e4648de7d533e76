//! The same mesh of two tetrahedra in every format and encoding that is read.

use std::fmt::Write;

use nalgebra::Point3;

use super::deck_quirks::deck;
use super::febio_quirks::febio;
use super::other_quirks::{meshb, netgen_sample};
use super::vtu_samples::vtu_samples;
use super::xdmf_quirks::xdmf;
use crate::mesh_io::{Format, MeshFile, MeshFileError, parse};

/// Coordinates of the sample; no number needs more than single precision.
pub(super) const POINTS: [[f64; 3]; 5] =
    [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.5], [1.0, 1.0, 0.25]];

/// Corners in the orientation of Gmsh and VTK.
pub(super) const TETS: [[usize; 4]; 2] = [[0, 1, 2, 3], [4, 2, 1, 3]];

/// A small file and what it is.
#[derive(Clone, Debug)]
pub(super) struct Sample {
    pub(super) label: &'static str,
    pub(super) format: Format,
    pub(super) bytes: Vec<u8>,
    /// The other half of a TetGen mesh.
    pub(super) companion: Option<Vec<u8>>,
}

impl Sample {
    pub(super) fn new(label: &'static str, format: Format, bytes: impl Into<Vec<u8>>) -> Self {
        Self { label, format, bytes: bytes.into(), companion: None }
    }

    pub(super) fn read(&self) -> Result<MeshFile, MeshFileError> {
        parse(self.label, &self.bytes, &mut |_| self.companion.clone())
    }
}

/// Reads a file that needs no other one.
pub(super) fn read(bytes: impl AsRef<[u8]>) -> Result<MeshFile, MeshFileError> {
    parse("f", bytes.as_ref(), &mut |_| None)
}

/// The error text of a file that cannot be used.
pub(super) fn refusal(bytes: impl AsRef<[u8]>) -> String {
    read(bytes).expect_err("this file is wrong").to_string()
}

/// Checks that a file gave the sample's nodes and tetrahedra and nothing had to be put right.
pub(super) fn assert_is_sample(file: &MeshFile, label: &str) {
    let points: Vec<_> = POINTS.iter().map(|&p| Point3::from(p)).collect();
    assert_eq!(file.mesh.vertices(), points, "{label}");
    // The mesh counts volume from its last corner, which mirrors the order of the files.
    let tets = TETS.map(|[a, b, c, d]| [a, b, d, c].map(|node| node as u32));
    assert_eq!(file.mesh.tets(), tets, "{label}");
    assert!(file.findings.flipped.is_empty(), "{label}");
    assert!(file.findings.degenerate.is_empty(), "{label}");
    assert_eq!((file.findings.file_nodes, file.findings.file_tets), (5, 2), "{label}");
}

/// Lines of labelled or bare points.
pub(super) fn point_lines(first_label: Option<usize>) -> String {
    let mut text = String::new();
    for (i, [x, y, z]) in POINTS.iter().enumerate() {
        if let Some(first) = first_label {
            write!(text, "{} ", i + first).unwrap();
        }
        writeln!(text, "{x} {y} {z}").unwrap();
    }
    text
}

/// Lines of tetrahedra: `prefix` with `#` replaced by the number from 1, nodes, `suffix`.
pub(super) fn tet_lines(prefix: &str, base: usize, suffix: &str) -> String {
    let mut text = String::new();
    for (i, tet) in TETS.iter().enumerate() {
        let [a, b, c, d] = tet.map(|node| node + base);
        let prefix = prefix.replace('#', &(i + 1).to_string());
        writeln!(text, "{prefix}{a} {b} {c} {d}{suffix}").unwrap();
    }
    text
}

/// MSH 2.2 text around the lines of `$Elements` (count included).
pub(super) fn msh2(elements: &str) -> String {
    let points = point_lines(Some(1));
    format!(
        "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n5\n{points}$EndNodes\n\
         $Elements\n{elements}$EndElements\n"
    )
}

/// MSH 4.1 text; `before` comes between format and nodes.
pub(super) fn msh41(before: &str) -> String {
    let (points, tets) = (point_lines(None), tet_lines("# ", 1, ""));
    format!(
        "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n{before}$Nodes\n1 5 1 5\n3 1 0 5\n1\n2\n3\n4\n5\n\
         {points}$EndNodes\n$Elements\n1 2 1 2\n3 1 4 2\n{tets}$EndElements\n"
    )
}

fn msh40() -> String {
    let (points, tets) = (point_lines(Some(1)), tet_lines("# ", 1, ""));
    format!(
        "$MeshFormat\n4 0 8\n$EndMeshFormat\n$Entities\n1 0 0 1\n1 0 0 0 0 0 0 0\n\
         1 0 0 0 1 1 1.5 1 9 0\n$EndEntities\n$Nodes\n1 5\n1 3 0 5\n{points}$EndNodes\n\
         $Elements\n1 2\n1 3 4 2\n{tets}$EndElements\n"
    )
}

/// Bytes of numbers in either byte order.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Order {
    Little,
    Big,
}

impl Order {
    pub(super) fn i32(self, value: i32) -> [u8; 4] {
        if self == Self::Little { value.to_le_bytes() } else { value.to_be_bytes() }
    }

    pub(super) fn u64(self, value: u64) -> [u8; 8] {
        if self == Self::Little { value.to_le_bytes() } else { value.to_be_bytes() }
    }

    pub(super) fn f64(self, value: f64) -> [u8; 8] {
        self.u64(value.to_bits())
    }
}

/// MSH 2.2 binary; `gap` is what stands between the binary one and the end mark.
pub(super) fn msh2_binary(order: Order, gap: &str) -> Vec<u8> {
    let mut out = b"$MeshFormat\n2.2 1 8\n".to_vec();
    out.extend(order.i32(1));
    out.extend(gap.bytes());
    out.extend(b"$EndMeshFormat\n$Nodes\n5\n");
    for (i, point) in POINTS.iter().enumerate() {
        // Label 10 begins with a byte that looks like a newline.
        out.extend(order.i32(10 + i as i32));
        point.iter().for_each(|&c| out.extend(order.f64(c)));
    }
    out.extend(b"\n$EndNodes\n$Elements\n3\n");
    for value in [15, 1, 2, 1, 0, 1, 10, 4, 2, 2] {
        out.extend(order.i32(value));
    }
    for (i, tet) in TETS.iter().enumerate() {
        [i as i32 + 2, 0, 1].iter().for_each(|&value| out.extend(order.i32(value)));
        tet.iter().for_each(|&node| out.extend(order.i32(node as i32 + 10)));
    }
    out.extend(b"\n$EndElements\n");
    out
}

/// MSH 4.1 binary with entities.
pub(super) fn msh41_binary(order: Order) -> Vec<u8> {
    let mut out = b"$MeshFormat\n4.1 1 8\n".to_vec();
    out.extend(order.i32(1));
    out.extend(b"\n$EndMeshFormat\n$Entities\n");
    [1, 0, 0, 1].iter().for_each(|&count| out.extend(order.u64(count)));
    out.extend(order.i32(1));
    [0.0; 3].iter().for_each(|&c| out.extend(order.f64(c)));
    out.extend(order.u64(0));
    out.extend(order.i32(1));
    [0.0; 6].iter().for_each(|&c| out.extend(order.f64(c)));
    out.extend(order.u64(1));
    out.extend(order.i32(7));
    out.extend(order.u64(0));
    out.extend(b"\n$EndEntities\n$Nodes\n");
    [1, 5, 1, 5].iter().for_each(|&count| out.extend(order.u64(count)));
    [3, 1, 0].iter().for_each(|&value| out.extend(order.i32(value)));
    [5, 1, 2, 3, 4, 5].iter().for_each(|&value| out.extend(order.u64(value)));
    POINTS.as_flattened().iter().for_each(|&c| out.extend(order.f64(c)));
    out.extend(b"\n$EndNodes\n$Elements\n");
    [1, 2, 1, 2].iter().for_each(|&count| out.extend(order.u64(count)));
    [3, 1, 4].iter().for_each(|&value| out.extend(order.i32(value)));
    out.extend(order.u64(2));
    for (i, tet) in TETS.iter().enumerate() {
        out.extend(order.u64(i as u64 + 1));
        tet.iter().for_each(|&node| out.extend(order.u64(node as u64 + 1)));
    }
    out.extend(b"\n$EndElements\n");
    out
}

/// VTK legacy header lines, up to the points.
pub(super) fn vtk_head(version: &str, encoding: &str) -> String {
    format!("# vtk DataFile Version {version}\ntitle\n{encoding}\nDATASET UNSTRUCTURED_GRID\n")
}

fn vtk_text() -> String {
    let (points, cells) = (point_lines(None), tet_lines("4 ", 0, ""));
    format!(
        "{}POINTS 5 double\n{points}\nCELLS 2 10\n{cells}\nCELL_TYPES 2\n10\n10\n",
        vtk_head("2.0", "ASCII")
    )
}

fn vtk_text_51() -> String {
    let (points, cells) = (point_lines(None), tet_lines("", 0, ""));
    format!(
        "{}POINTS 5 float\n{points}METADATA\nINFORMATION 1\nNAME L2_NORM_RANGE LOCATION \
         vtkDataArray\nDATA 2 0 1.7\n\nCELLS 3 8\nOFFSETS vtktypeint64\n0 4 8\n\
         CONNECTIVITY vtktypeint64\n{cells}CELL_TYPES 2\n10\n10\n\nCELL_DATA 2\nSCALARS m int\n",
        vtk_head("5.1", "ASCII")
    )
}

/// VTK legacy binary, `float` points; `new` for version 5.1 with offsets.
pub(super) fn vtk_binary(new: bool) -> Vec<u8> {
    let mut out = vtk_head(if new { "5.1" } else { "3.0" }, "BINARY").into_bytes();
    out.extend(b"POINTS 5 float\n");
    POINTS.as_flattened().iter().for_each(|&c| out.extend((c as f32).to_be_bytes()));
    if new {
        out.extend(b"\nCELLS 3 8\nOFFSETS vtktypeint64\n");
        [0_i64, 4, 8].iter().for_each(|v| out.extend(v.to_be_bytes()));
        out.extend(b"\nCONNECTIVITY vtktypeint64\n");
        TETS.as_flattened().iter().for_each(|&v| out.extend((v as i64).to_be_bytes()));
    } else {
        out.extend(b"\nCELLS 2 10\n");
        for tet in TETS {
            out.extend(4_i32.to_be_bytes());
            tet.iter().for_each(|&v| out.extend((v as i32).to_be_bytes()));
        }
    }
    out.extend(b"\nCELL_TYPES 2\n");
    [10_i32; 2].iter().for_each(|v| out.extend(v.to_be_bytes()));
    out.push(b'\n');
    out
}

/// The sample in every format and encoding.
pub(super) fn samples() -> Vec<Sample> {
    let points = point_lines(Some(1));
    let msh1 = tet_lines("# 4 1 1 4 ", 1, "");
    let msh1 = format!("$NOD\n5\n{points}$ENDNOD\n$ELM\n2\n{msh1}$ENDELM\n");
    let node = format!("5 3 0 0\n{points}# Generated by tetgen\n");
    let ele = format!("2 4 0\n{}", tet_lines("# ", 1, ""));
    let medit = point_lines(None).replace('\n', " 0\n");
    let medit = format!(
        "MeshVersionFormatted 2\nDimension 3\nVertices\n5\n{medit}\nTetrahedra\n2\n{}End\n",
        tet_lines("", 1, " 3")
    );
    let tets = tet_lines("# ", 1, "");
    let vega = format!("# v\n*VERTICES\n5 3 0 0\n{points}\n*ELEMENTS\nTET\n2 4 0\n{tets}");
    let vertices: String = point_lines(None).lines().map(|line| format!("v {line}\n")).collect();
    let tet = format!("{vertices}{}", tet_lines("t ", 0, ""));
    // The lists keep the order of the mesh, which counts volume from the last corner.
    let lists = format!(
        "softgrasp-lists 1\nvertices 5\n{}elements 2\n0 1 3 2\n4 2 3 1\ndisplay 1\n0 2 1\n",
        point_lines(None)
    );
    let mut samples = vec![
        Sample::new("MSH 1", Format::GmshMsh1, msh1),
        Sample::new(
            "MSH 2 text",
            Format::GmshMsh2Ascii,
            msh2(&format!("2\n{}", tet_lines("# 4 2 0 1 ", 1, ""))),
        ),
        Sample::new("MSH 2 binary", Format::GmshMsh2Binary, msh2_binary(Order::Little, "\n")),
        Sample::new("MSH 2 binary big", Format::GmshMsh2Binary, msh2_binary(Order::Big, "\n")),
        Sample::new("MSH 4.1 text", Format::GmshMsh4Ascii, msh41("")),
        Sample::new("MSH 4.0 text", Format::GmshMsh4Ascii, msh40()),
        Sample::new("MSH 4.1 binary", Format::GmshMsh4Binary, msh41_binary(Order::Little)),
        Sample::new("MSH 4.1 binary big", Format::GmshMsh4Binary, msh41_binary(Order::Big)),
        Sample::new("VTK text", Format::VtkLegacy, vtk_text()),
        Sample::new("VTK 5.1 text", Format::VtkLegacy, vtk_text_51()),
        Sample::new("VTK binary", Format::VtkLegacy, vtk_binary(false)),
        Sample::new("VTK 5.1 binary", Format::VtkLegacy, vtk_binary(true)),
        Sample {
            companion: Some(ele.clone().into()),
            ..Sample::new("a.node", Format::TetGen, node.clone())
        },
        Sample { companion: Some(node.into()), ..Sample::new("a.ele", Format::TetGen, ele) },
        Sample::new("MEDIT", Format::Medit, medit),
        Sample::new("meshb 1", Format::MeditBinary, meshb(1, Order::Little, false)),
        Sample::new("meshb 4", Format::MeditBinary, meshb(4, Order::Big, false)),
        Sample::new("Netgen", Format::Netgen, netgen_sample()),
        Sample::new("FEBio", Format::Febio, febio()),
        Sample::new("XDMF", Format::Xdmf, xdmf()),
        Sample::new("deck", Format::Deck, deck("")),
        Sample::new("Vega", Format::Vega, vega),
        Sample::new(".tet", Format::Tet, tet),
        Sample::new("lists", Format::ThesisLists, lists),
    ];
    samples.extend(vtu_samples());
    samples
}

#[test]
fn one_mesh_comes_out_of_every_format() {
    for sample in samples() {
        let file = sample.read().unwrap();
        assert_eq!(file.format, sample.format, "{}", sample.label);
        assert_is_sample(&file, sample.label);
    }
}

#[test]
fn carriage_returns_tabs_and_fortran_exponents_change_nothing() {
    for mut sample in samples() {
        let Ok(text) = String::from_utf8(sample.bytes.clone()) else { continue };
        let is_binary =
            text.contains("\n2.2 1 8") || text.contains("BINARY") || text.contains("appended");
        if is_binary {
            continue;
        }
        let crlf = text.replace('\n', "\r\n");
        sample.bytes = crlf.clone().into();
        assert_is_sample(&sample.read().unwrap(), sample.label);
        if !matches!(sample.format, Format::Vtu | Format::VtkLegacy) {
            // Names such as "Generated by tetgen" stay as they are: comments.
            sample.bytes = crlf.replace(' ', " \t ").replace("1.5", "0.15D+01").into();
            assert_is_sample(&sample.read().unwrap(), sample.label);
        }
    }
}
