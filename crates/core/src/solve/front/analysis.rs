//! Everything about a factor that depends on the pattern of `K11` only: fronts, where entries and
//! contributions go, work and memory.

use super::etree::{EliminationTree, NONE, inverse};
use super::supernodes::{Supernodes, flops};
use crate::fem::{AXES, Stiffness, dof};
use crate::solve::Partition;
use crate::solve::ordering::NodeGraph;

/// Marks a stiffness block whose entries go to no panel: known, or stored by symmetry.
const NOWHERE: u32 = u32::MAX;

/// Subtrees below this work (floating point operations) are one task each.
const SERIAL_FLOPS: f64 = 30e6;

/// Elimination order, fronts and the tree they form, for all factors of one pattern.
///
/// Shapes: n rows of `K11`.
///
/// Source: Duff and Reid, "The multifrontal solution of indefinite sparse symmetric linear
/// equations" (1983); Liu, "The multifrontal method for sparse matrix solution" (1992).
pub struct FrontAnalysis {
    /// `order[new]` is the row of `K11` eliminated at `new`.
    pub(super) order: Vec<u32>,
    /// Its inverse.
    pub(super) position: Vec<u32>,
    /// Postordered: children before parents, subtrees contiguous.
    pub(super) fronts: Vec<Front>,
    /// Fronts without a parent.
    pub(super) roots: Vec<u32>,
    pub(super) entries: Entries,
    node_count: usize,
    block_count: usize,
}

/// One dense front: `pivots` rows eliminated here and the rows they couple to.
///
/// Shapes: panel `size` × `pivots` column-major, lower triangle of its top; contribution block
/// (`size` − `pivots`)², lower triangle, added to the parent's front.
#[derive(Default)]
pub(super) struct Front {
    /// First eliminated row, in the elimination order.
    pub first: usize,
    pub pivots: usize,
    pub size: usize,
    /// Parent front, or [`NONE`].
    pub parent: u32,
    pub children: Vec<u32>,
    /// Where the contribution rows lie in the parent.
    pub runs: Vec<Run>,
    /// First front of the subtree.
    pub subtree_first: u32,
    /// Work of the subtree.
    pub subtree_flops: f64,
    /// Entries of the subtree's panels.
    pub subtree_entries: usize,
    /// Where the contribution block lies in the arena of its serial subtree.
    pub in_arena: usize,
    /// At the root of a serial subtree: entries its arena must hold.
    pub arena: usize,
    /// Vertices eliminated here, as a range of [`Entries`].
    pub vertices: std::ops::Range<u32>,
}

/// Neighbouring rows of a contribution block that are neighbours in the parent's front too.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Run {
    /// First row in the contribution block.
    pub child: u32,
    /// First row in the parent's front; a run never crosses from its pivots to the rest.
    pub parent: u32,
    pub len: u32,
}

/// Where each stiffness block of an eliminated vertex goes, vertex by vertex in elimination order.
pub(super) struct Entries {
    /// Mesh node of each vertex.
    pub nodes: Vec<u32>,
    /// Unknown axes of each vertex, one bit each.
    pub axes: Vec<u8>,
    /// Unknown axes of every mesh node.
    pub node_axes: Vec<u8>,
    /// `target[start[v] + k]` is the first row, in the vertex's front, of the k-th block of its
    /// stiffness row, or [`NOWHERE`].
    pub start: Vec<u32>,
    pub target: Vec<u32>,
}

impl Entries {
    /// Stiffness blocks of a vertex with their first front rows and unknown axes.
    pub fn of<'a>(
        &'a self,
        vertex: usize,
        stiffness: &'a Stiffness,
    ) -> impl Iterator<Item = (usize, u8, &'a [f64; 9])> {
        let targets = &self.target[self.start[vertex] as usize..];
        stiffness
            .row(self.nodes[vertex] as usize)
            .zip(targets)
            .filter(|&(_, &target)| target != NOWHERE)
            .map(|((node, block), &target)| (target as usize, self.node_axes[node], block))
    }
}

impl Front {
    /// Rows left over for the parent.
    pub fn rest(&self) -> usize {
        self.size - self.pivots
    }

    /// Entries of the panel.
    pub fn panel_len(&self) -> usize {
        self.size * self.pivots
    }

    /// Whether the subtree is one task.
    pub fn is_serial(&self) -> bool {
        self.subtree_flops < SERIAL_FLOPS
    }
}

impl FrontAnalysis {
    /// Orders and analyses the `K11` of a partition.
    ///
    /// Source: thesis (3.41); METIS nested dissection of the graph of nodes.
    pub fn new(stiffness: &Stiffness, partition: &Partition) -> Self {
        let mut graph = NodeGraph::new(stiffness, partition);
        let order = graph.nested_dissection();
        Self::with_order(stiffness, partition, &graph, order)
    }

