//! Exact answer of a grip, as sums of two doubles.

use nalgebra::{DMatrix, DVector};
use softgrasp_core::fem::Stiffness;
use softgrasp_core::solve::condensed::Touched;

use softgrasp_bench::reference::{two_product, two_sum};

/// Displacements of all nodes for a unit displacement of each contact, with the stiffness as it is
/// stored.
///
/// Shapes: one field of 3N sums of two doubles for each contact direction.
pub(super) struct Exact {
    fields: Vec<Vec<(f64, f64)>>,
}

/// Largest last correction of a reference that counts as converged.
const SETTLED: f64 = 1e-20;
const STEPS_MAX: usize = 30;

/// The system `[K −E; Eᵀ 0]` over the degrees of freedom that are not fixed.
struct System<'a> {
    stiffness: &'a Stiffness,
    columns: Vec<Vec<(u32, f64)>>,
    /// Row of each degree of freedom; `None` where it is fixed.
    row_of: Vec<Option<usize>>,
    rows: usize,
}

impl Exact {
    /// Solves densely and refines with residuals in twice the working precision; `None` if this does not
    /// converge.
    pub fn of(stiffness: &Stiffness, fixed: &[u32], touched: &Touched) -> Option<Self> {
        let all = 3 * stiffness.node_count();
        let mut rows = 0;
        let row_of = (0..all as u32).map(|dof| {
            fixed.binary_search(&dof).is_err().then(|| {
                rows += 1;
                rows - 1
            })
        });
        let row_of = row_of.collect();
        let nodes = touched.dofs.iter().map(|&dof| vec![(dof, 1.0)]);
        let masks = touched.masks.iter().flat_map(|mask| {
            [0, 1, 2].map(|axis| mask.entries().iter().map(|&(n, w)| (3 * n + axis, w)).collect())
        });
        let system = System { stiffness, columns: nodes.chain(masks).collect(), row_of, rows };
        system.solve().map(|fields| Self { fields })
    }

    /// Displacements of all nodes for displacements of the contacts, m.
    pub fn displacement(&self, q: &[f64]) -> Vec<(f64, f64)> {
        let mut u = vec![(0.0, 0.0); self.fields.first().map_or(0, Vec::len)];
        for (field, q) in self.fields.iter().zip(q) {
            for (u, f) in u.iter_mut().zip(field) {
                let (product, rest) = two_product(*q, f.0);
                let (sum, lost) = two_sum(u.0, product);
                *u = two_sum(sum, u.1 + (lost + rest + q * f.1));
            }
        }
        u
    }
}

impl System<'_> {
    fn solve(&self) -> Option<Vec<Vec<(f64, f64)>>> {
        let (n, c) = (self.rows, self.columns.len());
        let scale = self.stiffness.row_sum_max();
        let mut a = DMatrix::zeros(n + c, n + c);
        for (node, axis) in (0..self.stiffness.node_count()).flat_map(|n| [0, 1, 2].map(|a| (n, a)))
        {
            let Some(row) = self.row_of[3 * node + axis] else { continue };
            for (column, block) in self.stiffness.row(node) {
                for other in 0..3 {
                    if let Some(at) = self.row_of[3 * column + other] {
                        a[(row, at)] = block[3 * axis + other] / scale;
                    }
                }
            }
        }
        for (k, entries) in self.columns.iter().enumerate() {
            for &(dof, weight) in entries {
                if let Some(row) = self.row_of[dof as usize] {
                    (a[(row, n + k)], a[(n + k, row)]) = (-weight, weight);
                }
            }
        }
        let lu = a.lu();
        (0..c).map(|k| self.column(&lu, k, scale)).collect()
    }

    fn column(
        &self,
        lu: &nalgebra::LU<f64, nalgebra::Dyn, nalgebra::Dyn>,
        k: usize,
        scale: f64,
    ) -> Option<Vec<(f64, f64)>> {
        let (n, c) = (self.rows, self.columns.len());
        let mut u = vec![(0.0, 0.0); self.row_of.len()];
        let mut force = vec![(0.0, 0.0); c];
        let mut last = f64::INFINITY;
        for _ in 0..STEPS_MAX {
            let mut right = DVector::zeros(n + c);
            let (of_rows, of_contacts) = self.residual(&u, &force, k);
            for (dof, r) in of_rows.into_iter().enumerate() {
                if let Some(row) = self.row_of[dof] {
                    right[row] = r / scale;
                }
            }
            (0..c).for_each(|i| right[n + i] = of_contacts[i]);
            let step = lu.solve(&right)?;
            let mut moved = 0.0f64;
            for (dof, u) in u.iter_mut().enumerate() {
                if let Some(row) = self.row_of[dof] {
                    let (sum, lost) = two_sum(u.0, step[row]);
                    *u = two_sum(sum, u.1 + lost);
                    moved = moved.max(step[row].abs());
                }
            }
            for (i, force) in force.iter_mut().enumerate() {
                let (sum, lost) = two_sum(force.0, step[n + i] * scale);
                *force = two_sum(sum, force.1 + lost);
            }
            let largest = u.iter().fold(0.0f64, |m, u| m.max(u.0.abs()));
            let size = moved / largest;
            if size <= SETTLED {
                return Some(u);
            }
            if size.is_nan() || (size > 0.9 * last && last < 1e-3) {
                return None;
            }
            last = size;
        }
        None
    }

    /// `E λ − K u` and `e_k − Eᵀ u`, computed in twice the precision.
    fn residual(&self, u: &[(f64, f64)], force: &[(f64, f64)], k: usize) -> (Vec<f64>, Vec<f64>) {
        let mut rows = vec![(0.0, 0.0); u.len()];
        for (entries, force) in self.columns.iter().zip(force) {
            entries.iter().for_each(|&(dof, weight)| add(&mut rows[dof as usize], weight, *force));
        }
        for node in 0..self.stiffness.node_count() {
            for (column, block) in self.stiffness.row(node) {
                for (axis, other) in [0, 1, 2].into_iter().flat_map(|a| [0, 1, 2].map(|b| (a, b))) {
                    add(
                        &mut rows[3 * node + axis],
                        -block[3 * axis + other],
                        u[3 * column + other],
                    );
                }
            }
        }
        let of_contacts = self.columns.iter().enumerate().map(|(i, entries)| {
            let mut sum = (if i == k { 1.0 } else { 0.0 }, 0.0);
            entries.iter().for_each(|&(dof, weight)| add(&mut sum, -weight, u[dof as usize]));
            sum.0 + sum.1
        });
        (rows.iter().map(|r| r.0 + r.1).collect(), of_contacts.collect())
    }
}

/// Adds `a x` to a sum of two doubles.
fn add(sum: &mut (f64, f64), a: f64, x: (f64, f64)) {
    let (product, rest) = two_product(a, x.0);
    let (high, lost) = two_sum(sum.0, product);
    *sum = two_sum(high, sum.1 + (lost + (rest + a * x.1)));
}
