//! Nested dissection: both sides of a separator first, then the separator itself.

use super::part::{Part, Side};
use super::separator::separate;

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
