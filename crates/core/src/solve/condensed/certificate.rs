//! How wrong an answer can be, said with every answer (the reasoning is in [`super::bound`]).

use nalgebra::DMatrix;

use super::base::{Base, gamma};
use super::contact_set::{ContactAnswer, ContactSet};
use super::overlap::{Overlap, product};
use super::touched::Touched;
use crate::solve::Certainty;
use crate::solve::certainty::{inverse_norm, row_sums};
use crate::solve::vectors::norm;

/// How wrong an answer can be.
#[derive(Clone, Debug, PartialEq)]
pub struct Certificate {
    /// `‖r‖ / ‖b‖` by the triangle inequality over the columns' residuals as computed; b is that of
    /// (3.42a), or, where masks are held, `K` times the smallest field that has the means asked for.
    pub residual_rel: f64,
    /// Proven bound on `‖e‖ / ‖u‖` over all nodes, or why there is none.
    pub error_bound_rel: Result<f64, &'static str>,
}

impl Base {
    /// Estimates Skeel's condition number of the held shape, once, by a few solves.
    pub fn estimate_condition(&self) -> f64 {
        self.condition.get_or(|| {
            let weights = row_sums(&self.stiffness, &self.partition);
            inverse_norm(&weights, &|mut b, columns| {
                self.factor.solve_in_place(&mut b, columns);
                b
            })
        })
    }
}

impl ContactSet {
    /// How certain the digits of every answer of this set are; `None` until the condition of the base
    /// has been estimated ([`Base::estimate_condition`]).
    ///
    /// The errors of the columns balance but for what the small system makes of them, so the worse of
    /// both conditions decides. The elimination of n unknowns has a backward error of up to n times
    /// the unit roundoff (Higham 2002, 9.3).
    pub fn certainty(&self, base: &Base) -> Option<Certainty> {
        let unknowns = (self.places.len() + base.modes.len()) as f64;
        let condition = base.condition.get()?.max(0.5 * unknowns * self.condition());
        Some(Certainty::new(condition, f64::EPSILON))
    }

    /// How wrong an answer can be; costs no more than a few products of the size of the set.
    ///
    /// Shapes: `q` as in [`ContactSet::solve`]; `delivered` displacements of distinct nodes, whose
    /// size makes the relative bound sharper (may be empty).
    pub fn certify(
        &self,
        base: &Base,
        q: &[f64],
        answer: &ContactAnswer,
        delivered: &[[f64; 3]],
    ) -> Certificate {
        let places = self.places.iter().map(|&(at, axis)| {
            let columns = &self.columns[at];
            [columns.norms[axis], columns.residuals[axis], columns.residual_bounds[axis]]
        });
        let modes = base.modes.iter().map(|m| [m.norm, m.residual, m.residual_bound]);
        let amounts = answer.lambda.iter().chain(&answer.amounts);
        let [mut moved, mut residual, mut residual_bound] = [0.0; 3];
        for ([field, computed, bound], amount) in places.chain(modes).zip(amounts) {
            moved += amount.abs() * field;
            residual += amount.abs() * computed;
            residual_bound += amount.abs() * bound;
        }
        // What the contacts are off moves their neighbours by at most so much force.
        let stiffest = (base.stiffest * self.overlap.lift).max(self.scale);
        residual += stiffest * answer.mismatch;
        let b = self.load.size(q);
        let residual_rel = if b > 0.0 { residual / b } else { residual };
        let terms = answer.lambda.len() + base.modes.len() + 2;
        let rounding = gamma(terms) * moved;
        // The mismatch is itself computed: products of the means of the columns.
        let rows = (terms as f64).sqrt();
        let mismatch = answer.mismatch + rows * gamma(terms + self.touched().longest()) * moved;
        residual_bound += stiffest * mismatch;
        // Part of the answer bounds the size of the whole from below.
        let size = (norm(q) / self.overlap.stretch).max(norm(delivered.as_flattened()));
        let error_bound_rel = match base.eigenvalue_min() {
            None => Err("no lower bound of the smallest eigenvalue has been proven for this shape"),
            Some(_) if size <= 0.0 => Err("nothing moves"),
            Some(eigenvalue) => {
                let compliance = 1.0 / eigenvalue + self.bound.compliance;
                let lifted = self.overlap.lift * mismatch;
                Ok((residual_bound * compliance + rounding + lifted) / size)
            }
        };
        Certificate { residual_rel, error_bound_rel }
    }
}

/// Size of `b = −K12 q` of (3.42a) for any `q`, from the products of the columns of `K12`; with masks
/// of `K E (EᵀE)⁻¹ q`, which is the same for single nodes but for the rows of the touched.
pub(super) struct LoadSize {
    /// Products of the columns with each other.
    products: DMatrix<f64>,
}

impl LoadSize {
    /// Shapes: `overlap` that of `touched`.
    pub fn new(base: &Base, touched: &Touched, overlap: &Overlap) -> Self {
        let is_known = |set: &[u32], row: u32| set.binary_search(&row).is_ok();
        let has_masks = !touched.masks.is_empty();
        let mut loads = loads_of(base, &touched.columns());
        for load in &mut loads {
            load.retain(|&(row, _)| {
                (has_masks || !is_known(&touched.dofs, row)) && !is_known(&base.fixed, row)
            });
        }
        let count = loads.len();
        let mut products = DMatrix::zeros(count, count);
        for j in 0..count {
            for i in 0..=j {
                products[(i, j)] = product(&loads[i], &loads[j]);
                products[(j, i)] = products[(i, j)];
            }
        }
        match overlap.inverse() {
            Some(inverse) => Self { products: &inverse * products * &inverse },
            None => Self { products },
        }
    }

    /// `‖b‖`.
    pub fn size(&self, q: &[f64]) -> f64 {
        let columns = self.products.column_iter().zip(q);
        let along = |column: &[f64]| column.iter().zip(q).map(|(p, q)| p * q).sum::<f64>();
        columns.map(|(p, q_j)| along(p.as_slice()) * q_j).sum::<f64>().max(0.0).sqrt()
    }
}

/// `K E`, column by column: degrees of freedom, ascending, and forces.
fn loads_of(base: &Base, columns: &[Vec<(u32, f64)>]) -> Vec<Vec<(u32, f64)>> {
    // Nodes of a mask share most of their neighbours, so the sums are made in place.
    let mut force = vec![0.0; base.dof_count()];
    let mut reached: Vec<u32> = Vec::new();
    let load_of = |column: &Vec<(u32, f64)>| {
        for &(dof, weight) in column {
            let (node, axis) = (dof as usize / 3, dof as usize % 3);
            for (other, block) in base.stiffness.row(node) {
                reached.push(other as u32);
                for c in 0..3 {
                    force[3 * other + c] += weight * block[3 * axis + c];
                }
            }
        }
        reached.sort_unstable();
        reached.dedup();
        let rows = reached.drain(..).flat_map(|node| 3 * node..3 * node + 3);
        rows.map(|row| (row, std::mem::take(&mut force[row as usize]))).collect()
    };
    columns.iter().map(load_of).collect()
}
