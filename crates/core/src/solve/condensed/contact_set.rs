//! A set of contacts (touched degrees of freedom, masks), its answers, and how wrong they can be.

use std::sync::atomic::{AtomicBool, Ordering};

use nalgebra::DVector;

use super::base::Base;
use super::certificate::{Certificate, Delivery, Judge};
use super::columns::Columns;
use super::correction::Correction;
use super::error::CondensedError;
use super::overlap::{LoadProducts, LoadSize, Overlap};
use super::small_system::{ContactAnswer, SmallSystem, WantedRows};
use super::touched::Touched;
use super::verified::Verified;
use crate::solve::Certainty;
use crate::solve::worked_out::WorkedOut;

/// A set of contacts, ready to answer any displacements of them.
///
/// Shapes: c unknown forces, z modes; small system (c + z)².
pub struct ContactSet {
    touched: Touched,
    small: SmallSystem,
    overlap: Overlap,
    pub(super) verified: Verified,
    /// What a second solve found, once there was one. Nobody waits for it: a thread that waits in a
    /// parallel loop takes other work, which may need the same.
    correction: WorkedOut<Correction>,
    is_refining: AtomicBool,
    load: LoadSize,
    rows: Option<WantedRows>,
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
        let (small, inverse) = SmallSystem::try_new(base, touched, columns)?;
        Ok(Self {
            touched: touched.clone(),
            verified: Verified::new(base, touched, &small, inverse),
            correction: WorkedOut::default(),
            is_refining: AtomicBool::new(false),
            load: LoadSize::new(base, touched, &overlap),
            rows: None,
            small,
            overlap,
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
        let rows = self.rows.as_ref().map_or(0, WantedRows::len);
        8 * (rows + 5 * self.small.matrix.len() + self.overlap.len())
            + Correction::bytes(self.small.matrix.nrows())
    }

    /// Numbers multiplied for one answer at the wanted nodes.
    pub fn products(&self) -> usize {
        self.rows.as_ref().map_or(0, WantedRows::len) + 6 * self.small.matrix.len()
    }

    /// Condition of the small system in the Frobenius norm: how weakly the contacts hold.
    pub fn condition(&self) -> f64 {
        self.small.condition
    }

    /// Gathers the rows of the nodes that answers are wanted for; does nothing if it is the same
    /// list as before.
    pub fn want(&mut self, base: &Base, nodes: &[u32]) {
        if self.rows.as_ref().is_none_or(|rows| rows.nodes != nodes) {
            let fields: Vec<&Vec<f64>> = self.small.fields(base).collect();
            self.rows = Some(WantedRows::new(nodes, &fields));
        }
    }

    /// Forces and motions for displacements of the contacts.
    ///
    /// Shapes: `q` one per touched degree of freedom, then three per mask, m.
    ///
    /// # Errors
    /// [`CondensedError::NotHeld`], [`CondensedError::NotFinite`].
    pub fn solve(&self, q: &[f64]) -> Result<ContactAnswer, CondensedError> {
        self.small.solve(q)
    }

    /// Displacements at the wanted nodes (see [`ContactSet::want`]), 3 per node, m.
    ///
    /// Source: `u = G λ + R a`, see the module.
    pub fn wanted_displacements(&self, answer: &ContactAnswer) -> Vec<[f64; 3]> {
        self.rows.as_ref().map_or_else(Vec::new, |rows| rows.displacements(answer))
    }

    /// Displacement of every degree of freedom, 3N, m.
    pub fn full_displacement(&self, base: &Base, answer: &ContactAnswer) -> Vec<f64> {
        self.small.full_displacement(base, answer)
    }

    /// Solves once more for every column of the set, on the current rayon pool: from then on bounds
    /// ([`ContactSet::certify`]) are hundreds of times sharper. Does nothing where that was done.
    pub fn refine(&self, base: &Base) {
        // Without a factor no eigenvalue is proven, and so no bound is there to be sharpened.
        let Some(factor) = base.inverse.factor() else { return };
        if self.correction.get_ref().is_none() && !self.small.matrix.is_empty() {
            let fields: Vec<&Vec<f64>> = self.small.fields(base).collect();
            let made = Correction::new((base, factor), &self.touched, &self.verified, &fields);
            // Somebody else may have been first; theirs has the same bits.
            self.correction.keep(made);
        }
    }

    /// Whether nobody has begun or done [`ContactSet::refine`] yet; whoever is told so shall do it.
    pub fn begin_refining(&self) -> bool {
        self.correction.get_ref().is_none() && !self.is_refining.swap(true, Ordering::Relaxed)
    }

    /// Bytes that [`ContactSet::refine`] takes for the moment.
    pub fn refine_bytes(&self, base: &Base) -> u64 {
        6 * 8 * (self.small.matrix.nrows() * base.dof_count()) as u64
    }

    /// How certain the digits of every answer of this set are; `None` until the condition of the base
    /// has been estimated ([`Base::estimate_condition`]).
    ///
    /// The errors of the columns balance but for what the small system makes of them, so the worse of
    /// both conditions decides. The elimination of n unknowns has a backward error of up to n times
    /// the unit roundoff (Higham 2002, 9.3).
    pub fn certainty(&self, base: &Base) -> Option<Certainty> {
        let unknowns = (self.small.places.len() + base.modes.len()) as f64;
        let condition = base.condition()?.max(0.5 * unknowns * self.condition());
        Some(Certainty::new(condition, f64::EPSILON))
    }

    /// How wrong an answer can be; costs no more than a few products of the size of the set.
    ///
    /// Shapes: `q` as in [`ContactSet::solve`]; `delivered` what
    /// [`ContactSet::wanted_displacements`] gave, or all nodes where none were asked for (may be
    /// empty).
    pub fn certify(
        &self,
        base: &Base,
        q: &[f64],
        answer: &ContactAnswer,
        delivered: &[[f64; 3]],
        delivery: Delivery,
    ) -> Certificate {
        let delivered = WantedRows::delivered_size(self.rows.as_ref(), delivered);
        self.judge(base).certificate(q, answer, delivered, delivery)
    }

    /// What answers of the set are judged by.
    pub(super) fn judge<'a>(&'a self, base: &'a Base) -> Judge<'a> {
        let Self { small, overlap, verified, load, .. } = self;
        let correction = self.correction.get_ref();
        Judge { base, small, overlap, verified, load, correction }
    }

    /// Forces and motions for any right side of the small system; see [`SmallSystem::solve_right`].
    pub(super) fn solve_right(
        &self,
        right: &DVector<f64>,
    ) -> Result<ContactAnswer, CondensedError> {
        self.small.solve_right(right)
    }

    /// Scale of the forces in the small system, N/m.
    pub(super) fn scale(&self) -> f64 {
        self.small.scale
    }

    /// Nodes that answers are wanted for, if some were named.
    pub(super) fn wanted_nodes(&self) -> Option<&[u32]> {
        self.rows.as_ref().map(|rows| rows.nodes.as_slice())
    }

    /// Products of loads with each other and with the contacts.
    pub(super) fn load_products(&self, base: &Base, forces: &[Vec<(u32, f64)>]) -> LoadProducts {
        LoadProducts::new(base, &self.touched, &self.overlap, forces)
    }
}
