//! The norm of the load that prescribed displacements of the contacts are equal to.

use nalgebra::DMatrix;

use super::base::Base;
use super::overlap::{Overlap, product};
use super::touched::Touched;

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
