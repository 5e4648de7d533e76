//! Lists, for every node, the elements that use it.

/// For each node the elements that use it, in element order (counting sort).
pub(super) fn elements_around<const K: usize>(
    node_count: usize,
    tets: &[[u32; K]],
) -> (Vec<usize>, Vec<u32>) {
    let mut start = vec![0usize; node_count + 1];
    for &n in tets.iter().flatten() {
        start[n as usize + 1] += 1;
    }
    for n in 0..node_count {
        start[n + 1] += start[n];
    }
    let mut next = start.clone();
    let mut around = vec![0u32; K * tets.len()];
    for (tet, nodes) in tets.iter().enumerate() {
        for &n in nodes {
            around[next[n as usize]] = tet as u32;
            next[n as usize] += 1;
        }
    }
    (start, around)
}
