//! The six rigid motions, which a free body makes without force, on every level.

use rayon::prelude::*;

use super::aggregates::Aggregates;
use super::block_rows::FineRows;
use crate::fem::AXES;

/// Rigid motions: three translations, three rotations.
pub(super) const MOTIONS: usize = 6;

/// What each unknown of a node does in each rigid motion.
pub(super) type OfNode<const B: usize> = [[f64; MOTIONS]; B];

/// Rigid motions on the finest level, zero on known axes. Rotations are about the middle of all nodes
/// and scaled so that they move the nodes about as far as translations do.
pub(super) fn of_fine(rows: &FineRows<'_>, count: usize) -> Vec<OfNode<AXES>> {
    let places: Vec<[f64; AXES]> = (0..count).map(|row| rows.place_of(row)).collect();
    let middle: [f64; AXES] = std::array::from_fn(|axis| {
        places.iter().map(|place| place[axis]).sum::<f64>() / count.max(1) as f64
    });
    let from_middle = |place: &[f64; AXES]| -> [f64; AXES] {
        std::array::from_fn(|axis| place[axis] - middle[axis])
    };
    let far = |place: &[f64; AXES]| from_middle(place).iter().fold(0.0f64, |m, x| m.max(x.abs()));
    let size = places.iter().map(far).fold(0.0, f64::max);
    let by = if size > 0.0 { 1.0 / size } else { 1.0 };
    let of_node = |(row, place): (usize, &[f64; AXES])| {
        let [x, y, z] = from_middle(place).map(|x| by * x);
        let mut motions =
            [[1.0, 0.0, 0.0, 0.0, z, -y], [0.0, 1.0, 0.0, -z, 0.0, x], [0.0, 0.0, 1.0, y, -x, 0.0]];
        for (motions, is_unknown) in motions.iter_mut().zip(rows.unknown_axes(row)) {
            if !is_unknown {
                *motions = [0.0; MOTIONS];
            }
        }
        motions
    };
    places.par_iter().enumerate().map(of_node).collect()
}

/// A motion of which so little is left once the others are taken out is one of them.
const DEPENDENT: f64 = 1e-8;

/// Motions of the nodes made orthonormal in each aggregate, and what each aggregate does in the
/// motions they were made of: `motions = orthonormal × coarse`.
///
/// Where an aggregate has fewer motions than six (one node, nodes in line, known axes) the missing
/// ones are zero in both.
///
/// Shapes: `motions` and the first result one per node; the second one per aggregate.
pub(super) fn orthonormal<const B: usize>(
    motions: &[OfNode<B>],
    aggregates: &Aggregates,
) -> (Vec<OfNode<B>>, Vec<OfNode<MOTIONS>>) {
    let members = aggregates.members();
    let found: Vec<(Vec<OfNode<B>>, OfNode<MOTIONS>)> =
        members.par_iter().with_min_len(16).map(|nodes| of_aggregate(motions, nodes)).collect();
    let mut orthonormal = vec![[[0.0; MOTIONS]; B]; motions.len()];
    let mut coarse = Vec::with_capacity(found.len());
    for (nodes, (of_nodes, of_aggregate)) in members.iter().zip(found) {
        for (&node, of_node) in nodes.iter().zip(of_nodes) {
            orthonormal[node as usize] = of_node;
        }
        coarse.push(of_aggregate);
    }
    (orthonormal, coarse)
}

/// Gram–Schmidt, each motion twice, because once loses digits.
fn of_aggregate<const B: usize>(
    motions: &[OfNode<B>],
    nodes: &[u32],
) -> (Vec<OfNode<B>>, OfNode<MOTIONS>) {
    let mut q: Vec<OfNode<B>> = nodes.iter().map(|&node| motions[node as usize]).collect();
    let mut r = [[0.0; MOTIONS]; MOTIONS];
    let dot = |q: &[OfNode<B>], a: usize, b: usize| -> f64 {
        q.iter().flatten().map(|line| line[a] * line[b]).sum()
    };
    for k in 0..MOTIONS {
        let before = dot(&q, k, k).sqrt();
        for _ in 0..2 {
            for j in 0..k {
                let along = dot(&q, j, k);
                r[j][k] += along;
                q.iter_mut().flatten().for_each(|line| line[k] -= along * line[j]);
            }
        }
        let left = dot(&q, k, k).sqrt();
        let is_one = left > DEPENDENT * before;
        r[k][k] = if is_one { left } else { 0.0 };
        q.iter_mut().flatten().for_each(|line| line[k] = if is_one { line[k] / left } else { 0.0 });
    }
    (q, r)
}
