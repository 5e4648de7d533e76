//! Separators: the best of planes in a few directions, then the smallest nearby.

use super::part::{Part, Separated, Side};
use super::vertex_cut::smallest_near;

/// Directions of planes: axes, and diagonals of faces and of the cube.
const DIRECTIONS: [[f32; 3]; 13] = [
    [1.0, 0.0, 0.0],
    [0.0, 1.0, 0.0],
    [0.0, 0.0, 1.0],
    [1.0, 1.0, 0.0],
    [1.0, -1.0, 0.0],
    [1.0, 0.0, 1.0],
    [1.0, 0.0, -1.0],
    [0.0, 1.0, 1.0],
    [0.0, 1.0, -1.0],
    [1.0, 1.0, 1.0],
    [1.0, 1.0, -1.0],
    [1.0, -1.0, 1.0],
    [-1.0, 1.0, 1.0],
];
/// Parts up to this size are cut along the axes only, the first of the directions.
const AXES_ONLY: usize = 500;
/// Layers that planes of one direction pass between.
const LAYERS: usize = 256;
/// How often a smaller separator is looked for near the last one found.
const SEARCHES: usize = 4;
/// A side has at most this share of a part, so that few levels lead to the smallest.
const SIDE_MAX: f64 = 0.9;
/// Weight of the imbalance, the difference of its two sides over the part, in the cost of a separator.
const IMBALANCE: f64 = 0.5;

/// What a separator costs; `None` where a side is empty or too large.
fn cost_of(separated: &Separated) -> Option<f64> {
    let Separated { left, right, sides } = separated;
    cost(*left, *right, sides.len() - left - right)
}

/// Cost of a separator: its vertices, and more the larger the imbalance of the two sides is; `None` where a
/// side is empty or too large.
fn cost(left: usize, right: usize, between: usize) -> Option<f64> {
    let all = (left + right + between) as f64;
    let is_cut = left > 0 && right > 0 && left.max(right) as f64 <= SIDE_MAX * all;
    let off = ((left as f64 - right as f64) / all).powi(2);
    is_cut.then(|| (between as f64 + 1.0) * (1.0 + IMBALANCE * off) / (1.0 - off))
}

/// A plane between layers of one direction.
struct Cut {
    /// First layer on the right.
    layer: usize,
    /// Whether the separator is made of vertices on the left.
    is_left: bool,
    cost: f64,
}

/// A separator of a part; `None` where no plane leaves something on both sides.
pub(super) fn separate(part: &Part) -> Option<Separated> {
    let directions = if part.len() <= AXES_ONLY { 3 } else { DIRECTIONS.len() };
    let by_places = DIRECTIONS[..directions].iter().map(|&d| layers_by_place(part, d));
    // Where most vertices lie in one layer, as many in each.
    let found = best_plane(part, by_places)
        .or_else(|| best_plane(part, (0..3).map(|axis| layers_by_rank(part, axis))))?;
    let mut cost = cost_of(&found)?;
    let mut found = found;
    for _ in 0..SEARCHES {
        let Some(other) = smallest_near(part, &found) else { break };
        match cost_of(&other) {
            Some(less) if less < cost => (found, cost) = (other, less),
            _ => break,
        }
    }
    Some(found)
}

/// The separator of the best plane between layers that were assigned in several ways.
fn best_plane(part: &Part, assigned: impl Iterator<Item = Vec<u8>>) -> Option<Separated> {
    let mut best: Option<(Cut, Vec<u8>)> = None;
    for layers in assigned {
        if let Some(cut) = best_cut(part, &layers)
            && best.as_ref().is_none_or(|(best, _)| cut.cost < best.cost)
        {
            best = Some((cut, layers));
        }
    }
    best.map(|(cut, layers)| Separated::count(sides_of(part, &layers, &cut)))
}

/// The layer of each vertex along a direction, all of the same thickness.
fn layers_by_place(part: &Part, direction: [f32; 3]) -> Vec<u8> {
    let along = |p: &[f32; 3]| p[0] * direction[0] + p[1] * direction[1] + p[2] * direction[2];
    let (mut low, mut high) = (f32::INFINITY, f32::NEG_INFINITY);
    for place in &part.places {
        low = low.min(along(place));
        high = high.max(along(place));
    }
    let scale = if high > low { LAYERS as f32 / (high - low) } else { 0.0 };
    // What is beyond the last layer, or no number, ends in the last one or in the first.
    part.places.iter().map(|place| ((along(place) - low) * scale) as u8).collect()
}

/// The layer of each vertex along an axis, all with as many vertices.
fn layers_by_rank(part: &Part, axis: usize) -> Vec<u8> {
    let mut order: Vec<u32> = (0..part.len() as u32).collect();
    let along = |v: u32| part.places[v as usize][axis];
    order.sort_by(|&a, &b| along(a).total_cmp(&along(b)).then(a.cmp(&b)));
    let mut layers = vec![0; part.len()];
    for (rank, &v) in order.iter().enumerate() {
        layers[v as usize] = (rank * LAYERS / part.len()) as u8;
    }
    layers
}

