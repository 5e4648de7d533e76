//! Surface triangles near rigid bodies, found by the sphere tree over the surface's vertices.

use std::ops::ControlFlow;

use nalgebra::{Isometry3, Point3};
use softgrasp_core::contact::SurfaceStars;
use softgrasp_core::dynamics::{Candidate, MovingBody};

use super::tree::SphereTree;

/// A surface with the tree over its vertices.
///
/// Units: m. Frame: the object's. Shapes: `places` one for each node; `stars` and `triangles` of the
/// same surface as `tree`.
#[derive(Clone, Copy)]
pub struct SearchedSurface<'a> {
    /// Tree over the vertices as they are now.
    pub tree: &'a SphereTree,
    /// Triangles around each node.
    pub stars: &'a SurfaceStars,
    /// Three node numbers of each triangle.
    pub triangles: &'a [[u32; 3]],
    /// Positions of the nodes as they are now.
    pub places: &'a [Point3<f64>],
}

/// Triangles whose distance from a body at the end of its step can be below a margin: exactly those
/// that [`softgrasp_core::dynamics::near_triangles`] finds by looking at all of them.
///
/// Shapes: result ascending by triangle, then body. Units: m.
pub fn triangles_near(
    surface: &SearchedSurface<'_>,
    world_from_object: &Isometry3<f64>,
    bodies: &[MovingBody],
    margin: f64,
) -> Vec<Candidate> {
    let round = surface.triangles.iter().map(|nodes| Round::of(nodes, surface.places));
    let round: Vec<Round> = round.collect();
    let reach_max = round.iter().map(|r| r.reach).fold(0.0, f64::max);
    let mut near = Vec::new();
    let mut found: Vec<u32> = Vec::new();
    for (position, body) in (0u16..).zip(bodies) {
        let body_from_object = body.world_from_body_end.inverse() * world_from_object;
        // A corner is no farther from the body than its triangle's middle and the way from there.
        let reach = margin + 2.0 * reach_max;
        nodes_near(surface.tree, &body_from_object, body, reach, &mut found);
        let mut triangles: Vec<u32> =
            found.drain(..).flat_map(|node| surface.stars.of_node(node)).copied().collect();
        triangles.sort_unstable();
        triangles.dedup();
        near.extend(triangles.into_iter().filter_map(|triangle| {
            let Round { middle, reach } = &round[triangle as usize];
            let in_body =
                body.world_from_body_end.inverse_transform_point(&(world_from_object * middle));
            let is_near = body.shape.distance(&in_body).distance < margin + reach;
            is_near.then_some(Candidate { triangle, body: position })
        }));
    }
    near.sort_unstable_by_key(|candidate| (candidate.triangle, candidate.body));
    near
}

/// Middle of a triangle and the distance of its farthest corner from the middle, m.
struct Round {
    middle: Point3<f64>,
    reach: f64,
}

impl Round {
    fn of(nodes: &[u32; 3], places: &[Point3<f64>]) -> Self {
        let corners = nodes.map(|node| places[node as usize]);
        let middle =
            Point3::from((corners[0].coords + corners[1].coords + corners[2].coords) / 3.0);
        let reach = corners.iter().map(|c| (c - middle).norm()).fold(0.0, f64::max);
        Self { middle, reach }
    }
}

/// Appends the vertices of a tree that are nearer to a body than a distance; some that are a little
/// farther may be among them.
fn nodes_near(
    tree: &SphereTree,
    body_from_object: &Isometry3<f64>,
    body: &MovingBody,
    distance: f64,
    out: &mut Vec<u32>,
) {
    let _ = tree.visit(
        |sphere| {
            let centre = body_from_object * sphere.centre;
            // A little more than the sphere, for what rounding takes.
            body.shape.distance(&centre).distance <= distance + 1.000_001 * sphere.radius
        },
        |_| false,
        |leaf| {
            out.extend_from_slice(tree.run(leaf).0);
            ControlFlow::Continue(())
        },
    );
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::object::{RestShape, SoftObject};
    use nalgebra::{UnitQuaternion, Vector3};
    use proptest::prelude::*;
    use softgrasp_core::dynamics::near_triangles;
    use softgrasp_core::mesh::{BuiltIn, generate};
    use softgrasp_core::rigid_body::RigidShape;

    fn body(shape: RigidShape, place: [f64; 3], turn: [f64; 3]) -> MovingBody {
        let turn = UnitQuaternion::from_scaled_axis(Vector3::from(turn));
        let pose = Isometry3::from_parts(Vector3::from(place).into(), turn);
        MovingBody::resting(shape, pose, 0.5)
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(64))]
        #[test]
        fn search_by_the_tree_finds_what_a_look_at_all_triangles_finds(
            places in prop::array::uniform4(prop::array::uniform3(-0.06..0.06f64)),
            turn in prop::array::uniform3(-2.0..2.0f64),
            bend in -0.3..0.3f64,
            margin in 0.0..0.02f64,
        ) {
            let rest = RestShape::try_new(generate(BuiltIn::Strawberry, 300).unwrap()).unwrap();
            let mut object = SoftObject::at_rest(rest, 1);
            let bent = object.rest().vertices().iter().map(|p| [bend * p.y * p.y / 0.05, 0.0, 0.0]);
            let bent = bent.collect();
            object.apply(bent).unwrap();
            let shapes = [
                RigidShape::sphere(0.008).unwrap(),
                RigidShape::capsule(0.009, 0.03).unwrap(),
                RigidShape::plane(Vector3::y()).unwrap(),
                RigidShape::cuboid(Vector3::new(0.01, 0.02, 0.005)).unwrap(),
            ];
            let bodies: Vec<MovingBody> =
                shapes.into_iter().zip(places).map(|(s, place)| body(s, place, turn)).collect();
            let world_from_object = Isometry3::new(Vector3::new(0.01, 0.0, -0.02), Vector3::from(turn));
            let surface = SearchedSurface {
                tree: object.tree(),
                stars: object.rest_shape().stars(),
                triangles: &object.surface().triangles,
                places: object.shape(),
            };
            let found = triangles_near(&surface, &world_from_object, &bodies, margin);
            let all = near_triangles(
                object.shape(), &object.surface().triangles, &world_from_object, &bodies, margin,
            );
            prop_assert_eq!(found, all);
        }
    }
}
