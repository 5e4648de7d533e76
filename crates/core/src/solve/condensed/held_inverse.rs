//! The inverse of the held stiffness `K_B`: by its factor or, where memory is too short for one, by
//! conjugate gradients with a multigrid hierarchy.

use std::sync::Arc;

use rayon::prelude::*;

use super::error::CondensedError;
use crate::fem::{Element, Stiffness};
use crate::mesh::TetMesh;
use crate::solve::front::{FrontAnalysis, FrontFactor};
use crate::solve::memory::{Need, Problem, hierarchy_bytes};
use crate::solve::multigrid::{self, Goal, Hierarchy, Outcome};
use crate::solve::vectors::norm;
use crate::solve::work::MeshSize;
use crate::solve::{Method, Partition, Stage};

/// Solver of `K_B u = f`.
pub(super) enum HeldInverse {
    /// Cholesky factor over fronts.
    Factor(FrontFactor<f64>),
    /// Conjugate gradients, preconditioned by smoothed aggregation.
    Cycles(Box<Hierarchy>),
}

/// Displacements under one load, and how far they are off by the end of the iterations.
///
/// Shapes: `field` 3N, zero where the body is held.
pub(super) struct HeldAnswer {
    pub field: Vec<f64>,
    /// Estimated norm of the error; zero by a factor, whose errors are rounding alone.
    pub error: f64,
}

/// A load by rows of `K_B`: row and force, each row once.
pub(super) type Load = Vec<(usize, f64)>;

/// Stiffness of the body and the partition that holds it.
pub(super) type Held<'a> = (&'a Stiffness, &'a Partition);

/// Contacts solved together: the fingers of a hand.
///
/// By a factor a solve always has this many contacts, some of them empty where fewer are asked for. The
/// kernels sum in another order for another number of columns, so a column would depend in its last bits on
/// which others happened to be missing with it, and that depends on timing.
pub const CONTACTS_TOGETHER: usize = 5;

/// Conjugate gradients end at this residual, relative to the load, and at this estimated error.
const GOAL: Goal = Goal { residual_rel: 1e-12, error_rel: 1e-10, steps_max: 1000 };
/// Answers with a larger estimated error are none.
const ERROR_MAX: f64 = 1e-4;

impl HeldInverse {
    /// The factor of the held stiffness. With a limit, where memory is too short for it and for one in single
    /// precision, but not for a multigrid hierarchy: conjugate gradients. A factor that cannot fit by the size
    /// of the mesh alone is not even ordered.
    ///
    /// Units: `limit` bytes.
    ///
    /// # Errors
    /// [`CondensedError::OverLimit`], and what a factor fails by.
    pub fn within(
        mesh: &TetMesh,
        (stiffness, partition): Held<'_>,
        limit: Option<u64>,
        on_stage: &mut dyn FnMut(Stage),
    ) -> Result<Self, CondensedError> {
        let limit = limit.unwrap_or(u64::MAX);
        let nodes = stiffness.node_count();
        let size = MeshSize { nodes, tets: mesh.tets().len() };
        let problem = Problem { size, known_dofs: partition.known().len() };
        let least = |method| Need::predicted(problem, Element::Tet4, method).factor_bytes_min;
        let mut needed = [least(Method::Condensed), least(Method::FrontMixed)];
        if needed[1] <= limit {
            on_stage(Stage::Order);
            let analysis = Arc::new(FrontAnalysis::new(stiffness, partition));
            needed = [analysis.peak_bytes::<f64>(), analysis.peak_bytes::<f32>()].map(|b| b as u64);
            if needed[0] <= limit {
                on_stage(Stage::Factor);
                let factor = FrontFactor::try_new(&analysis, stiffness);
                return factor
                    .map(Self::Factor)
                    .map_err(|error| CondensedError::of_factor(error, partition));
            }
        }
        let hierarchy = hierarchy_bytes(nodes, stiffness.pattern().block_count()) as u64;
        if needed[1] <= limit || hierarchy > limit {
            return Err(CondensedError::OverLimit { needed: needed[0], limit });
        }
        on_stage(Stage::Factor);
        Ok(Self::cycles((stiffness, partition)))
    }

    /// Conjugate gradients with a multigrid hierarchy.
    pub fn cycles((stiffness, partition): Held<'_>) -> Self {
        Self::Cycles(Box::new(Hierarchy::new(stiffness, partition)))
    }

    /// The factor, if there is one.
    pub fn factor(&self) -> Option<&FrontFactor<f64>> {
        match self {
            Self::Factor(factor) => Some(factor),
            Self::Cycles(_) => None,
        }
    }

