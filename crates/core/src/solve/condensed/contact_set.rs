//! The small system of one set of contacts (touched degrees of freedom, masks), and its answers.

use std::collections::BTreeSet;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use nalgebra::{DMatrix, DVector, Dyn, LU};
use rayon::prelude::*;

use super::base::{Base, CondensedError};
use super::columns::{Columns, ContactColumns};
use super::correction::Correction;
use super::load_size::LoadSize;
use super::overlap::Overlap;
use super::touched::Touched;
use super::verified::Verified;
use crate::solve::vectors::norm;
use crate::solve::worked_out::WorkedOut;
use crate::solve::zero_energy::FREE_BELOW;

/// A set of contacts, ready to answer any displacements of them.
///
/// Shapes: c unknown forces, z modes; small system (c + z)².
pub struct ContactSet {
    touched: Touched,
    pub(super) columns: Vec<Arc<ContactColumns>>,
    /// Position in `columns` and axis of every unknown force.
    pub(super) places: Vec<(usize, usize)>,
    /// Scaled `[ EᵀG EᵀR ; (EᵀR)ᵀ 0 ]`, so that both kinds of unknowns have size one.
    small: DMatrix<f64>,
    /// Factor of the same with `EᵀG` made symmetric: the two triangles differ by rounding. `None`
    /// where nothing is unknown.
    small_lu: Option<LU<f64, Dyn, Dyn>>,
    /// Scale of λ.
    pub(super) scale: f64,
    condition: f64,
    pub(super) overlap: Overlap,
    pub(super) verified: Verified,
    /// What a second solve found, once there was one. Nobody waits for it: a thread that waits in a
    /// parallel loop takes other work, which may need the same.
    correction: WorkedOut<Correction>,
    is_refining: AtomicBool,
    pub(super) load: LoadSize,
    rows: Option<WantedRows>,
}

/// Rows of `[G R]` at the nodes asked for, gathered once per set of nodes.
///
/// Shapes: blocks of [`ROWS_TOGETHER`] rows (the last may be shorter), one behind the other, the
/// columns of a block one behind the other: the product runs once through this memory.
struct WantedRows {
    nodes: Vec<u32>,
    blocks: Vec<f64>,
    /// Places in `nodes` of those that stand further ahead already, ascending.
    repeated: Vec<usize>,
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
/// Rows multiplied together: as many as stay in the nearest cache, a multiple of three.
const ROWS_TOGETHER: usize = 1536;
/// A product of more numbers is shared out among the threads; a smaller one is sooner done.
const SHARED_PRODUCT: usize = 1 << 20;

/// Why a small system cannot be solved: `moved` says how far each motion without energy moves each
/// contact, and a motion that moves none of them is free.
///
/// Shapes: `moved` one row per displacement of a contact, one column per motion.
fn refusal(moved: &DMatrix<f64>, condition: f64) -> CondensedError {
    let sizes = moved.clone().singular_values();
    let is_free = moved.nrows() < moved.ncols()
        || !moved.is_empty() && sizes.min() <= FREE_BELOW * sizes.max();
    match is_free {
        true => CondensedError::NotHeld,
        false => CondensedError::HeldTooWeakly { condition },
    }
}

impl ContactSet {
    /// Gathers (or computes) the columns of the contacts and factors the small system.
    ///
    /// # Errors
    /// [`CondensedError::Dependent`] if a mask follows from other contacts;
    /// [`CondensedError::CacheTooSmall`]; [`CondensedError::NotHeld`] if a motion is left free,
    /// [`CondensedError::HeldTooWeakly`] if one is nearly free.
    pub fn try_new(
        base: &Base,
        columns: &Columns,
        touched: &Touched,
    ) -> Result<Self, CondensedError> {
        touched.check(base.dof_count() / 3)?;
        let overlap = Overlap::try_new(touched, &base.fixed, base.dof_count())?;
        let columns = columns.of_contacts(base, &touched.contacts())?;
        let places = touched.places();
        let (c, z) = (places.len(), base.modes.len());
        let compliance = DMatrix::from_fn(c, c, |i, j| {
            let (at, axis) = places[j];
            touched.mean(i, &columns[at].fields[axis])
        });
        let moved = DMatrix::from_fn(c, z, |i, k| touched.mean(i, &base.modes[k].field));
        let trace = compliance.trace();
        let scale = if trace > 0.0 { c as f64 / trace } else { base.stiffest };
        let mut small = DMatrix::zeros(c + z, c + z);
        small.view_mut((0, 0), (c, c)).copy_from(&(&compliance * scale));
        small.view_mut((0, c), (c, z)).copy_from(&moved);
        small.view_mut((c, 0), (z, c)).copy_from(&moved.transpose());
        let symmetric = 0.5 * (&small + small.transpose());
        let unsolvable = |condition| refusal(&moved, condition);
        // A matrix without rows has no factor, and needs none.
        let small_lu = (c + z > 0).then(|| symmetric.lu());
        let inverse = match &small_lu {
            Some(lu) => lu.try_inverse().ok_or_else(|| unsolvable(f64::INFINITY))?,
            None => DMatrix::zeros(0, 0),
        };
        let condition = small.norm() * inverse.norm();
        // Written so that a NaN is refused too.
        if !(0.0..=CONDITION_MAX).contains(&condition) {
            return Err(unsolvable(condition));
        }
        let verified = Verified::new(base, touched, &columns, &places, &small, inverse, scale);
        let load = LoadSize::new(base, touched, &overlap);
        let (touched, rows) = (touched.clone(), None);
        Ok(Self {
            touched,
            columns,
            places,
            small,
            small_lu,
            scale,
            condition,
            overlap,
            verified,
            correction: WorkedOut::default(),
            is_refining: AtomicBool::new(false),
            load,
            rows,
        })
    }

