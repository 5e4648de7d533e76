//! Columns of the compliance, computed when a node is first asked for and kept under a bound.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use rayon::prelude::*;

use super::base::{Base, CondensedError, rounding_of_product};
use crate::solve::pcg::norm;

/// Responses of the held shape to unit forces at one node.
///
/// Units: m/N; residuals 1.
pub struct NodeColumns {
    /// The node.
    pub node: u32,
    /// Displacement of every degree of freedom under a unit force along x, y, z; 3 × 3N.
    pub(super) fields: [Vec<f64>; 3],
    pub(super) norms: [f64; 3],
    /// Norms of `e − K_B g` over the free degrees of freedom, as computed.
    pub(super) residuals: [f64; 3],
    /// Bounds on the same norms, rounding of the computation included.
    pub(super) residual_bounds: [f64; 3],
}

/// Cache of columns under a memory bound, least recently used out first.
pub struct Columns {
    bound: usize,
    kept: Mutex<Kept>,
}

#[derive(Default)]
struct Kept {
    columns: BTreeMap<u32, (u64, Arc<NodeColumns>)>,
    uses: u64,
    computed: u64,
}

/// A column whose relative residual is above this is refined once.
const RESIDUAL_GOOD: f64 = 1e-11;

impl Columns {
    /// An empty cache.
    ///
    /// Units: `bound` bytes.
    pub fn new(bound: usize) -> Self {
        Self { bound, kept: Mutex::default() }
    }

    /// Bytes the columns of one node take.
    pub fn bytes_per_node(base: &Base) -> usize {
        3 * 8 * base.dof_count()
    }

    /// Bytes held now.
    pub fn bytes(&self, base: &Base) -> usize {
        self.lock().columns.len() * Self::bytes_per_node(base)
    }

    /// Nodes whose columns have been computed so far, repetitions counted.
    pub fn computed(&self) -> u64 {
        self.lock().computed
    }

    /// Columns of some nodes, from the cache or computed now on the current rayon pool.
    ///
    /// # Errors
    /// [`CondensedError::CacheTooSmall`] if they alone are larger than the bound.
    pub fn of_nodes(
        &self,
        base: &Base,
        nodes: &[u32],
    ) -> Result<Vec<Arc<NodeColumns>>, CondensedError> {
        let needed = nodes.len() * Self::bytes_per_node(base);
        if needed > self.bound {
            let (nodes, bound) = (nodes.len(), self.bound);
            return Err(CondensedError::CacheTooSmall { nodes, needed, bound });
        }
        let missing: Vec<u32> = {
            let kept = self.lock();
            nodes.iter().copied().filter(|n| !kept.columns.contains_key(n)).collect()
        };
        // Computed without the lock: others may answer from the cache meanwhile.
        let made = compute(base, &missing);
        let mut kept = self.lock();
        kept.computed += missing.len() as u64;
        for columns in made {
            kept.columns.insert(columns.node, (0, Arc::new(columns)));
        }
        kept.uses += 1;
        let now = kept.uses;
        let mut found = Vec::with_capacity(nodes.len());
        for node in nodes {
            if let Some((used, columns)) = kept.columns.get_mut(node) {
                *used = now;
                found.push(Arc::clone(columns));
            }
        }
        trim(&mut kept, self.bound / Self::bytes_per_node(base));
        drop(kept);
        // Another thread may have trimmed what this one counted on; then it is computed again.
        if found.len() < nodes.len() {
            return Ok(compute(base, nodes).into_iter().map(Arc::new).collect());
        }
        Ok(found)
    }

    fn lock(&self) -> MutexGuard<'_, Kept> {
        self.kept.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Drops the columns unused for longest until at most `count_max` nodes are left.
fn trim(kept: &mut Kept, count_max: usize) {
    let over = kept.columns.len().saturating_sub(count_max);
    if over == 0 {
        return;
    }
    let mut order: Vec<(u64, u32)> =
        kept.columns.iter().map(|(&n, &(used, _))| (used, n)).collect();
    order.sort_unstable();
    for (_, node) in order.into_iter().take(over) {
        kept.columns.remove(&node);
    }
}

/// Nodes solved together: enough right-hand sides for matrix products, few enough for the cache.
const NODES_TOGETHER: usize = 8;

fn compute(base: &Base, nodes: &[u32]) -> Vec<NodeColumns> {
    nodes.chunks(NODES_TOGETHER).flat_map(|some| compute_together(base, some)).collect()
}

fn compute_together(base: &Base, nodes: &[u32]) -> Vec<NodeColumns> {
    let unknown = base.partition.unknown();
    let n = unknown.len();
    let rows_wanted: Vec<usize> = (0..n).collect();
    let dofs: Vec<u32> = nodes.iter().flat_map(|&node| 3 * node..3 * node + 3).collect();
    // A degree of freedom of the base itself does not move under its own force: a zero column.
    let unit = |dof: &u32| base.partition.row_of(*dof as usize).map(|row| (row, 1.0));
    let unit_forces: Vec<Vec<(usize, f64)>> =
        dofs.iter().map(|dof| unit(dof).into_iter().collect()).collect();
    let solved = base.factor.solve_partial(&unit_forces, &rows_wanted);
    let mut fields: Vec<Field> = (0..dofs.len())
        .into_par_iter()
        .map(|column| {
            let mut field = vec![0.0; base.dof_count()];
            for (row, &dof) in unknown.iter().enumerate() {
                field[dof as usize] = solved[(row, column)];
            }
            Field::check(base, dofs[column], field)
        })
        .collect();
    for field in &mut fields {
        field.refine(base);
    }
    let mut fields = fields.into_iter();
    nodes
        .iter()
        .filter_map(|&node| {
            let [x, y, z] = [fields.next()?, fields.next()?, fields.next()?];
            Some(NodeColumns {
                node,
                norms: [x.norm, y.norm, z.norm],
                residuals: [norm(&x.residual), norm(&y.residual), norm(&z.residual)],
                residual_bounds: [x.residual_bound, y.residual_bound, z.residual_bound],
                fields: [x.field, y.field, z.field],
            })
        })
        .collect()
}

/// One column and how well it solves its equations.
struct Field {
    dof: u32,
    field: Vec<f64>,
    norm: f64,
    residual: Vec<f64>,
    residual_bound: f64,
}

impl Field {
    fn check(base: &Base, dof: u32, field: Vec<f64>) -> Self {
        let f = base.stiffness.mul(&field);
        let unknown = base.partition.unknown();
        let residual: Vec<f64> =
            unknown.iter().map(|&d| f64::from(u8::from(d == dof)) - f[d as usize]).collect();
        let rounding = rounding_of_product(&base.stiffness, &field);
        let residual_bound = norm(&residual) + rounding;
        Self { dof, norm: norm(&field), field, residual, residual_bound }
    }

    fn refine(&mut self, base: &Base) {
        if norm(&self.residual) <= RESIDUAL_GOOD {
            return;
        }
        let mut correction = self.residual.clone();
        base.factor.solve_in_place(&mut correction, 1);
        let mut field = self.field.clone();
        for (&dof, c) in base.partition.unknown().iter().zip(&correction) {
            field[dof as usize] += c;
        }
        let refined = Self::check(base, self.dof, field);
        if refined.residual_bound < self.residual_bound {
            *self = refined;
        }
    }
}
