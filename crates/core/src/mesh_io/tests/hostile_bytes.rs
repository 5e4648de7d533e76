//! Damaged and hostile bytes, packed ones among them.

use std::io::Write;

use flate2::Compression;
use flate2::write::GzEncoder;
use proptest::prelude::*;

use super::samples::{Sample, assert_is_sample, read, samples};
use crate::mesh_io::{
    Format, MeshFile, SurfaceFormat, parse, parse_surface, sniff, surface_format,
};

/// What must hold of every mesh that comes out, whatever went in.
fn check(file: &MeshFile) {
    let findings = &file.findings;
    let kept = findings.file_tets - findings.degenerate.len() - findings.repeated.len();
    assert_eq!(file.mesh.tets().len(), kept);
    assert_eq!(file.mesh.node_count(), file.findings.file_nodes);
    for tet in 0..kept {
        assert!(file.mesh.signed_volume(tet) > 0.0);
    }
}

#[test]
fn a_file_cut_anywhere_gives_an_error_or_a_mesh() {
    for sample in samples() {
        for length in 0..sample.bytes.len() {
            let cut = Sample { bytes: sample.bytes[..length].to_vec(), ..sample.clone() };
            match cut.read() {
                Ok(file) => check(&file),
                Err(error) => assert!(!error.to_string().contains('\n'), "{error}"),
            }
        }
    }
}

#[test]
fn a_companion_cut_anywhere_gives_an_error_or_a_mesh() {
    for sample in samples().into_iter().filter(|s| s.format == Format::TetGen) {
        let whole = sample.companion.clone().unwrap();
        for length in 0..whole.len() {
            let cut = Sample { companion: Some(whole[..length].to_vec()), ..sample.clone() };
            let _ = cut.read().map(|file| check(&file));
        }
    }
}

#[test]
fn a_file_cut_before_its_last_element_is_never_taken_for_whole() {
    // The lists of TetGen, MEDIT and the thesis announce their lengths; .tet does not.
    for sample in samples().into_iter().filter(|s| s.format != Format::Tet) {
        // Up to here no format is past its last tetrahedron.
        let length = sample.bytes.len() / 2;
        let cut = Sample { bytes: sample.bytes[..length].to_vec(), ..sample.clone() };
        assert!(cut.read().is_err(), "{}", sample.label);
    }
}

/// Words that numbers of a file are replaced by.
const WORDS: [&str; 10] = [
    "0",
    "-1",
    "4294967295",
    "9223372036854775807",
    "-9223372036854775808",
    "18446744073709551616",
    "1e308",
    "nan",
    "",
    "$End",
];

#[test]
fn a_number_replaced_by_an_odd_one_gives_an_error_or_a_mesh() {
    for sample in samples() {
        let is_number = |i: usize| sample.bytes[i].is_ascii_digit() || sample.bytes[i] == b'.';
        let starts = (1..sample.bytes.len()).filter(|&i| is_number(i) && !is_number(i - 1));
        for start in starts.take(60) {
            let end = (start..sample.bytes.len()).find(|&i| !is_number(i));
            let end = end.unwrap_or(sample.bytes.len());
            for word in WORDS {
                let (before, after) = (&sample.bytes[..start], &sample.bytes[end..]);
                let bytes = [before, word.as_bytes(), after].concat();
                let _ = Sample { bytes, ..sample.clone() }.read().map(|file| check(&file));
            }
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(2000))]

    #[test]
    fn changed_bytes_never_panic(
        which in 0_usize..1000,
        changes in prop::collection::vec((0_usize..100_000, any::<u8>()), 1..6),
    ) {
        let samples = samples();
        let mut sample = samples[which % samples.len()].clone();
        let length = sample.bytes.len();
        for (at, byte) in changes {
            sample.bytes[at % length] = byte;
        }
        if let Ok(file) = sample.read() {
            check(&file);
        }
    }

    #[test]
    fn noise_never_panics(
        start in prop::sample::select(vec![
            "", "$MeshFormat\n2.2 1 8\n\u{1}\0\0\0$EndMeshFormat\n", "$NOD\n", "v 0 0 0\n",
            "# vtk DataFile Version 5.1\n\nBINARY\nDATASET UNSTRUCTURED_GRID\n", "<VTKFile ",
            "MeshVersionFormatted 1\n", "*VERTICES\n", "4 3 0 0\n", "softgrasp-lists 1\n", "mesh3d\nvolumeelements\n",
            "<febio_spec><Nodes>", "\u{1}\0\0\0\u{3}\0\0\0",
            "<Xdmf><Grid><Geometry><DataItem Format=\"Binary\">a</DataItem></Geometry><Topology>",
            "*NODE\n1,0,0,0\n*ELEMENT,TYPE=C3D4,ELSET=a\n1,1,1,1,1\n*ELSET,ELSET=b,GENERATE\n",
        ]),
        noise in prop::collection::vec(any::<u8>(), 0..200),
    ) {
        let bytes = [start.as_bytes(), &noise].concat();
        if let Ok(file) = parse("noise", &bytes, &mut |_| Some(noise.clone())) {
            check(&file);
        }
    }
}

/// Bytes as gzip packs them.
pub(super) fn packed(bytes: &[u8]) -> Vec<u8> {
    let mut encoder = GzEncoder::new(Vec::new(), Compression::default());
    encoder.write_all(bytes).unwrap();
    encoder.finish().unwrap()
}

#[test]
fn every_format_is_read_packed_as_well() {
    for sample in samples() {
        let bytes = packed(&sample.bytes);
        assert_eq!(sniff(&bytes), sniff(&sample.bytes), "{}", sample.label);
        let other = sample.companion.as_deref().map(packed);
        let file = parse(sample.label, &bytes, &mut |_| other.clone()).unwrap();
        assert_is_sample(&file, sample.label);
        assert_eq!(file.format, sample.format);
        assert!(file.findings.notes.iter().any(|note| note == "unpacked from gzip"));
    }
}

#[test]
fn packed_surfaces_are_surfaces() {
    let mut stl = vec![b's'; 80];
    stl.extend(4_000_u32.to_le_bytes());
    stl.extend([0; 50 * 4_000]);
    assert_eq!(surface_format(&packed(&stl)), Some(SurfaceFormat::Stl));
    let off =
        packed(b"OFF\n4 4 6\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n3 0 2 1\n3 0 1 3\n3 1 2 3\n3 0 3 2\n");
    assert_eq!(parse_surface("f", &off, &mut |_| None).unwrap().format, SurfaceFormat::Off);
}

#[test]
fn damaged_and_doubly_packed_files_are_refused() {
    let error = read(b"\x1f\x8b\x08\0").unwrap_err().to_string();
    assert!(error.starts_with("f: byte 0: expected sound gzip data, found "), "{error}");
    let error = read(packed(&packed(b"v 0 0 0\n"))).unwrap_err().to_string();
    assert!(error.contains("this is a gzip file inside another one, which is not read"), "{error}");
    assert_eq!(read(packed(b" ")).unwrap_err().to_string(), "f: the file is empty");
    let tetgen = samples().into_iter().find(|s| s.format == Format::TetGen).unwrap();
    let damaged = packed(&tetgen.companion.unwrap())[..30].to_vec();
    let error = parse("a", &tetgen.bytes, &mut |_| Some(damaged.clone())).unwrap_err().to_string();
    assert!(error.contains("expected sound gzip data"), "{error}");
}
