//! Fill-reducing order: METIS nested dissection on the graph of nodes, expanded by the unknown
//! degrees of freedom of each node.

use std::sync::Mutex;

use super::Partition;
use crate::fem::{Stiffness, dof};

/// METIS draws from the C library's one random generator; two orderings at once would disturb
/// each other and the order (hence the last bits of an answer) would depend on timing.
static METIS_GENERATOR: Mutex<()> = Mutex::new(());

/// Below this many nodes any order will do, and METIS refuses graphs without edges.
const DISSECTED_NODES_MIN: usize = 32;

/// Marks a node without unknown degrees of freedom.
const NOT_FREE: u32 = u32::MAX;

/// Nodes with at least one unknown degree of freedom and which of them share a stiffness block:
/// the pattern of `K11`, nine times smaller than that of its entries.
///
/// Shapes: vertex v is node `nodes[v]` of the mesh, nodes ascending; its neighbours (vertices, no
/// self loops, ascending) are `neighbours[start[v] .. start[v + 1]]`. `i32` is METIS's index type.
///
/// Source: thesis (3.41).
pub(super) struct NodeGraph {
    pub nodes: Vec<u32>,
    pub start: Vec<i32>,
    pub neighbours: Vec<i32>,
}

/// Order in which the rows of `K11` are eliminated: `order[new] = old`.
///
/// Shapes: n rows of `K11`, a permutation of `0..n`.
///
/// Source: facts in `docs/decisions.md`; Karypis and Kumar, METIS 5 manual, `METIS_NodeND`.
pub(super) fn nested_dissection(stiffness: &Stiffness, partition: &Partition) -> Vec<usize> {
    let mut graph = NodeGraph::new(stiffness, partition);
    let mut order = Vec::with_capacity(partition.unknown().len());
    for vertex in graph.nested_dissection() {
        let node = graph.nodes[vertex as usize] as usize;
        order.extend((0..3).filter_map(|a| partition.row_of(dof(node, a))));
    }
    order
}

impl NodeGraph {
    /// Graph of the free nodes of a partition.
    pub fn new(stiffness: &Stiffness, partition: &Partition) -> Self {
        let mut vertex_of = vec![NOT_FREE; stiffness.node_count()];
        let mut nodes = Vec::with_capacity(stiffness.node_count());
        for node in 0..stiffness.node_count() {
            if (0..3).any(|a| partition.row_of(dof(node, a)).is_some()) {
                vertex_of[node] = nodes.len() as u32;
                nodes.push(node as u32);
            }
        }
        let mut start: Vec<i32> = Vec::with_capacity(nodes.len() + 1);
        let mut neighbours = Vec::with_capacity(stiffness.pattern().block_count());
        start.push(0);
        for &node in &nodes {
            for &other in stiffness.pattern().columns(node as usize) {
                let vertex = vertex_of[other as usize];
                if other != node && vertex != NOT_FREE {
                    neighbours.push(vertex as i32);
                }
            }
            start.push(neighbours.len() as i32);
        }
        Self { nodes, start, neighbours }
    }

    /// Number of vertices.
    pub fn len(&self) -> usize {
        self.nodes.len()
    }

    /// Vertices that share a stiffness block with vertex `v`, ascending.
    pub fn neighbours(&self, v: u32) -> impl Iterator<Item = u32> {
        let range = self.start[v as usize] as usize..self.start[v as usize + 1] as usize;
        self.neighbours[range].iter().map(|&other| other as u32)
    }

    /// Elimination order of the vertices, `order[new] = old`.
    pub fn nested_dissection(&mut self) -> Vec<u32> {
        let natural = || (0..self.nodes.len() as u32).collect();
        if self.len() < DISSECTED_NODES_MIN || self.neighbours.is_empty() {
            return natural();
        }
        dissect(&mut self.start, &mut self.neighbours).unwrap_or_else(natural)
    }
}

/// One call of `METIS_NodeND`; `None` if METIS reports an error (then any order is right, only
/// slower).
fn dissect(start: &mut [i32], neighbours: &mut [i32]) -> Option<Vec<u32>> {
    let mut count = (start.len() - 1) as i32;
    let mut order = vec![0i32; start.len() - 1];
    let mut inverse = vec![0i32; start.len() - 1];
    let mut options = metis_options();
    let guard = METIS_GENERATOR.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
    // SAFETY: `start` has count + 1 entries, ascending, the last one being the length of
    // `neighbours`; every neighbour is in 0..count, the graph is symmetric (the stiffness pattern
    // is) and free of self loops (filtered above); both outputs hold `count` entries and the
    // options `METIS_NOPTIONS`. Null means no vertex weights.
    let status = unsafe {
        metis_sys::METIS_NodeND(
            &mut count,
            start.as_mut_ptr(),
            neighbours.as_mut_ptr(),
            std::ptr::null_mut(),
            options.as_mut_ptr(),
            order.as_mut_ptr(),
            inverse.as_mut_ptr(),
        )
    };
    drop(guard);
    let order: Vec<u32> = order.into_iter().map(|i| i as u32).collect();
    (status == metis_sys::rstatus_et_METIS_OK && is_permutation(&order)).then_some(order)
}

/// How much larger than the other one part may be, in thousandths.
///
/// METIS's default is 200. On cubes of 3375 to 21 952 nodes a fifth to a quarter of the time of
/// the order goes at 50, for 1–3 % more operations in the factor: less than one seed or another
/// makes (measured 60 → 45 ms against 17.2 → 17.3 GFlop at 10 648 nodes).
const IMBALANCE_PER_MILLE: i32 = 50;

/// Options of `METIS_NodeND`.
fn metis_options() -> [i32; metis_sys::METIS_NOPTIONS as usize] {
    let mut options = [0; metis_sys::METIS_NOPTIONS as usize];
    // SAFETY: METIS writes METIS_NOPTIONS entries.
    unsafe { metis_sys::METIS_SetDefaultOptions(options.as_mut_ptr()) };
    options[metis_sys::moptions_et_METIS_OPTION_UFACTOR as usize] = IMBALANCE_PER_MILLE;
    // One node is one vertex already; there is nothing to compress.
    options[metis_sys::moptions_et_METIS_OPTION_COMPRESS as usize] = 0;
    options
}

fn is_permutation(order: &[u32]) -> bool {
    let mut seen = vec![false; order.len()];
    order
        .iter()
        .all(|&i| (i as usize) < seen.len() && !std::mem::replace(&mut seen[i as usize], true))
}
