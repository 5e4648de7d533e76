//! Which elements are around a node.

/// Elements around every node, as one list with borders.
pub(crate) struct Incidence {
    starts: Vec<usize>,
    tets: Vec<u32>,
}

impl Incidence {
    /// Lists the elements around each of `node_count` nodes, ascending.
    pub(crate) fn new(node_count: usize, tets: &[[u32; 4]]) -> Self {
        let mut starts = vec![0; node_count + 1];
        for n in tets.iter().flatten() {
            starts[*n as usize + 1] += 1;
        }
        for n in 1..starts.len() {
            starts[n] += starts[n - 1];
        }
        let mut next = starts.clone();
        let mut listed = vec![0; 4 * tets.len()];
        for (t, corners) in (0u32..).zip(tets) {
            for n in corners {
                listed[next[*n as usize]] = t;
                next[*n as usize] += 1;
            }
        }
        Self { starts, tets: listed }
    }

    /// Elements around one node.
    pub(crate) fn tets(&self, node: u32) -> &[u32] {
        &self.tets[self.starts[node as usize]..self.starts[node as usize + 1]]
    }
}
