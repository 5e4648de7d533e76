//! What holds a body: known degrees of freedom, masks, and springs where these leave it free.

use std::collections::BTreeSet;
use std::sync::Arc;

use nalgebra::DMatrix;

use crate::contact::Mask;
use crate::fem::Stiffness;
use crate::mesh::{Bodies, TetMesh};
use crate::solve::front::FrontAnalysis;
use crate::solve::partition::AXIS_NAMES;
use crate::solve::zero_energy::held_for_definiteness;
use crate::solve::{Partition, RigidBodies};

/// What holds a body, ordered and analysed for factors of any tangent, or for corrections without a factor.
///
/// Shapes: n unknown degrees of freedom, c = 3 × masks constraints.
pub struct Hold {
    pub(super) partition: Arc<Partition>,
    /// `None` where tangents are not factored.
    pub(super) analysis: Option<Arc<FrontAnalysis>>,
    masks: Vec<Mask>,
    /// Row of `C` for each axis of each mask: places among the unknown, weights.
    pub(super) rows: Vec<Vec<(u32, f64)>>,
    /// What known degrees of freedom add to each row.
    known_parts: Vec<Vec<(u32, f64)>>,
    /// `(C Cᵀ)⁻¹`: forces of the masks from forces of their nodes.
    gram_inverse: DMatrix<f64>,
    /// Degrees of freedom that springs hold while a factor is made, because masks alone hold the
    /// body; what the springs carry is taken out again.
    pub(super) sprung: Vec<u32>,
}

/// A mask whose mean displacement follows from what else is held.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "along {axis}, mask {mask} (from 0) says what other masks or known nodes say already, so its \
     force is not determined; leave it out or move it"
)]
pub struct Dependent {
    /// The mask, in the order given.
    pub mask: usize,
    /// Axis of the constraint: x, y or z.
    pub axis: char,
}

/// How tangents are inverted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TangentsBy {
    /// Cholesky factors over fronts.
    Factors,
    /// Conjugate gradients, preconditioned by a multigrid hierarchy of each tangent: a fraction of a
    /// factor's memory, and more time for each correction.
    Multigrid,
}

/// The body that is held.
#[derive(Clone, Copy)]
pub struct HoldOf<'a> {
    /// Mesh of the body.
    pub mesh: &'a TetMesh,
    /// Its connected bodies.
    pub bodies: &'a Bodies,
    /// Their rigid parts.
    pub rigid: &'a RigidBodies,
    /// A stiffness with the pattern of every tangent.
    pub stiffness: &'a Stiffness,
}

/// Share of a mask's weights that must be its own.
const OWN_SHARE_MIN: f64 = 1e-10;

impl Hold {
    /// A hold by known degrees of freedom (fixed ones among them) and masks, which together must
    /// hold every body; `before` lends its order and analysis if it is by the same degrees of
    /// freedom. Tangents are inverted by factors, or by conjugate gradients with multigrid.
    ///
    /// # Errors
    /// [`Dependent`] naming a mask.
    pub fn try_new(
        body: HoldOf<'_>,
        partition: Partition,
        masks: Vec<Mask>,
        by: TangentsBy,
        before: Option<&Self>,
    ) -> Result<Self, Dependent> {
        let lends = |before: &&Self| {
            before.partition.known() == partition.known()
                && before.masks.is_empty() == masks.is_empty()
                && before.analysis.is_some() == (by == TangentsBy::Factors)
        };
        let (partition, analysis, sprung) = match before.filter(lends) {
            Some(Self { partition, analysis, sprung, .. }) => {
                (Arc::clone(partition), analysis.clone(), sprung.clone())
            }
            None => {
                let HoldOf { mesh, bodies, rigid, stiffness } = body;
                let analysis = match by {
                    TangentsBy::Factors => {
                        Some(Arc::new(FrontAnalysis::new(stiffness, &partition)))
                    }
                    TangentsBy::Multigrid => None,
                };
                let sprung = match masks.is_empty() {
                    true => Vec::new(),
                    false => held_for_definiteness(mesh, bodies, rigid, partition.known()),
                };
                (Arc::new(partition), analysis, sprung)
            }
        };
        let mut rows = Vec::with_capacity(3 * masks.len());
        let mut known_parts = Vec::with_capacity(3 * masks.len());
        for mask in &masks {
            for axis in 0..3 {
                let dof = |node: u32| 3 * node + axis;
                let entries = mask.entries().iter();
                let (unknown, known): (Vec<_>, Vec<_>) = entries
                    .map(|&(node, weight)| (dof(node), weight))
                    .partition(|&(dof, _)| partition.row_of(dof as usize).is_some());
                let placed = unknown.into_iter().filter_map(|(dof, weight)| {
                    partition.row_of(dof as usize).map(|row| (row as u32, weight))
                });
                rows.push(placed.collect::<Vec<_>>());
                known_parts.push(known);
            }
        }
        let gram_inverse = gram_inverse(&rows)?;
        Ok(Self { partition, analysis, masks, rows, known_parts, gram_inverse, sprung })
    }

    /// Whether this is the hold by these degrees of freedom and masks.
    pub fn is_by(&self, dofs: &[u32], masks: &[Mask]) -> bool {
        self.partition.known() == dofs && self.masks == masks
    }

