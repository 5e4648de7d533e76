//! Finds masks that follow from other contacts of their set, and bounds the norm of E.
//!
//! Single nodes are orthonormal columns of E, so nothing has to be looked at. Masks are shorter than
//! one and may overlap; then EᵀE over the degrees of freedom that the scene leaves free decides. If
//! it is singular, no forces belong to the displacements, or infinitely many do.

use nalgebra::DMatrix;

use super::base::Base;
use super::error::CondensedError;
use super::touched::Touched;
use crate::solve::partition::AXIS_NAMES;

/// Sizes of the columns E of the contacts.
///
/// Units: 1.
pub(super) struct Overlap {
    /// `EᵀE`, c × c; `None` for single nodes, where it is the identity.
    gram: Option<DMatrix<f64>>,
    /// Bound of `‖E (EᵀE)⁻¹‖`: the smallest field that has some means is at most so much larger.
    pub lift: f64,
    /// Bound of `‖E‖`: means are at most so much larger than the field.
    pub stretch: f64,
}

/// A mask whose part outside the span of the others is shorter than this, relative to itself,
/// counts as dependent: its force would be all rounding.
const INDEPENDENT_MIN: f64 = 1e-6;
/// What rounding may add to the two bounds.
const MARGIN: f64 = 1.01;

impl Overlap {
    /// Shapes: `fixed` ascending degrees of freedom held by the scene, of `dof_count` in all.
    ///
    /// # Errors
    /// [`CondensedError::Dependent`] naming the first mask that follows from the rest.
    pub fn try_new(
        touched: &Touched,
        fixed: &[u32],
        dof_count: usize,
    ) -> Result<Self, CondensedError> {
        let Some(last) = touched.masks.len().checked_sub(1) else {
            return Ok(Self { gram: None, lift: 1.0, stretch: 1.0 });
        };
        let dependent = CondensedError::Dependent { mask: last, axis: AXIS_NAMES[0] };
        // So many columns cannot be independent; this bounds the matrix.
        if touched.force_count() + fixed.len() > dof_count {
            return Err(dependent);
        }
        let free = free_columns(touched, fixed);
        let c = free.len();
        let gram = DMatrix::from_fn(c, c, |i, j| product(&free[i], &free[j]));
        let inverse = factor(&gram, touched)?.solve_lower_triangular(&DMatrix::identity(c, c));
        let inverse = inverse.filter(|l| l.iter().all(|x| x.is_finite())).ok_or(dependent)?;
        let row_sum = |i: usize| gram.row(i).iter().map(|x| x.abs()).sum::<f64>();
        let stretch = MARGIN * (0..c).map(row_sum).fold(0.0, f64::max).sqrt();
        // ‖E (EᵀE)⁻¹‖² = ‖(EᵀE)⁻¹‖ = ‖L⁻¹‖².
        Ok(Self { gram: Some(gram), lift: MARGIN * inverse.norm(), stretch })
    }

    /// `(EᵀE)⁻¹`; `None` for single nodes, where it is the identity.
    pub fn inverse(&self) -> Option<DMatrix<f64>> {
        self.gram.clone()?.cholesky().map(|factor| factor.inverse())
    }

    /// Numbers kept of `EᵀE`.
    pub fn len(&self) -> usize {
        self.gram.as_ref().map_or(0, DMatrix::len)
    }
}

/// Columns of E by degree of freedom, ascending, without those that the scene fixes.
fn free_columns(touched: &Touched, fixed: &[u32]) -> Vec<Vec<(u32, f64)>> {
    let mut columns = touched.columns();
    for column in &mut columns {
        column.retain(|(dof, _)| fixed.binary_search(dof).is_err());
    }
    columns
}

/// Product of two sparse columns.
pub(super) fn product(a: &[(u32, f64)], b: &[(u32, f64)]) -> f64 {
    let (mut i, mut j, mut sum) = (0, 0, 0.0);
    while let (Some(x), Some(y)) = (a.get(i), b.get(j)) {
        match x.0.cmp(&y.0) {
            std::cmp::Ordering::Less => i += 1,
            std::cmp::Ordering::Greater => j += 1,
            std::cmp::Ordering::Equal => {
                sum += x.1 * y.1;
                (i, j) = (i + 1, j + 1);
            }
        }
    }
    sum
}

