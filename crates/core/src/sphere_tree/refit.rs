//! Refitting: the same tree over a deformed surface, and when to give up and rebuild.

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
        let mut cost = 0.0;
        // Children lie behind their parents, so backwards is bottom-up.
        for index in (0..self.nodes.len()).rev() {
            let node = self.nodes[index];
            let sphere = if node.is_leaf() {
                self.leaf_sphere(&node)
            } else {
                let sphere = enclosing(&self.nodes[node.child_range()]);
                cost += sphere.radius * sphere.radius;
                sphere
            };
            self.nodes[index].sphere = sphere;
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

    fn leaf_sphere(&self, node: &TreeNode) -> Sphere {
        let first = node.first_slot as usize;
        let rest = &self.leaf_rest[first];
        let centre = self.points[first] + rest.centre_from_vertex;
        let mut radius = rest.radius;
        if node.slots > 1 {
            for point in &self.points[node.slot_range()] {
                radius = radius.max((point - centre).norm());
            }
        }
        Sphere { centre, radius: rounded_up(radius, &centre) }
    }
}

/// Sphere around spheres: centre of the box around them, radius to the farthest.
fn enclosing(children: &[TreeNode]) -> Sphere {
    let mut low = Vector3::repeat(f64::INFINITY);
    let mut high = Vector3::repeat(f64::NEG_INFINITY);
    for Sphere { centre, radius } in children.iter().map(|c| &c.sphere) {
        for axis in 0..3 {
            low[axis] = low[axis].min(centre[axis] - radius);
            high[axis] = high[axis].max(centre[axis] + radius);
        }
    }
    let centre = Point3::from((low + high) / 2.0);
    let mut radius = 0.0_f64;
    for child in children {
        radius = radius.max((child.sphere.centre - centre).norm() + child.sphere.radius);
    }
    Sphere { centre, radius: rounded_up(radius, &centre) }
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

/// Chosen: twice the spheres to test cost more per tick than a rebuild every few ticks.
const QUALITY_MAX: f64 = 2.0;
