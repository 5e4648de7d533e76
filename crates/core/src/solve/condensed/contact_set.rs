//! One set of touched degrees of freedom: the small system, and answers from it.

use std::sync::Arc;

use nalgebra::{DMatrix, DVector, Dyn, LU};
use rayon::prelude::*;

use super::base::{Base, CondensedError};
use super::bound::SmallBound;
use super::certificate::LoadSize;
use super::columns::{Columns, NodeColumns};

/// A set of touched degrees of freedom, ready to answer any displacements of them.
///
/// Shapes: c touched degrees of freedom, z modes; small system (c + z)².
pub struct ContactSet {
    dofs: Vec<u32>,
    pub(super) columns: Vec<Arc<NodeColumns>>,
    /// Position in `columns` and axis of every touched degree of freedom.
    pub(super) places: Vec<(usize, usize)>,
    /// Scaled `[ G_C R_C ; R_Cᵀ 0 ]`, so that both kinds of unknowns have size one.
    small: DMatrix<f64>,
    small_lu: LU<f64, Dyn, Dyn>,
    /// Scale of λ.
    scale: f64,
    condition: f64,
    pub(super) bound: SmallBound,
    pub(super) load: LoadSize,
    rows: Option<WantedRows>,
}

/// Rows of `[G_C R]` at the nodes asked for, gathered once per set of nodes.
///
/// Shapes: blocks of [`ROWS_TOGETHER`] rows (the last may be shorter), one behind the other, the
/// columns of a block one behind the other: the product runs once through this memory.
struct WantedRows {
    nodes: Vec<u32>,
    blocks: Vec<f64>,
}

/// Forces and motions that answer one set of displacements.
#[derive(Clone, Debug, PartialEq)]
pub struct ContactAnswer {
    /// Force at every touched degree of freedom, N: the reactions of (3.43b).
    pub lambda: Vec<f64>,
    /// Amounts of the modes.
    pub amounts: Vec<f64>,
    /// How far the touched degrees of freedom are from what was asked, as a norm, m.
    pub mismatch: f64,
}

/// Above this condition the last digits of the small system are all rounding.
const CONDITION_MAX: f64 = 1e14;
/// Rows multiplied together: as many as stay in the nearest cache, a multiple of three.
const ROWS_TOGETHER: usize = 1536;
/// A product of more numbers is shared out among the threads; a smaller one is sooner done.
const SHARED_PRODUCT: usize = 1 << 20;

impl ContactSet {
    /// Gathers (or computes) the columns of the touched nodes and factors the small system.
    ///
    /// Shapes: `dofs` ascending touched degrees of freedom, none of them fixed by the scene.
    ///
    /// # Errors
    /// [`CondensedError::CacheTooSmall`]; [`CondensedError::NotHeld`] if a motion is left free.
    pub fn try_new(base: &Base, columns: &Columns, dofs: &[u32]) -> Result<Self, CondensedError> {
        let mut nodes: Vec<u32> = dofs.iter().map(|d| d / 3).collect();
        nodes.dedup();
        let columns = columns.of_nodes(base, &nodes)?;
        let places: Vec<(usize, usize)> = dofs
            .iter()
            .map(|d| (nodes.partition_point(|n| n < &(d / 3)), *d as usize % 3))
            .collect();
        let (c, z) = (dofs.len(), base.modes.len());
        let g = |i: usize, j: usize| {
            let (node, axis) = places[j];
            columns[node].fields[axis][dofs[i] as usize]
        };
        let trace: f64 = (0..c).map(|i| g(i, i)).sum();
        let scale = if trace > 0.0 { c as f64 / trace } else { 1.0 };
        let small = DMatrix::from_fn(c + z, c + z, |i, j| match (i < c, j < c) {
            // Symmetrised: the two triangles differ by rounding of two different solves.
            (true, true) => 0.5 * scale * (g(i, j) + g(j, i)),
            (true, false) => base.modes[j - c].field[dofs[i] as usize],
            (false, true) => base.modes[i - c].field[dofs[j] as usize],
            (false, false) => 0.0,
        });
        let small_lu = small.clone().lu();
        let inverse = small_lu.try_inverse().ok_or(CondensedError::NotHeld)?;
        let condition = small.norm() * inverse.norm();
        // Written so that a NaN is refused too.
        if !(0.0..=CONDITION_MAX).contains(&condition) {
            return Err(CondensedError::NotHeld);
        }
        let bound = SmallBound::new(base, &columns, &places, &inverse, scale)?;
        let load = LoadSize::new(base, dofs);
        let dofs = dofs.to_vec();
        let rows = None;
        Ok(Self { dofs, columns, places, small, small_lu, scale, condition, bound, load, rows })
    }

    /// The touched degrees of freedom, ascending.
    pub fn dofs(&self) -> &[u32] {
        &self.dofs
    }

    /// Bytes of the small system and the wanted rows; the columns are counted where they are kept.
    pub fn bytes(&self) -> usize {
        let rows = self.rows.as_ref().map_or(0, |rows| rows.blocks.len());
        8 * (rows + 2 * self.small.len())
    }

