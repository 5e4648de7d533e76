//! Searching down the tree for the surface vertices near a finger (thesis 4.4.3).

use std::ops::ControlFlow;

use nalgebra::Point3;

use super::overlap::{
    cylinder_covers_sphere, cylinder_meets_sphere, sphere_covers_sphere, sphere_meets_sphere,
};
use super::tree::{SphereTree, TreeNode};
use crate::shape::{Cylinder, Sphere};

impl SphereTree {
    /// Appends the vertices the thesis calls "near" a finger segment: those whose leaf sphere meets it.
    ///
    /// Frame: that of the tree. Order: fixed by tree and query, without meaning.
    /// `out` is the caller's buffer and is not cleared; nothing else is allocated.
    ///
    /// Source: thesis 4.4.3.
    pub fn search_cylinder(&self, cylinder: &Cylinder, out: &mut Vec<u32>) {
        self.collect(
            |sphere| cylinder_meets_sphere(cylinder, sphere),
            |sphere| cylinder_covers_sphere(cylinder, sphere),
            out,
        );
    }

    /// As [`SphereTree::search_cylinder`], for a fingertip.
    pub fn search_sphere(&self, tip: &Sphere, out: &mut Vec<u32>) {
        self.collect(
            |sphere| sphere_meets_sphere(tip, sphere),
            |sphere| sphere_covers_sphere(tip, sphere),
            out,
        );
    }

    /// Appends the vertices within `radius` of `point`: exact distances, for prefetching columns.
    pub fn nodes_near(&self, point: &Point3<f64>, radius: f64, out: &mut Vec<u32>) {
        let ball = Sphere { centre: *point, radius };
        let _ = self.visit(
            |sphere| sphere_meets_sphere(&ball, sphere),
            |_| false,
            |leaf| {
                let (nodes, points) = self.run(leaf);
                let near = points.iter().map(|p| (p - point).norm_squared() <= radius * radius);
                out.extend(nodes.iter().zip(near).filter(|(_, near)| *near).map(|(&n, _)| n));
                ControlFlow::Continue(())
            },
        );
    }

    fn collect(
        &self,
        meets: impl Fn(&Sphere) -> bool,
        covers: impl Fn(&Sphere) -> bool,
        out: &mut Vec<u32>,
    ) {
        let _ = self.visit(meets, covers, |found| {
            match self.run(found).0 {
                // Nearly always; spares the call that copies a slice.
                [vertex] => out.push(*vertex),
                several => out.extend_from_slice(several),
            }
            ControlFlow::Continue(())
        });
    }

    /// Calls `found` for each leaf whose sphere `meets` the query, until it breaks.
    ///
    /// A subtree whose sphere the query `covers` is reported once, as a whole: each sphere below
    /// lies inside and would meet the query too.
    pub(super) fn visit(
        &self,
        meets: impl Fn(&Sphere) -> bool,
        covers: impl Fn(&Sphere) -> bool,
        mut found: impl FnMut(&TreeNode) -> ControlFlow<()>,
    ) -> ControlFlow<()> {
        let root = &self.nodes[0];
        if !meets(&root.sphere) {
            return ControlFlow::Continue(());
        }
        if root.is_leaf() {
            return found(root);
        }
        let mut stack = [0_u32; STACK_LEN];
        let mut height = 1;
        while height > 0 {
            height -= 1;
            let node = &self.nodes[stack[height] as usize];
            for (child, index) in self.nodes[node.child_range()].iter().zip(node.first_child..) {
                if !meets(&child.sphere) {
                    continue;
                }
                if child.is_leaf() || covers(&child.sphere) {
                    found(child)?;
                } else {
                    stack[height] = index;
                    height += 1;
                }
            }
        }
        ControlFlow::Continue(())
    }
}

/// Inner nodes have at most 21 levels; on each, at most seven siblings wait, on the last eight.
const STACK_LEN: usize = 7 * 21 + 1;
