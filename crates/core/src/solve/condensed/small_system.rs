//! The small system of one set of contacts: the compliance between them and the motions without energy; and
//! the rows of its columns at the nodes that answers are wanted for.

use std::collections::BTreeSet;
use std::sync::Arc;

use nalgebra::{DMatrix, DVector, Dyn, LU};
use rayon::prelude::*;

use super::base::Base;
use super::columns::ContactColumns;
use super::error::CondensedError;
use super::touched::Touched;
use crate::solve::vectors::norm;
use crate::solve::zero_energy::FREE_BELOW;

/// The small system of one set of contacts, factored.
///
/// Shapes: c unknown forces, z modes; matrices (c + z)².
pub(super) struct SmallSystem {
    pub columns: Vec<Arc<ContactColumns>>,
    /// Position in `columns` and axis of every unknown force.
    pub places: Vec<(usize, usize)>,
    /// Scaled `[ EᵀG EᵀR ; (EᵀR)ᵀ 0 ]`, so that both kinds of unknowns have size one.
    pub matrix: DMatrix<f64>,
    /// Factor of the same with `EᵀG` made symmetric: the two triangles differ by rounding. `None`
    /// where nothing is unknown.
    lu: Option<LU<f64, Dyn, Dyn>>,
    /// Scale of λ.
    pub scale: f64,
    /// Condition in the Frobenius norm.
    pub condition: f64,
}

/// Forces and motions that answer one set of displacements.
#[derive(Clone, Debug, PartialEq)]
pub struct ContactAnswer {
    /// Force of every contact, N: the reactions of (3.43b) at the touched degrees of freedom, then
    /// the three components of each mask.
    pub lambda: Vec<f64>,
    /// Amounts of the modes.
    pub amounts: Vec<f64>,
    /// How far the contacts are from what was asked, as a norm, m.
    pub mismatch: f64,
}

/// Above this condition the last digits of the small system are all rounding.
const CONDITION_MAX: f64 = 1e14;
/// Why a small system cannot be solved: `moved` says how far each motion without energy moves each
/// contact, and a motion that moves none of them is free.
///
/// Shapes: `moved` one row per displacement of a contact, one column per motion.
fn refusal(moved: &DMatrix<f64>, condition: f64) -> CondensedError {
    // A matrix without rows has no singular values.
    let is_nearly_free = |moved: &DMatrix<f64>| {
        let sizes = moved.clone().singular_values();
        sizes.min() <= FREE_BELOW * sizes.max()
    };
    let is_free = moved.nrows() < moved.ncols() || !moved.is_empty() && is_nearly_free(moved);
    match is_free {
        true => CondensedError::NotHeld,
        false => CondensedError::HeldTooWeakly { condition },
    }
}

impl SmallSystem {
    /// Gathers the compliance between the contacts out of their columns and factors the system; gives
    /// its inverse too.
    ///
    /// # Errors
    /// [`CondensedError::NotHeld`] if a motion is left free, [`CondensedError::HeldTooWeakly`] if one
    /// is nearly free.
    pub fn try_new(
        base: &Base,
        touched: &Touched,
        columns: Vec<Arc<ContactColumns>>,
    ) -> Result<(Self, DMatrix<f64>), CondensedError> {
        let places = touched.places();
        let (c, z) = (places.len(), base.modes.len());
        let compliance = DMatrix::from_fn(c, c, |i, j| {
            let (at, axis) = places[j];
            touched.mean(i, &columns[at].fields[axis])
        });
        let moved = DMatrix::from_fn(c, z, |i, k| touched.mean(i, &base.modes[k].field));
        let trace = compliance.trace();
        let scale = if trace > 0.0 { c as f64 / trace } else { base.stiffest };
        let mut matrix = DMatrix::zeros(c + z, c + z);
        matrix.view_mut((0, 0), (c, c)).copy_from(&(&compliance * scale));
        matrix.view_mut((0, c), (c, z)).copy_from(&moved);
        matrix.view_mut((c, 0), (z, c)).copy_from(&moved.transpose());
        let symmetric = 0.5 * (&matrix + matrix.transpose());
        let unsolvable = |condition| refusal(&moved, condition);
        // A matrix without rows has no factor, and needs none.
        let lu = (c + z > 0).then(|| symmetric.lu());
        let inverse = match &lu {
            Some(lu) => lu.try_inverse().ok_or_else(|| unsolvable(f64::INFINITY))?,
            None => DMatrix::zeros(0, 0),
        };
        let condition = matrix.norm() * inverse.norm();
        // Written so that a NaN is refused too.
        if !(0.0..=CONDITION_MAX).contains(&condition) {
            return Err(unsolvable(condition));
        }
        Ok((Self { columns, places, matrix, lu, scale, condition }, inverse))
    }

    /// Columns of the compliance and motions without energy, in the order of the unknowns.
    pub fn fields<'a>(&'a self, base: &'a Base) -> impl Iterator<Item = &'a Vec<f64>> {
        let columns = self.places.iter().map(|&(at, axis)| &self.columns[at].fields[axis]);
        columns.chain(base.modes.iter().map(|mode| &mode.field))
    }

    /// Forces and motions for displacements of the contacts.
    ///
    /// Shapes: `q` one per touched degree of freedom, then three per mask, m.
    ///
    /// # Errors
    /// [`CondensedError::NotHeld`], [`CondensedError::NotFinite`].
    pub fn solve(&self, q: &[f64]) -> Result<ContactAnswer, CondensedError> {
        let right = DVector::from_fn(self.matrix.nrows(), |i, _| q.get(i).copied().unwrap_or(0.0));
        self.solve_right(&right)
    }

