//! Nodes of a glTF scene: which meshes it shows, and where.

use nalgebra::{Matrix4, Quaternion, Transform3, Translation3, UnitQuaternion, Vector3};
use serde_json::Value;

use crate::mesh_io::cursor::Cursor;
use crate::mesh_io::error::MeshFileError;

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