/// Cholesky factor of EᵀE; each pivot is what a column adds to the span of those before it.
fn factor(gram: &DMatrix<f64>, touched: &Touched) -> Result<DMatrix<f64>, CondensedError> {
    let c = gram.nrows();
    let mut l = DMatrix::zeros(c, c);
    for j in 0..c {
        let dot = |l: &DMatrix<f64>, i: usize| (0..j).map(|k| l[(i, k)] * l[(j, k)]).sum::<f64>();
        let pivot = gram[(j, j)] - dot(&l, j);
        if j >= touched.dofs.len() {
            let (mask, axis) = touched.mask_and_axis(j);
            let whole: f64 = touched.masks[mask].entries().iter().map(|e| e.1 * e.1).sum();
            // Written so that a NaN is refused too.
            let independent = pivot > INDEPENDENT_MIN * INDEPENDENT_MIN * whole;
            if !independent {
                return Err(CondensedError::Dependent { mask, axis: AXIS_NAMES[axis] });
            }
        }
        l[(j, j)] = pivot.sqrt();
        for i in j + 1..c {
            l[(i, j)] = (gram[(i, j)] - dot(&l, i)) / l[(j, j)];
        }
    }
    Ok(l)
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
        let mut loads = loads_of(base, &touched.columns());
        loads.iter_mut().for_each(|load| load.retain(|&(row, _)| is_counted(base, touched, row)));
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

    /// Norm `‖b‖` of the load that displacements `q` of the contacts are equal to.
    pub fn size(&self, q: &[f64]) -> f64 {
        let columns = self.products.column_iter().zip(q);
        let along = |column: &[f64]| column.iter().zip(q).map(|(p, q)| p * q).sum::<f64>();
        columns.map(|(p, q_j)| along(p.as_slice()) * q_j).sum::<f64>().max(0.0).sqrt()
    }
}

/// Whether a row counts in the size of the right side: not what the scene fixes, nor, without masks, what
/// is touched.
fn is_counted(base: &Base, touched: &Touched, row: u32) -> bool {
    let is_known = |set: &[u32]| set.binary_search(&row).is_ok();
    (!touched.masks.is_empty() || !is_known(&touched.dofs)) && !is_known(&base.fixed)
}

/// Products of loads with each other and with what the contacts' displacements are equal to, so that the
/// size of `b = f − K12 q` is known for any amounts and any `q`.
pub(super) struct LoadProducts {
    /// Loads with each other, l × l.
    own: DMatrix<f64>,
    /// Contacts with loads, c × l.
    mixed: DMatrix<f64>,
}

impl LoadProducts {
    /// Shapes: `forces` one sparse column for each load, ascending by degree of freedom.
    pub fn new(
        base: &Base,
        touched: &Touched,
        overlap: &Overlap,
        forces: &[Vec<(u32, f64)>],
    ) -> Self {
        let counted = |column: &Vec<(u32, f64)>| {
            let rows = column.iter().copied();
            rows.filter(|&(row, _)| is_counted(base, touched, row)).collect::<Vec<_>>()
        };
        let forces: Vec<Vec<(u32, f64)>> = forces.iter().map(counted).collect();
        let of_contacts: Vec<_> = loads_of(base, &touched.columns()).iter().map(counted).collect();
        let (c, l) = (of_contacts.len(), forces.len());
        let mixed = DMatrix::from_fn(c, l, |i, j| product(&of_contacts[i], &forces[j]));
        Self {
            own: DMatrix::from_fn(l, l, |i, j| product(&forces[i.min(j)], &forces[i.max(j)])),
            mixed: match overlap.inverse() {
                Some(inverse) => inverse * mixed,
                None => mixed,
            },
        }
    }

    /// Numbers kept.
    pub fn len(&self) -> usize {
        self.own.len() + self.mixed.len()
    }

    /// Norm `‖b‖` for displacements `q` of the contacts and amounts of the loads; `of_contacts` is that
    /// without loads.
    pub fn size(&self, of_contacts: f64, q: &[f64], amounts: &[f64]) -> f64 {
        let product = |matrix: &DMatrix<f64>, left: &[f64]| {
            let columns = matrix.column_iter().zip(amounts);
            let along = |column: &[f64]| column.iter().zip(left).map(|(p, x)| p * x).sum::<f64>();
            columns.map(|(column, amount)| along(column.as_slice()) * amount).sum::<f64>()
        };
        let square =
            of_contacts.powi(2) + product(&self.own, amounts) - 2.0 * product(&self.mixed, q);
        square.max(0.0).sqrt()
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
