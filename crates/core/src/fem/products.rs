//! Products of the stiffness with several displacements at once: each block is read once for all.

use pulp::{Arch, Simd, WithSimd};
use rayon::prelude::*;

use super::{AXES, Stiffness};

/// `K q` and what rounding in it is measured by.
///
/// Shapes: 3N × columns, the numbers of one degree of freedom next to each other.
pub(crate) struct Products {
    /// `K q`, N.
    pub forces: Vec<f64>,
    /// `|K| |q|` with absolute values of all entries, N.
    pub sizes: Vec<f64>,
}

/// Nodes of a task.
const TASK_NODES: usize = 64;

impl Stiffness {
    /// `K q` and `|K| |q|` for several displacements (3.36); rows in parallel, same bits always.
    ///
    /// Shapes: `q` 3N × `columns`, the numbers of one degree of freedom next to each other.
    pub(crate) fn mul_columns(&self, q: &[f64], columns: usize) -> Products {
        assert_eq!(q.len(), AXES * self.node_count() * columns, "displacements do not fit");
        let (mut forces, mut sizes) = (vec![0.0; q.len()], vec![0.0; q.len()]);
        if columns > 0 {
            let arch = Arch::new();
            let task = TASK_NODES * AXES * columns;
            forces.par_chunks_mut(task).zip(sizes.par_chunks_mut(task)).enumerate().for_each(
                |(k, (forces, sizes))| {
                    let first = k * TASK_NODES;
                    arch.dispatch(Rows { stiffness: self, first, q, columns, forces, sizes });
                },
            );
        }
        Products { forces, sizes }
    }
}

/// Some block rows of a product.
struct Rows<'a> {
    stiffness: &'a Stiffness,
    first: usize,
    q: &'a [f64],
    columns: usize,
    forces: &'a mut [f64],
    sizes: &'a mut [f64],
}

impl WithSimd for Rows<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let of_node = AXES * self.columns;
        let nodes = self.forces.chunks_exact_mut(of_node).zip(self.sizes.chunks_exact_mut(of_node));
        for (k, (forces, sizes)) in nodes.enumerate() {
            let row = Row { stiffness: self.stiffness, node: self.first + k, q: self.q };
            let mut from = 0;
            while from < self.columns {
                let at = (from, self.columns);
                from += match self.columns - from {
                    8.. => row.some_columns::<8>(at, forces, sizes),
                    4.. => row.some_columns::<4>(at, forces, sizes),
                    _ => row.some_columns::<1>(at, forces, sizes),
                };
            }
        }
    }
}

/// One block row of a product.
struct Row<'a> {
    stiffness: &'a Stiffness,
    node: usize,
    q: &'a [f64],
}

impl Row<'_> {
    /// W columns, whose sums stay in registers; returns W.
    #[inline(always)]
    fn some_columns<const W: usize>(
        &self,
        (from, columns): (usize, usize),
        forces: &mut [f64],
        sizes: &mut [f64],
    ) -> usize {
        let (mut force, mut size) = ([[0.0; W]; AXES], [[0.0; W]; AXES]);
        for (other, block) in self.stiffness.row(self.node) {
            for c in 0..AXES {
                let at = (AXES * other + c) * columns + from;
                let q = &self.q[at..at + W];
                for a in 0..AXES {
                    let entry = block[AXES * a + c];
                    for w in 0..W {
                        force[a][w] += entry * q[w];
                        size[a][w] += (entry * q[w]).abs();
                    }
                }
            }
        }
        for a in 0..AXES {
            let at = a * columns + from;
            forces[at..at + W].copy_from_slice(&force[a]);
            sizes[at..at + W].copy_from_slice(&size[a]);
        }
        W
    }
}