/// The plane whose separator costs least.
///
/// A vertex is in the separator of all planes between its own layer and the furthest of its
/// neighbours, so one pass over the edges counts the separators of all planes.
fn best_cut(part: &Part, layers: &[u8]) -> Option<Cut> {
    let mut at = [0usize; LAYERS];
    // Changes of the counts from one plane to the next, for separators on the left and the right.
    let mut left = [0i64; LAYERS + 1];
    let mut right = [0i64; LAYERS + 1];
    for v in 0..part.len() {
        let own = layers[v];
        let (mut low, mut high) = (own, own);
        for &w in part.neighbours(v) {
            low = low.min(layers[w as usize]);
            high = high.max(layers[w as usize]);
        }
        at[own as usize] += 1;
        left[own as usize + 1] += 1;
        left[high as usize + 1] -= 1;
        right[low as usize + 1] += 1;
        right[own as usize + 1] -= 1;
    }
    let mut best: Option<Cut> = None;
    let (mut before, mut of_left, mut of_right) = (0, 0, 0);
    for layer in 1..LAYERS {
        before += at[layer - 1];
        of_left += left[layer];
        of_right += right[layer];
        let after = part.len() - before;
        let (of_left, of_right) = (of_left as usize, of_right as usize);
        for (is_left, cost) in [
            (true, cost(before - of_left, after, of_left)),
            (false, cost(before, after - of_right, of_right)),
        ] {
            if let Some(cost) = cost
                && best.as_ref().is_none_or(|best| cost < best.cost)
            {
                best = Some(Cut { layer, is_left, cost });
            }
        }
    }
    best
}

fn sides_of(part: &Part, layers: &[u8], cut: &Cut) -> Vec<Side> {
    let is_left = |v: usize| usize::from(layers[v]) < cut.layer;
    let side = |v: usize| {
        let own = is_left(v);
        let mut others = part.neighbours(v).iter();
        if own == cut.is_left && others.any(|&w| is_left(w as usize) != own) {
            return Side::Between;
        }
        if own { Side::Left } else { Side::Right }
    };
    (0..part.len()).map(side).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A lattice of points with all edges of its cells.
    pub(in super::super) fn lattice(counts: [usize; 3]) -> Part {
        let at = |i: usize, j: usize, k: usize| (i + counts[0] * (j + counts[1] * k)) as u32;
        let (mut start, mut neighbours, mut places) = (vec![0], Vec::new(), Vec::new());
        let near = |x: usize, count: usize| x.saturating_sub(1)..(x + 2).min(count);
        for k in 0..counts[2] {
            for j in 0..counts[1] {
                for i in 0..counts[0] {
                    places.push([i as f32, j as f32, k as f32]);
                    for c in near(k, counts[2]) {
                        for b in near(j, counts[1]) {
                            let row = near(i, counts[0]).map(|a| at(a, b, c));
                            neighbours.extend(row.filter(|&w| w != at(i, j, k)));
                        }
                    }
                    start.push(neighbours.len() as u32);
                }
            }
        }
        Part { vertices: (0..places.len() as u32).collect(), start, neighbours, places }
    }

    fn check(part: &Part, found: &Separated) -> usize {
        for v in 0..part.len() {
            for &w in part.neighbours(v) {
                let pair = [found.sides[v], found.sides[w as usize]];
                assert!(pair != [Side::Left, Side::Right], "an edge passes the separator");
            }
        }
        part.len() - found.left - found.right
    }

    #[test]
    fn lattice_is_cut_across_its_longest_side_in_the_middle() {
        let part = lattice([5, 21, 6]);
        let found = separate(&part).unwrap();
        assert_eq!(check(&part, &found), 30);
        assert!(found.left.abs_diff(found.right) <= 30);
    }

    #[test]
    fn places_that_tell_nothing_are_cut_too() {
        let mut part = lattice([4, 30, 4]);
        // All in the first layer but one.
        part.places.iter_mut().skip(1).for_each(|place| *place = [0.0; 3]);
        part.places[0] = [1.0e9; 3];
        let found = separate(&part).unwrap();
        assert!(check(&part, &found) < 100);
    }

    #[test]
    fn nearest_waist_is_found_where_no_plane_fits() {
        // A plate bent like an S: the plane between its halves passes through three layers of it.
        let mut part = lattice([40, 4, 1]);
        for v in 0..part.len() {
            let x = part.places[v][0];
            part.places[v] = [x, 3.0 * (0.9 * x).sin() + part.places[v][1], 0.0];
        }
        let found = separate(&part).unwrap();
        assert_eq!(check(&part, &found), 4);
    }
}
