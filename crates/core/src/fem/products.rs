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

impl Products {
    /// `K q` and `|K| |q|` for several displacements (3.36); rows in parallel, same bits always.
    ///
    /// Shapes: `q` 3N × `columns`, the numbers of one degree of freedom next to each other.
    pub fn of(stiffness: &Stiffness, q: &[f64], columns: usize) -> Self {
        let (mut forces, mut sizes) = (vec![0.0; q.len()], vec![0.0; q.len()]);
        let task = task_len(stiffness, q, columns);
        let (arch, tasks) = (Arch::new(), sizes.par_chunks_mut(task));
        forces.par_chunks_mut(task).zip(tasks).enumerate().for_each(|(k, (forces, sizes))| {
            let first = k * TASK_NODES;
            arch.dispatch(NodeRows { stiffness, first, q, columns, forces, sizes: Some(sizes) });
        });
        Self { forces, sizes }
    }
}

/// `K q` alone, with the bits of [`Products`], in the place of what `forces` held.
///
/// Shapes: as [`Products::of`].
pub(crate) fn forces_of_columns(
    stiffness: &Stiffness,
    q: &[f64],
    columns: usize,
    forces: &mut [f64],
) {
    assert_eq!(forces.len(), q.len(), "forces do not fit");
    let (arch, task) = (Arch::new(), task_len(stiffness, q, columns));
    forces.par_chunks_mut(task).enumerate().for_each(|(k, forces)| {
        let first = k * TASK_NODES;
        arch.dispatch(NodeRows { stiffness, first, q, columns, forces, sizes: None });
    });
}

fn task_len(stiffness: &Stiffness, q: &[f64], columns: usize) -> usize {
    assert_eq!(q.len(), AXES * stiffness.node_count() * columns, "displacements do not fit");
    TASK_NODES * AXES * columns.max(1)
}

/// Some block rows of a product.
struct NodeRows<'a> {
    stiffness: &'a Stiffness,
    first: usize,
    q: &'a [f64],
    columns: usize,
    forces: &'a mut [f64],
    sizes: Option<&'a mut [f64]>,
}

impl WithSimd for NodeRows<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let Self { stiffness, first, q, columns, forces, sizes } = self;
        let of_node = AXES * columns;
        let row = |k: usize| Row { stiffness, node: first + k, q, columns };
        match sizes {
            Some(sizes) => {
                let sizes = sizes.chunks_exact_mut(of_node);
                for (k, (forces, sizes)) in forces.chunks_exact_mut(of_node).zip(sizes).enumerate()
                {
                    row(k).all_columns::<true>(forces, sizes);
                }
            }
            None => {
                for (k, forces) in forces.chunks_exact_mut(of_node).enumerate() {
                    row(k).all_columns::<false>(forces, &mut []);
                }
            }
        }
    }
}

/// One block row of a product.
struct Row<'a> {
    stiffness: &'a Stiffness,
    node: usize,
    q: &'a [f64],
    columns: usize,
}

impl Row<'_> {
    #[inline(always)]
    fn all_columns<const SIZES: bool>(&self, forces: &mut [f64], sizes: &mut [f64]) {
        let mut from = 0;
        while from < self.columns {
            from += match self.columns - from {
                24.. => self.some_columns::<24, SIZES>(from, forces, sizes),
                16.. => self.some_columns::<16, SIZES>(from, forces, sizes),
                8.. => self.some_columns::<8, SIZES>(from, forces, sizes),
                4.. => self.some_columns::<4, SIZES>(from, forces, sizes),
                2.. => self.some_columns::<2, SIZES>(from, forces, sizes),
                _ => self.some_columns::<1, SIZES>(from, forces, sizes),
            };
        }
    }

    /// W columns, whose sums stay in registers; returns W.
    #[inline(always)]
    fn some_columns<const W: usize, const SIZES: bool>(
        &self,
        from: usize,
        forces: &mut [f64],
        sizes: &mut [f64],
    ) -> usize {
        let (mut force, mut size) = ([[0.0; W]; AXES], [[0.0; W]; AXES]);
        for (other, block) in self.stiffness.row(self.node) {
            for c in 0..AXES {
                let at = (AXES * other + c) * self.columns + from;
                let q = &self.q[at..at + W];
                for a in 0..AXES {
                    let entry = block[AXES * a + c];
                    for w in 0..W {
                        let product = entry * q[w];
                        force[a][w] += product;
                        if SIZES {
                            size[a][w] += product.abs();
                        }
                    }
                }
            }
        }
        for a in 0..AXES {
            let at = a * self.columns + from;
            forces[at..at + W].copy_from_slice(&force[a]);
            if SIZES {
                sizes[at..at + W].copy_from_slice(&size[a]);
            }
        }
        W
    }
}
