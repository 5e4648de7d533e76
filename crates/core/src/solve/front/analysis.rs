//! Everything about a factor that depends on the pattern of `K11` only: fronts, where entries and
//! contributions go, work and memory.

use super::etree::{EliminationTree, NONE, inverse};
use super::slabs::{BlockSlabs, Slabs};
use super::supernodes::{Supernodes, flops};
use super::{Real, runs};
use crate::fem::{AXES, Stiffness, dof};
use crate::solve::ordering::NodeGraph;
use crate::solve::{Method, Partition};

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
    /// Place in the order of elimination of every row of `K11`.
    pub(super) position: Vec<u32>,
    /// The fronts in postorder: children before parents, subtrees contiguous.
    pub(super) fronts: Vec<Front>,
    /// Fronts without a parent.
    pub(super) roots: Vec<u32>,
    pub(super) entries: Entries,
    node_count: usize,
    block_count: usize,
}

/// One dense front: `pivots` rows eliminated here and the rows they couple to.
///
/// Shapes: panel `size` × `pivots`, lower triangle of its top; contribution block
/// (`size` − `pivots`)², lower triangle, added to the parent's front; both in slabs ([`Slabs`]).
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
    /// Contribution rows that the parent eliminates; they come first.
    pub eliminated: usize,
    /// First front of the subtree.
    pub subtree_first: u32,
    /// Work of the subtree.
    pub subtree_flops: f64,
    /// Entries of the subtree's panels, without the zeros that slabs are filled up with.
    pub subtree_entries: usize,
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

    /// How its panel lies in memory.
    pub fn slabs<T: Real>(&self) -> Slabs {
        Slabs::new::<T>(self.pivots, self.rest())
    }

    /// How its contribution block lies in memory.
    pub fn block_slabs<T: Real>(&self) -> BlockSlabs {
        BlockSlabs::new::<T>(self.rest(), self.eliminated)
    }

    /// Entries of the factor, explicit zeros of merged fronts included.
    fn entries(&self) -> usize {
        self.size * self.pivots - self.pivots * (self.pivots.max(1) - 1) / 2
    }

    /// Whether the subtree is one task.
    pub fn is_serial(&self) -> bool {
        self.subtree_flops < SERIAL_FLOPS
    }
}

impl FrontAnalysis {
    /// Orders and analyses the `K11` of a partition.
    ///
    /// Source: thesis (3.41); nested dissection of the graph of nodes.
    pub fn new(stiffness: &Stiffness, partition: &Partition) -> Self {
        let graph = NodeGraph::new(stiffness, partition);
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
        let mut supernodes = Supernodes::new(graph, &tree);
        supernodes.permute(&runs::places(&supernodes));
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
        this
    }

    /// Links the fronts to their children and sums over subtrees.
    fn link(&mut self, supernodes: &Supernodes) {
        for v in 0..self.fronts.len() {
            let parent = supernodes.parent[v];
            let front = &mut self.fronts[v];
            front.parent = parent;
            front.subtree_flops += flops(front.pivots as f64, front.size as f64);
            front.subtree_entries += front.entries();
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
                let runs = runs(placed, pivots);
                let eliminated = runs.iter().filter(|run| run.parent < pivots).map(|run| run.len);
                let front = &mut self.fronts[child as usize];
                (front.eliminated, front.runs) = (eliminated.sum::<u32>() as usize, runs);
                self.fronts[v].children.push(child);
            }
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
        self.fronts.iter().map(Front::entries).sum()
    }

    /// Floating point operations of a factorisation.
    pub fn flops(&self) -> f64 {
        self.roots.iter().map(|&v| self.fronts[v as usize].subtree_flops).sum()
    }

    /// Number of fronts.
    pub fn front_count(&self) -> usize {
        self.fronts.len()
    }

    /// Bytes of a factor in this precision, with the zeros that fill up slabs.
    pub fn factor_bytes<T: Real>(&self) -> usize {
        self.fronts.iter().map(|f| f.slabs::<T>().panel_len()).sum::<usize>() * size_of::<T>()
    }

    /// Numbers of the contribution blocks that can be there at once, on any number of threads.
    pub(super) fn blocks_max<T: Real>(&self) -> usize {
        self.most::<T>(|_| 0)
    }

    /// Numbers that can be there at once while a factor is made, on any number of threads: panels and
    /// contribution blocks. Panels are allocated as their fronts are come to, so what waits deep in
    /// the tree waits before the panels above are there.
    pub(super) fn peak<T: Real>(&self) -> usize {
        self.most::<T>(|front| front.slabs::<T>().panel_len())
    }

    /// Most numbers at once, where a front keeps some and its block goes with its parent: the columns
    /// that the parent eliminates before its own block is there, the others after that.
    fn most<T: Real>(&self, kept_by: impl Fn(&Front) -> usize) -> usize {
        let block = |v: usize| self.fronts[v].block_slabs::<T>();
        let mut most = vec![0usize; self.fronts.len()];
        let mut kept: Vec<usize> = self.fronts.iter().map(kept_by).collect();
        for (v, front) in self.fronts.iter().enumerate() {
            let children = || front.children.iter().map(|&c| c as usize);
            let below = match front.is_serial() {
                // One after another: what those before keep and hand on waits.
                true => {
                    let mut waiting = 0;
                    let mut below = 0;
                    for c in children() {
                        below = below.max(waiting + most[c]);
                        waiting += kept[c] + block(c).len();
                    }
                    below
                }
                // All children at their most at once.
                false => children().map(|c| most[c]).sum(),
            };
            kept[v] += children().map(|c| kept[c]).sum::<usize>();
            let eliminated = children().map(|c| block(c).eliminated_len()).sum::<usize>();
            let passed_on = children().map(|c| block(c).passed_on_len()).sum::<usize>();
            most[v] = below.max(kept[v] + passed_on + eliminated.max(block(v).len()));
        }
        self.roots.iter().map(|&v| most[v as usize]).sum()
    }

    /// Upper bound of the bytes held while factoring, on any number of threads.
    pub fn peak_bytes<T: Real>(&self) -> usize {
        self.peak::<T>() * size_of::<T>()
    }

    /// Largest memory while the factor is made, in the precision of a method.
    pub fn peak_bytes_of(&self, method: Method) -> usize {
        match method.is_single() {
            false => self.peak_bytes::<f64>(),
            true => self.peak_bytes::<f32>(),
        }
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
