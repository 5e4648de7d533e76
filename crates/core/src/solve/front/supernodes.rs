//! Columns of the factor grouped into dense fronts: fundamental supernodes, merged where the
//! zeros they take in cost less than the fronts they save.

use super::etree::{EliminationTree, NONE, inverse};
use crate::solve::ordering::NodeGraph;

/// Supernodes in postorder with the row structure of each.
///
/// Shapes: S supernodes; supernode v eliminates columns `start[v] .. start[v + 1]` (vertices of
/// the graph in elimination order, `order[new] = vertex`) and its front has the further rows
/// `rows[rows_start[v] .. rows_start[v + 1]]`, ascending. `parent` is a supernode or [`NONE`].
/// Every child precedes its parent and every subtree is a contiguous range.
pub(super) struct Supernodes {
    pub order: Vec<u32>,
    pub position: Vec<u32>,
    pub start: Vec<u32>,
    pub parent: Vec<u32>,
    pub rows_start: Vec<usize>,
    pub rows: Vec<u32>,
}

/// Supernode while it is being merged.
struct Group {
    /// Columns that the supernode eliminates.
    columns: u32,
    /// Rows of the front, eliminated ones included.
    rows: u32,
    /// Fundamental supernodes in it, in elimination order.
    parts: Vec<u32>,
    children: Vec<u32>,
}

impl Supernodes {
    /// Groups the columns of an elimination tree.
    pub fn new(graph: &NodeGraph, tree: &EliminationTree) -> Self {
        let part_start = fundamental(tree);
        let (mut groups, parents) = merge(tree, &part_start);
        // Larger subtrees first: their contribution blocks then wait for the smaller ones, not
        // the other way round, which keeps the stack low.
        let mut work: Vec<f64> = vec![0.0; groups.len()];
        for v in 0..groups.len() {
            work[v] += cost(groups[v].columns, groups[v].rows);
            if parents[v] != NONE {
                work[parents[v] as usize] += work[v];
            }
        }
        for group in &mut groups {
            group.children.sort_by(|&a, &b| work[b as usize].total_cmp(&work[a as usize]));
        }
        let visited = visit(&groups, &parents);
        let number = inverse(&visited);
        let mut order = Vec::with_capacity(tree.order.len());
        let mut start = vec![0];
        for &old in &visited {
            for &part in &groups[old as usize].parts {
                let columns = part_start[part as usize]..part_start[part as usize + 1];
                order.extend(columns.map(|j| tree.order[j as usize]));
            }
            start.push(order.len() as u32);
        }
        let parent = visited
            .iter()
            .map(|&old| match parents[old as usize] {
                NONE => NONE,
                parent => number[parent as usize],
            })
            .collect();
        let position = inverse(&order);
        let mut this =
            Self { order, position, start, parent, rows_start: vec![0], rows: Vec::new() };
        this.find_rows(graph);
        this
    }

    /// Gives columns other places inside their supernodes: `place[old] = new`.
    pub fn permute(&mut self, place: &[u32]) {
        let mut order = vec![0; self.order.len()];
        for (&vertex, &new) in self.order.iter().zip(place) {
            order[new as usize] = vertex;
        }
        self.position = inverse(&order);
        self.order = order;
        for row in &mut self.rows {
            *row = place[*row as usize];
        }
        for v in 0..self.len() {
            self.rows[self.rows_start[v]..self.rows_start[v + 1]].sort_unstable();
        }
    }

    /// Number of supernodes.
    pub fn len(&self) -> usize {
        self.parent.len()
    }

    /// Columns a supernode eliminates.
    pub fn columns(&self, v: usize) -> std::ops::Range<u32> {
        self.start[v]..self.start[v + 1]
    }

    /// Rows of a front below its eliminated columns.
    pub fn rows(&self, v: usize) -> &[u32] {
        &self.rows[self.rows_start[v]..self.rows_start[v + 1]]
    }

