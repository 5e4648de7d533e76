//! Nested dissection of the graph of the nodes that are free: both sides of a separator first, then the
//! separator itself; and its order expanded by their degrees of freedom.

use super::part::{Part, Side};
use super::separator::separate;
use crate::fem::{Stiffness, dof};
use crate::solve::Partition;

/// Parts up to this size are not cut: supernodes take them together anyway.
const WHOLE: usize = 8;
/// Parts below this size are one task.
const SERIAL: usize = 1000;

/// Elimination order of the vertices, `order[new] = vertex` of the whole graph.
///
/// Source: George, "Nested dissection of a regular finite element mesh" (1973).
pub(super) fn dissect(part: Part) -> Vec<u32> {
    let mut order = vec![0; part.len()];
    dissect_into(part, &mut order);
    order
}

/// Shapes: `order` as many as the part has vertices.
fn dissect_into(part: Part, order: &mut [u32]) {
    let separated = if part.len() > WHOLE { separate(&part) } else { None };
    let Some(separated) = separated else {
        order.copy_from_slice(&part.vertices);
        return;
    };
    let is_serial = part.len() < SERIAL;
    let (sides, between) = order.split_at_mut(separated.left + separated.right);
    let (left_order, right_order) = sides.split_at_mut(separated.left);
    let of_between = (0..part.len()).filter(|&v| separated.sides[v] == Side::Between);
    between.iter_mut().zip(of_between).for_each(|(slot, v)| *slot = part.vertices[v]);
    let [left, right] = part.split(&separated.sides);
    let (one, other) = (|| dissect_into(left, left_order), || dissect_into(right, right_order));
    match is_serial {
        true => {
            one();
            other();
        }
        false => {
            rayon::join(one, other);
        }
    }
}

/// Marks a node without unknown degrees of freedom.
const NOT_FREE: u32 = u32::MAX;

/// Nodes with at least one unknown degree of freedom and which of them share a stiffness block:
/// the pattern of `K11`, nine times smaller than that of its entries.
///
/// Shapes: vertex v is node `nodes[v]` of the mesh, nodes ascending, and lies at `places[v]`; its
/// neighbours (vertices, no self loops, ascending) are `neighbours[start[v] .. start[v + 1]]`.
/// Units: places in parts of the body's largest extent.
///
/// Source: thesis (3.41).
pub(crate) struct NodeGraph {
    pub nodes: Vec<u32>,
    pub places: Vec<[f32; 3]>,
    pub start: Vec<u32>,
    pub neighbours: Vec<u32>,
}

/// Order in which the rows of `K11` are eliminated: `order[new] = old`.
///
/// Shapes: n rows of `K11`, a permutation of `0..n`.
pub(crate) fn nested_dissection(stiffness: &Stiffness, partition: &Partition) -> Vec<usize> {
    let graph = NodeGraph::new(stiffness, partition);
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
        let pattern = stiffness.pattern();
        let mut vertex_of = vec![NOT_FREE; stiffness.node_count()];
        let mut nodes = Vec::with_capacity(stiffness.node_count());
        for node in 0..stiffness.node_count() {
            if (0..3).any(|a| partition.row_of(dof(node, a)).is_some()) {
                vertex_of[node] = nodes.len() as u32;
                nodes.push(node as u32);
            }
        }
        let mut start: Vec<u32> = Vec::with_capacity(nodes.len() + 1);
        let mut neighbours = Vec::with_capacity(pattern.block_count());
        start.push(0);
        for &node in &nodes {
            for &other in pattern.columns(node as usize) {
                let vertex = vertex_of[other as usize];
                if other != node && vertex != NOT_FREE {
                    neighbours.push(vertex);
                }
            }
            start.push(neighbours.len() as u32);
        }
        let places = scaled(nodes.iter().map(|&node| pattern.places()[node as usize].into()));
        Self { nodes, places, start, neighbours }
    }

    /// Graph from an edge list; each vertex is a node, all at one place.
    #[cfg(test)]
    pub fn from_edges(count: usize, edges: &[(u32, u32)]) -> Self {
        let mut rows = vec![std::collections::BTreeSet::new(); count];
        for &(a, b) in edges.iter().filter(|(a, b)| a != b) {
            rows[a as usize].insert(b);
            rows[b as usize].insert(a);
        }
        let mut start = vec![0];
        let mut neighbours = Vec::new();
        for row in rows {
            neighbours.extend(row);
            start.push(neighbours.len() as u32);
        }
        let places = vec![[0.0; 3]; count];
        Self { nodes: (0..count as u32).collect(), places, start, neighbours }
    }

    /// Number of vertices.
    pub fn len(&self) -> usize {
        self.nodes.len()
    }

    /// Vertices that share a stiffness block with vertex `v`, ascending.
    pub fn neighbours(&self, v: u32) -> impl Iterator<Item = u32> {
        let range = self.start[v as usize] as usize..self.start[v as usize + 1] as usize;
        self.neighbours[range].iter().copied()
    }

    /// Elimination order of the vertices, `order[new] = old`, on the current rayon pool; the same
    /// for any number of threads.
    pub fn nested_dissection(&self) -> Vec<u32> {
        dissect(Part {
            vertices: (0..self.len() as u32).collect(),
            start: self.start.clone(),
            neighbours: self.neighbours.clone(),
            places: self.places.clone(),
        })
    }
}