    /// Forces and motions for any right side.
    ///
    /// Shapes: `right` displacements of the contacts, then moments along the motions over the scale of the
    /// forces; c + z. Units: m.
    ///
    /// # Errors
    /// [`CondensedError::NotHeld`], [`CondensedError::NotFinite`].
    pub fn solve_right(&self, right: &DVector<f64>) -> Result<ContactAnswer, CondensedError> {
        let c = self.places.len();
        let solve = |right: &DVector<f64>| match &self.lu {
            Some(lu) => lu.solve(right).ok_or(CondensedError::NotHeld),
            None => Ok(right.clone()),
        };
        let mut x = solve(right)?;
        // One step of refinement takes out the rounding of the elimination and of the symmetry.
        let miss = right - &self.matrix * &x;
        x += solve(&miss)?;
        let mismatch = (right - &self.matrix * &x).norm();
        if !x.iter().all(|v| v.is_finite()) {
            return Err(CondensedError::NotFinite);
        }
        Ok(ContactAnswer {
            lambda: x.iter().take(c).map(|v| v * self.scale).collect(),
            amounts: x.iter().skip(c).copied().collect(),
            mismatch,
        })
    }

    /// Displacement of every degree of freedom, 3N, m.
    pub fn full_displacement(&self, base: &Base, answer: &ContactAnswer) -> Vec<f64> {
        let mut u = vec![0.0; base.dof_count()];
        let amounts = answer.lambda.iter().chain(&answer.amounts);
        for (field, amount) in self.fields(base).zip(amounts) {
            for (u, g) in u.iter_mut().zip(field) {
                *u += amount * g;
            }
        }
        u
    }
}

/// Rows of `[G R]` at the nodes asked for, gathered once per set of nodes.
///
/// Shapes: blocks of [`ROWS_TOGETHER`] rows (the last may be shorter), one behind the other, the
/// columns of a block one behind the other: the product runs once through this memory.
pub(super) struct WantedRows {
    pub nodes: Vec<u32>,
    blocks: Vec<f64>,
    /// Places in `nodes` of those that stand further ahead already, ascending.
    repeated: Vec<usize>,
}

/// Rows multiplied together: as many as stay in the nearest cache, a multiple of three.
const ROWS_TOGETHER: usize = 1536;
/// A product of more numbers is shared out among the threads; a smaller one is sooner done.
const SHARED_PRODUCT: usize = 1 << 20;

impl WantedRows {
    /// Gathers the rows of fields of 3N.
    pub fn new(nodes: &[u32], fields: &[&Vec<f64>]) -> Self {
        let mut blocks = vec![0.0; 3 * nodes.len() * fields.len()];
        let of_nodes = nodes.par_chunks(ROWS_TOGETHER / 3);
        let in_blocks = blocks.par_chunks_mut((ROWS_TOGETHER * fields.len()).max(1));
        of_nodes.zip(in_blocks).for_each(|(nodes, block)| {
            for (field, column) in fields.iter().zip(block.chunks_exact_mut(3 * nodes.len())) {
                for (row, &node) in column.as_chunks_mut::<3>().0.iter_mut().zip(nodes) {
                    row.copy_from_slice(&field[3 * node as usize..][..3]);
                }
            }
        });
        let mut seen = BTreeSet::new();
        let repeated = (0..nodes.len()).filter(|&at| !seen.insert(nodes[at])).collect();
        Self { nodes: nodes.to_vec(), blocks, repeated }
    }

    /// Numbers of all rows.
    pub fn len(&self) -> usize {
        self.blocks.len()
    }

    /// Displacements of an answer, 3 per node, m.
    pub fn displacements(&self, answer: &ContactAnswer) -> Vec<[f64; 3]> {
        let x: Vec<f64> = answer.lambda.iter().chain(&answer.amounts).copied().collect();
        self.product(&x)
    }

    /// The rows times some amounts of their fields, 3 per node.
    pub fn product(&self, x: &[f64]) -> Vec<[f64; 3]> {
        let mut u = vec![[0.0; 3]; self.nodes.len()];
        let parts = u.chunks_mut(ROWS_TOGETHER / 3).map(|part| part.as_flattened_mut());
        let blocks = self.blocks.chunks((ROWS_TOGETHER * x.len()).max(1));
        match self.blocks.len() < SHARED_PRODUCT {
            true => parts.zip(blocks).for_each(|(u, block)| multiply(block, x, u)),
            false => parts.zip(blocks).par_bridge().for_each(|(u, block)| multiply(block, x, u)),
        }
        u
    }

    /// Norm of delivered displacements: of the rows that were wanted, or of all nodes where none were named.
    pub fn delivered_size(rows: Option<&Self>, delivered: &[[f64; 3]]) -> f64 {
        rows.map_or_else(|| norm(delivered.as_flattened()), |rows| rows.size_of(delivered))
    }

    /// Norm of delivered displacements, every node once; zero where it is not known whose they are.
    fn size_of(&self, delivered: &[[f64; 3]]) -> f64 {
        if delivered.len() != self.nodes.len() {
            return 0.0;
        }
        if self.repeated.is_empty() {
            return norm(delivered.as_flattened());
        }
        let mut once = delivered.to_vec();
        self.repeated.iter().for_each(|&at| once[at] = [0.0; 3]);
        norm(once.as_flattened())
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