    /// Numbers multiplied for one answer at the wanted nodes.
    pub fn products(&self) -> usize {
        self.rows.as_ref().map_or(0, |rows| rows.blocks.len()) + 6 * self.small.len()
    }

    /// Condition of the small system in the Frobenius norm: how weakly the touched nodes hold.
    pub fn condition(&self) -> f64 {
        self.condition
    }

    /// Gathers the rows of the nodes that answers are wanted for; does nothing if it is the same
    /// list as before.
    pub fn want(&mut self, base: &Base, nodes: &[u32]) {
        if self.rows.as_ref().is_some_and(|rows| rows.nodes == nodes) {
            return;
        }
        let columns = self.places.iter().map(|&(node, axis)| &self.columns[node].fields[axis]);
        let fields: Vec<&Vec<f64>> = columns.chain(base.modes.iter().map(|m| &m.field)).collect();
        let mut blocks = Vec::with_capacity(3 * nodes.len() * fields.len());
        for nodes in nodes.chunks(ROWS_TOGETHER / 3) {
            for field in &fields {
                blocks.extend(nodes.iter().flat_map(|&node| &field[3 * node as usize..][..3]));
            }
        }
        self.rows = Some(WantedRows { nodes: nodes.to_vec(), blocks });
    }

    /// Forces and motions for displacements of the touched degrees of freedom.
    ///
    /// Shapes: `q` one per touched degree of freedom, m.
    ///
    /// # Errors
    /// [`CondensedError::NotHeld`], [`CondensedError::NotFinite`].
    pub fn solve(&self, q: &[f64]) -> Result<ContactAnswer, CondensedError> {
        let c = self.dofs.len();
        let right = DVector::from_fn(self.small.nrows(), |i, _| q.get(i).copied().unwrap_or(0.0));
        let mut x = self.small_lu.solve(&right).ok_or(CondensedError::NotHeld)?;
        // One step of refinement takes out the rounding of the elimination.
        let miss = &right - &self.small * &x;
        x += self.small_lu.solve(&miss).ok_or(CondensedError::NotHeld)?;
        let mismatch = (&right - &self.small * &x).norm();
        if !x.iter().all(|v| v.is_finite()) {
            return Err(CondensedError::NotFinite);
        }
        Ok(ContactAnswer {
            lambda: x.iter().take(c).map(|v| v * self.scale).collect(),
            amounts: x.iter().skip(c).copied().collect(),
            mismatch,
        })
    }

    /// Displacements at the wanted nodes (see [`ContactSet::want`]), 3 per node, m.
    ///
    /// Source: `u = G λ + R a`, see the module.
    pub fn wanted_displacements(&self, answer: &ContactAnswer) -> Vec<[f64; 3]> {
        let Some(rows) = &self.rows else { return Vec::new() };
        let x: Vec<f64> = answer.lambda.iter().chain(&answer.amounts).copied().collect();
        let mut u = vec![[0.0; 3]; rows.nodes.len()];
        let parts = u.chunks_mut(ROWS_TOGETHER / 3).map(|part| part.as_flattened_mut());
        let blocks = rows.blocks.chunks((ROWS_TOGETHER * x.len()).max(1));
        match rows.blocks.len() < SHARED_PRODUCT {
            true => parts.zip(blocks).for_each(|(u, block)| multiply(block, &x, u)),
            false => parts.zip(blocks).par_bridge().for_each(|(u, block)| multiply(block, &x, u)),
        }
        u
    }

    /// Displacement of every degree of freedom, 3N, m.
    pub fn full_displacement(&self, base: &Base, answer: &ContactAnswer) -> Vec<f64> {
        let mut u = vec![0.0; base.dof_count()];
        let columns = self.places.iter().map(|&(node, axis)| &self.columns[node].fields[axis]);
        let modes = base.modes.iter().map(|mode| &mode.field);
        let amounts = answer.lambda.iter().chain(&answer.amounts);
        for (field, amount) in columns.chain(modes).zip(amounts) {
            for (u, g) in u.iter_mut().zip(field) {
                *u += amount * g;
            }
        }
        u
    }
}

/// `u += M x` for a block of columns, four at a time; the order of the sums is always the same.
fn multiply(block: &[f64], x: &[f64], u: &mut [f64]) {
    let rows = u.len().max(1);
    let mut fours = block.chunks_exact(4 * rows);
    let mut amounts = x.chunks_exact(4);
    for (four, x) in fours.by_ref().zip(amounts.by_ref()) {
        let (ab, cd) = four.split_at(2 * rows);
        let ((a, b), (c, d)) = (ab.split_at(rows), cd.split_at(rows));
        for ((((u, a), b), c), d) in u.iter_mut().zip(a).zip(b).zip(c).zip(d) {
            *u += (a * x[0] + b * x[1]) + (c * x[2] + d * x[3]);
        }
    }
    for (column, x) in fours.remainder().chunks_exact(rows).zip(amounts.remainder()) {
        u.iter_mut().zip(column).for_each(|(u, g)| *u += g * x);
    }
}
