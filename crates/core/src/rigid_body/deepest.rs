//! The search for the deepest point of a triangle in a body of which only the signed distance is known.

use nalgebra::{Matrix2, Point3, Vector2, Vector3};

use super::closest::{Barycentric, Deepest, EDGES, SignedDistance, on_edge, point_at};

/// Pieces into which a triangle is cut at most while its deepest point is looked for.
const PIECES_MAX: usize = 64;
/// A piece is given up where it can be deeper by this share of its size only.
const NEAR_ENOUGH: f64 = 1e-3;
/// Halvings of the step of the last search around the deepest point found, and ways tried with each.
const HALVINGS: u32 = 34;
const WAYS: u32 = 9;
/// Steps down a crease with each halving, each twice as long as the one before.
const STRIDES: usize = 12;
/// Samples along an edge, and thirds that are taken away around the best of them.
const EDGE_SAMPLES: u32 = 8;
const EDGE_THIRDS: usize = 40;
/// The whole turn, and the turn from one halving to the next: no part of the whole.
const FULL: f64 = std::f64::consts::TAU;
const TURN: f64 = 2.399_963;

/// The deepest point of a triangle: pieces whose middle cannot be near enough are left out, then a
/// search with ever smaller steps ends at a point from which no step leads deeper.
///
/// Shapes and frame: `corners` in the frame of `distance`, m.
pub(super) fn deepest_of(
    corners: &[Point3<f64>; 3],
    distance: impl Fn(&Point3<f64>) -> SignedDistance,
) -> Deepest {
    let at = |weights: Barycentric| Deepest {
        weights,
        distance: distance(&point_at(corners, &weights)),
    };
    let size = (0..3).map(|i| (corners[i] - corners[(i + 1) % 3]).norm()).fold(0.0, f64::max);
    let whole = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    let mut best = at(whole[0]);
    let consider = |weights: Barycentric, best: &mut Deepest| {
        let found = at(weights);
        if found.distance.distance < best.distance.distance {
            *best = found;
        }
        found.distance.distance
    };
    consider(whole[1], &mut best);
    consider(whole[2], &mut best);
    // Each piece with the smallest distance that can be in it; the most promising comes next.
    let mut pieces = vec![(f64::NEG_INFINITY, whole, size)];
    for _ in 0..PIECES_MAX {
        let next = (0..pieces.len()).min_by(|&a, &b| pieces[a].0.total_cmp(&pieces[b].0));
        let Some((least, piece, size)) = next.map(|at| pieces.swap_remove(at)) else { break };
        if least >= best.distance.distance - NEAR_ENOUGH * size {
            break;
        }
        for quarter in quarters(&piece) {
            let middle = [0, 1, 2].map(|k| (quarter[0][k] + quarter[1][k] + quarter[2][k]) / 3.0);
            // The distance changes by no more than the way gone: two thirds of the longest
            // median, which is below the longest edge.
            let reach = 0.5 * size;
            pieces.push((consider(middle, &mut best) - 0.6 * reach, quarter, reach));
        }
    }
    let mut best = descend(corners, best, at);
    for (first, second) in EDGES {
        let on_edge = deepest_on_edge(first, second, at);
        if on_edge.distance.distance < best.distance.distance {
            best = on_edge;
        }
    }
    best
}

/// Steps in all ways, ever smaller, and after those of each size down the crease that the slopes around the
/// point tell of.
///
/// Source: gradient sampling, Burke, Lewis and Overton (2005).
fn descend(
    corners: &[Point3<f64>; 3],
    mut best: Deepest,
    at: impl Fn(Barycentric) -> Deepest,
) -> Deepest {
    // A step out of the triangle ends at its border.
    let within = |moved: Barycentric| {
        let within = moved.map(|weight: f64| weight.max(0.0));
        let sum: f64 = within.iter().sum();
        at(within.map(|weight| weight / sum))
    };
    let is_deeper =
        |one: &Deepest, other: &Deepest| one.distance.distance < other.distance.distance;
    let plane = Plane::of(corners);
    let mut step = 0.125;
    for halving in 0..HALVINGS {
        let from = best;
        let mut slopes = [Vector2::zeros(); WAYS as usize];
        for (way, slope) in (0..WAYS).zip(&mut slopes) {
            // Turned with every halving, so that no crease stays between two ways for ever.
            let angle = TURN * f64::from(halving) + FULL * f64::from(way) / f64::from(WAYS);
            let (a, b) = (step * angle.cos(), step * angle.sin());
            let [x, y, z] = from.weights;
            let found = within([x + a, y + b, z - a - b]);
            *slope = plane.slope(&found.distance.normal);
            if is_deeper(&found, &best) {
                best = found;
            }
        }
        let down = -shortest(&slopes);
        let mut length = step;
        for _ in 0..STRIDES {
            let found = within(plane.moved(&from.weights, &(length * down)));
            if !is_deeper(&found, &best) {
                break;
            }
            (best, length) = (found, 2.0 * length);
        }
        step *= 0.5;
    }
    best
}