    /// Bytes of the factor or the hierarchy.
    pub fn bytes(&self) -> usize {
        match self {
            Self::Factor(factor) => factor.bytes(),
            Self::Cycles(hierarchy) => hierarchy.bytes(),
        }
    }

    /// Answers to loads on all rows, one by one behind each other.
    ///
    /// Shapes: `right` n for each load, in the order of the unknown degrees of freedom.
    ///
    /// # Errors
    /// [`CondensedError::NotConverged`] by conjugate gradients.
    pub fn solve(
        &self,
        (stiffness, partition): Held<'_>,
        mut right: Vec<f64>,
    ) -> Result<Vec<HeldAnswer>, CondensedError> {
        match self {
            Self::Factor(factor) => {
                let n = partition.unknown().len().max(1);
                let count = right.len() / n;
                factor.solve_in_place(&mut right, count);
                let answer = |x: &[f64]| {
                    let mut field = vec![0.0; partition.dof_count()];
                    partition.scatter_unknown(x, &mut field);
                    HeldAnswer { field, error: 0.0 }
                };
                Ok(right.chunks(n).map(answer).collect())
            }
            Self::Cycles(hierarchy) => {
                let found = multigrid::solve_columns(stiffness, partition, hierarchy, &right, GOAL);
                found.into_iter().map(answer_of_cycles).collect()
            }
        }
    }

    /// Answers to the three loads of each contact. Those of one contact do not depend on which others are
    /// asked for with it, to the last bit.
    ///
    /// Shapes: `loads` three for each of at most [`CONTACTS_TOGETHER`] contacts.
    ///
    /// # Errors
    /// [`CondensedError::NotConverged`] by conjugate gradients.
    pub fn solve_contacts(
        &self,
        (stiffness, partition): Held<'_>,
        mut loads: Vec<Load>,
    ) -> Result<Vec<HeldAnswer>, CondensedError> {
        let unknown = partition.unknown();
        match self {
            Self::Factor(factor) => {
                let rows: Vec<usize> = (0..unknown.len()).collect();
                let asked = loads.len();
                // The kernels sum in another order for another number of columns.
                loads.resize_with(3 * CONTACTS_TOGETHER, Vec::new);
                let solved = factor.solve_partial(&loads, &rows);
                let answer = |column: usize| {
                    let mut field = vec![0.0; partition.dof_count()];
                    for (row, &dof) in unknown.iter().enumerate() {
                        field[dof as usize] = solved[(row, column)];
                    }
                    HeldAnswer { field, error: 0.0 }
                };
                Ok((0..asked).into_par_iter().map(answer).collect())
            }
            Self::Cycles(hierarchy) => {
                let posed = |load: &Load| {
                    let mut b = vec![0.0; partition.dof_count()];
                    load.iter().for_each(|&(row, force)| b[unknown[row] as usize] = force);
                    (b, GOAL)
                };
                let mut answers = Vec::with_capacity(loads.len());
                for of_contact in loads.chunks(3) {
                    let asked: Vec<_> = of_contact.iter().map(posed).collect();
                    let found = multigrid::solve(stiffness, partition, hierarchy, &asked);
                    for outcome in found {
                        answers.push(answer_of_cycles(outcome)?);
                    }
                }
                Ok(answers)
            }
        }
    }

    /// `K_B⁻¹ B` to a digit at least, for columns of n, one behind the other; no number where conjugate
    /// gradients do not reach one.
    pub fn to_a_digit(&self, (stiffness, partition): Held<'_>, mut b: Vec<f64>) -> Vec<f64> {
        match self {
            Self::Factor(factor) => {
                let count = b.len() / partition.unknown().len().max(1);
                factor.solve_in_place(&mut b, count);
                b
            }
            Self::Cycles(hierarchy) => {
                multigrid::inverse_to_a_digit(stiffness, partition, hierarchy, &b)
            }
        }
    }
}

/// The answer of conjugate gradients, if it is one.
fn answer_of_cycles(found: Outcome) -> Result<HeldAnswer, CondensedError> {
    let Outcome { x: field, residual_rel, error_estimate_rel, steps, .. } = found;
    // Nothing acts on degrees of freedom that are held; and a NaN is no answer.
    let is_nothing = residual_rel == 0.0;
    if !is_nothing && (error_estimate_rel.is_nan() || error_estimate_rel > ERROR_MAX) {
        return Err(CondensedError::NotConverged { steps, residual_rel, error_estimate_rel });
    }
    let size = norm(&field);
    let error = if is_nothing { 0.0 } else { error_estimate_rel * size };
    Ok(HeldAnswer { field, error })
}