    /// Analyses `K11` under a given order of the graph's vertices.
    pub(super) fn with_order(
        stiffness: &Stiffness,
        partition: &Partition,
        graph: &NodeGraph,
        order: Vec<u32>,
    ) -> Self {
        let tree = EliminationTree::new(graph, order);
        let supernodes = Supernodes::new(graph, &tree);
        let mut axes = Vec::with_capacity(graph.len());
        let mut first_row = Vec::with_capacity(graph.len() + 1);
        let mut order = Vec::with_capacity(partition.unknown().len());
        let mut node_axes = vec![0u8; stiffness.node_count()];
        for &vertex in &supernodes.order {
            let node = graph.nodes[vertex as usize] as usize;
            first_row.push(order.len() as u32);
            let mut mask = 0;
            for axis in 0..AXES {
                if let Some(row) = partition.row_of(dof(node, axis)) {
                    mask |= 1 << axis;
                    order.push(row as u32);
                }
            }
            node_axes[node] = mask;
            axes.push(mask);
        }
        first_row.push(order.len() as u32);
        let nodes = supernodes.order.iter().map(|&v| graph.nodes[v as usize]).collect();
        let entries = Entries { nodes, axes, node_axes, start: vec![0], target: Vec::new() };
        let mut this = Self {
            position: inverse(&order),
            order,
            fronts: shapes(&supernodes, &first_row),
            roots: Vec::new(),
            entries,
            node_count: stiffness.node_count(),
            block_count: stiffness.pattern().block_count(),
        };
        this.link(&supernodes);
        this.place_rows(stiffness, &supernodes, &first_row);
        this.place_arenas();
        this
    }

    /// Children, roots and sums over subtrees.
    fn link(&mut self, supernodes: &Supernodes) {
        for v in 0..self.fronts.len() {
            let parent = supernodes.parent[v];
            let front = &mut self.fronts[v];
            front.parent = parent;
            front.subtree_flops += flops(front.pivots as f64, front.size as f64);
            front.subtree_entries += front.panel_len();
            let (work, entries) = (front.subtree_flops, front.subtree_entries);
            let first = front.subtree_first;
            match self.fronts.get_mut(parent as usize) {
                Some(parent) => {
                    parent.children.push(v as u32);
                    parent.subtree_flops += work;
                    parent.subtree_entries += entries;
                    parent.subtree_first = parent.subtree_first.min(first);
                }
                None => self.roots.push(v as u32),
            }
        }
    }

    /// Where stiffness blocks and contribution rows go in each front.
    fn place_rows(&mut self, stiffness: &Stiffness, supernodes: &Supernodes, first_row: &[u32]) {
        let mut position_of_node = vec![NONE; stiffness.node_count()];
        for (position, &node) in self.entries.nodes.iter().enumerate() {
            position_of_node[node as usize] = position as u32;
        }
        let width = |i: u32| first_row[i as usize + 1] - first_row[i as usize];
        let mut local = vec![0u32; supernodes.order.len()];
        for v in 0..self.fronts.len() {
            let mut next = 0;
            for i in supernodes.columns(v).chain(supernodes.rows(v).iter().copied()) {
                local[i as usize] = next;
                next += width(i);
            }
            for j in supernodes.columns(v) {
                let node = self.entries.nodes[j as usize] as usize;
                let targets = stiffness.pattern().columns(node).iter().map(|&other| {
                    match position_of_node[other as usize] {
                        // Not free; or before j, and then this is the other triangle.
                        i if i == NONE || i < j => NOWHERE,
                        i => local[i as usize],
                    }
                });
                self.entries.target.extend(targets);
                self.entries.start.push(self.entries.target.len() as u32);
            }
            let pivots = self.fronts[v].pivots as u32;
            for child in std::mem::take(&mut self.fronts[v].children) {
                let rows = supernodes.rows(child as usize);
                let placed = rows.iter().map(|&i| (local[i as usize], width(i)));
                self.fronts[child as usize].runs = runs(placed, pivots);
                self.fronts[v].children.push(child);
            }
        }
    }

