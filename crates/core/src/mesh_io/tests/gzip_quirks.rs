//! Tests of meshes and surfaces that gzip packed.

use std::io::Write;

use flate2::Compression;
use flate2::write::GzEncoder;

use super::samples::{assert_is_sample, read, samples};
use crate::mesh_io::{Format, SurfaceFormat, parse, parse_surface, sniff, surface_format};

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
