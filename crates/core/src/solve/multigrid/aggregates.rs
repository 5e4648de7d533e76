//! Gathers neighbouring nodes into aggregates, the nodes of the next coarser level.

use super::block_rows::{NodeMatrix, TASK_ROWS};
use super::small::square;
use rayon::prelude::*;

/// Which aggregate each node belongs to.
pub(super) struct Aggregates {
    /// Aggregate of each node, or [`Aggregates::NONE`].
    of_node: Vec<u32>,
    count: usize,
}

/// Two nodes belong together if the block between them is at least this share of the mean of their
/// own blocks; halved from level to level.
///
/// Source: Vaněk, Mandel, Brezina 1996, section 5.1, with norms of blocks.
const STRONG: f64 = 0.08;

/// Fewer nodes than this in an aggregate, on average, make a coarse system that is hardly smaller: in
/// flat boxes the strong neighbours of a node are two. Weaker ones are then taken for strong.
const GATHERED_MIN: usize = 6;
/// The shares that are tried, over the first one, before all neighbours are taken.
const WEAKER: [f64; 3] = [1.0, 0.25, 0.0625];

/// For each node those that it belongs together with.
struct Strong {
    start: Vec<usize>,
    nodes: Vec<u32>,
}

impl Strong {
    /// Neighbours by the norms of blocks, at least a share of the mean of a pair's own blocks.
    fn new<const B: usize>(rows: &impl NodeMatrix<B, B>, share: f64) -> Self {
        let count = rows.row_count();
        let own: Vec<f64> = (0..count)
            .into_par_iter()
            .with_min_len(TASK_ROWS)
            .map(|row| {
                let mut own = 0.0;
                rows.visit(row, &mut |column, block| {
                    if column == row {
                        own = square(block).sqrt();
                    }
                });
                own
            })
            .collect();
        let share = share * share;
        let tasks: Vec<(Vec<usize>, Vec<u32>)> = (0..count.div_ceil(TASK_ROWS))
            .into_par_iter()
            .map(|task| {
                let (mut ends, mut nodes) = (Vec::new(), Vec::new());
                for row in task * TASK_ROWS..count.min((task + 1) * TASK_ROWS) {
                    rows.visit(row, &mut |column, block| {
                        if column != row && square(block) > share * own[row] * own[column] {
                            nodes.push(column as u32);
                        }
                    });
                    ends.push(nodes.len());
                }
                (ends, nodes)
            })
            .collect();
        let (mut start, mut nodes) = (vec![0], Vec::new());
        for (ends, of_task) in tasks {
            let before = nodes.len();
            start.extend(ends.into_iter().map(|end| before + end));
            nodes.extend_from_slice(&of_task);
        }
        Self { start, nodes }
    }

    fn of(&self, node: usize) -> &[u32] {
        &self.nodes[self.start[node]..self.start[node + 1]]
    }

    fn node_count(&self) -> usize {
        self.start.len() - 1
    }
}

impl Aggregates {
    /// A node without neighbours is in no aggregate: smoothing alone finds its answer.
    pub const NONE: u32 = u32::MAX;

    /// Aggregates of the nodes of a matrix; `level` counts from 0, the finest.
    pub fn new<const B: usize>(rows: &impl NodeMatrix<B, B>, level: usize) -> Self {
        let share = STRONG * 0.5f64.powi(level as i32);
        for weaker in WEAKER {
            let this = Self::gather(&Strong::new(rows, weaker * share));
            if GATHERED_MIN * this.count <= this.of_node.len() {
                return this;
            }
        }
        Self::gather(&Strong::new(rows, 0.0))
    }

    /// First nodes none of whose neighbours is taken, with all their neighbours; then each node left
    /// joins the aggregate of most of its neighbours; what is left then gathers by itself.
    ///
    /// Source: Vaněk, Mandel, Brezina 1996, algorithm 5.1.
    fn gather(strong: &Strong) -> Self {
        let mut this = Self { of_node: vec![Self::NONE; strong.node_count()], count: 0 };
        for node in 0..strong.node_count() {
            let around = strong.of(node);
            let is_free = |n: u32| this.of_node[n as usize] == Self::NONE;
            if !around.is_empty() && is_free(node as u32) && around.iter().all(|&n| is_free(n)) {
                this.take(node, around);
            }
        }
        let joined: Vec<u32> = (0..strong.node_count())
            .into_par_iter()
            .map(|node| match this.of_node[node] {
                Self::NONE => this.most_around(strong.of(node)),
                own => own,
            })
            .collect();
        this.of_node = joined;
        for node in 0..strong.node_count() {
            if this.of_node[node] == Self::NONE && !strong.of(node).is_empty() {
                this.take(node, strong.of(node));
            }
        }
        this
    }

    /// A new aggregate of a node and those around it that are free.
    fn take(&mut self, node: usize, around: &[u32]) {
        let aggregate = self.count as u32;
        self.of_node[node] = aggregate;
        for &n in around {
            if self.of_node[n as usize] == Self::NONE {
                self.of_node[n as usize] = aggregate;
            }
        }
        self.count += 1;
    }

    /// The aggregate that most of some nodes are in, the first of equals.
    fn most_around(&self, around: &[u32]) -> u32 {
        let mut found: Vec<u32> = around.iter().map(|&n| self.of_node[n as usize]).collect();
        found.retain(|&aggregate| aggregate != Self::NONE);
        found.sort_unstable();
        let groups = found.chunk_by(|a, b| a == b);
        let mut best: &[u32] = &[];
        for group in groups {
            if group.len() > best.len() {
                best = group;
            }
        }
        best.first().copied().unwrap_or(Self::NONE)
    }

    /// Number of aggregates.
    pub fn count(&self) -> usize {
        self.count
    }

    /// Aggregate of a node, or [`Aggregates::NONE`].
    pub fn of(&self, node: usize) -> u32 {
        self.of_node[node]
    }

    /// The nodes of each aggregate, ascending.
    pub fn members(&self) -> Vec<Vec<u32>> {
        let mut members = vec![Vec::new(); self.count];
        for (node, &aggregate) in self.of_node.iter().enumerate() {
            if aggregate != Self::NONE {
                members[aggregate as usize].push(node as u32);
            }
        }
        members
    }
}
