//! The submatrices of (3.41) taken out of the stiffness: `K11` dense or sparse, `K12` applied.

use super::Partition;
use crate::fem::{Stiffness, dof};

/// Lower triangle of `K11` by columns (compressed sparse columns, rows ascending).
///
/// Shapes: n × n, n unknown degrees of freedom. Units: N/m.
pub(super) struct SparseK11 {
    pub column_start: Vec<usize>,
    pub rows: Vec<usize>,
    pub values: Vec<f64>,
}

/// Calls `visit(row, column, value)` for every stored entry of `K11`, both triangles, by rows.
///
/// Source: thesis (3.41).
pub(super) fn visit_k11(
    stiffness: &Stiffness,
    partition: &Partition,
    mut visit: impl FnMut(usize, usize, f64),
) {
    for node in 0..stiffness.node_count() {
        for axis in 0..3 {
            let Some(row) = partition.row_of(dof(node, axis)) else { continue };
            for (column_node, block) in stiffness.row(node) {
                for c in 0..3 {
                    if let Some(column) = partition.row_of(dof(column_node, c)) {
                        visit(row, column, block[3 * axis + c]);
                    }
                }
            }
        }
    }
}

impl SparseK11 {
    /// Takes the lower triangle out of the stiffness. The matrix is symmetric, so row i of the
    /// upper triangle is column i of the lower one and comes in the right order.
    pub fn new(stiffness: &Stiffness, partition: &Partition) -> Self {
        let n = partition.unknown().len();
        let mut k11 = Self { column_start: vec![0; n + 1], rows: Vec::new(), values: Vec::new() };
        visit_k11(stiffness, partition, |row, column, value| {
            if column >= row {
                k11.rows.push(column);
                k11.values.push(value);
                k11.column_start[row + 1] += 1;
            }
        });
        for i in 0..n {
            k11.column_start[i + 1] += k11.column_start[i];
        }
        k11
    }
}

/// Right-hand side of (3.42a) solved for `Q_u`: `b = f₁ − K12 Q_k`.
///
/// Shapes: `q_known` as many as known degrees of freedom; `forces` empty or 3N; result n.
/// Units: m, N.
///
/// Source: thesis (3.42a), with external forces (3.7).
pub(super) fn right_hand_side(
    stiffness: &Stiffness,
    partition: &Partition,
    q_known: &[f64],
    forces: &[f64],
) -> Vec<f64> {
    let mut b: Vec<f64> = match forces {
        [] => vec![0.0; partition.unknown().len()],
        f => partition.unknown().iter().map(|&d| f[d as usize]).collect(),
    };
    for (&known, &q) in partition.known().iter().zip(q_known) {
        let (node, axis) = (known as usize / 3, known as usize % 3);
        // Row `known` of the symmetric matrix is its column.
        for (other, block) in stiffness.row(node) {
            for c in 0..3 {
                if let Some(row) = partition.row_of(dof(other, c)) {
                    b[row] -= block[3 * axis + c] * q;
                }
            }
        }
    }
    b
}

/// Row of `K11` where a pivot was not positive.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct NotPositive {
    pub row: usize,
}
