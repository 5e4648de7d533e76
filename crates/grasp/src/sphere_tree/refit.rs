//! Fits the spheres of a tree to a deformed surface, and measures what searching them costs.

use nalgebra::{Point3, Vector3};

use super::node::{LeafRest, TreeNode};
use crate::shape::Sphere;

/// Moves the spheres after the points; returns the search cost measure (see [`search_cost`]).
///
/// A leaf's sphere travels with its vertex; a parent becomes a sphere around its children's.
pub(super) fn refit_spheres(
    nodes: &mut [TreeNode],
    leaves: &[LeafRest],
    inner: &[u32],
    points: &[Point3<f64>],
) -> f64 {
    for leaf in leaves {
        let first = leaf.first_slot as usize;
        let centre = points[first] + leaf.centre_from_vertex;
        let mut radius = leaf.radius;
        if leaf.slots > 1 {
            for point in &points[first..first + leaf.slots as usize] {
                radius = greater(radius, (point - centre).norm());
            }
        }
        let radius = rounded_up(radius, &centre);
        nodes[leaf.node as usize].sphere = Sphere { centre, radius };
    }
    let mut cost = 0.0;
    // Children lie behind their parents, so backwards is bottom-up.
    for &inner in inner.iter().rev() {
        let sphere = enclosing(&nodes[nodes[inner as usize].child_range()]);
        cost += sphere.radius * sphere.radius;
        nodes[inner as usize].sphere = sphere;
    }
    relative_cost(cost, nodes[0].sphere.radius)
}

/// Sphere around spheres: centre of the box around them, radius to the farthest.
fn enclosing(children: &[TreeNode]) -> Sphere {
    let mut low = [f64::INFINITY; 3];
    let mut high = [f64::NEG_INFINITY; 3];
    for Sphere { centre, radius } in children.iter().map(|c| &c.sphere) {
        for axis in 0..3 {
            low[axis] = lesser(low[axis], centre[axis] - radius);
            high[axis] = greater(high[axis], centre[axis] + radius);
        }
    }
    let centre = Point3::from((Vector3::from(low) + Vector3::from(high)) / 2.0);
    let mut radius = 0.0;
    for child in children {
        let reach = (child.sphere.centre - centre).norm() + child.sphere.radius;
        radius = greater(radius, reach);
    }
    Sphere { centre, radius: rounded_up(radius, &centre) }
}

/// `f64::min` without its care for NaN, which costs a sixth of a refit; the input is checked.
fn lesser(a: f64, b: f64) -> f64 {
    if b < a { b } else { a }
}

/// `f64::max` without its care for NaN.
fn greater(a: f64, b: f64) -> f64 {
    if b > a { b } else { a }
}

/// Search cost measure of a tree: squared radii of the inner nodes over the root's.
pub(super) fn search_cost(nodes: &[TreeNode]) -> f64 {
    let inner = nodes.iter().filter(|n| !n.is_leaf());
    let sum = inner.map(|n| n.sphere.radius * n.sphere.radius).sum();
    relative_cost(sum, nodes[0].sphere.radius)
}

fn relative_cost(sum: f64, root_radius: f64) -> f64 {
    if root_radius > 0.0 { sum / (root_radius * root_radius) } else { 0.0 }
}

/// Radius plus what rounding may have cost.
fn rounded_up(radius: f64, centre: &Point3<f64>) -> f64 {
    radius + 8.0 * f64::EPSILON * (radius + centre.x.abs() + centre.y.abs() + centre.z.abs())
}
