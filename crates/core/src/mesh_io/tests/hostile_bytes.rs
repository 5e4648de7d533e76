//! Bytes that are cut or changed give an error or a mesh, never a panic.

use proptest::prelude::*;

use super::samples::{Sample, samples};
use crate::mesh_io::{Format, MeshFile, parse};

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
