//! How the force of a contact moves through its triangle while the triangle tilts on a round body.
//!
//! The deepest point of a triangle moves by `R` times the angle by which the triangle tilts, R the radius of
//! the body's curvature there. A force λ that moves with it turns the triangle back: it is a spring of
//! `λ R` N m between angle and moment, the Hessian of the gap times the force. Without it a soft surface
//! under a large force tilts too far, and the point goes to and fro from round to round.
//!
//! Source: the Hessian of the Lagrangian in sequential quadratic programming, Nocedal and Wright (2006),
//! chapter 18; of a gap between a triangle and a smooth body by the implicit function theorem.

use nalgebra::{Matrix2, Matrix3, Vector2, Vector3};

use super::features::MaterialPoint;
use super::state::mix;
use crate::contact::coulomb::PointForce;
use crate::rigid_body::Barycentric;

/// A direction in which the place of a point's force moves.
#[derive(Clone)]
pub(super) struct Rolling {
    /// Position of the point in the problem.
    pub position: usize,
    /// Change of its weights, of which the largest is 1; their sum is 0.
    pub weights: Barycentric,
    /// Way of the point for that change, m, in the object's frame.
    pub along: Vector3<f64>,
    /// Rise of the triangle along it, over the tangent plane of the body, for a unit motion of the point
    /// along the body: the body falls away.
    pub falls: Vector3<f64>,
    /// Change for a unit rise, 1/m.
    pub per_motion: f64,
    /// Force of the point over that motion, N/m.
    pub stiffness: PointForce,
}

/// Share of the largest curvature below which a body counts as straight in a direction.
const STRAIGHT: f64 = 0.1;

/// The directions in which a force at a point moves: those in which its body is curved, at most one on an
/// edge and two inside a triangle.
///
/// Shapes: `corners` the places of the point's nodes, m. Units: `force` N; `curvature` 1/m.
/// Frame: the object's.
pub(super) fn rollings(
    (point, corners): (&MaterialPoint, &[Vector3<f64>; 3]),
    curvature: &Matrix3<f64>,
    (position, force): (usize, PointForce),
) -> Vec<Rolling> {
    let along = |weights: &Barycentric| mix(corners, weights).coords;
    let of_direction = |weights: Barycentric| {
        let largest = weights.iter().fold(0.0, |most: f64, w| most.max(w.abs()));
        let weights = weights.map(|w| w / largest);
        let along = along(&weights);
        let bend = along.dot(&(curvature * along));
        let is_curved = bend > STRAIGHT * along.norm_squared() * curvature.norm();
        is_curved.then(|| {
            let (per_motion, stiffness) = (1.0 / bend, force / bend);
            Rolling { position, weights, along, falls: curvature * along, per_motion, stiffness }
        })
    };
    directions(&point.nodes, along, curvature).into_iter().filter_map(of_direction).collect()
}

/// Number of directions in which a point can move within its edge or triangle.
pub(super) fn freedoms(point: &MaterialPoint) -> usize {
    let [a, b, c] = point.nodes;
    usize::from(a != b) + usize::from(b != c)
}

/// Changes of weights that move a point along an edge, or along the two directions in a triangle that the
/// curvature does not couple.
fn directions(
    nodes: &[u32; 3],
    along: impl Fn(&Barycentric) -> Vector3<f64>,
    curvature: &Matrix3<f64>,
) -> Vec<Barycentric> {
    if nodes[0] == nodes[1] {
        return Vec::new();
    }
    if nodes[1] == nodes[2] {
        return vec![[-1.0, 1.0, 0.0]];
    }
    let edges = [[-1.0, 1.0, 0.0], [-1.0, 0.0, 1.0]];
    let e = edges.each_ref().map(along);
    let gram = Matrix2::from_fn(|r, c| e[r].dot(&e[c]));
    let bend = Matrix2::from_fn(|r, c| e[r].dot(&(curvature * e[c])));
    // Directions x with `bend x = μ gram x`, by the factor L of the Gram matrix.
    let Some(factor) = gram.cholesky() else { return Vec::new() };
    let Some(inverse) = factor.l().try_inverse() else { return Vec::new() };
    let modes = (inverse * bend * inverse.transpose()).symmetric_eigen();
    let of_mode = |k: usize| {
        let x: Vector2<f64> = inverse.transpose() * modes.eigenvectors.column(k);
        [-x.x - x.y, x.x, x.y]
    };
    vec![of_mode(0), of_mode(1)]
}

