//! A set of contacts of a body that loads act on: its answers, and how wrong they can be.
//!
//! With the loads' forces F, their amounts p and the displacements `H = K_B⁻¹ F`,
//!
//! ```text
//! [ EᵀG    EᵀR ] [λ]   [ q − EᵀH p ]
//! [ (EᵀR)ᵀ  0  ] [a] = [   −RᵀF p  ]        u = G λ + R a + H p
//! ```
//!
//! Contacts and loads balance each other, so the artificial base carries nothing and `K u = E λ + F p`,
//! `Eᵀu = q` hold exactly.

use std::sync::Arc;

use nalgebra::{DMatrix, DVector};

use super::base::Base;
use super::certificate::{Certificate, Delivery, LoadTerms};
use super::contact_set::ContactSet;
use super::error::CondensedError;
use super::load_column::UnitLoad;
use super::overlap::LoadProducts;
use super::rounding::{SLACK, accurate_dot, gamma};
use super::small_system::{ContactAnswer, WantedRows};

/// A contact set and the loads that act beside it, whose amounts may be others in every answer.
///
/// Shapes: c unknown forces, z modes, l loads.
pub struct LoadedSet {
    set: Arc<ContactSet>,
    loads: Vec<UnitLoad>,
    /// `[EᵀH ; RᵀF / s]`, what a unit of each load takes from the right side of the small system; (c + z) × l.
    taken: DMatrix<f64>,
    /// Bound on the norm of what each column of it is off.
    off: Vec<f64>,
    products: LoadProducts,
    rows: Option<WantedRows>,
}

/// Forces, motions and loads that answer one question.
#[derive(Clone, Debug, PartialEq)]
pub struct LoadedAnswer {
    /// Forces of the contacts and amounts of the motions.
    pub contact: ContactAnswer,
    /// Amount of each load.
    pub amounts: Vec<f64>,
    /// Right side of the small system, m.
    right: DVector<f64>,
    /// Bound on the norm of what the right side is off, m.
    right_off: f64,
}

impl LoadedSet {
    /// Gathers what the loads do at the contacts and at the nodes that the set's answers are wanted for.
    pub fn new(base: &Base, set: Arc<ContactSet>, loads: Vec<UnitLoad>) -> Self {
        let (touched, scale) = (set.touched(), set.scale());
        let (c, z, l) = (touched.force_count(), base.modes.len(), loads.len());
        let means = gamma(touched.longest() + 3);
        let mut taken = DMatrix::zeros(c + z, l);
        let mut off = Vec::with_capacity(l);
        for (j, load) in loads.iter().enumerate() {
            let field = load.field();
            let mut squares = 0.0;
            for i in 0..c {
                taken[(i, j)] = touched.mean(i, field);
                squares += (means * touched.mean_of_sizes(i, field)).powi(2);
            }
            let forces = load.forces();
            for (k, mode) in base.modes.iter().enumerate() {
                let pairs = forces.iter().map(|&(dof, force)| (force, mode.field[dof as usize]));
                let (moment, lost) = accurate_dot(pairs);
                taken[(c + k, j)] = moment / scale;
                squares += ((lost + gamma(2) * moment.abs()) / scale).powi(2);
            }
            off.push(squares.sqrt() * SLACK);
        }
        let forces: Vec<Vec<(u32, f64)>> = loads.iter().map(UnitLoad::forces).collect();
        let products = set.load_products(base, &forces);
        let rows = set.wanted_nodes().map(|nodes| {
            let fields: Vec<&Vec<f64>> = loads.iter().map(UnitLoad::field).collect();
            WantedRows::new(nodes, &fields)
        });
        Self { set, loads, taken, off, products, rows }
    }

    /// The contacts without the loads.
    pub fn set(&self) -> &Arc<ContactSet> {
        &self.set
    }

    /// Bytes of the loads' rows and products; the contact set and the columns are counted where they are
    /// kept.
    pub fn bytes(&self) -> usize {
        8 * (self.rows.as_ref().map_or(0, WantedRows::len)
            + self.taken.len()
            + self.products.len()
            + self.off.len())
    }

