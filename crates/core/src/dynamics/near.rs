//! Triangles near bodies by looking at all of them: the oracle of every quicker search.

use nalgebra::{Isometry3, Point3};

use super::bodies::MovingBody;
use super::features::Candidate;

/// Triangles whose distance from a body at the end of the step can be below a margin.
///
/// Shapes: `places` one point for each node, in the object's frame; `triangles` of them; result
/// ascending. Units: m.
pub fn near_triangles(
    places: &[Point3<f64>],
    triangles: &[[u32; 3]],
    world_from_object: &Isometry3<f64>,
    bodies: &[MovingBody],
    margin: f64,
) -> Vec<Candidate> {
    let mut near = Vec::new();
    for (triangle, nodes) in (0u32..).zip(triangles) {
        let corners = nodes.map(|node| places[node as usize]);
        let middle =
            Point3::from((corners[0].coords + corners[1].coords + corners[2].coords) / 3.0);
        let reach = corners.iter().map(|c| (c - middle).norm()).fold(0.0, f64::max);
        for (position, body) in (0u16..).zip(bodies) {
            let in_body =
                body.world_from_body_end.inverse_transform_point(&(world_from_object * middle));
            // A distance changes by no more than the way gone.
            if body.shape.distance(&in_body).distance < margin + reach {
                near.push(Candidate { triangle, body: position });
            }
        }
    }
    near
}
