//! All levels, and one descent and ascent through them as an approximate inverse of `K11`.

use rayon::prelude::*;

use super::block_rows::{NodeMatrix, TASK_ROWS};
use super::chebyshev::Vectors;
use super::coarsest::Coarsest;
use super::fine_rows::FineRows;
use super::level::Level;
use super::motions::{self, MOTIONS};
use super::sums::largest;
use crate::fem::{AXES, Stiffness};
use crate::solve::Partition;

/// A hierarchy of levels for `K11` of one partition.
///
/// Shapes: three unknowns at a node of the finest level, six at one of the others.
pub(crate) struct Hierarchy {
    fine: Level<AXES>,
    coarse: Vec<Level<MOTIONS>>,
    coarsest: Coarsest,
    coarsest_rows: usize,
    /// Node of each row of the finest level, ascending.
    nodes: Vec<u32>,
    /// Degree of freedom of each row of `K11`, ascending.
    unknown: Vec<u32>,
    /// What the stiffness was multiplied with.
    scale: f64,
}

/// A level with as few nodes is factored.
const COARSEST_NODES: usize = 120;
/// A level with more than this share of the nodes of the finer one is the last.
const COARSENED: f64 = 0.8;
/// Levels at most.
const LEVELS_MAX: usize = 20;

/// What one descent and ascent works on.
pub(crate) struct Workspace {
    fine: Vectors<AXES>,
    coarse: Vec<Vectors<MOTIONS>>,
    coarsest: Vectors<MOTIONS>,
}

impl Hierarchy {
    /// Makes the levels on the current rayon pool.
    pub fn new(stiffness: &Stiffness, partition: &Partition) -> Self {
        let rows = FineRows::new(stiffness, partition);
        let motions = motions::of_fine(&rows, rows.row_count());
        let (fine, mut coarser) = Level::of_fine(&rows, motions);
        let mut coarse: Vec<Level<MOTIONS>> = Vec::new();
        let mut finer_rows = rows.row_count();
        while coarser.a.row_count() > COARSEST_NODES
            && (coarser.a.row_count() as f64) < COARSENED * finer_rows as f64
            && coarse.len() + 2 < LEVELS_MAX
        {
            finer_rows = coarser.a.row_count();
            let (level, next) = Level::of_coarse(coarser.a, coarser.motions, coarse.len() + 1);
            coarse.push(level);
            coarser = next;
        }
        let coarsest_rows = coarser.a.row_count();
        let coarsest = Coarsest::new(coarser.a);
        let (nodes, scale) = (rows.nodes().to_vec(), rows.scale());
        let unknown = partition.unknown().to_vec();
        Self { fine, coarse, coarsest, coarsest_rows, nodes, unknown, scale }
    }

    /// Memory for [`Hierarchy::apply`].
    pub fn workspace(&self) -> Workspace {
        Workspace {
            fine: Vectors::new(self.fine.row_count()),
            coarse: self.coarse.iter().map(|level| Vectors::new(level.row_count())).collect(),
            coarsest: Vectors::new(self.coarsest_rows),
        }
    }

    /// Nodes of each level, the finest first.
    #[cfg(test)]
    pub fn level_rows(&self) -> Vec<usize> {
        let coarse = self.coarse.iter().map(Level::row_count);
        [self.fine.row_count()].into_iter().chain(coarse).chain([self.coarsest_rows]).collect()
    }

    /// Bytes held.
    pub fn bytes(&self) -> usize {
        let coarse: usize = self.coarse.iter().map(Level::bytes).sum();
        self.fine.bytes()
            + coarse
            + self.coarsest.bytes()
            + std::mem::size_of_val(self.nodes.as_slice())
            + std::mem::size_of_val(self.unknown.as_slice())
    }

    /// Nearly `K11⁻¹ r`, symmetric positive definite up to single precision's rounding.
    ///
    /// Shapes: `r` and `z` 3N, known rows of `r` zero, those of `z` become zero. Units: N, m.
    pub fn apply(&self, r: &[f64], z: &mut [f64], w: &mut Workspace) {
        let size = largest(r);
        let size = if size > 0.0 && size.is_finite() { size } else { 1.0 };
        let by = 1.0 / size;
        let nodes = self.nodes.par_iter().with_min_len(TASK_ROWS);
        w.fine.r.par_iter_mut().zip(nodes).for_each(|(place, &node)| {
            let first = AXES * node as usize;
            *place = std::array::from_fn(|axis| (by * r[first + axis]) as f32);
        });
        self.cycle(w);
        let back = size * self.scale;
        z.par_chunks_mut(TASK_ROWS * AXES).enumerate().for_each(|(task, z)| {
            z.fill(0.0);
            let first = (task * TASK_ROWS) as u32;
            let last = first + (z.len() / AXES) as u32;
            let from = self.nodes.partition_point(|&node| node < first);
            let nodes = self.nodes[from..].iter().take_while(|node| **node < last);
            for (&node, x) in nodes.zip(&w.fine.x[from..]) {
                let at = AXES * (node - first) as usize;
                (0..AXES).for_each(|axis| z[at + axis] = back * f64::from(x[axis]));
            }
        });
    }

    /// Preconditioner applied to the rows of `K11` alone.
    ///
    /// Shapes: `r` and result n.
    pub fn apply_to_unknown(&self, r: &[f64]) -> Vec<f64> {
        let dofs = self.unknown.last().map_or(0, |last| *last as usize + 1);
        let mut all = vec![0.0; dofs.next_multiple_of(AXES)];
        let mut z = all.clone();
        for (&dof, r) in self.unknown.iter().zip(r) {
            all[dof as usize] = *r;
        }
        self.apply(&all, &mut z, &mut self.workspace());
        self.unknown.iter().map(|&dof| z[dof as usize]).collect()
    }

    /// Down and up again: `w.fine.x` for `w.fine.r`.
    fn cycle(&self, w: &mut Workspace) {
        let Workspace { fine, coarse, coarsest } = w;
        self.fine.descend(fine, coarse.first_mut().map_or(&mut coarsest.r, |v| &mut v.r));
        for (k, level) in self.coarse.iter().enumerate() {
            let (of_level, rest) = coarse[k..].split_at_mut(1);
            let next = rest.first_mut().map_or(&mut coarsest.r, |v| &mut v.r);
            level.descend(&mut of_level[0], next);
        }
        self.coarsest.solve(coarsest);
        for (k, level) in self.coarse.iter().enumerate().rev() {
            let (of_level, rest) = coarse[k..].split_at_mut(1);
            let correction = rest.first().map_or(&coarsest.x, |v| &v.x);
            level.ascend(&mut of_level[0], correction);
        }
        self.fine.ascend(fine, coarse.first().map_or(&coarsest.x, |v| &v.x));
    }
}
