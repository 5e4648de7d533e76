//! glTF 2.0, as JSON with buffers beside or inside it, or as one binary file (GLB).

use nalgebra::{Matrix4, Point3, Quaternion, Transform3, Translation3, UnitQuaternion, Vector3};
use serde_json::Value;

use super::raw_surface::RawSurface;
use crate::mesh_io::cursor::Cursor;
use crate::mesh_io::error::MeshFileError;
use crate::mesh_io::scalar::{ByteOrder, Scalar};
use crate::mesh_io::{Companion, encoding};

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
            let is_mirrored = is_mirror(&world_from_mesh);
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

/// Whether a transform mirrors, which turns the triangles; mending would see it only where other meshes
/// join.
fn is_mirror(world_from_mesh: &Transform3<f64>) -> bool {
    world_from_mesh.matrix().fixed_view::<3, 3>(0, 0).determinant() < 0.0
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
                    encoding::decode(text.as_bytes(), usize::MAX)
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

/// The buffers, and the text that says what lies where in them.
pub(super) struct Buffers<'a> {
    pub(super) json: &'a Value,
    pub(super) data: &'a [Vec<u8>],
    pub(super) cursor: &'a Cursor<'a>,
}

impl Buffers<'_> {
    /// Points of an accessor of three single precision numbers each.
    pub(super) fn points(&self, accessor: u64) -> Result<Vec<Point3<f64>>, MeshFileError> {
        let about = self.entry("accessors", Some(accessor))?;
        if about["type"] != "VEC3" || about["componentType"].as_u64() != Some(5126) {
            return Err(self.cursor.unsupported("glTF positions other than three floats"));
        }
        let records = self.records(about, 12)?;
        Ok(records
            .map(|bytes| Point3::from_slice(&Scalar::F32.reals(bytes, ByteOrder::Little)))
            .collect())
    }

    /// Indices of an accessor of whole numbers of any size.
    pub(super) fn indices(&self, accessor: u64) -> Result<Vec<u32>, MeshFileError> {
        let about = self.entry("accessors", Some(accessor))?;
        let kind = match about["componentType"].as_u64() {
            Some(5121) => Scalar::U8,
            Some(5123) => Scalar::U16,
            Some(5125) => Scalar::U32,
            _ => return Err(self.cursor.unsupported("glTF indices other than whole numbers")),
        };
        let records = self.records(about, kind.bytes())?;
        let index = |bytes| {
            let values = kind.integers(bytes, ByteOrder::Little);
            values.first().and_then(|v| u32::try_from(*v).ok()).unwrap_or(u32::MAX)
        };
        Ok(records.map(index).collect())
    }

    /// The bytes of each record of an accessor, `length` of them each; checked against the buffer
    /// before anything is made.
    fn records(
        &self,
        about: &Value,
        length: usize,
    ) -> Result<impl Iterator<Item = &[u8]>, MeshFileError> {
        if about.get("sparse").is_some() {
            return Err(self.cursor.unsupported("a sparse glTF accessor"));
        }
        let view = self.entry("bufferViews", about["bufferView"].as_u64())?;
        let buffer = usize_of(&view["buffer"]).and_then(|b| self.data.get(b));
        let number = |value: &Value| if value.is_null() { Some(0) } else { usize_of(value) };
        let stride = match view.get("byteStride") {
            Some(stride) => usize_of(stride).filter(|s| *s >= length),
            None => Some(length),
        };
        let count = usize_of(&about["count"]);
        let offset = number(&view["byteOffset"])
            .zip(number(&about["byteOffset"]))
            .and_then(|(view, own)| view.checked_add(own));
        let whole = (|| {
            let (count, stride, offset) = (count?, stride?, offset?);
            let bytes = buffer?.get(offset..)?;
            let needed = match count {
                0 => 0,
                _ => (count - 1).checked_mul(stride)?.checked_add(length)?,
            };
            Some(bytes.get(..needed)?.chunks(stride))
        })();
        let whole = whole.ok_or_else(|| {
            self.cursor.count_fault(
                "a glTF accessor",
                &format!("{} records of {length} bytes", about["count"]),
                &format!("a buffer of {} bytes", buffer.map_or(0, Vec::len)),
            )
        })?;
        Ok(whole.filter_map(move |record| record.get(..length)))
    }

    fn entry(&self, list: &str, index: Option<u64>) -> Result<&Value, MeshFileError> {
        let found = index
            .and_then(|i| usize::try_from(i).ok())
            .and_then(|i| self.json[list].as_array()?.get(i));
        found.ok_or_else(|| {
            let index = index.map_or("none".to_owned(), |i| i.to_string());
            self.cursor.count_fault(list, &format!("an entry {index}"), "no such entry")
        })
    }
}