/// Where a point is when its force has moved in some directions, by motions of their springs; at the border
/// of its triangle at most.
///
/// Units: the motions m.
pub(super) fn rolled<'a>(
    point: &MaterialPoint,
    moved: impl Iterator<Item = (&'a Rolling, f64)>,
) -> MaterialPoint {
    let mut change = [0.0; 3];
    for (rolling, motion) in moved {
        let by = -rolling.per_motion * motion;
        change.iter_mut().zip(rolling.weights).for_each(|(change, weight)| *change += by * weight);
    }
    let borders = point.weights.iter().zip(change).filter(|(_, change)| *change < 0.0);
    let share = borders.map(|(weight, change)| weight / -change).fold(1.0, f64::min);
    let weights = std::array::from_fn(|k| (point.weights[k] + share * change[k]).max(0.0));
    MaterialPoint::new(point.body, point.nodes, weights)
}

#[cfg(test)]
mod tests {
    use nalgebra::Point3;
    use proptest::prelude::*;

    use super::*;
    use crate::rigid_body::RigidShape;

    fn corner() -> impl Strategy<Value = Vector3<f64>> {
        prop::array::uniform3(-1.0..1.0f64).prop_map(Vector3::from)
    }

    fn deepest(corners: &[Vector3<f64>; 3], shape: &RigidShape) -> (MaterialPoint, Vector3<f64>) {
        let found = shape.deepest(&corners.map(Point3::from));
        let point = MaterialPoint { body: 0, nodes: [0, 1, 2], weights: found.weights };
        (point, found.distance.normal.into_inner())
    }

    proptest! {
        /// A triangle of 1 cm on a tip of 8 mm, whose corners go along the normal by some micrometres.
        #[test]
        fn a_force_moves_to_where_the_tilted_triangle_is_deepest(
            motion in prop::array::uniform3(-1.0..1.0f64),
            tilt in corner(),
            is_capsule in any::<bool>(),
        ) {
            let shape = match is_capsule {
                true => RigidShape::capsule(0.008, 0.001).unwrap(),
                false => RigidShape::sphere(0.008).unwrap(),
            };
            let flat = [(0.0, 0.006), (-0.005, -0.003), (0.005, -0.003)];
            let z = |x: f64, y: f64| 0.0079 + 0.02 * (tilt.x * x + tilt.y * y);
            let corners = flat.map(|(x, y)| Vector3::new(x, y, z(x, y)));
            // The axis of a capsule is z here: its round end is what is touched.
            let (point, normal) = deepest(&corners, &shape);
            prop_assume!(point.weights.iter().all(|w| *w > 0.05));
            let place = mix(&corners, &point.weights);
            let curvature = shape.curvature(&place).unwrap();
            let found = rollings((&point, &corners), &curvature, (0, PointForce::x()));
            prop_assert_eq!(found.len(), freedoms(&point));
            let moved: [Vector3<f64>; 3] =
                std::array::from_fn(|k| corners[k] + 1e-5 * motion[k] * normal);
            let rise = |r: &Rolling| mix(&moved, &r.weights).coords.dot(&normal);
            let to = rolled(&point, found.iter().map(|r| (r, rise(r))));
            let (expected, _) = deepest(&moved, &shape);
            for k in 0..3 {
                prop_assert!((to.weights[k] - expected.weights[k]).abs() < 1e-4);
            }
        }
    }

    #[test]
    fn a_force_moves_across_a_cylinder_and_not_along_it() {
        let capsule = RigidShape::capsule(0.008, 0.1).unwrap();
        let corners = [(0.004, 0.001), (-0.003, 0.004), (-0.002, -0.005)]
            .map(|(y, z)| Vector3::new(0.0079, y, z));
        let (point, _) = deepest(&corners, &capsule);
        let curvature = capsule.curvature(&mix(&corners, &point.weights)).unwrap();
        let inside = MaterialPoint { body: 0, nodes: [0, 1, 2], weights: [0.4, 0.3, 0.3] };
        let found = rollings((&inside, &corners), &curvature, (0, PointForce::x()));
        assert_eq!(found.len(), 1);
        let along = found[0].along.normalize();
        assert!(along.y.abs() > 0.999 && along.z.abs() < 1e-9, "{along}");
    }

    #[test]
    fn a_force_that_would_leave_its_triangle_stops_at_the_border() {
        let corners = [(0.0, 0.006), (-0.005, -0.003), (0.005, -0.003)]
            .map(|(x, y)| Vector3::new(x, y, 0.008));
        let (point, _) = deepest(&corners, &RigidShape::sphere(0.008).unwrap());
        let curvature =
            RigidShape::sphere(0.008).unwrap().curvature(&mix(&corners, &point.weights)).unwrap();
        let found = rollings((&point, &corners), &curvature, (0, PointForce::x()));
        let to = rolled(&point, found.iter().map(|r| (r, 1.0)));
        assert!(to.weights.contains(&0.0), "{to:?}");
        assert!((to.weights.iter().sum::<f64>() - 1.0).abs() < 1e-12);
    }
}
