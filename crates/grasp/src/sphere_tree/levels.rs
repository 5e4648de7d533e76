//! The spheres of the tree level by level, to be looked at (thesis Figure 4.13).

use std::ops::Range;

use super::tree::SphereTree;
use crate::shape::Sphere;

impl SphereTree {
    /// Levels below the root; 0 where the root is a leaf.
    pub fn depth(&self) -> usize {
        self.levels().count() - 1
    }

    /// The spheres with which the tree covers the surface at a level, the root's being 0: those of
    /// that level, and the leaves above it, so every surface vertex lies in one of them. Below the
    /// last level there are the leaves.
    ///
    /// A cell with one child is left out of the tree, so spheres of one level differ in size.
    /// Frame: that of the tree.
    ///
    /// Source: thesis Figure 4.13.
    pub fn spheres_at_level(&self, level: usize) -> Vec<Sphere> {
        let end = self.nodes.len();
        let of_level = self.levels().nth(level).unwrap_or(end..end);
        let above = self.nodes[..of_level.start].iter().filter(|node| node.is_leaf());
        above.chain(&self.nodes[of_level]).map(|node| node.sphere).collect()
    }

    /// Where the nodes of each level lie: breadth first, so one level is one run.
    fn levels(&self) -> impl Iterator<Item = Range<usize>> {
        std::iter::successors(Some(0..1), |level| {
            let last_inner = self.nodes[level.clone()].iter().rev().find(|node| !node.is_leaf())?;
            Some(level.end..last_inner.child_range().end)
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Point3;
    use softgrasp_core::mesh::{BuiltIn, Surface, generate};

    fn strawberry() -> (SphereTree, Vec<Point3<f64>>) {
        let mesh = generate(BuiltIn::Strawberry, 800).unwrap();
        let nodes = Surface::from_mesh(&mesh).nodes;
        let points = nodes.iter().map(|&n| mesh.vertices()[n as usize]).collect();
        (SphereTree::try_build(mesh.vertices(), &nodes).unwrap(), points)
    }

    #[test]
    fn levels_begin_with_the_root_and_end_with_the_leaves() {
        let (tree, points) = strawberry();
        assert_eq!(tree.spheres_at_level(0), [tree.bounding_sphere()]);
        let leaves = tree.nodes.iter().filter(|node| node.is_leaf()).count();
        let depth = tree.depth();
        assert!((2..=22).contains(&depth), "{depth}");
        assert_eq!(tree.spheres_at_level(depth).len(), leaves);
        assert_eq!(tree.spheres_at_level(depth + 1).len(), leaves);
        assert_eq!(leaves, points.len(), "no two vertices of this mesh coincide");
    }

    #[test]
    fn every_level_covers_every_vertex_with_more_and_smaller_spheres() {
        let (tree, points) = strawberry();
        let levels: Vec<_> = (0..=tree.depth()).map(|level| tree.spheres_at_level(level)).collect();
        for spheres in &levels {
            for point in &points {
                let holds = |s: &Sphere| (point - s.centre).norm() <= s.radius * (1.0 + 1e-12);
                assert!(spheres.iter().any(holds));
            }
        }
        let mean = |spheres: &[Sphere]| {
            spheres.iter().map(|s| s.radius).sum::<f64>() / spheres.len() as f64
        };
        for pair in levels.windows(2) {
            assert!(pair[0].len() < pair[1].len() && mean(&pair[0]) > mean(&pair[1]));
        }
    }

    #[test]
    fn one_vertex_is_one_level() {
        let tree = SphereTree::try_build(&[Point3::origin()], &[0]).unwrap();
        assert_eq!((tree.depth(), tree.spheres_at_level(0).len()), (0, 1));
    }
}