fn usize_of(value: &Value) -> Option<usize> {
    value.as_u64().and_then(|n| usize::try_from(n).ok())
}

/// The meshes of the scene by index, each with the transform of its nodes. Without a scene all nodes
/// that no other has as a child are its roots; without nodes every mesh is where it was drawn.
pub(super) fn placed_meshes(
    json: &Value,
    cursor: &Cursor,
) -> Result<Vec<(usize, Transform3<f64>)>, MeshFileError> {
    let empty = Vec::new();
    let nodes = json["nodes"].as_array().unwrap_or(&empty);
    let meshes = json["meshes"].as_array().map_or(0, Vec::len);
    if nodes.is_empty() {
        return Ok((0..meshes).map(|mesh| (mesh, Transform3::identity())).collect());
    }
    let scene = json["scene"].as_u64().and_then(|s| usize::try_from(s).ok()).unwrap_or(0);
    let roots = match json["scenes"].as_array().and_then(|scenes| scenes.get(scene)) {
        Some(scene) => indices(&scene["nodes"]),
        None => {
            let children: Vec<usize> = nodes.iter().flat_map(|n| indices(&n["children"])).collect();
            (0..nodes.len()).filter(|n| !children.contains(n)).collect()
        }
    };
    let mut placed = Vec::new();
    let mut is_seen = vec![false; nodes.len()];
    let mut waiting: Vec<(usize, Transform3<f64>)> =
        roots.into_iter().rev().map(|node| (node, Transform3::identity())).collect();
    while let Some((index, world_from_parent)) = waiting.pop() {
        let Some(node) = nodes.get(index) else {
            return Err(cursor.count_fault("nodes", &format!("a node {index}"), "no such node"));
        };
        // Nodes form trees; one that comes again would go round for ever.
        if std::mem::replace(&mut is_seen[index], true) {
            return Err(cursor.count_fault(
                "nodes",
                "trees of nodes",
                &format!("node {index} twice"),
            ));
        }
        let Some(parent_from_node) = transform(node) else {
            return Err(cursor.unsupported(&format!("the transform of node {index}")));
        };
        let world_from_node = world_from_parent * parent_from_node;
        if let Some(mesh) = node["mesh"].as_u64().and_then(|m| usize::try_from(m).ok()) {
            placed.push((mesh, world_from_node));
        }
        let children = indices(&node["children"]);
        waiting.extend(children.into_iter().rev().map(|child| (child, world_from_node)));
    }
    Ok(placed)
}

/// Transform of a node: a matrix by columns, or translation, rotation (x, y, z, w) and scale.
fn transform(node: &Value) -> Option<Transform3<f64>> {
    if node.get("matrix").is_some() {
        let matrix = Matrix4::from_column_slice(&numbers::<16>(&node["matrix"])?);
        return Some(Transform3::from_matrix_unchecked(matrix));
    }
    let or = |key: &str, default: &[f64]| match node.get(key) {
        None => Some(default.to_vec()),
        Some(value) if default.len() == 4 => numbers::<4>(value).map(|n| n.to_vec()),
        Some(value) => numbers::<3>(value).map(|n| n.to_vec()),
    };
    let move_by = Vector3::from_column_slice(&or("translation", &[0.0; 3])?);
    let turn = or("rotation", &[0.0, 0.0, 0.0, 1.0])?;
    let scale = Vector3::from_column_slice(&or("scale", &[1.0; 3])?);
    let turn = UnitQuaternion::try_new(Quaternion::new(turn[3], turn[0], turn[1], turn[2]), 1e-6)?;
    let matrix = Translation3::from(move_by).to_homogeneous()
        * turn.to_homogeneous()
        * Matrix4::new_nonuniform_scaling(&scale);
    Some(Transform3::from_matrix_unchecked(matrix))
}

fn numbers<const N: usize>(value: &Value) -> Option<[f64; N]> {
    let values: Option<Vec<f64>> = value.as_array()?.iter().map(Value::as_f64).collect();
    values?.try_into().ok()
}

fn indices(list: &Value) -> Vec<usize> {
    let index = |v: &Value| v.as_u64().and_then(|n| usize::try_from(n).ok());
    list.as_array().into_iter().flatten().filter_map(index).collect()
}
