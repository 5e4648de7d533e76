//! Searching down the tree for the surface vertices near a finger (thesis 4.4.3).

use std::ops::ControlFlow;

use nalgebra::Point3;

use super::overlap::{cylinder_meets_sphere, sphere_meets_sphere};
use super::tree::{SphereTree, TreeNode};
use crate::shape::{Cylinder, Sphere};

impl SphereTree {
    /// Appends the vertices the thesis calls "near" a finger segment: those whose leaf sphere meets it.
    ///
    /// Frame: that of the tree. Order: depth first, the same for the same tree and query.
    /// `out` is the caller's buffer and is not cleared; nothing else is allocated.
    ///
    /// Source: thesis 4.4.3.
    pub fn search_cylinder(&self, cylinder: &Cylinder, out: &mut Vec<u32>) {
        self.collect(|sphere| cylinder_meets_sphere(cylinder, sphere), out);
    }

    /// As [`SphereTree::search_cylinder`], for a fingertip.
    pub fn search_sphere(&self, tip: &Sphere, out: &mut Vec<u32>) {
        self.collect(|sphere| sphere_meets_sphere(tip, sphere), out);
    }

    /// Appends the vertices within `radius` of `point`: exact distances, for prefetching columns.
    pub fn nodes_near(&self, point: &Point3<f64>, radius: f64, out: &mut Vec<u32>) {
        let ball = Sphere { centre: *point, radius };
        let _ = self.visit(
            |sphere| sphere_meets_sphere(&ball, sphere),
            |leaf| {
                let (nodes, points) = self.leaf(leaf);
                let near = points.iter().map(|p| (p - point).norm_squared() <= radius * radius);
                out.extend(nodes.iter().zip(near).filter(|(_, near)| *near).map(|(&n, _)| n));
                ControlFlow::Continue(())
            },
        );
    }

    fn collect(&self, meets: impl Fn(&Sphere) -> bool, out: &mut Vec<u32>) {
        let _ = self.visit(meets, |leaf| {
            out.extend_from_slice(self.leaf(leaf).0);
            ControlFlow::Continue(())
        });
    }

    /// Calls `leaf` for each leaf whose sphere `meets` the query, until it breaks.
    pub(super) fn visit(
        &self,
        meets: impl Fn(&Sphere) -> bool,
        mut leaf: impl FnMut(&TreeNode) -> ControlFlow<()>,
    ) -> ControlFlow<()> {
        if !meets(&self.nodes[0].sphere) {
            return ControlFlow::Continue(());
        }
        let mut stack = [0_u32; STACK_LEN];
        let mut height = 1;
        while height > 0 {
            height -= 1;
            let node = &self.nodes[stack[height] as usize];
            if node.is_leaf() {
                leaf(node)?;
                continue;
            }
            for (child, offset) in self.nodes[node.child_range()].iter().zip(0..) {
                if meets(&child.sphere) {
                    stack[height] = node.first_child + offset;
                    height += 1;
                }
            }
        }
        ControlFlow::Continue(())
    }
}

/// At most seven siblings wait on each of 21 levels below the root, and eight on the last.
const STACK_LEN: usize = 7 * 21 + 8;
