//! The exact test at the leaves: which vertices a fingertip or segment contains (thesis 4.4.4).

use std::ops::ControlFlow;

use nalgebra::{Point3, Vector3};

use super::node::TreeError;
use super::overlap::sphere_meets_sphere;
use super::tree::SphereTree;
use crate::shape::Sphere;

/// A surface vertex a fingertip is in contact with.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ContactHit {
    /// Number of the mesh node.
    pub node: u32,
    /// Distance from the vertex to the fingertip's contact point (|D| of 4.10), m.
    pub distance: f64,
    /// Unit vertex normal N of (4.10), in the frame of the tree.
    pub normal: Vector3<f64>,
}

/// Most vertices that are offered per fingertip: five tips can always take five different ones.
pub const TIP_HITS_MAX: usize = 5;

/// Vertices a fingertip is inside of, nearest to its contact point first; empty when it is outside.
///
/// Among the leaves that `tip` meets, the vertex nearest to `contact_point` decides: the tip is
/// inside if R = D · N ≤ 0 there, with D from the vertex to the contact point. The others follow as
/// alternatives if they agree. A vertex without a normal cannot decide and is passed over.
///
/// The test is as sharp as the mesh: it sees the tangent plane at one vertex, so next to an edge of
/// the object, or far inside where no leaf is near, it differs from a true inside test.
///
/// Shapes: `normals` by mesh node (see [`vertex_normals`]). Frame: that of the tree, throughout.
///
/// Source: thesis (4.10), 4.4.4.
pub fn tip_hits(
    tree: &SphereTree,
    normals: &[Vector3<f64>],
    tip: &Sphere,
    contact_point: &Point3<f64>,
) -> [Option<ContactHit>; TIP_HITS_MAX] {
    let mut nearest: [Option<Candidate>; TIP_HITS_MAX] = [None; TIP_HITS_MAX];
    let _ = tree.visit(
        |sphere| sphere_meets_sphere(tip, sphere),
        |_| false,
        |leaf| {
            let (nodes, points) = tree.run(leaf);
            for (&node, point) in nodes.iter().zip(points) {
                let d = contact_point - point;
                if let Some(normal) = normals.get(node as usize).filter(|n| n.norm_squared() > 0.0)
                {
                    insert(&mut nearest, Candidate { distance: d.norm(), node, r: d.dot(normal) });
                }
            }
            ControlFlow::Continue(())
        },
    );
    if nearest[0].is_none_or(|first| first.r > 0.0) {
        return [None; TIP_HITS_MAX];
    }
    let mut hits = [None; TIP_HITS_MAX];
    let inside = nearest.iter().flatten().filter(|c| c.r <= 0.0);
    for (hit, c) in hits.iter_mut().zip(inside) {
        let normal = normals[c.node as usize];
        *hit = Some(ContactHit { node: c.node, distance: c.distance, normal });
    }
    hits
}

/// Vertex normals: the plain average of the unit normals of the neighbouring faces, made unit.
///
/// Plain as in the thesis, not weighted by area. A vertex without a face, or whose faces cancel,
/// gets zero; faces without area count for nothing.
///
/// Shapes: `triangles` three node indices each, counter-clockwise seen from outside; the result has
/// one vector per position. `normals` is overwritten and reuses its memory.
///
/// # Errors
/// [`TreeError::IndexOutOfRange`] if a triangle refers to a position that is not there.
///
/// Source: thesis 4.4.4, Figure 4.20.
pub fn vertex_normals(
    positions: &[Point3<f64>],
    triangles: &[[u32; 3]],
    normals: &mut Vec<Vector3<f64>>,
) -> Result<(), TreeError> {
    let node_count = positions.len();
    if let Some(&node) = triangles.iter().flatten().find(|&&n| n as usize >= node_count) {
        return Err(TreeError::IndexOutOfRange { node, node_count });
    }
    normals.clear();
    normals.resize(node_count, Vector3::zeros());
    for corners in triangles {
        let [a, b, c] = corners.map(|n| positions[n as usize]);
        if let Some(face) = (b - a).cross(&(c - a)).try_normalize(f64::MIN_POSITIVE) {
            for &n in corners {
                normals[n as usize] += face;
            }
        }
    }
    for normal in normals {
        *normal = normal.try_normalize(CANCELLED).unwrap_or_else(Vector3::zeros);
    }
    Ok(())
}

/// A vertex by its distance to the contact point, with R of (4.10).
#[derive(Clone, Copy)]
struct Candidate {
    distance: f64,
    node: u32,
    r: f64,
}

/// Keeps the nearest candidates sorted; of equally near ones the lower node comes first.
fn insert(nearest: &mut [Option<Candidate>; TIP_HITS_MAX], mut new: Candidate) {
    for slot in nearest {
        match slot {
            Some(old) if (old.distance, old.node) <= (new.distance, new.node) => {}
            Some(old) => std::mem::swap(old, &mut new),
            None => {
                *slot = Some(new);
                return;
            }
        }
    }
}

/// Sums of unit vectors shorter than this are rounding, not direction.
const CANCELLED: f64 = 1e-12;
