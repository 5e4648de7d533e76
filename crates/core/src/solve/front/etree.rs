//! Elimination tree of the node graph: parents, postorder, column counts.

use crate::solve::ordering::NodeGraph;

/// Marks a root, and in general "no column".
pub(super) const NONE: u32 = u32::MAX;

/// Elimination tree in a postordered elimination order.
///
/// Shapes: one entry per vertex of the graph. `order[new] = vertex`;
/// `parent` (or [`NONE`]) and `counts` by new position. `counts[j]` is the number of vertices in
/// column j of the factor, its diagonal included. Every child precedes its parent and every
/// subtree is a contiguous range.
///
/// Source: Liu, "The role of elimination trees in sparse factorization" (1990).
pub(super) struct EliminationTree {
    pub order: Vec<u32>,
    pub parent: Vec<u32>,
    pub counts: Vec<u32>,
}

impl EliminationTree {
    /// Tree of `graph` under `order[new] = vertex`; the order is refined to a postorder, which
    /// leaves the fill as it is.
    pub fn new(graph: &NodeGraph, order: Vec<u32>) -> Self {
        let position = inverse(&order);
        let parent = parents(graph, &order, &position);
        let postorder = postorder(&parent);
        let renumbered = inverse(&postorder);
        let order: Vec<u32> = postorder.iter().map(|&old| order[old as usize]).collect();
        let position = inverse(&order);
        let parent: Vec<u32> = postorder
            .iter()
            .map(|&old| match parent[old as usize] {
                NONE => NONE,
                parent => renumbered[parent as usize],
            })
            .collect();
        let counts = column_counts(graph, &order, &position, &parent);
        Self { order, parent, counts }
    }
}

/// Inverse of a permutation.
pub(super) fn inverse(order: &[u32]) -> Vec<u32> {
    let mut position = vec![0; order.len()];
    for (new, &old) in order.iter().enumerate() {
        position[old as usize] = new as u32;
    }
    position
}

/// Parent of each column: the row of its first entry below the diagonal, found without forming
/// the factor by climbing shortcut paths.
fn parents(graph: &NodeGraph, order: &[u32], position: &[u32]) -> Vec<u32> {
    let mut parent = vec![NONE; order.len()];
    let mut ancestor = vec![NONE; order.len()];
    for (j, &vertex) in order.iter().enumerate() {
        let j = j as u32;
        for other in graph.neighbours(vertex) {
            let mut i = position[other as usize];
            while i < j {
                let next = std::mem::replace(&mut ancestor[i as usize], j);
                if next == NONE {
                    parent[i as usize] = j;
                    break;
                }
                i = next;
            }
        }
    }
    parent
}

/// `postorder[new] = old` of a forest whose parents come after their children.
fn postorder(parent: &[u32]) -> Vec<u32> {
    let mut first_child = vec![NONE; parent.len()];
    let mut next_sibling = vec![NONE; parent.len()];
    for j in (0..parent.len()).rev() {
        if parent[j] != NONE {
            next_sibling[j] = std::mem::replace(&mut first_child[parent[j] as usize], j as u32);
        }
    }
    let mut order = Vec::with_capacity(parent.len());
    let mut stack = Vec::new();
    for root in (0..parent.len()).filter(|&j| parent[j] == NONE) {
        stack.push(root as u32);
        while let Some(&top) = stack.last() {
            // A child is taken off its parent's list when it is entered.
            match first_child[top as usize] {
                NONE => {
                    order.push(top);
                    stack.pop();
                }
                child => {
                    first_child[top as usize] = next_sibling[child as usize];
                    stack.push(child);
                }
            }
        }
    }
    order
}

