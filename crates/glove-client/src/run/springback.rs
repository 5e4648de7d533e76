//! Support of an object that springs back: prescribed displacements that carry no force.

use nalgebra::{Point3, Vector3};
use softgrasp_grasp::object::SoftObject;
use softgrasp_protocol::DofValue;

/// Three nodes of the surface, held so that the object cannot move rigidly; no force is needed for that.
///
/// Units: m. Frame: the object's. Shapes: ascending by degree of freedom.
pub(crate) fn support(object: &SoftObject) -> Vec<DofValue> {
    let nodes = &object.surface().nodes;
    let places: Vec<Point3<f64>> =
        nodes.iter().map(|&n| object.rest().vertices()[n as usize]).collect();
    let held = determinate_support(&places).into_iter().map(|(place, axis)| {
        let node = nodes[place];
        let value = object.displacement()[node as usize][axis];
        DofValue { dof: 3 * node + axis as u32, value }
    });
    let mut held: Vec<DofValue> = held.collect();
    held.sort_unstable_by_key(|known| known.dof);
    held
}

/// Points and axes of a statically determinate support: all three axes of one point, two of another, one
/// of a third. They carry no force in any equilibrium of the body.
///
/// # Panics
/// If there is no point.
fn determinate_support(places: &[Point3<f64>]) -> [(usize, usize); 6] {
    let farthest = |distance: &dyn Fn(&Point3<f64>) -> f64| {
        let all = (0..places.len())
            .max_by(|&a, &b| distance(&places[a]).total_cmp(&distance(&places[b])));
        all.expect("a surface has nodes")
    };
    let first = farthest(&|p| (p - places[0]).norm());
    let a = places[first];
    let second = farthest(&|p| (p - a).norm());
    let along = places[second] - a;
    let third = farthest(&|p| (p - a).cross(&along).norm());
    let across = (places[third] - a).cross(&along);
    // The second may move along the line of both, which is the axis nearest to it.
    let free = axis_nearest(&along);
    let [u, v] = [(free + 1) % 3, (free + 2) % 3];
    let turned = axis_nearest(&across);
    [(first, 0), (first, 1), (first, 2), (second, u), (second, v), (third, turned)]
}

fn axis_nearest(direction: &Vector3<f64>) -> usize {
    direction.iamax()
}

#[cfg(test)]
mod tests {
    use nalgebra::{Matrix6, UnitQuaternion};

    use super::*;

    /// The support holds a body if no rigid motion leaves all six degrees of freedom at rest.
    #[test]
    fn support_holds_a_body_however_it_is_turned() {
        for turn in 0..50 {
            let t = f64::from(turn);
            let rotation = UnitQuaternion::from_euler_angles(0.3 * t, 0.7 * t, 1.1 * t);
            let corner = |i: u32| {
                let [x, y, z] = [i & 1, i >> 1 & 1, i >> 2].map(f64::from);
                rotation * Point3::new(x, 1.7 * y, 0.4 * z)
            };
            let places: Vec<Point3<f64>> = (0..8).map(corner).collect();
            let support = determinate_support(&places);
            let rows = Matrix6::from_fn(|row, column| {
                let (place, axis) = support[row];
                let moved = match column {
                    0..3 => Vector3::ith(column, 1.0),
                    _ => Vector3::ith(column - 3, 1.0).cross(&places[place].coords),
                };
                moved[axis]
            });
            let smallest = rows.singular_values().min();
            assert!(smallest > 0.05, "turn {turn}: {smallest}");
        }
    }
}
