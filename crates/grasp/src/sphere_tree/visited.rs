//! The spheres that a search looks at on its way down, to be looked at (thesis Figure 4.21).

use super::overlap::{cylinder_meets_sphere, sphere_meets_sphere};
use super::tree::SphereTree;
use crate::shape::{Cylinder, Sphere};

/// A sphere that a search has compared with a part of the hand.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VisitedSphere {
    /// The sphere, in the frame of the tree.
    pub sphere: Sphere,
    /// Level in the tree, the root's being 0.
    pub level: usize,
    /// Whether it overlaps the part: only then its children are visited.
    pub overlaps: bool,
    /// Whether it has no children, so that an overlap is a vertex near the part.
    pub is_leaf: bool,
}

impl SphereTree {
    /// The spheres that the search for vertices near a finger segment visits, level by level.
    ///
    /// The overlapping leaves among them are those of [`SphereTree::search_cylinder`], which saves
    /// the tests below a sphere that lies wholly inside the cylinder; here none is saved.
    /// Frame: that of the tree.
    ///
    /// Source: thesis 4.4.3, Figure 4.21.
    pub fn visited_by_cylinder(&self, cylinder: &Cylinder) -> Vec<VisitedSphere> {
        self.visited(|sphere| cylinder_meets_sphere(cylinder, sphere))
    }

    /// As [`SphereTree::visited_by_cylinder`], for a fingertip.
    pub fn visited_by_sphere(&self, tip: &Sphere) -> Vec<VisitedSphere> {
        self.visited(|sphere| sphere_meets_sphere(tip, sphere))
    }

    fn visited(&self, meets: impl Fn(&Sphere) -> bool) -> Vec<VisitedSphere> {
        let mut visited = Vec::new();
        let mut at_level = vec![0];
        for level in 0.. {
            let mut below = Vec::new();
            for &index in &at_level {
                let node = &self.nodes[index];
                let overlaps = meets(&node.sphere);
                let (sphere, is_leaf) = (node.sphere, node.is_leaf());
                visited.push(VisitedSphere { sphere, level, overlaps, is_leaf });
                if overlaps {
                    below.extend(node.child_range());
                }
            }
            if below.is_empty() {
                break;
            }
            at_level = below;
        }
        visited
    }
}
