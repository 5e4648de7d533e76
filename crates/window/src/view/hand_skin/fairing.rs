//! Draws the vertices of a net onto the surface and spreads them evenly over it.

use std::collections::BTreeSet;

use nalgebra::{Point3, Vector3};

use super::hand_body::HandBody;
use super::surface_net::SurfaceNet;

/// Rounds of spreading; more change nothing that one sees.
const ROUNDS: usize = 4;
/// Share of the way to the middle of the neighbours that a vertex takes in a round.
const STRIDE: f64 = 0.5;

/// A triangle mesh with unit normals.
///
/// Units: m. Frame: palm.
#[derive(Clone, Debug)]
pub(super) struct Surface {
    /// Vertices on the surface.
    pub places: Vec<Point3<f64>>,
    /// Outward unit normals: the gradient of the distance.
    pub normals: Vec<Vector3<f64>>,
    /// Counter-clockwise seen from outside.
    pub triangles: Vec<[u32; 3]>,
}

/// The faired surface of a net.
pub(super) fn fair(mut net: SurfaceNet, body: &HandBody) -> Surface {
    let mut normals = vec![Vector3::z(); net.places.len()];
    draw(&mut net.places, &mut normals, body);
    for _ in 0..ROUNDS {
        spread(&mut net, &normals);
        draw_along(&mut net.places, &normals, body);
    }
    draw(&mut net.places, &mut normals, body);
    draw(&mut net.places, &mut normals, body);
    let triangles = triangulate(&net);
    Surface { places: net.places, normals, triangles }
}

/// One Newton step of each vertex along the gradient, and its normal.
fn draw(places: &mut [Point3<f64>], normals: &mut [Vector3<f64>], body: &HandBody) {
    for (place, normal) in places.iter_mut().zip(normals) {
        let (distance, gradient) = body.distance_and_gradient(place);
        let steepness = gradient.norm_squared();
        // Where two bodies meet in a groove the gradient can nearly vanish; leave the vertex.
        if steepness > 0.05 {
            *place -= gradient * (distance / steepness);
            *normal = gradient / steepness.sqrt();
        }
    }
}

/// A cheaper step along the normals as they are; the slope of the distance is about 1.
fn draw_along(places: &mut [Point3<f64>], normals: &[Vector3<f64>], body: &HandBody) {
    for (place, normal) in places.iter_mut().zip(normals) {
        *place -= normal * body.distance(place);
    }
}

/// Moves every vertex toward the middle of its neighbours, within its tangent plane.
fn spread(net: &mut SurfaceNet, normals: &[Vector3<f64>]) {
    let mut sums = vec![(Vector3::zeros(), 0.0); net.places.len()];
    for quad in &net.quads {
        for i in 0..4 {
            let (from, to) = (quad[i] as usize, quad[(i + 1) % 4] as usize);
            sums[from].0 += net.places[to].coords;
            sums[from].1 += 1.0;
        }
    }
    for ((place, (sum, count)), normal) in net.places.iter_mut().zip(sums).zip(normals) {
        let way = sum / count - place.coords;
        *place += (way - normal * normal.dot(&way)) * STRIDE;
    }
}

/// Cuts every quadrilateral along its shorter diagonal, or along the other one where that
/// diagonal is an edge already.
fn triangulate(net: &SurfaceNet) -> Vec<[u32; 3]> {
    let sorted = |i: u32, j: u32| (i.min(j), i.max(j));
    let length = |i: u32, j: u32| (net.places[i as usize] - net.places[j as usize]).norm_squared();
    let mut edges: BTreeSet<(u32, u32)> = BTreeSet::new();
    for quad in &net.quads {
        edges.extend((0..4).map(|i| sorted(quad[i], quad[(i + 1) % 4])));
    }
    let mut triangles = Vec::with_capacity(2 * net.quads.len());
    for &[a, b, c, d] in &net.quads {
        let is_ac_shorter = length(a, c) <= length(b, d);
        let shorter = if is_ac_shorter { sorted(a, c) } else { sorted(b, d) };
        let cuts_ac = is_ac_shorter != edges.contains(&shorter);
        edges.insert(if cuts_ac { sorted(a, c) } else { sorted(b, d) });
        triangles.extend(if cuts_ac { [[a, b, c], [a, c, d]] } else { [[a, b, d], [b, c, d]] });
    }
    triangles
}
