//! How wrong an answer can be, said with every answer (the reasoning is in [`super::bound`]).

use std::collections::BTreeMap;

use nalgebra::DMatrix;

use super::base::{Base, gamma};
use super::contact_set::{ContactAnswer, ContactSet};
use super::overlap::Overlap;
use super::touched::Touched;
use crate::solve::pcg::norm;

/// How wrong an answer can be.
#[derive(Clone, Debug, PartialEq)]
pub struct Certificate {
    /// `‖r‖ / ‖b‖` by the triangle inequality over the columns' residuals as computed; b is that of
    /// (3.42a), or, where masks are held, `K` times the smallest field that has the means asked for.
    pub residual_rel: f64,
    /// Proven bound on `‖e‖ / ‖u‖` over all nodes, or why there is none.
    pub error_bound_rel: Result<f64, &'static str>,
}

impl ContactSet {
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
        // For each free degree of freedom what it shares with the unknown forces.
        let mut rows: BTreeMap<usize, Vec<(usize, f64)>> = BTreeMap::new();
        for (column, entries) in touched.columns().into_iter().enumerate() {
            for (dof, weight) in entries {
                let (node, axis) = (dof as usize / 3, dof as usize % 3);
                for (other, block) in base.stiffness.row(node) {
                    for c in 0..3 {
                        let k = weight * block[3 * axis + c];
                        rows.entry(3 * other + c).or_default().push((column, k));
                    }
                }
            }
        }
        let is_known = |set: &[u32], row: usize| set.binary_search(&(row as u32)).is_ok();
        let has_masks = !touched.masks.is_empty();
        rows.retain(|&row, _| {
            (has_masks || !is_known(&touched.dofs, row)) && !is_known(&base.fixed, row)
        });
        let count = touched.force_count();
        let mut products = DMatrix::zeros(count, count);
        for row in rows.values() {
            for &(i, k_i) in row {
                row.iter().for_each(|&(j, k_j)| products[(i, j)] += k_i * k_j);
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
