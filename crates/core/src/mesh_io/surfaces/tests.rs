//! Each format gives the same surface; hostile bytes give an error or a surface, never a panic.

use nalgebra::{Point3, Vector3};
use proptest::prelude::*;

use super::{SurfaceFile, SurfaceFormat, parse_surface};
use crate::mesh_io::{Companion, MeshFileError, encoding};
use crate::surface::samples::cuboid;
use crate::surface::{MendedSurface, TriangleSurface};

/// A box of 1 × 2 × 3 whose coordinates are whole numbers, exact in every format.
fn solid() -> TriangleSurface {
    cuboid(Point3::new(-1.0, 0.0, 2.0), Vector3::new(1.0, 2.0, 3.0))
}

fn text(lines: impl Iterator<Item = String>) -> String {
    lines.collect::<Vec<_>>().join("\n")
}

fn stl_text() -> Vec<u8> {
    let facet = |t: usize| {
        let corners = solid().corners(t).map(|p| format!("vertex {} {} {}", p.x, p.y, p.z));
        format!("facet normal 0 0 0\nouter loop\n{}\nendloop\nendfacet", corners.join("\n"))
    };
    format!("solid a box\n{}\nendsolid a box\n", text((0..12).map(facet))).into_bytes()
}

fn stl_binary() -> Vec<u8> {
    let mut bytes = vec![b' '; 80];
    bytes[..5].copy_from_slice(b"solid");
    bytes.extend(12_u32.to_le_bytes());
    for t in 0..12 {
        bytes.extend([0; 12]);
        for p in solid().corners(t) {
            bytes.extend(p.iter().flat_map(|c| (*c as f32).to_le_bytes()));
        }
        bytes.extend([0; 2]);
    }
    bytes
}

fn obj() -> Vec<u8> {
    let points = text(solid().points().iter().map(|p| format!("v {} {} {}", p.x, p.y, p.z)));
    // The first face counts from the front, the others back from the newest point.
    let face = |(i, t): (usize, &[u32; 3])| match i {
        0 => format!("f {}/1/1 {}//2 {}", t[0] + 1, t[1] + 1, t[2] + 1),
        _ => format!("f {} {} {}", t[0] as i64 - 8, t[1] as i64 - 8, t[2] as i64 - 8),
    };
    let faces = text(solid().triangles().iter().enumerate().map(face));
    format!("# box\nmtllib box.mtl\no box\n{points}\nvn 0 0 1\ns off\n{faces}\nl 1 2\n")
        .into_bytes()
}

fn off() -> Vec<u8> {
    let points = text(solid().points().iter().map(|p| format!("{} {} {}", p.x, p.y, p.z)));
    let faces =
        text(solid().triangles().iter().map(|t| format!("3 {} {} {} 255 0 0", t[0], t[1], t[2])));
    format!("OFF # a box\n8 12 0\n{points}\n{faces}\n").into_bytes()
}

fn ply_header(encoding: &str) -> String {
    format!(
        "ply\nformat {encoding} 1.0\ncomment box\nelement vertex 8\nproperty double x\n\
         property uchar red\nproperty double y\nproperty double z\nelement face 12\n\
         property list uchar int vertex_indices\nend_header\n"
    )
}

fn ply_text() -> Vec<u8> {
    let points = text(solid().points().iter().map(|p| format!("{} 7 {} {}", p.x, p.y, p.z)));
    let faces = text(solid().triangles().iter().map(|t| format!("3 {} {} {}", t[0], t[1], t[2])));
    format!("{}{points}\n{faces}\n", ply_header("ascii")).into_bytes()
}

