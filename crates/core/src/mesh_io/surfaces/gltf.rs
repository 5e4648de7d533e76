//! glTF 2.0, as JSON with buffers beside or inside it, or as one binary file (GLB).

use nalgebra::Point3;
use serde_json::Value;

use super::gltf_accessor::Buffers;
use super::gltf_nodes::placed_meshes;
use super::raw_surface::RawSurface;
use crate::mesh_io::cursor::Cursor;
use crate::mesh_io::error::MeshFileError;
use crate::mesh_io::{Companion, base64};

/// Triangles that are read at most, so that one mesh placed many times does not fill the memory.
const TRIANGLES_MAX: usize = 20_000_000;

/// Reads the triangles of all meshes in the scene, each where its nodes put it.
pub(super) fn read(
    name: &str,
    bytes: &[u8],
    companion: &mut dyn FnMut(&Companion) -> Option<Vec<u8>>,
) -> Result<RawSurface, MeshFileError> {
    let (text, binary) = parts(name, bytes)?;
    let whole = Cursor::new(name, text);
    let json: Value = serde_json::from_slice(text)
        .map_err(|e| whole.expected_instead("JSON of glTF", e.to_string().as_bytes()))?;
    let buffers = load_buffers(&json, binary, companion, &whole)?;
    let buffers = Buffers { json: &json, data: &buffers, cursor: &whole };
    let mut raw = RawSurface::default();
    let mut other_modes = 0;
    for (mesh, world_from_mesh) in placed_meshes(&json, &whole)? {
        let primitives = json["meshes"][mesh]["primitives"].as_array();
        for primitive in primitives.into_iter().flatten() {
            if primitive["extensions"].get("KHR_draco_mesh_compression").is_some() {
                return Err(whole.unsupported("glTF with Draco compression"));
            }
            let mode = primitive["mode"].as_u64().unwrap_or(4);
            let Some(position) = primitive["attributes"]["POSITION"].as_u64() else { continue };
            if !(4..=6).contains(&mode) {
                other_modes += 1;
                continue;
            }
            let points = buffers.points(position)?;
            let corners = match primitive["indices"].as_u64() {
                Some(accessor) => buffers.indices(accessor)?,
                None => (0..points.len() as u32).collect(),
            };
            let first = raw.points.len() as u32;
            if raw.points.len() + points.len() > TRIANGLES_MAX
                || raw.triangles.len() + corners.len() > TRIANGLES_MAX
            {
                return Err(whole.unsupported("a scene of more than 20 million triangles"));
            }
            let place = |p: &Point3<f64>| world_from_mesh.transform_point(p);
            raw.points.extend(points.iter().map(place));
            let count = points.len() as u32;
            // A transform that mirrors turns the triangles; mending would see it only where other
            // meshes join.
            let is_mirrored = world_from_mesh.matrix().fixed_view::<3, 3>(0, 0).determinant() < 0.0;
            for mut triangle in triangles(mode, &corners) {
                if let Some(&far) = triangle.iter().find(|n| **n >= count) {
                    return Err(whole.count_fault(
                        "points of a glTF primitive",
                        &format!("more than {far}"),
                        &count.to_string(),
                    ));
                }
                if is_mirrored {
                    triangle.swap(1, 2);
                }
                raw.triangles.push(triangle.map(|n| first + n));
            }
        }
    }
    if other_modes > 0 {
        raw.notes.push(format!("{other_modes} primitives of points or lines were left out"));
    }
    Ok(raw)
}

/// The JSON text, and the buffer of a binary file.
fn parts<'a>(
    name: &'a str,
    bytes: &'a [u8],
) -> Result<(&'a [u8], Option<&'a [u8]>), MeshFileError> {
    if !bytes.starts_with(b"glTF") {
        return Ok((bytes, None));
    }
    let mut cursor = Cursor::new(name, bytes);
    cursor.set_binary(true);
    cursor.take(4, "the word glTF")?;
    let version = u32::from_le_bytes(cursor.take_array("the version")?);
    if version != 2 {
        return Err(cursor.unsupported(&format!("glTF of version {version}")));
    }
    cursor.take(4, "the length of the file")?;
    let mut text = None;
    let mut binary = None;
    while cursor.rest().len() >= 8 {
        let length = u32::from_le_bytes(cursor.take_array("the length of a chunk")?) as usize;
        let kind: [u8; 4] = cursor.take_array("the kind of a chunk")?;
        let chunk = cursor.take(length, "bytes of a chunk")?;
        match &kind {
            b"JSON" => text = text.or(Some(chunk)),
            b"BIN\0" => binary = binary.or(Some(chunk)),
            _ => {}
        }
    }
    text.map(|text| (text, binary)).ok_or_else(|| cursor.expected("a chunk of JSON"))
}

/// Bytes of every buffer: the binary chunk, base64 in the text, or a file beside.
fn load_buffers(
    json: &Value,
    binary: Option<&[u8]>,
    companion: &mut dyn FnMut(&Companion) -> Option<Vec<u8>>,
    cursor: &Cursor,
) -> Result<Vec<Vec<u8>>, MeshFileError> {
    let mut loaded = Vec::new();
    for buffer in json["buffers"].as_array().into_iter().flatten() {
        let bytes = match buffer["uri"].as_str() {
            None => binary.unwrap_or_default().to_vec(),
            Some(uri) => match uri.strip_prefix("data:") {
                Some(data) => {
                    let text = data.split_once(";base64,").map(|(_, text)| text);
                    let text = text.ok_or_else(|| cursor.unsupported("a buffer without base64"))?;
                    base64::decode(text.as_bytes(), usize::MAX)
                }
                None => {
                    let wanted = Companion::FileName(uri.to_owned());
                    companion(&wanted).ok_or_else(|| {
                        cursor.fault(crate::mesh_io::Fault::MissingCompanion { companion: wanted })
                    })?
                }
            },
        };
        loaded.push(bytes);
    }
    Ok(loaded)
}

/// Triangles of a list (4), strip (5) or fan (6).
fn triangles(mode: u64, corners: &[u32]) -> Vec<[u32; 3]> {
    match mode {
        5 => corners
            .windows(3)
            .enumerate()
            .map(|(i, w)| if i % 2 == 0 { [w[0], w[1], w[2]] } else { [w[1], w[0], w[2]] })
            .collect(),
        6 => match corners {
            [first, rest @ ..] => rest.windows(2).map(|w| [*first, w[0], w[1]]).collect(),
            [] => Vec::new(),
        },
        _ => corners.chunks_exact(3).map(|w| [w[0], w[1], w[2]]).collect(),
    }
}
