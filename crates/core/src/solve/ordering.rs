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

/// Order in which the rows of `K11` are eliminated: `order[new] = old`.
///
/// Shapes: n rows of `K11`, a permutation of `0..n`.
///
/// Source: facts in `docs/decisions.md`; Karypis and Kumar, METIS 5 manual, `METIS_NodeND`.
pub(super) fn nested_dissection(stiffness: &Stiffness, partition: &Partition) -> Vec<usize> {
    let free: Vec<u32> = (0..stiffness.node_count() as u32)
        .filter(|&node| (0..3).any(|a| partition.row_of(dof(node as usize, a)).is_some()))
        .collect();
    let mut order = Vec::with_capacity(partition.unknown().len());
    for index in order_nodes(stiffness, &free) {
        let node = free[index] as usize;
        order.extend((0..3).filter_map(|a| partition.row_of(dof(node, a))));
    }
    order
}

/// Elimination order of the nodes in `free` (ascending), as positions in `free`.
fn order_nodes(stiffness: &Stiffness, free: &[u32]) -> Vec<usize> {
    let mut start: Vec<i32> = Vec::with_capacity(free.len() + 1);
    let mut neighbours: Vec<i32> = Vec::new();
    start.push(0);
    for &node in free {
        for &other in stiffness.pattern().columns(node as usize) {
            if other != node
                && let Ok(position) = free.binary_search(&other)
            {
                neighbours.push(position as i32);
            }
        }
        start.push(neighbours.len() as i32);
    }
    if free.len() < DISSECTED_NODES_MIN || neighbours.is_empty() {
        return (0..free.len()).collect();
    }
    dissect(&mut start, &mut neighbours).unwrap_or_else(|| (0..free.len()).collect())
}

/// One call of `METIS_NodeND`; `None` if METIS reports an error (then any order is right, only
/// slower).
fn dissect(start: &mut [i32], neighbours: &mut [i32]) -> Option<Vec<usize>> {
    let mut count = (start.len() - 1) as i32;
    let mut order = vec![0i32; start.len() - 1];
    let mut inverse = vec![0i32; start.len() - 1];
    let guard = METIS_GENERATOR.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
    // SAFETY: `start` has count + 1 entries, ascending, the last one being the length of
    // `neighbours`; every neighbour is in 0..count, the graph is symmetric (the stiffness pattern
    // is) and free of self loops (filtered above); both outputs hold `count` entries. Null means
    // no vertex weights and default options.
    let status = unsafe {
        metis_sys::METIS_NodeND(
            &mut count,
            start.as_mut_ptr(),
            neighbours.as_mut_ptr(),
            std::ptr::null_mut(),
            std::ptr::null_mut(),
            order.as_mut_ptr(),
            inverse.as_mut_ptr(),
        )
    };
    drop(guard);
    let order: Vec<usize> = order.into_iter().map(|i| i as usize).collect();
    (status == metis_sys::rstatus_et_METIS_OK && is_permutation(&order)).then_some(order)
}

fn is_permutation(order: &[usize]) -> bool {
    let mut seen = vec![false; order.len()];
    order.iter().all(|&i| i < seen.len() && !std::mem::replace(&mut seen[i], true))
}