fn ply_binary(is_big: bool) -> Vec<u8> {
    let name = if is_big { "binary_big_endian" } else { "binary_little_endian" };
    let mut bytes = ply_header(name).into_bytes();
    let real = |v: f64| if is_big { v.to_be_bytes() } else { v.to_le_bytes() };
    let index = |v: u32| if is_big { v.to_be_bytes() } else { v.to_le_bytes() };
    for p in solid().points() {
        bytes.extend(real(p.x));
        bytes.push(7);
        bytes.extend(real(p.y));
        bytes.extend(real(p.z));
    }
    for t in solid().triangles() {
        bytes.push(3);
        bytes.extend(t.iter().flat_map(|n| index(*n)));
    }
    bytes
}

/// Indices, then points at half their size, which the node doubles; the second node moves them.
fn gltf_buffer() -> Vec<u8> {
    let indices = solid().triangles().concat().into_iter().flat_map(|n| (n as u16).to_le_bytes());
    let points = solid();
    let coordinates = points.points().iter().flat_map(|p| {
        [0.5 * (p.x - 10.0), 0.5 * p.y, 0.5 * p.z]
            .into_iter()
            .flat_map(|c| (c as f32).to_le_bytes())
    });
    indices.chain(coordinates).collect()
}

fn gltf_json(buffer: &str) -> String {
    format!(
        r#"{{"asset": {{"version": "2.0"}}, "scene": 0, "scenes": [{{"nodes": [1]}}],
        "nodes": [{{"mesh": 0, "scale": [2, 2, 2]}},
                  {{"children": [0], "translation": [10, 0, 0], "rotation": [0, 0, 0, 1]}}],
        "meshes": [{{"primitives": [{{"attributes": {{"POSITION": 1}}, "indices": 0}},
                                    {{"attributes": {{"POSITION": 1}}, "mode": 0}}]}}],
        "accessors": [{{"bufferView": 0, "componentType": 5123, "count": 36, "type": "SCALAR"}},
                      {{"bufferView": 1, "componentType": 5126, "count": 8, "type": "VEC3"}}],
        "bufferViews": [{{"buffer": 0, "byteLength": 72}},
                        {{"buffer": 0, "byteOffset": 72, "byteLength": 96, "byteStride": 12}}],
        "buffers": [{{"byteLength": 168{buffer}}}]}}"#
    )
}