/// Places with the middle at zero and the largest extent one: what is subtracted of each other in
/// single precision, or too large for it, would be lost.
fn scaled(places: impl Iterator<Item = [f64; 3]> + Clone) -> Vec<[f32; 3]> {
    let (mut low, mut high) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
    for place in places.clone() {
        for axis in 0..3 {
            low[axis] = low[axis].min(place[axis]);
            high[axis] = high[axis].max(place[axis]);
        }
    }
    let extent = (0..3).map(|axis| high[axis] - low[axis]).fold(0.0, f64::max);
    let scale = if extent > 0.0 && extent.is_finite() { 1.0 / extent } else { 0.0 };
    let axes = [0, 1, 2];
    places.map(|place| axes.map(|axis| ((place[axis] - low[axis]) * scale - 0.5) as f32)).collect()
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::super::NodeGraph;

    /// Order of a graph of edges; `place` of each vertex.
    fn order(count: usize, edges: &[(u32, u32)], place: impl Fn(usize) -> [f32; 3]) -> Vec<u32> {
        let mut graph = NodeGraph::from_edges(count, edges);
        graph.places = (0..count).map(place).collect();
        graph.nested_dissection()
    }

    fn is_permutation(order: &[u32]) -> bool {
        let mut seen = vec![false; order.len()];
        order.iter().all(|&v| !std::mem::replace(&mut seen[v as usize], true))
    }

    proptest! {
        #[test]
        fn every_vertex_has_one_place_in_the_order(
            count in 1usize..120,
            edges in proptest::collection::vec((0u32..120, 0u32..120), 0..400),
            places in proptest::collection::vec(proptest::array::uniform3(-0.5f32..0.5), 120),
            step in prop::sample::select(vec![0.0f32, 1e-30, 0.25, 1.0]),
        ) {
            let edges: Vec<_> = edges
                .into_iter()
                .map(|(a, b)| (a % count as u32, b % count as u32))
                .collect();
            // With a coarse step many lie at the same place, with none all.
            let coarse = |x: f32| if step > 0.0 { (x / step).round() * step } else { 0.0 };
            let order = order(count, &edges, |v| places[v].map(coarse));
            prop_assert!(is_permutation(&order));
        }
    }

    #[test]
    fn bodies_in_many_pieces_and_stars_do_not_go_deep() {
        // Each would be one level of recursion for each vertex if small parts could be cut off.
        let count = 40_000;
        let in_a_row = |v: usize| [v as f32 / count as f32, 0.0, 0.0];
        let star: Vec<(u32, u32)> = (1..count as u32).map(|v| (0, v)).collect();
        let path: Vec<(u32, u32)> = (1..count as u32).map(|v| (v - 1, v)).collect();
        let ever_denser = |v: usize| [0.5f32.powi(v as i32), 0.0, 0.0];
        for (edges, place) in [
            (&star, &in_a_row as &dyn Fn(usize) -> [f32; 3]),
            (&path, &ever_denser),
            (&Vec::new(), &ever_denser),
            (&Vec::new(), &in_a_row),
            (&path, &|_| [0.0; 3]),
        ] {
            assert!(is_permutation(&order(count, edges, place)));
        }
    }
}
