//! A face of a ten-node element: six nodes, perhaps curved, under an even pressure.

use nalgebra::{Point3, Vector3};

/// Barycentric coordinates and weights of a point and its turns; the weights of all seven add up to 1.
///
/// Exact for polynomials of degree five; a shape function times the normal is of degree four.
///
/// Source: Radon (1948): the middle, and three points each with `a = (6 ∓ √15) / 21` twice.
const SEVEN_POINTS: [([f64; 3], f64); 7] = [
    ([1.0 / 3.0; 3], 0.225),
    ([INNER, INNER, 1.0 - 2.0 * INNER], INNER_WEIGHT),
    ([INNER, 1.0 - 2.0 * INNER, INNER], INNER_WEIGHT),
    ([1.0 - 2.0 * INNER, INNER, INNER], INNER_WEIGHT),
    ([OUTER, OUTER, 1.0 - 2.0 * OUTER], OUTER_WEIGHT),
    ([OUTER, 1.0 - 2.0 * OUTER, OUTER], OUTER_WEIGHT),
    ([1.0 - 2.0 * OUTER, OUTER, OUTER], OUTER_WEIGHT),
];

const ROOT_OF_15: f64 = 3.872_983_346_207_417;
const INNER: f64 = (6.0 - ROOT_OF_15) / 21.0;
const INNER_WEIGHT: f64 = (155.0 - ROOT_OF_15) / 1200.0;
const OUTER: f64 = (6.0 + ROOT_OF_15) / 21.0;
const OUTER_WEIGHT: f64 = (155.0 + ROOT_OF_15) / 1200.0;

/// Ends of the edges of nodes 4 … 6: the middles of 12, 23, 31.
const EDGES: [[usize; 2]; 3] = [[0, 1], [1, 2], [2, 0]];

/// Forces at the nodes that do the work of an even pressure against the normal, `−p ∫ N_a n dA`.
///
/// Shapes: `nodes` three corners, counter-clockwise seen against the pressure, then the middles of 12,
/// 23, 31. Units: m, Pa; result N.
pub(super) fn pressure_forces(nodes: &[Point3<f64>; 6], pressure: f64) -> [Vector3<f64>; 6] {
    let arms = nodes.map(|node| node - nodes[0]);
    let mut forces = [Vector3::zeros(); 6];
    for (l, weight) in SEVEN_POINTS {
        let along = |i: usize| -> Vector3<f64> {
            let slopes = slopes(l);
            arms.iter().zip(slopes).map(|(arm, slope)| arm * (slope[i] - slope[2])).sum()
        };
        // The triangle of the barycentric coordinates has an area of one half.
        let load = along(0).cross(&along(1)) * (-0.5 * pressure * weight);
        forces.iter_mut().zip(shape_functions(l)).for_each(|(force, n)| *force += load * n);
    }
    forces
}

fn shape_functions(l: [f64; 3]) -> [f64; 6] {
    let [c1, c2, c3] = l.map(|x| x * (2.0 * x - 1.0));
    let [e1, e2, e3] = EDGES.map(|[i, j]| 4.0 * l[i] * l[j]);
    [c1, c2, c3, e1, e2, e3]
}

/// Slopes of the shape functions by the three coordinates.
fn slopes(l: [f64; 3]) -> [[f64; 3]; 6] {
    let mut slopes = [[0.0; 3]; 6];
    for i in 0..3 {
        slopes[i][i] = 4.0 * l[i] - 1.0;
        let [a, b] = EDGES[i];
        (slopes[3 + i][a], slopes[3 + i][b]) = (4.0 * l[b], 4.0 * l[a]);
    }
    slopes
}

#[cfg(test)]
mod tests {
    use super::*;

    fn flat() -> [Point3<f64>; 6] {
        let [a, b, c] =
            [[0.1, 0.2, 0.3], [1.1, 0.1, 0.4], [0.3, 1.4, 0.9]].map(Point3::<f64>::from);
        let middle = |a, b| nalgebra::center(&a, &b);
        [a, b, c, middle(a, b), middle(b, c), middle(c, a)]
    }

    #[test]
    fn middles_of_a_flat_face_carry_a_third_each() {
        let nodes = flat();
        let third = (nodes[1] - nodes[0]).cross(&(nodes[2] - nodes[0])) * (-7.0 / 6.0);
        let forces = pressure_forces(&nodes, 7.0);
        for (at, force) in forces.into_iter().enumerate() {
            let expected = if at < 3 { Vector3::zeros() } else { third };
            assert!((force - expected).norm() < 1e-14 * third.norm(), "{at}: {force}");
        }
    }

    #[test]
    fn a_curved_face_has_the_load_and_the_moment_of_its_projections() {
        // z = x y over the unit triangle, which six nodes have exactly: n dA = (−y, −x, 1) dx dy.
        let flat = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [0.5, 0.0], [0.5, 0.5], [0.0, 0.5]];
        let nodes = flat.map(|[x, y]| Point3::new(x, y, x * y));
        let forces = pressure_forces(&nodes, -1.0);
        let sum: Vector3<f64> = forces.iter().sum();
        assert!((sum - Vector3::new(-1.0 / 6.0, -1.0 / 6.0, 0.5)).norm() < 1e-15, "{sum}");
        let moment: Vector3<f64> = nodes.iter().zip(&forces).map(|(p, f)| p.coords.cross(f)).sum();
        // ∫ (x, y, xy) × (−y, −x, 1) = ∫ (y + x²y, −xy² − x, y² − x²).
        let expected = Vector3::new(1.0 / 6.0 + 1.0 / 60.0, -1.0 / 6.0 - 1.0 / 60.0, 0.0);
        assert!((moment - expected).norm() < 1e-15, "{moment}");
    }
}