fn gltf_embedded() -> Vec<u8> {
    let data = String::from_utf8(encoding::encode(&gltf_buffer())).unwrap();
    let uri = format!(r#", "uri": "data:application/octet-stream;base64,{data}""#);
    gltf_json(&uri).into_bytes()
}

fn glb() -> Vec<u8> {
    let mut json = gltf_json("").into_bytes();
    json.resize(json.len().next_multiple_of(4), b' ');
    let buffer = gltf_buffer();
    let mut bytes = b"glTF".to_vec();
    bytes.extend(2_u32.to_le_bytes());
    bytes.extend((28 + json.len() as u32 + buffer.len() as u32).to_le_bytes());
    bytes.extend((json.len() as u32).to_le_bytes());
    bytes.extend(b"JSON");
    bytes.extend(json);
    bytes.extend((buffer.len() as u32).to_le_bytes());
    bytes.extend(b"BIN\0");
    bytes.extend(buffer);
    bytes
}

fn samples() -> Vec<(SurfaceFormat, Vec<u8>)> {
    vec![
        (SurfaceFormat::Stl, stl_text()),
        (SurfaceFormat::Stl, stl_binary()),
        (SurfaceFormat::Obj, obj()),
        (SurfaceFormat::Off, off()),
        (SurfaceFormat::Ply, ply_text()),
        (SurfaceFormat::Ply, ply_binary(false)),
        (SurfaceFormat::Ply, ply_binary(true)),
        (SurfaceFormat::Gltf, gltf_embedded()),
        (SurfaceFormat::Gltf, glb()),
    ]
}

fn read(bytes: &[u8]) -> Result<SurfaceFile, MeshFileError> {
    parse_surface("sample", bytes, &mut |_| None)
}

#[test]
fn every_format_gives_the_same_box() {
    for (format, bytes) in samples() {
        let file = read(&bytes).unwrap();
        assert_eq!(file.format, format);
        let mended = MendedSurface::new(&file.surface).unwrap();
        assert!(mended.mending.is_closed(), "{format}");
        assert_eq!((mended.mending.turned, mended.mending.turned_shells), (0, 0), "{format}");
        assert_eq!(mended.surface.triangles().len(), 12, "{format}");
        assert!((mended.surface.signed_volume() - 6.0).abs() < 1e-12, "{format}");
        assert_eq!(mended.surface.bounds(), solid().bounds(), "{format}");
    }
}

#[test]
fn gltf_takes_its_buffer_from_the_file_beside_it() {
    let json = gltf_json(r#", "uri": "box.bin""#);
    let mut asked = Vec::new();
    let file = parse_surface("sample", json.as_bytes(), &mut |wanted| {
        asked.push(wanted.clone());
        Some(gltf_buffer())
    });
    assert_eq!(asked, [Companion::FileName("box.bin".to_owned())]);
    assert!((file.unwrap().surface.signed_volume() - 6.0).abs() < 1e-12);
    assert!(parse_surface("sample", json.as_bytes(), &mut |_| None).is_err());
}

#[test]
fn gltf_nodes_in_a_ring_are_refused() {
    let ring = r#"{"asset": {"version": "2.0"}, "scenes": [{"nodes": [0]}],
        "nodes": [{"children": [1]}, {"children": [0]}], "meshes": []}"#;
    assert!(read(ring.as_bytes()).unwrap_err().to_string().contains("node 0 twice"));
}

#[test]
fn polygons_become_fans() {
    let file = read(b"OFF\n4 1 0\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n4 0 1 2 3\n").unwrap();
    assert_eq!(file.surface.triangles(), [[0, 1, 2], [0, 2, 3]]);
    assert_eq!(file.notes, ["1 polygons were cut into fans of triangles"]);
}

#[test]
fn announced_counts_that_the_file_does_not_keep_are_refused_before_memory_is_taken() {
    let huge = "4000000000";
    for text in [
        format!("OFF\n{huge} 1 0\n0 0 0\n"),
        format!(
            "ply\nformat ascii 1.0\nelement vertex {huge}\nproperty float x\nproperty float y\n\
                 property float z\nend_header\n0 0 0\n"
        ),
        format!(
            "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\n\
                 property float z\nelement face 1\nproperty list uint int vertex_indices\n\
                 end_header\n0 0 0\n{huge} 0 0 0\n"
        ),
        format!("ply\nformat ascii 1.0\nelement nothing {huge}\nend_header\n"),
        gltf_json("").replace("36", huge),
        "f 1 2 99999999999999999999\nv 0 0 0\n".to_owned(),
        "v 0 0 0\nf 1 2 3\n".to_owned(),
        "v 0 0 0\nf 0 1 1\n".to_owned(),
        "v 0 0 0\nf 1 1 -2\n".to_owned(),
    ] {
        let error = read(text.as_bytes()).unwrap_err().to_string();
        assert!(!error.contains('\n'), "{error}");
    }
}

#[test]
fn a_surface_cut_anywhere_gives_an_error_or_a_surface() {
    for (_, bytes) in samples() {
        for length in 0..bytes.len() {
            if let Err(error) = read(&bytes[..length]) {
                assert!(!error.to_string().contains('\n'), "{error}");
            }
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(2000))]

    #[test]
    fn changed_bytes_of_surfaces_never_panic(
        which in 0_usize..9,
        changes in prop::collection::vec((0_usize..100_000, any::<u8>()), 1..6),
    ) {
        let (_, mut bytes) = samples().swap_remove(which);
        let length = bytes.len();
        for (at, byte) in changes {
            bytes[at % length] = byte;
        }
        if let Ok(file) = read(&bytes) {
            // What is read can be mended, whatever it is.
            let _ = MendedSurface::new(&file.surface);
        }
    }
}
