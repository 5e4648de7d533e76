//! All levels, and one descent and ascent through them as an approximate inverse of `K11`.
//! The coarsest level has a dense factor where it is small, and is smoothed where it is not.

use rayon::prelude::*;

use super::block_rows::{BlockRows, FineRows, NodeMatrix, TASK_ROWS};
use super::chebyshev::{Chebyshev, Vectors};
use super::level::Level;
use super::motions::{self, MOTIONS};
use super::small::largest;
use crate::fem::{AXES, Stiffness};
use crate::solve::Partition;
use crate::solve::tiles::Tiles;

/// Solver of the coarsest level.
pub(super) enum Coarsest {
    /// Dense Cholesky factor.
    Factor(Tiles),
    /// Where many bodies end in one aggregate each, or rounding leaves no factor, the level is
    /// smoothed.
    Smoothed(BlockRows<MOTIONS, MOTIONS>, Chebyshev<MOTIONS>),
}

/// A level with more nodes is not factored: its factor would take longer than all the rest.
const NODES_MAX: usize = 500;
/// Added to the diagonal where rounding makes the matrix lose its definiteness, one after another.
const SHIFTS: [f64; 4] = [0.0, 1e-7, 1e-6, 1e-5];

impl Coarsest {
    pub fn new(a: BlockRows<MOTIONS, MOTIONS>) -> Self {
        if a.row_count() <= NODES_MAX {
            for shift in SHIFTS {
                let mut tiles = dense(&a, shift);
                if tiles.factor().is_ok() {
                    return Self::Factor(tiles);
                }
            }
        }
        let smoother = Chebyshev::new(&a);
        Self::Smoothed(a, smoother)
    }
    pub fn bytes(&self) -> usize {
        match self {
            Self::Factor(tiles) => tiles.bytes(),
            Self::Smoothed(a, smoother) => a.bytes() + smoother.bytes(),
        }
    }

    /// The answers, or something near them, in `v.x` for the right-hand sides `v.r`.
    pub fn solve<const W: usize>(&self, v: &mut Vectors<MOTIONS, W>) {
        match self {
            Self::Factor(tiles) => {
                let solved: Vec<Vec<f64>> = (0..W)
                    .into_par_iter()
                    .map(|w| {
                        let of_column = v.r.as_flattened().iter().map(|x| f64::from(x[w]));
                        let mut b: Vec<f64> = of_column.collect();
                        tiles.solve_in_place(&mut b);
                        b
                    })
                    .collect();
                for (row, x) in v.x.as_flattened_mut().iter_mut().enumerate() {
                    *x = std::array::from_fn(|w| solved[w][row] as f32);
                }
            }
            Self::Smoothed(a, smoother) => {
                v.x.fill([[0.0; W]; MOTIONS]);
                smoother.smooth(a, v, true);
                smoother.smooth(a, v, false);
            }
        }
    }
}

/// The lower triangle as a dense matrix, its diagonal larger by a share.
fn dense(a: &BlockRows<MOTIONS, MOTIONS>, shift: f64) -> Tiles {
    let mut tiles = Tiles::zeros(MOTIONS * a.row_count());
    for row in 0..a.row_count() {
        a.visit(row, &mut |column, block| {
            for (r, line) in block.iter().enumerate() {
                for (c, value) in line.iter().enumerate() {
                    let (i, j) = (MOTIONS * row + r, MOTIONS * column + c);
                    let value = if i == j { value * (1.0 + shift) } else { *value };
                    if i >= j {
                        tiles.add(i, j, value);
                    }
                }
            }
        });
    }
    tiles
}

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
    /// Power of two that the stiffness was multiplied with.
    scale: f64,
}

/// A level with as few nodes is factored.
const COARSEST_NODES: usize = 120;
/// A level with more than this share of the nodes of the finer one is the last.
const COARSENED: f64 = 0.8;
/// Most levels of a hierarchy.
const LEVELS_MAX: usize = 20;

/// What one descent and ascent works on, for W right-hand sides at once.
pub(crate) struct Workspace<const W: usize> {
    fine: Vectors<AXES, W>,
    coarse: Vec<Vectors<MOTIONS, W>>,
    coarsest: Vectors<MOTIONS, W>,
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
    pub fn workspace<const W: usize>(&self) -> Workspace<W> {
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
    pub fn bytes(&self) -> usize {
        let coarse: usize = self.coarse.iter().map(Level::bytes).sum();
        self.fine.bytes()
            + coarse
            + self.coarsest.bytes()
            + std::mem::size_of_val(self.nodes.as_slice())
            + std::mem::size_of_val(self.unknown.as_slice())
    }

    /// Nearly `K11⁻¹ r` for W right-hand sides, symmetric positive definite up to single precision's
    /// rounding. Each is scaled by itself, so none spoils the digits of another.
    ///
    /// Shapes: `r` and `z` 3N × W, the numbers of one degree of freedom next to each other; known rows of
    /// `r` zero, those of `z` become zero. Units: N, m.
    pub fn apply<const W: usize>(&self, r: &[f64], z: &mut [f64], w: &mut Workspace<W>) {
        let is_scale = |size: f64| size > 0.0 && size.is_finite();
        let sizes = largest::<W>(r).map(|size| if is_scale(size) { size } else { 1.0 });
        let by = sizes.map(|size| 1.0 / size);
        let nodes = self.nodes.par_iter().with_min_len(TASK_ROWS);
        w.fine.r.par_iter_mut().zip(nodes).for_each(|(place, &node)| {
            let r = &r[AXES * W * node as usize..];
            for (place, r) in place.iter_mut().zip(r.as_chunks::<W>().0) {
                *place = std::array::from_fn(|w| (by[w] * r[w]) as f32);
            }
        });
        self.cycle(w);
        let back = sizes.map(|size| size * self.scale);
        z.par_chunks_mut(TASK_ROWS * AXES * W).enumerate().for_each(|(task, z)| {
            z.fill(0.0);
            let first = (task * TASK_ROWS) as u32;
            let last = first + (z.len() / (AXES * W)) as u32;
            let from = self.nodes.partition_point(|&node| node < first);
            let nodes = self.nodes[from..].iter().take_while(|node| **node < last);
            for (&node, x) in nodes.zip(&w.fine.x[from..]) {
                let z = &mut z[AXES * W * (node - first) as usize..];
                for (z, x) in z.as_chunks_mut::<W>().0.iter_mut().zip(x) {
                    *z = std::array::from_fn(|w| back[w] * f64::from(x[w]));
                }
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
        self.apply::<1>(&all, &mut z, &mut self.workspace());
        self.unknown.iter().map(|&dof| z[dof as usize]).collect()
    }

    /// Down and up again: `w.fine.x` for `w.fine.r`.
    fn cycle<const W: usize>(&self, w: &mut Workspace<W>) {
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