    /// Whether a hold by these degrees of freedom and masks has a node in common with this one.
    pub fn shares_a_node(&self, dofs: &[u32], masks: &[Mask]) -> bool {
        let nodes = |dofs: &[u32], masks: &[Mask]| -> BTreeSet<u32> {
            let of_masks = masks.iter().flat_map(|mask| mask.entries().iter().map(|entry| entry.0));
            dofs.iter().map(|dof| dof / 3).chain(of_masks).collect()
        };
        !nodes(self.dofs(), &self.masks).is_disjoint(&nodes(dofs, masks))
    }

    /// Known degrees of freedom, ascending.
    pub fn dofs(&self) -> &[u32] {
        self.partition.known()
    }

    /// Order and analysis of factors; `None` where tangents are not factored.
    pub fn analysis(&self) -> Option<&FrontAnalysis> {
        self.analysis.as_deref()
    }

    /// Whether an inverse for another hold serves this one too, once its masks are fitted.
    pub(super) fn has_order_of(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.partition, &other.partition)
    }

    /// Constraints: three for each mask.
    pub(super) fn constraint_count(&self) -> usize {
        self.rows.len()
    }

    /// Means of the masks of a displacement field of 3N.
    pub(super) fn means(&self, q: &[f64]) -> Vec<f64> {
        let unknown = self.partition.unknown();
        let of_rows = self.rows.iter().zip(&self.known_parts);
        of_rows
            .map(|(row, known)| {
                let free: f64 =
                    row.iter().map(|&(at, w)| w * q[unknown[at as usize] as usize]).sum();
                free + known.iter().map(|&(dof, w)| w * q[dof as usize]).sum::<f64>()
            })
            .collect()
    }

    /// `C v` for a vector over the unknown.
    pub(super) fn constrained(&self, v: &[f64]) -> Vec<f64> {
        let of_row = |row: &Vec<(u32, f64)>| row.iter().map(|&(at, w)| w * v[at as usize]).sum();
        self.rows.iter().map(of_row).collect()
    }

    /// Forces of the masks that come nearest to forces on the unknown: least squares `Cᵀ λ = f`.
    pub(super) fn mask_forces(&self, f: &[f64]) -> Vec<f64> {
        let sums = nalgebra::DVector::from_vec(self.constrained(f));
        (&self.gram_inverse * sums).as_slice().to_vec()
    }

    /// Moves the nodes of masks by what a step misses of `C z = m`: a factor in single precision keeps
    /// some seven digits of it, and forces of masks would do work on the rest.
    pub(super) fn meet(&self, m: &[f64], z: &mut [f64]) {
        let means = self.constrained(z);
        let missed: Vec<f64> = means.iter().zip(m).map(|(mean, m)| mean - m).collect();
        let lambda = &self.gram_inverse * nalgebra::DVector::from_vec(missed);
        self.subtract_mask_forces(lambda.as_slice(), z);
    }

    /// Subtracts `Cᵀ λ` from forces on the unknown.
    pub(super) fn subtract_mask_forces(&self, lambda: &[f64], f: &mut [f64]) {
        for (row, lambda) in self.rows.iter().zip(lambda) {
            row.iter().for_each(|&(at, w)| f[at as usize] -= w * lambda);
        }
    }

    /// Adds springs as stiff as the matrix is where they stand; gives them.
    pub(super) fn add_springs(&self, stiffness: &mut Stiffness) -> Vec<f64> {
        if self.sprung.is_empty() {
            return Vec::new();
        }
        let diagonal = stiffness.diagonal();
        let springs: Vec<(u32, f64)> =
            self.sprung.iter().map(|&dof| (dof, diagonal[dof as usize].abs())).collect();
        stiffness.add_springs(&springs);
        springs.into_iter().map(|(_, spring)| spring).collect()
    }
}

/// `(C Cᵀ)⁻¹`, or which constraint follows from the ones before it.
fn gram_inverse(rows: &[Vec<(u32, f64)>]) -> Result<DMatrix<f64>, Dependent> {
    let c = rows.len();
    let product = |a: &[(u32, f64)], b: &[(u32, f64)]| -> f64 {
        let other = |at: u32| b.binary_search_by_key(&at, |e| e.0).map_or(0.0, |i| b[i].1);
        a.iter().map(|&(at, w)| w * other(at)).sum()
    };
    let gram = DMatrix::from_fn(c, c, |i, j| product(&rows[i], &rows[j]));
    let mut factor = gram.clone();
    for k in 0..c {
        let own: f64 = (0..k).map(|i| factor[(k, i)] * factor[(k, i)]).sum();
        let pivot = gram[(k, k)] - own;
        if pivot <= OWN_SHARE_MIN * gram[(k, k)] || pivot.is_nan() {
            return Err(Dependent { mask: k / 3, axis: AXIS_NAMES[k % 3] });
        }
        factor[(k, k)] = pivot.sqrt();
        for r in k + 1..c {
            let sum: f64 = (0..k).map(|i| factor[(r, i)] * factor[(k, i)]).sum();
            factor[(r, k)] = (gram[(r, k)] - sum) / factor[(k, k)];
        }
    }
    let lower = factor.lower_triangle();
    let inverse = lower.solve_lower_triangular(&DMatrix::identity(c, c));
    Ok(inverse.map_or_else(|| DMatrix::zeros(c, c), |inverse| inverse.tr_mul(&inverse)))
}
