//! Which triangles can touch in a step: how near they must be, and a search that looks at all of them,
//! the oracle of every quicker one.

use nalgebra::{Isometry3, Point3};

use super::bodies::MovingBody;
use super::features::Candidate;

/// What lies farther from a body than this share of the object's size is never asked about.
const MARGIN_OF_SIZE: f64 = 0.02;

/// How near a triangle must be to be able to touch: what bodies and object move in the step, and a share
/// of the object's extent for what the surface moves.
///
/// Units: m, s; `speed` of the object's middle in the step at most m/s, `turning` rad/s.
pub fn reach_of_step(
    extent: f64,
    bodies: &[MovingBody],
    seconds: f64,
    (speed, turning): (f64, f64),
) -> f64 {
    let way = bodies.iter().map(MovingBody::way).fold(0.0, f64::max);
    2.0 * way + 2.0 * seconds * (speed + turning * extent) + MARGIN_OF_SIZE * extent
}

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
