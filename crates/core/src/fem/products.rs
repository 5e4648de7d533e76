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
        let Self { stiffness, first, q, columns, forces, sizes } = self;
        let of_node = AXES * columns;
        let rows = forces.chunks_exact_mut(of_node).zip(sizes.chunks_exact_mut(of_node));
        for (k, (forces, sizes)) in rows.enumerate() {
            for (other, block) in stiffness.row(first + k) {
                let q = &q[other * of_node..][..of_node];
                let rows = forces.chunks_exact_mut(columns).zip(sizes.chunks_exact_mut(columns));
                for ((forces, sizes), entries) in rows.zip(block.chunks_exact(AXES)) {
                    for (&entry, q) in entries.iter().zip(q.chunks_exact(columns)) {
                        for ((force, size), q) in forces.iter_mut().zip(&mut *sizes).zip(q) {
                            *force += entry * q;
                            *size += (entry * q).abs();
                        }
                    }
                }
            }
        }
    }
}