    /// Rows of each front: those its own columns couple to and those its children leave over.
    fn find_rows(&mut self, graph: &NodeGraph) {
        let mut children = vec![Vec::new(); self.len()];
        let mut seen = vec![NONE; self.order.len()];
        for v in 0..self.len() {
            let (first, end) = (self.start[v], self.start[v + 1]);
            let from = self.rows.len();
            let mut add = |rows: &mut Vec<u32>, i: u32| {
                if i >= end && std::mem::replace(&mut seen[i as usize], v as u32) != v as u32 {
                    rows.push(i);
                }
            };
            for j in first..end {
                for other in graph.neighbours(self.order[j as usize]) {
                    add(&mut self.rows, self.position[other as usize]);
                }
            }
            for &child in &children[v] {
                for k in self.rows_start[child as usize]..self.rows_start[child as usize + 1] {
                    let i = self.rows[k];
                    add(&mut self.rows, i);
                }
            }
            self.rows[from..].sort_unstable();
            self.rows_start.push(self.rows.len());
            if self.parent[v] != NONE {
                children[self.parent[v] as usize].push(v as u32);
            }
        }
    }
}

/// First columns of the fundamental supernodes, and the end: runs of columns, each the only child
/// of the next, whose structures are nested without a gap.
fn fundamental(tree: &EliminationTree) -> Vec<u32> {
    let n = tree.parent.len();
    let mut child_count = vec![0u32; n];
    for &p in tree.parent.iter().filter(|&&p| p != NONE) {
        child_count[p as usize] += 1;
    }
    let mut start = Vec::new();
    for j in 0..n {
        let continues = j > 0
            && tree.parent[j - 1] == j as u32
            && child_count[j] == 1
            && tree.counts[j - 1] == tree.counts[j] + 1;
        if !continues {
            start.push(j as u32);
        }
    }
    start.push(n as u32);
    start
}

/// Merges children into parents, from the leaves up. Returns the groups that are left, children
/// before parents, and their parents.
fn merge(tree: &EliminationTree, part_start: &[u32]) -> (Vec<Group>, Vec<u32>) {
    let count = part_start.len() - 1;
    let mut part_of = vec![0u32; tree.parent.len()];
    let mut groups: Vec<Option<Group>> = Vec::with_capacity(count);
    for p in 0..count {
        let columns = part_start[p]..part_start[p + 1];
        part_of[columns.start as usize..columns.end as usize].fill(p as u32);
        let rows = tree.counts[columns.start as usize];
        let parts = vec![p as u32];
        groups.push(Some(Group { columns: columns.len() as u32, rows, parts, children: vec![] }));
    }
    for p in 0..count {
        // All children of p come before p and are final.
        let mut group = groups[p].take().expect("a group is taken only here and by its parent");
        let mut children = std::mem::take(&mut group.children);
        let rows_of =
            |c: u32, groups: &[Option<Group>]| groups[c as usize].as_ref().map_or(0, |g| g.rows);
        children.sort_by_key(|&c| (std::cmp::Reverse(rows_of(c, &groups)), c));
        for c in children {
            let child = groups[c as usize].as_ref().expect("children are merged once");
            let merged = (group.columns + child.columns, group.rows + child.columns);
            let apart = cost(group.columns, group.rows) + cost(child.columns, child.rows);
            if cost(merged.0, merged.1) > apart {
                group.children.push(c);
                continue;
            }
            let mut child = groups[c as usize].take().expect("seen above");
            child.parts.append(&mut group.parts);
            child.children.append(&mut group.children);
            group = Group { columns: merged.0, rows: merged.1, ..child };
        }
        let last = part_start[p + 1] - 1;
        let parent = tree.parent[last as usize];
        groups[p] = Some(group);
        if parent != NONE
            && let Some(parent) = &mut groups[part_of[parent as usize] as usize]
        {
            parent.children.push(p as u32);
        }
    }
    compact(groups)
}