/// Number of entries in each column of the factor, in time nearly linear in the graph.
///
/// Row i of the factor is a subtree of the elimination tree. Each of its leaves adds one to the
/// counts on the way up, and the least common ancestor of consecutive leaves takes one back.
///
/// Source: Gilbert, Ng, Peyton, "An efficient algorithm to compute row and column counts for
/// sparse Cholesky factorization" (1994).
fn column_counts(graph: &NodeGraph, order: &[u32], position: &[u32], parent: &[u32]) -> Vec<u32> {
    let n = order.len();
    let mut first_descendant: Vec<u32> = (0..n as u32).collect();
    let mut delta = vec![1i64; n];
    for j in 0..n {
        if parent[j] != NONE {
            let p = parent[j] as usize;
            first_descendant[p] = first_descendant[p].min(first_descendant[j]);
            delta[p] = 0;
        }
    }
    let mut latest_leaf = vec![NONE; n];
    let mut ancestor: Vec<u32> = (0..n as u32).collect();
    for j in 0..n as u32 {
        if parent[j as usize] != NONE {
            delta[parent[j as usize] as usize] -= 1;
        }
        for other in graph.neighbours(order[j as usize]) {
            let i = position[other as usize] as usize;
            // Column j is a leaf of row i's subtree if no leaf seen so far lies below j.
            let leaf = latest_leaf[i];
            if (i as u32) <= j || (leaf != NONE && first_descendant[j as usize] <= leaf) {
                continue;
            }
            delta[j as usize] += 1;
            latest_leaf[i] = j;
            if leaf != NONE {
                delta[find(&mut ancestor, leaf) as usize] -= 1;
            }
        }
        if parent[j as usize] != NONE {
            ancestor[j as usize] = parent[j as usize];
        }
    }
    for j in 0..n {
        if parent[j] != NONE {
            delta[parent[j] as usize] += delta[j];
        }
    }
    delta.into_iter().map(|count| count as u32).collect()
}

/// Root of `j` among the merged sets, with path compression.
fn find(ancestor: &mut [u32], j: u32) -> u32 {
    let mut root = j;
    while ancestor[root as usize] != root {
        root = ancestor[root as usize];
    }
    let mut i = j;
    while i != root {
        i = std::mem::replace(&mut ancestor[i as usize], root);
    }
    root
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use proptest::prelude::*;

    /// Elimination on the filled graph, column by column.
    pub fn eliminate(graph: &NodeGraph, order: &[u32]) -> Vec<Vec<usize>> {
        let position = inverse(order);
        let n = order.len();
        let mut columns: Vec<std::collections::BTreeSet<usize>> = order
            .iter()
            .enumerate()
            .map(|(j, &v)| {
                graph.neighbours(v).map(|o| position[o as usize] as usize).filter(move |&i| i > j)
            })
            .map(Iterator::collect)
            .collect();
        for j in 0..n {
            let column = columns[j].clone();
            if let Some(&first) = column.first() {
                columns[first].extend(column.iter().filter(|&&i| i > first));
            }
        }
        columns.into_iter().map(|c| c.into_iter().collect()).collect()
    }

    proptest! {
        #[test]
        fn parents_and_counts_equal_those_of_the_filled_graph(
            count in 1usize..25,
            edges in proptest::collection::vec((0u32..25, 0u32..25), 0..60),
            seed in 0u64..1000,
        ) {
            let edges: Vec<_> =
                edges.into_iter().map(|(a, b)| (a % count as u32, b % count as u32)).collect();
            let graph = NodeGraph::from_edges(count, &edges);
            let mut order: Vec<u32> = (0..count as u32).collect();
            order.sort_by_key(|&v| (u64::from(v) + 1).wrapping_mul(seed * 2 + 1) % 101);
            let tree = EliminationTree::new(&graph, order);
            for (j, column) in eliminate(&graph, &tree.order).iter().enumerate() {
                let first = column.first().map_or(NONE, |&i| i as u32);
                prop_assert_eq!(tree.parent[j], first);
                prop_assert_eq!(tree.counts[j] as usize, column.len() + 1);
                prop_assert!(first > j as u32);
            }
        }
    }
}