/// Two directions across each other in the plane of a triangle, in units of its longest edge.
struct Plane {
    /// m.
    directions: [Vector3<f64>; 2],
    /// Change of the first two weights by steps along them.
    weights: Matrix2<f64>,
}

impl Plane {
    fn of(corners: &[Point3<f64>; 3]) -> Self {
        let (a, b) = (corners[0] - corners[2], corners[1] - corners[2]);
        let size = a.norm().max(b.norm()).max((a - b).norm());
        let first = a.try_normalize(f64::MIN_POSITIVE).unwrap_or(Vector3::x());
        let across = b - first * first.dot(&b);
        let second = across.try_normalize(f64::MIN_POSITIVE).unwrap_or(Vector3::zeros());
        let directions = [size * first, size * second];
        let edges = Matrix2::new(first.dot(&a), first.dot(&b), second.dot(&a), second.dot(&b));
        // A triangle without an area has no second direction: nothing moves then.
        let weights = edges.try_inverse().map_or(Matrix2::zeros(), |inverse| size * inverse);
        Self { directions, weights }
    }

    /// How the distance grows along the directions, where it grows along a normal.
    fn slope(&self, normal: &Vector3<f64>) -> Vector2<f64> {
        Vector2::new(self.directions[0].dot(normal), self.directions[1].dot(normal))
    }

    /// Weights after a step of a length, counted in the longest edge, along a vector.
    fn moved(&self, weights: &Barycentric, step: &Vector2<f64>) -> Barycentric {
        let change = self.weights * step;
        let [x, y, z] = *weights;
        [x + change.x, y + change.y, z - change.x - change.y]
    }
}

/// Unit vector towards the nearest point, from the origin, of the hull of some vectors; zero where there is
/// none.
fn shortest(vectors: &[Vector2<f64>]) -> Vector2<f64> {
    let mut best = vectors[0];
    for (i, from) in vectors.iter().enumerate() {
        for to in &vectors[i..] {
            let edge = to - from;
            let square = edge.norm_squared();
            let share =
                if square > 0.0 { (-from.dot(&edge) / square).clamp(0.0, 1.0) } else { 0.0 };
            let nearest = from + share * edge;
            if nearest.norm_squared() < best.norm_squared() {
                best = nearest;
            }
        }
    }
    best.try_normalize(1e-12).unwrap_or(Vector2::zeros())
}

/// The deepest point of an edge: the best of some samples, then a search by thirds around it.
fn deepest_on_edge(first: usize, second: usize, at: impl Fn(Barycentric) -> Deepest) -> Deepest {
    let on = |t: f64| at(on_edge((first, second), t));
    let sample = |k: u32| f64::from(k) / f64::from(EDGE_SAMPLES);
    let depth = |t: f64| on(t).distance.distance;
    let best = (0..=EDGE_SAMPLES).min_by(|&a, &b| depth(sample(a)).total_cmp(&depth(sample(b))));
    let middle = sample(best.unwrap_or(0));
    let (mut low, mut high) = ((middle - sample(1)).max(0.0), (middle + sample(1)).min(1.0));
    for _ in 0..EDGE_THIRDS {
        let third = (high - low) / 3.0;
        match depth(low + third) <= depth(high - third) {
            true => high -= third,
            false => low += third,
        }
    }
    on(0.5 * (low + high))
}

/// A quarter each of a triangle.
fn quarters(piece: &[Barycentric; 3]) -> [[Barycentric; 3]; 4] {
    let middle = |a: usize, b: usize| [0, 1, 2].map(|k| 0.5 * (piece[a][k] + piece[b][k]));
    let (ab, bc, ca) = (middle(0, 1), middle(1, 2), middle(2, 0));
    [[piece[0], ab, ca], [ab, piece[1], bc], [ca, bc, piece[2]], [ab, bc, ca]]
}
