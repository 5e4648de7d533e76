//! The sphere tree itself: flat arrays of spheres and of the surface vertices they enclose, and the ways
//! down through them (thesis 4.4.3).

use std::ops::{ControlFlow, Range};

use nalgebra::Point3;

use super::build::{Cells, cells, leaves};
use super::node::{LeafRest, TreeError, TreeNode, check_positions};
use super::overlap::{
    cylinder_covers_sphere, cylinder_meets_sphere, sphere_covers_sphere, sphere_meets_sphere,
};
use super::refit::{refit_spheres, search_cost};
use crate::shape::{Cylinder, Sphere};

/// Octree of bounding spheres over surface vertices, in the frame of the positions it was built on.
///
/// Nodes lie breadth first, so a node's children are contiguous and always behind it. Vertices lie
/// in Morton order, so every subtree owns one contiguous run of them.
///
/// The thesis tests vertices against *overlapping* spheres (Figure 4.8), which stores a vertex once
/// for every sphere it falls in. Here each vertex belongs to the one cube cell that holds it, and
/// the cell's sphere (4.3) encloses the cell: nothing is stored twice and nothing is missed.
/// A cell whose vertices all fall in one child is replaced by that child (no single-child chains).
/// Vertices that share a cell 21 levels down (coincident ones) share a leaf.
///
/// Invariants: each sphere encloses its vertices and the spheres of its children;
/// 1 ≤ leaf count ≤ vertex count; `children` ≤ 8, depth ≤ 22.
///
/// Source: thesis 4.3, Table 4.1.
#[derive(Clone, Debug, PartialEq)]
pub struct SphereTree {
    nodes: Vec<TreeNode>,
    /// Number of the mesh node in each slot.
    vertices: Vec<u32>,
    /// Position of the vertex in each slot, as of the last build or refit.
    points: Vec<Point3<f64>>,
    /// The leaves, with what it takes to carry their spheres along.
    leaves: Vec<LeafRest>,
    /// The nodes that have children, ascending.
    inner: Vec<u32>,
    /// Search cost measure right after the build and now (see [`SphereTree::quality`]).
    cost_built: f64,
    cost: f64,
}

/// How close a collider is to the surface vertices.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Closeness {
    /// No vertex is within the margin.
    Clear,
    /// A vertex is within the margin, none inside the collider.
    Near,
    /// A vertex is inside: the collider penetrates the object.
    Colliding,
}

/// A sphere that a search has compared with a part of the hand.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VisitedSphere {
    /// The sphere of a tree node, in the frame of the tree.
    pub sphere: Sphere,
    /// Level of the node in the tree, the root's being 0.
    pub level: usize,
    /// Whether the sphere overlaps the part: only then the node's children are visited.
    pub overlaps: bool,
    /// Whether the node has no children, so that an overlap is a vertex near the part.
    pub is_leaf: bool,
}

impl SphereTree {
    /// Builds the tree over `surface_nodes`, in O(n log n); the result does not depend on their order.
    ///
    /// Shapes: `positions` all mesh nodes; `surface_nodes` indices into them, repetitions ignored.
    /// Units: those of `positions`. Frame: that of `positions` (the object's).
    ///
    /// # Errors
    /// [`TreeError`] if there is no vertex, an index is out of range or a coordinate is not finite.
    ///
    /// Source: thesis 4.3.2–4.3.3, (4.1)–(4.6).
    pub fn try_build(positions: &[Point3<f64>], surface_nodes: &[u32]) -> Result<Self, TreeError> {
        let Cells { nodes, vertices, points } = cells(positions, surface_nodes)?;
        let leaves = leaves(&nodes, &points);
        let inner = (0..).zip(&nodes).filter(|(_, n)| !n.is_leaf()).map(|(i, _)| i).collect();
        let cost = search_cost(&nodes);
        Ok(Self { nodes, vertices, points, leaves, inner, cost_built: cost, cost })
    }

    /// Number of distinct surface vertices.
    pub fn vertex_count(&self) -> usize {
        self.vertices.len()
    }

    /// Number of spheres, leaves included.
    pub fn sphere_count(&self) -> usize {
        self.nodes.len()
    }

    /// The spheres, breadth first.
    #[cfg(test)]
    pub(super) fn nodes(&self) -> &[TreeNode] {
        &self.nodes
    }

    /// Sphere at the root: encloses the whole surface.
    pub fn bounding_sphere(&self) -> Sphere {
        self.nodes[0].sphere
    }

    /// Mesh nodes of the surface vertices in Morton order (near in the list is near in space).
    pub fn vertices(&self) -> &[u32] {
        &self.vertices
    }

    /// The vertices below a node and their positions.
    pub(super) fn run(&self, node: &TreeNode) -> (&[u32], &[Point3<f64>]) {
        let slots = node.slot_range();
        (&self.vertices[slots.clone()], &self.points[slots])
    }

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
        self.cost = refit_spheres(&mut self.nodes, &self.leaves, &self.inner, &self.points);
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

    /// The spheres that the search for vertices near a fingertip visits; see
    /// [`SphereTree::visited_by_cylinder`].
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

    /// Appends the vertices whose leaf sphere meets a fingertip; see [`SphereTree::search_cylinder`].
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

    /// How close a finger segment is: a vertex inside the cylinder, within `margin` of it, or none.
    ///
    /// Vertices only: a cylinder thinner than the mesh is coarse can pass between them.
    /// Units: m. Frame: that of the tree.
    pub fn closeness_to_cylinder(&self, cylinder: &Cylinder, margin: f64) -> Closeness {
        self.closeness(margin, |sphere| cylinder_meets_sphere(cylinder, sphere))
    }

    /// How close a fingertip is to the vertices; see [`SphereTree::closeness_to_cylinder`].
    pub fn closeness_to_sphere(&self, tip: &Sphere, margin: f64) -> Closeness {
        self.closeness(margin, |sphere| sphere_meets_sphere(tip, sphere))
    }

    fn closeness(&self, margin: f64, meets: impl Fn(&Sphere) -> bool) -> Closeness {
        let mut closest = Closeness::Clear;
        let grown = |s: &Sphere| Sphere { centre: s.centre, radius: s.radius + margin };
        let _ = self.visit(
            |sphere| meets(&grown(sphere)),
            |_| false,
            |leaf| {
                for &centre in self.run(leaf).1 {
                    if meets(&Sphere { centre, radius: 0.0 }) {
                        closest = Closeness::Colliding;
                        return ControlFlow::Break(());
                    }
                    if meets(&Sphere { centre, radius: margin }) {
                        closest = Closeness::Near;
                    }
                }
                ControlFlow::Continue(())
            },
        );
        closest
    }
}

/// Inner nodes have at most 21 levels; on each, at most seven siblings wait, on the last eight.
const STACK_LEN: usize = 7 * 21 + 1;

/// Chosen: a rebuild costs about as much as thirty searches with all fingers (release build, 10 000
/// vertices), so at twice the spheres to test it pays within half a second.
const QUALITY_MAX: f64 = 2.0;
