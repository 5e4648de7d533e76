//! Closed surfaces of triangles: which triangles bound a body, and pseudonormals that tell its inside from its
//! outside.

use std::collections::BTreeMap;

use nalgebra::{Point3, Unit, Vector3};

use super::closest::area_normal;

/// Why triangles bound no rigid body.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum RigidMeshError {
    /// No triangle with an area.
    #[error("the surface has no triangle with an area")]
    Empty,
    /// A corner that is not there.
    #[error("triangle {triangle} names vertex {vertex}, but there are {vertex_count} (0-based)")]
    NoSuchVertex {
        /// Index of the triangle, from 0.
        triangle: usize,
        /// The vertex it names.
        vertex: u32,
        /// Vertices there are.
        vertex_count: usize,
    },
    /// A coordinate that is not finite.
    #[error("vertex {vertex} is not finite")]
    NotFinite {
        /// Index of the vertex, from 0.
        vertex: usize,
    },
    /// An edge that does not join exactly two triangles of the same sense.
    #[error(
        "the surface is not closed: the edge between vertices {from} and {to} belongs to {count} \
         triangles of one sense; close it, and turn all triangles outward"
    )]
    Open {
        /// An end of the edge.
        from: u32,
        /// Its other end.
        to: u32,
        /// Triangles that run along it.
        count: usize,
    },
    /// A surface that is turned inside out.
    #[error("the surface encloses the volume {volume:e} m³; turn its triangles outward")]
    InsideOut {
        /// Signed volume that the triangles enclose, m³.
        volume: f64,
    },
    /// A radius of the edges that is negative or no number.
    #[error(
        "the radius of the edges of a mesh is {radius}; it must be a number of metres, at least 0"
    )]
    Radius {
        /// The radius.
        radius: f64,
    },
}

/// Vertices and triangles.
type Triangles = (Vec<Point3<f64>>, Vec<[u32; 3]>);

/// One vertex for each place, and the triangles that have an area.
pub(super) fn welded(
    vertices: &[Point3<f64>],
    triangles: &[[u32; 3]],
) -> Result<Triangles, RigidMeshError> {
    if let Some(vertex) = vertices.iter().position(|v| !v.iter().all(|x| x.is_finite())) {
        return Err(RigidMeshError::NotFinite { vertex });
    }
    let mut places: BTreeMap<[u64; 3], u32> = BTreeMap::new();
    let mut kept = Vec::new();
    let mut number = Vec::with_capacity(vertices.len());
    for vertex in vertices {
        // Adding zero makes one zero of both.
        let key = [vertex.x + 0.0, vertex.y + 0.0, vertex.z + 0.0].map(f64::to_bits);
        number.push(*places.entry(key).or_insert_with(|| {
            kept.push(*vertex);
            kept.len() as u32 - 1
        }));
    }
    let mut sound = Vec::with_capacity(triangles.len());
    for (triangle, corners) in triangles.iter().enumerate() {
        let mut named = [0; 3];
        for (named, &vertex) in named.iter_mut().zip(corners) {
            *named = *number.get(vertex as usize).ok_or(RigidMeshError::NoSuchVertex {
                triangle,
                vertex,
                vertex_count: vertices.len(),
            })?;
        }
        if named[0] != named[1] && named[1] != named[2] && named[2] != named[0] {
            sound.push(named);
        }
    }
    match sound.is_empty() {
        true => Err(RigidMeshError::Empty),
        false => Ok((kept, sound)),
    }
}

/// Every edge must be run along once in each sense.
pub(super) fn check_closed(triangles: &[[u32; 3]]) -> Result<(), RigidMeshError> {
    let mut runs: BTreeMap<(u32, u32), usize> = BTreeMap::new();
    for t in triangles {
        for k in 0..3 {
            *runs.entry((t[k], t[(k + 1) % 3])).or_default() += 1;
        }
    }
    for (&(from, to), &count) in &runs {
        if runs.get(&(to, from)) != Some(&count) {
            return Err(RigidMeshError::Open { from, to, count });
        }
    }
    Ok(())
}

/// Normals of every triangle, of its edges (opposite corner 0, 1, 2) and of its corners: sums over what meets
/// there, at corners weighted by angle.
pub(super) fn pseudonormals(
    vertices: &[Point3<f64>],
    triangles: &[[u32; 3]],
) -> Vec<[Vector3<f64>; 7]> {
    let mut of_edges: BTreeMap<(u32, u32), Vector3<f64>> = BTreeMap::new();
    let mut of_vertices = vec![Vector3::zeros(); vertices.len()];
    let faces: Vec<Vector3<f64>> = triangles
        .iter()
        .map(|t| {
            let normal = area_normal(&t.map(|n| vertices[n as usize]));
            Unit::try_new(normal, f64::MIN_POSITIVE).map_or(Vector3::zeros(), Unit::into_inner)
        })
        .collect();
    for (t, normal) in triangles.iter().zip(&faces) {
        for k in 0..3 {
            let [at, next, last] = [k, (k + 1) % 3, (k + 2) % 3].map(|k| vertices[t[k] as usize]);
            of_vertices[t[k] as usize] += (next - at).angle(&(last - at)) * normal;
            *of_edges.entry(edge(t[k], t[(k + 1) % 3])).or_insert(Vector3::zeros()) += normal;
        }
    }
    let opposite = |t: &[u32; 3], k: usize| of_edges[&edge(t[(k + 1) % 3], t[(k + 2) % 3])];
    let at = |n: u32| of_vertices[n as usize];
    triangles
        .iter()
        .zip(&faces)
        .map(|(t, normal)| {
            let edges = [opposite(t, 0), opposite(t, 1), opposite(t, 2)];
            [*normal, edges[0], edges[1], edges[2], at(t[0]), at(t[1]), at(t[2])]
        })
        .collect()
}

fn edge(a: u32, b: u32) -> (u32, u32) {
    (a.min(b), a.max(b))
}