    /// What is touched.
    pub fn touched(&self) -> &Touched {
        &self.touched
    }

    /// The touched degrees of freedom, ascending.
    pub fn dofs(&self) -> &[u32] {
        &self.touched.dofs
    }

    /// Bytes of the small system and the wanted rows; the columns are counted where they are kept.
    pub fn bytes(&self) -> usize {
        let rows = self.rows.as_ref().map_or(0, |rows| rows.blocks.len());
        8 * (rows + 5 * self.small.len() + self.overlap.len())
            + Correction::bytes(self.small.nrows())
    }

    /// Numbers multiplied for one answer at the wanted nodes.
    pub fn products(&self) -> usize {
        self.rows.as_ref().map_or(0, |rows| rows.blocks.len()) + 6 * self.small.len()
    }

    /// Condition of the small system in the Frobenius norm: how weakly the contacts hold.
    pub fn condition(&self) -> f64 {
        self.condition
    }

    /// Gathers the rows of the nodes that answers are wanted for; does nothing if it is the same
    /// list as before.
    pub fn want(&mut self, base: &Base, nodes: &[u32]) {
        if self.rows.as_ref().is_some_and(|rows| rows.nodes == nodes) {
            return;
        }
        let columns = self.places.iter().map(|&(at, axis)| &self.columns[at].fields[axis]);
        let fields: Vec<&Vec<f64>> = columns.chain(base.modes.iter().map(|m| &m.field)).collect();
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
        self.rows = Some(WantedRows { nodes: nodes.to_vec(), blocks, repeated });
    }

    /// Forces and motions for displacements of the contacts.
    ///
    /// Shapes: `q` one per touched degree of freedom, then three per mask, m.
    ///
    /// # Errors
    /// [`CondensedError::NotHeld`], [`CondensedError::NotFinite`].
    pub fn solve(&self, q: &[f64]) -> Result<ContactAnswer, CondensedError> {
        let c = self.places.len();
        let right = DVector::from_fn(self.small.nrows(), |i, _| q.get(i).copied().unwrap_or(0.0));
        let solve = |right: &DVector<f64>| match &self.small_lu {
            Some(lu) => lu.solve(right).ok_or(CondensedError::NotHeld),
            None => Ok(right.clone()),
        };
        let mut x = solve(&right)?;
        // One step of refinement takes out the rounding of the elimination and of the symmetry.
        let miss = &right - &self.small * &x;
        x += solve(&miss)?;
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

    /// Solves once more for every column of the set, on the current rayon pool: from then on bounds
    /// ([`ContactSet::certify`]) are hundreds of times sharper. Does nothing where that was done.
    pub fn refine(&self, base: &Base) {
        if self.correction.get_ref().is_none() && !self.small.is_empty() {
            let columns = self.places.iter().map(|&(at, axis)| &self.columns[at].fields[axis]);
            let fields: Vec<&Vec<f64>> =
                columns.chain(base.modes.iter().map(|m| &m.field)).collect();
            let made = Correction::new(base, &self.touched, &self.verified, &fields);
            // Somebody else may have been first; theirs is the same.
            self.correction.keep(made);
        }
    }

    /// Whether nobody has begun or done [`ContactSet::refine`] yet; whoever is told so shall do it.
    pub fn begin_refining(&self) -> bool {
        self.correction.get_ref().is_none() && !self.is_refining.swap(true, Ordering::Relaxed)
    }

    /// Bytes that [`ContactSet::refine`] takes for the moment.
    pub fn refine_bytes(&self, base: &Base) -> u64 {
        6 * 8 * (self.small.nrows() * base.dof_count()) as u64
    }

    pub(super) fn correction(&self) -> Option<&Correction> {
        self.correction.get_ref()
    }

    /// Norm of delivered displacements, every node once; zero where it is not known whose they are.
    pub(super) fn size_of(&self, delivered: &[[f64; 3]]) -> f64 {
        let Some(rows) = &self.rows else { return norm(delivered.as_flattened()) };
        if delivered.len() != rows.nodes.len() {
            return 0.0;
        }
        if rows.repeated.is_empty() {
            return norm(delivered.as_flattened());
        }
        let mut once = delivered.to_vec();
        rows.repeated.iter().for_each(|&at| once[at] = [0.0; 3]);
        norm(once.as_flattened())
    }

    /// Displacement of every degree of freedom, 3N, m.
    pub fn full_displacement(&self, base: &Base, answer: &ContactAnswer) -> Vec<f64> {
        let mut u = vec![0.0; base.dof_count()];
        let columns = self.places.iter().map(|&(at, axis)| &self.columns[at].fields[axis]);
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