/// Closes the gaps that merged groups leave in the numbering.
fn compact(groups: Vec<Option<Group>>) -> (Vec<Group>, Vec<u32>) {
    let mut number = vec![NONE; groups.len()];
    let left = (0..groups.len()).filter(|&old| groups[old].is_some());
    for (new, old) in left.enumerate() {
        number[old] = new as u32;
    }
    let mut groups: Vec<Group> = groups.into_iter().flatten().collect();
    let mut parents = vec![NONE; groups.len()];
    for (v, group) in groups.iter_mut().enumerate() {
        for child in &mut group.children {
            *child = number[*child as usize];
            parents[*child as usize] = v as u32;
        }
    }
    (groups, parents)
}

/// Postorder that visits children in the order of their lists.
fn visit(groups: &[Group], parents: &[u32]) -> Vec<u32> {
    // A postorder by ascending number, of numbers that rank siblings: reverse preorder.
    let mut reversed = Vec::with_capacity(groups.len());
    let mut stack: Vec<u32> =
        (0..groups.len() as u32).filter(|&v| parents[v as usize] == NONE).collect();
    while let Some(v) = stack.pop() {
        reversed.push(v);
        stack.extend(&groups[v as usize].children);
    }
    reversed.reverse();
    reversed
}

/// Degrees of freedom of a vertex, for estimates only.
const AXES: f64 = crate::fem::AXES as f64;

/// Estimated nanoseconds of a front with `columns` eliminated vertices out of `rows`.
///
/// The rate of the dense kernels against the number of columns, the traffic of the contribution
/// block and the price of calling anything at all were measured once on an AVX-512 machine; only
/// their ratios matter, and they matter little.
fn cost(columns: u32, rows: u32) -> f64 {
    let (s, m) = (AXES * f64::from(columns), AXES * f64::from(rows));
    let rate = 50.0 * s / (s + 25.0);
    let contribution = (m - s) * (m - s);
    1500.0 + flops(s, m) / rate + 0.6 * contribution + 0.5 * s * m
}

/// Floating point operations of eliminating `s` of `m` rows: `Σ (m − i)²`, i from 0 to s − 1.
pub(super) fn flops(s: f64, m: f64) -> f64 {
    s * m * m - s * (s - 1.0) * m + (s - 1.0) * s * (2.0 * s - 1.0) / 6.0
}

#[cfg(test)]
mod tests {
    use super::super::etree::tests::eliminate;
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn every_entry_of_the_factor_has_a_place_in_its_front(
            count in 1usize..40,
            edges in proptest::collection::vec((0u32..40, 0u32..40), 0..90),
        ) {
            let count = count as u32;
            let edges: Vec<_> = edges.into_iter().map(|(a, b)| (a % count, b % count)).collect();
            let graph = NodeGraph::from_edges(count as usize, &edges);
            let tree = EliminationTree::new(&graph, (0..count).collect());
            let supernodes = Supernodes::new(&graph, &tree);
            prop_assert_eq!(*supernodes.start.last().unwrap(), count);
            let columns = eliminate(&graph, &supernodes.order);
            for v in 0..supernodes.len() {
                let rows = supernodes.rows(v);
                prop_assert!(rows.windows(2).all(|w| w[0] < w[1]));
                for j in supernodes.columns(v) {
                    for &i in &columns[j as usize] {
                        let i = i as u32;
                        let own = supernodes.columns(v).contains(&i);
                        prop_assert!(own || rows.binary_search(&i).is_ok());
                    }
                }
                // What is left over fits into the parent's front.
                let parent = supernodes.parent[v];
                prop_assert_eq!(parent == NONE, rows.is_empty());
                for &i in rows {
                    let p = parent as usize;
                    prop_assert!(p > v && p < supernodes.len());
                    let own = supernodes.columns(p).contains(&i);
                    prop_assert!(own || supernodes.rows(p).binary_search(&i).is_ok());
                }
            }
        }
    }
}