    /// Numbers multiplied for one answer at the wanted nodes, those of the contacts among them.
    pub fn products(&self) -> usize {
        let rows = self.rows.as_ref().map_or(0, WantedRows::len);
        self.set.products() + rows + 2 * self.taken.len()
    }

    /// Forces and motions for displacements of the contacts and amounts of the loads.
    ///
    /// Shapes: `q` one per touched degree of freedom, then three per mask, m; `amounts` one per load.
    ///
    /// # Errors
    /// [`CondensedError::NotHeld`], [`CondensedError::NotFinite`].
    pub fn solve(&self, q: &[f64], amounts: &[f64]) -> Result<LoadedAnswer, CondensedError> {
        let mut right =
            DVector::from_fn(self.taken.nrows(), |i, _| q.get(i).copied().unwrap_or(0.0));
        let mut sizes = right.abs();
        for (column, amount) in self.taken.column_iter().zip(amounts) {
            right.axpy(-amount, &column, 1.0);
            sizes.axpy(amount.abs(), &column.abs(), 1.0);
        }
        let off: f64 = self.off.iter().zip(amounts).map(|(off, amount)| off * amount.abs()).sum();
        let right_off = (off + gamma(self.loads.len() + 3) * sizes.norm()) * SLACK;
        let contact = self.set.solve_right(&right)?;
        Ok(LoadedAnswer { contact, amounts: amounts.to_vec(), right, right_off })
    }

    /// Displacements at the nodes wanted of the set, 3 per node, m.
    ///
    /// Source: `u = G λ + R a + H p`, see the module.
    pub fn wanted_displacements(&self, answer: &LoadedAnswer) -> Vec<[f64; 3]> {
        let mut u = self.set.wanted_displacements(&answer.contact);
        if let Some(rows) = &self.rows {
            let of_loads = rows.product(&answer.amounts);
            u.iter_mut().flatten().zip(of_loads.iter().flatten()).for_each(|(u, h)| *u += h);
        }
        u
    }

    /// Displacement of every degree of freedom, 3N, m.
    pub fn full_displacement(&self, base: &Base, answer: &LoadedAnswer) -> Vec<f64> {
        let mut u = self.set.full_displacement(base, &answer.contact);
        for (load, amount) in self.loads.iter().zip(&answer.amounts) {
            u.iter_mut().zip(load.field()).for_each(|(u, h)| *u += amount * h);
        }
        u
    }

    /// Subtracts the loads from forces of every degree of freedom: what is left is that of supports.
    ///
    /// Shapes: 3N. Units: N.
    pub fn subtract_loads(&self, amounts: &[f64], forces: &mut [f64]) {
        for (load, amount) in self.loads.iter().zip(amounts) {
            load.forces().into_iter().for_each(|(dof, f)| forces[dof as usize] -= amount * f);
        }
    }

    /// How wrong an answer can be. A second solve ([`ContactSet::refine`]) does not sharpen it.
    ///
    /// Shapes: `q` as in [`LoadedSet::solve`]; `delivered` what [`LoadedSet::wanted_displacements`] gave.
    pub fn certify(
        &self,
        base: &Base,
        q: &[f64],
        answer: &LoadedAnswer,
        delivered: &[[f64; 3]],
        delivery: Delivery,
    ) -> Certificate {
        let delivered = WantedRows::delivered_size(self.rows.as_ref(), delivered);
        let judge = self.set.judge(base);
        let sum = |of: &dyn Fn(&UnitLoad) -> f64| {
            let terms = self.loads.iter().zip(&answer.amounts);
            terms.map(|(load, amount)| amount.abs() * of(load)).sum::<f64>() * SLACK
        };
        let terms = LoadTerms {
            count: self.loads.len(),
            size: sum(&|load| load.norm()),
            residual: sum(&|load| load.residual().0),
            residual_bound: sum(&|load| load.residual().1),
            error: sum(&UnitLoad::error),
            right: &answer.right,
            right_off: answer.right_off,
            load_size: self.products.size(judge.load.size(q), q, &answer.amounts),
        };
        judge.loaded(q, &answer.contact, terms, delivered, delivery)
    }
}
