//! Fits the spheres of a tree to a deformed surface, and says when to rebuild it instead.

use nalgebra::{Point3, Vector3};

use super::tree::{SphereTree, TreeError, TreeNode, check_positions};
use crate::shape::Sphere;

impl SphereTree {
    /// Moves the spheres after the deformed surface; topology and leaf sizes stay.
    ///
    /// A leaf's sphere travels with its vertex; a parent becomes a sphere around its children's.
    /// So a search after this finds exactly the leaves that brute force finds.
    /// Linear in the number of vertices, without allocation. On error the tree is unchanged.
    ///
    /// Shapes: `positions` all mesh nodes, as for the build.
    ///
    /// # Errors
    /// [`TreeError`] if a surface node is out of range or has a coordinate that is not finite.
    ///
    /// Source: the thesis rebuilds (4.2, last paragraphs); refitting is ours.
    pub fn refit(&mut self, positions: &[Point3<f64>]) -> Result<(), TreeError> {
        check_positions(positions, &self.vertices)?;
        for (point, &node) in self.points.iter_mut().zip(&self.vertices) {
            *point = positions[node as usize];
        }
        for leaf in &self.leaves {
            let first = leaf.first_slot as usize;
            let centre = self.points[first] + leaf.centre_from_vertex;
            let mut radius = leaf.radius;
            if leaf.slots > 1 {
                for point in &self.points[first..first + leaf.slots as usize] {
                    radius = greater(radius, (point - centre).norm());
                }
            }
            let radius = rounded_up(radius, &centre);
            self.nodes[leaf.node as usize].sphere = Sphere { centre, radius };
        }
        let mut cost = 0.0;
        // Children lie behind their parents, so backwards is bottom-up.
        for &inner in self.inner.iter().rev() {
            let sphere = enclosing(&self.nodes[self.nodes[inner as usize].child_range()]);
            cost += sphere.radius * sphere.radius;
            self.nodes[inner as usize].sphere = sphere;
        }
        self.cost = relative_cost(cost, self.bounding_sphere().radius);
        Ok(())
    }

    /// How much larger the spheres are, relative to the object, than when the tree was built.
    ///
    /// Sum of squared radii of the inner nodes over the root's, now over then: about the growth in
    /// the number of spheres a search tests. 1 when built, below 1 after a mild refit (a refitted
    /// sphere is tighter than the cell's).
    pub fn quality(&self) -> f64 {
        if self.cost_built > 0.0 { self.cost / self.cost_built } else { 1.0 }
    }

    /// Whether searching has become so slow that a rebuild pays (keep shape rebuilds anyway).
    pub fn needs_rebuild(&self) -> bool {
        self.quality() > QUALITY_MAX
    }
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

/// Chosen: a rebuild costs about as much as thirty searches with all fingers (release build, 10 000
/// vertices), so at twice the spheres to test it pays within half a second.
const QUALITY_MAX: f64 = 2.0;