    /// Lays the contribution blocks of each serial subtree out in one arena with two stacks: even
    /// depths from the left, odd ones from the right. A front pushes on one stack while its
    /// children's blocks lie on top of the other.
    fn place_arenas(&mut self) {
        let heads: Vec<usize> = (0..self.fronts.len())
            .filter(|&v| {
                let parent = self.fronts.get(self.fronts[v].parent as usize);
                self.fronts[v].is_serial() && !parent.is_some_and(Front::is_serial)
            })
            .collect();
        for head in heads {
            let first = self.fronts[head].subtree_first as usize;
            let mut odd = vec![false; head - first + 1];
            for v in (first..head).rev() {
                odd[v - first] = !odd[self.fronts[v].parent as usize - first];
            }
            let (mut tops, mut most) = ([0, 0], 0);
            for v in first..=head {
                let side = usize::from(odd[v - first]);
                // The left stack grows from the start, the right one towards smaller offsets.
                self.fronts[v].in_arena = tops[0];
                tops[side] += self.fronts[v].rest().pow(2);
                if side == 1 {
                    self.fronts[v].in_arena = tops[1];
                }
                most = most.max(tops[0] + tops[1]);
                let children = &self.fronts[v].children;
                let popped: usize =
                    children.iter().map(|&c| self.fronts[c as usize].rest().pow(2)).sum();
                tops[1 - side] -= popped;
            }
            for v in first..=head {
                if odd[v - first] {
                    self.fronts[v].in_arena = most - self.fronts[v].in_arena;
                }
            }
            self.fronts[head].arena = most;
        }
    }

    /// Number of rows of `K11`.
    pub fn row_count(&self) -> usize {
        self.order.len()
    }

    /// Whether a stiffness has the pattern this analysis was made for, as far as its counts tell.
    pub(super) fn fits(&self, stiffness: &Stiffness) -> bool {
        stiffness.node_count() == self.node_count
            && stiffness.pattern().block_count() == self.block_count
    }

    /// Entries of the factor, explicit zeros of merged fronts included.
    pub fn fill(&self) -> usize {
        self.fronts.iter().map(|f| f.panel_len() - f.pivots * (f.pivots.max(1) - 1) / 2).sum()
    }

    /// Floating point operations of a factorisation.
    pub fn flops(&self) -> f64 {
        self.roots.iter().map(|&v| self.fronts[v as usize].subtree_flops).sum()
    }

    /// Number of fronts.
    pub fn front_count(&self) -> usize {
        self.fronts.len()
    }

    /// Numbers a factor stores: each panel is a full rectangle.
    pub(super) fn stored(&self) -> usize {
        self.fronts.iter().map(Front::panel_len).sum()
    }

    /// Bytes of a factor in numbers of `size_of::<T>()` bytes.
    pub fn factor_bytes<T>(&self) -> usize {
        self.stored() * size_of::<T>()
    }

    /// Upper bound of the bytes held while factoring, on any number of threads: panels and
    /// contribution blocks that can be there at once. Panels are allocated as their fronts are come
    /// to, so what waits deep in the tree waits before the panels above are there.
    pub fn peak_bytes<T>(&self) -> usize {
        let mut most = vec![0usize; self.fronts.len()];
        for (v, front) in self.fronts.iter().enumerate() {
            most[v] = if front.is_serial() {
                front.subtree_entries + front.arena
            } else {
                // All children at their most at once; or all done, and this front beside them.
                let below: usize = front.children.iter().map(|&c| most[c as usize]).sum();
                let blocks: usize =
                    front.children.iter().map(|&c| self.fronts[c as usize].rest().pow(2)).sum();
                below.max(front.subtree_entries + blocks + front.rest().pow(2))
            };
        }
        let most: usize = self.roots.iter().map(|&v| most[v as usize]).sum();
        most * size_of::<T>()
    }
}

/// Sizes of the fronts from the supernodes, in degrees of freedom.
fn shapes(supernodes: &Supernodes, first_row: &[u32]) -> Vec<Front> {
    (0..supernodes.len())
        .map(|v| {
            let vertices = supernodes.columns(v);
            let first = first_row[vertices.start as usize] as usize;
            let pivots = first_row[vertices.end as usize] as usize - first;
            let width = |&i: &u32| (first_row[i as usize + 1] - first_row[i as usize]) as usize;
            let size = pivots + supernodes.rows(v).iter().map(width).sum::<usize>();
            let subtree_first = v as u32;
            Front { first, pivots, size, subtree_first, vertices, ..Front::default() }
        })
        .collect()
}

/// Joins rows that are neighbours on both sides: `placed` gives (first row in the parent, width)
/// of each vertex of the contribution block.
fn runs(placed: impl Iterator<Item = (u32, u32)>, parent_pivots: u32) -> Vec<Run> {
    let mut runs: Vec<Run> = Vec::new();
    let mut child = 0;
    for (parent, len) in placed {
        match runs.last_mut() {
            Some(run) if run.parent + run.len == parent && parent != parent_pivots => {
                run.len += len;
            }
            _ => runs.push(Run { child, parent, len }),
        }
        child += len;
    }
    runs
}
