//! The base of a body, made once: held degrees of freedom, factor, motions without energy, condition
//! number, and the smallest eigenvalue of the held stiffness, estimated and proven from below.
//!
//! A Cholesky factor of `K_B − s I` that exists proves that the smallest eigenvalue is at least s less
//! a margin (`docs/bound.md`, section 3).

use std::sync::Arc;

use nalgebra::DMatrix;

use super::error::CondensedError;
use super::held_inverse::{Held, HeldInverse};
use super::rounding::{Ball, SLACK, UNIT, asymmetry, gamma, rounding_of_product, settled};
use crate::fem::Stiffness;
use crate::mesh::{Bodies, Surface, TetMesh};
use crate::solve::certainty::{inverse_norm, row_sums};
use crate::solve::front::{FrontAnalysis, FrontFactor};
use crate::solve::vectors::norm;
use crate::solve::worked_out::WorkedOut;
use crate::solve::zero_energy::{RigidBodies, hold, motions};
use crate::solve::{Partition, Stage};

/// A motion that costs no energy and leaves the fixed degrees of freedom in place.
pub(super) struct Mode {
    /// Displacement of every degree of freedom, largest about one.
    pub field: Vec<f64>,
    /// Norm of the field.
    pub norm: f64,
    /// Norm of `K` times the field, as computed; it is all rounding.
    pub residual: f64,
    /// Bound on the same norm, rounding of the computation included.
    pub residual_bound: f64,
}

impl Mode {
    /// Shapes: `field` 3N.
    pub fn new(stiffness: &Stiffness, field: Vec<f64>) -> Self {
        let residual = norm(&stiffness.mul(&field));
        let residual_bound = settled(residual, rounding_of_product(stiffness, &field));
        Self { norm: norm(&field), residual, residual_bound, field }
    }
}

/// `R D`: the modes, combined to a nearly orthonormal basis.
///
/// Shapes: z modes; both matrices z².
pub(super) struct Rigid {
    /// Matrix D that makes the modes nearly orthonormal.
    pub to_orthonormal: DMatrix<f64>,
    /// About its inverse.
    pub from_modes: DMatrix<f64>,
    /// Bound of `‖R D‖`.
    pub norm: f64,
    /// Bound of `‖K R D‖`, `‖Kᵀ R D‖` and that of the symmetric part, N/m.
    pub stiffness: f64,
    /// `‖K R D‖` about, as computed: rounding, N/m.
    pub computed_stiffness: f64,
}

impl Rigid {
    /// `None` where there is no mode, or where it is not proven that the rows `held` determine the
    /// modes.
    ///
    /// Units: `asymmetry` N/m.
    pub fn new(modes: &[Mode], held: &[u32], asymmetry: f64) -> Option<Self> {
        let z = modes.len();
        let first = modes.first()?;
        let product = |i: usize, j: usize| {
            let (a, b) = (&modes[i].field, &modes[j].field);
            a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>()
        };
        let sums = gamma(first.field.len() + 2);
        let gram = Ball {
            middle: DMatrix::from_fn(z, z, |i, j| product(i.min(j), i.max(j))),
            radius: DMatrix::from_fn(z, z, |i, j| modes[i].norm * modes[j].norm * sums * SLACK),
        };
        let lower = gram.middle.clone().cholesky()?.l();
        let to_orthonormal = lower.clone().try_inverse()?.transpose();
        let exact = Ball::exact(to_orthonormal.clone());
        let departure = exact.transposed().times(&gram).times(&exact).distance_from_identity();
        let rows = DMatrix::from_fn(z, z, |i, j| {
            held.get(i).map_or(0.0, |&dof| modes[j].field[dof as usize])
        });
        let rows = Ball::exact(rows).times(&exact);
        let inverse = Ball::exact(rows.middle.clone().try_inverse()?);
        // Written so that a NaN is refused too.
        let is_proven = departure < 1.0 && inverse.times(&rows).distance_from_identity() < 1.0;
        let of_columns = |of_mode: &dyn Fn(&Mode) -> f64| {
            let of = |(i, j): (usize, usize)| of_mode(&modes[i]) * to_orthonormal[(i, j)].abs();
            let column = |j: usize| (0..z).map(|i| of((i, j))).sum::<f64>();
            (0..z).map(|j| column(j).powi(2)).sum::<f64>().sqrt()
        };
        let stiffness = of_columns(&|m| m.residual_bound + 2.0 * asymmetry * m.norm) * SLACK;
        let computed_stiffness = of_columns(&|m| m.residual);
        is_proven.then(|| Self {
            norm: (1.0 + departure).sqrt() * SLACK,
            from_modes: lower.transpose(),
            to_orthonormal,
            stiffness,
            computed_stiffness,
        })
    }
}

/// The held body of one shape, with the inverse of its stiffness.
///
/// Shapes: 3N degrees of freedom; `modes` z columns of 3N numbers.
/// Units: stiffness N/m, modes 1.
pub struct Base {
    pub(super) stiffness: Arc<Stiffness>,
    pub(super) partition: Partition,
    pub(super) inverse: HeldInverse,
    /// Degrees of freedom the scene fixes, ascending.
    pub(super) fixed: Vec<u32>,
    /// Degrees of freedom held in addition so that `K_B` is definite; as many as modes.
    pub(super) held: Vec<u32>,
    pub(super) modes: Vec<Mode>,
    /// Largest sum of absolute values in a row of `K`, N/m: a bound of its norm.
    pub(super) stiffest: f64,
    /// Bound on how far a symmetric matrix of entries of `K` is from its symmetric part, N/m.
    pub(super) asymmetry: f64,
    /// The nodes of the boundary surface.
    pub(super) surface: SurfaceNodes,
    /// The modes as one basis; `None` without modes or where the basis is not proven to be one.
    pub(super) rigid: Option<Rigid>,
    /// Skeel's condition number of `K_B`, once somebody has asked for it.
    condition: WorkedOut<f64>,
    /// Lower bound of the smallest eigenvalue of `K_B`, once somebody has proven one.
    eigenvalue_min: WorkedOut<Option<f64>>,
}

/// The body that a base is made for.
#[derive(Clone, Copy)]
pub struct BaseOf<'a> {
    /// Mesh of the body.
    pub mesh: &'a TetMesh,
    /// Its connected bodies.
    pub bodies: &'a Bodies,
    /// Their rigid parts.
    pub rigid: &'a RigidBodies,
    /// The stiffness `kᵍ`.
    pub stiffness: &'a Arc<Stiffness>,
}

/// Share of the estimated smallest eigenvalue that the shifted factor must prove.
const SHIFT_SHARE: f64 = 0.7;
/// Steps of inverse iteration: the estimate only has to be good to a few per cent.
const INVERSE_STEPS: usize = 12;

impl Base {
    /// Chooses the base of a shape and factors it on the current rayon pool. With a limit the factor may
    /// take so much memory only, which is looked at before it is allocated; where not even a factor in single
    /// precision would fit, columns come from conjugate gradients with a multigrid hierarchy.
    ///
    /// Shapes: `fixed` ascending degrees of freedom held at zero by the scene. Units: `limit` bytes.
    ///
    /// # Errors
    /// [`CondensedError`]; [`CondensedError::OverLimit`] with needed bytes and limit.
    pub fn try_new(
        body: BaseOf<'_>,
        fixed: &[u32],
        limit: Option<u64>,
        on_stage: &mut dyn FnMut(Stage),
    ) -> Result<Self, CondensedError> {
        Self::made(body, fixed, |held| HeldInverse::within(body.mesh, held, limit, on_stage))
    }

    /// The base of a shape whose columns come from conjugate gradients with a multigrid hierarchy, however
    /// much memory there is.
    ///
    /// Shapes: as in [`Base::try_new`].
    ///
    /// # Errors
    /// [`CondensedError`].
    pub fn without_factor(body: BaseOf<'_>, fixed: &[u32]) -> Result<Self, CondensedError> {
        Self::made(body, fixed, |held| Ok(HeldInverse::cycles(held)))
    }

    fn made(
        body: BaseOf<'_>,
        fixed: &[u32],
        inverse_of: impl FnOnce(Held<'_>) -> Result<HeldInverse, CondensedError>,
    ) -> Result<Self, CondensedError> {
        let BaseOf { mesh, bodies, rigid, stiffness } = body;
        let fields =
            motions(mesh, bodies, rigid, fixed).map_err(|body| CondensedError::Hinges { body })?;
        let held = hold(&fields, fixed);
        let mut known = [fixed, held.as_slice()].concat();
        known.sort_unstable();
        let partition = Partition::try_new(&mesh.used_nodes(), &known)?;
        let inverse = inverse_of((stiffness, &partition))?;
        let modes: Vec<Mode> =
            fields.into_iter().map(|field| Mode::new(stiffness, field)).collect();
        let stiffest = stiffness.row_sum_max();
        let asymmetry = asymmetry(stiffness, stiffest);
        Ok(Self {
            stiffness: Arc::clone(stiffness),
            partition,
            inverse,
            fixed: fixed.to_vec(),
            surface: SurfaceNodes::from_mesh(mesh),
            rigid: Rigid::new(&modes, &held, asymmetry),
            held,
            modes,
            stiffest,
            asymmetry,
            condition: WorkedOut::default(),
            eigenvalue_min: WorkedOut::default(),
        })
    }

    /// Number of degrees of freedom, orphans included.
    pub fn dof_count(&self) -> usize {
        self.partition.dof_count()
    }

    /// Degrees of freedom the scene fixes, ascending.
    pub fn fixed(&self) -> &[u32] {
        &self.fixed
    }

    /// Order and analysis of the factor, and of that of any matrix on its pattern; `None` where memory was
    /// too short for a factor.
    pub fn analysis(&self) -> Option<&FrontAnalysis> {
        self.inverse.factor().map(|factor| &**factor.analysis())
    }

    /// Whether columns come from a factor; else from conjugate gradients with a multigrid hierarchy.
    pub fn has_factor(&self) -> bool {
        self.inverse.factor().is_some()
    }

    /// The stiffness, and the partition that holds the body.
    pub(super) fn held_system(&self) -> Held<'_> {
        (&self.stiffness, &self.partition)
    }

    /// Nodal forces `K u` (3.36) of a displacement field.
    ///
    /// Shapes: 3N. Units: m, N.
    pub fn forces_of(&self, displacement: &[f64]) -> Vec<f64> {
        self.stiffness.mul(displacement)
    }

    /// Whether the scene's fixed nodes hold every body.
    pub fn is_held_by_scene(&self) -> bool {
        self.held.is_empty()
    }

    /// Bytes that the proof of the smallest eigenvalue takes for the moment: a second factor. None where
    /// there is no first one, and so no proof.
    pub fn proof_bytes(&self) -> u64 {
        self.analysis().map_or(0, |analysis| analysis.peak_bytes::<f64>() as u64)
    }

    /// Bytes of the factor or hierarchy, and of the modes.
    pub fn bytes(&self) -> usize {
        self.inverse.bytes() + self.modes.len() * 8 * self.dof_count() + self.surface.bytes()
    }

    /// Skeel's condition number of the held shape, if it was estimated earlier.
    pub(super) fn condition(&self) -> Option<f64> {
        self.condition.get()
    }

    /// Estimates Skeel's condition number of the held shape, once, by a few solves.
    pub fn estimate_condition(&self) -> f64 {
        self.condition.get_or(|| {
            let weights = row_sums(&self.stiffness, &self.partition);
            inverse_norm(&weights, &|b, _| self.inverse.to_a_digit(self.held_system(), b))
        })
    }

    /// Proves a lower bound of the smallest eigenvalue of the symmetric part of `K_B`, once; costs a
    /// second factor for the moment.
    ///
    /// Returns N/m, or `None` where double precision cannot prove one, or there is no factor.
    pub fn prove_eigenvalue_min(&self) -> Option<f64> {
        self.eigenvalue_min.get_or(|| {
            let analysis = self.inverse.factor()?.analysis();
            let estimate = self.estimate_eigenvalue_min()?;
            let shift = SHIFT_SHARE * estimate;
            let shifted = self.stiffness.shifted(-shift);
            FrontFactor::<f64>::try_new(analysis, &shifted).ok()?;
            // Rump 2006 for any order of summation; twice, for divisions by way of reciprocals.
            let n = self.partition.unknown().len();
            let margin = 2.0 * gamma(n + 3) * self.stiffness.trace() * SLACK;
            // The shifted diagonal is rounded, and one triangle of K is read.
            let proven = shift - margin - UNIT * self.stiffest * SLACK - self.asymmetry;
            (proven > 0.0).then_some(proven * (1.0 - 1e-12))
        })
    }

    /// Bound proven earlier, without proving one now.
    pub fn eigenvalue_min(&self) -> Option<f64> {
        self.eigenvalue_min.get().flatten()
    }

    /// Rayleigh quotient after some steps of inverse iteration: an estimate from above.
    pub(super) fn estimate_eigenvalue_min(&self) -> Option<f64> {
        let n = self.partition.unknown().len();
        // A fixed start without symmetry.
        let mut x: Vec<f64> = (0..n).map(|i| 1.0 + 0.5 * (1.7 * i as f64).sin()).collect();
        let mut quotient = None;
        for _ in 0..INVERSE_STEPS {
            let size = norm(&x);
            if size.is_nan() || size <= 0.0 || !size.is_finite() {
                return None;
            }
            x.iter_mut().for_each(|v| *v /= size);
            let y = self.inverse.to_a_digit(self.held_system(), x.clone());
            let along: f64 = x.iter().zip(&y).map(|(a, b)| a * b).sum();
            quotient = (along > 0.0).then(|| 1.0 / along);
            x = y;
        }
        quotient
    }
}

/// The nodes of a boundary surface, and where each of them stands among them.
///
/// Shapes: `nodes` ascending; `places` one for each node of the mesh.
pub(super) struct SurfaceNodes {
    nodes: Vec<u32>,
    places: Vec<u32>,
}

/// Displacement of a node of the surface under a unit force along x, y and z, one after the other, m/N.
pub(super) type Block = [f64; 9];

/// Of a node that is inside.
const INSIDE: u32 = u32::MAX;

impl SurfaceNodes {
    pub fn from_mesh(mesh: &TetMesh) -> Self {
        let nodes = Surface::with_mid_edge_nodes(mesh).nodes;
        let mut places = vec![INSIDE; mesh.node_count()];
        for (place, &node) in (0..).zip(&nodes) {
            places[node as usize] = place;
        }
        Self { nodes, places }
    }

    /// Position of a node among those of the surface.
    pub fn place_of(&self, node: u32) -> Option<usize> {
        let place = self.places.get(node as usize).copied().unwrap_or(INSIDE);
        (place != INSIDE).then_some(place as usize)
    }

    /// Number of nodes of the surface.
    pub fn len(&self) -> usize {
        self.nodes.len()
    }

    pub fn bytes(&self) -> usize {
        size_of_val(self.nodes.as_slice()) + size_of_val(self.places.as_slice())
    }

    /// Bytes of the blocks of one contact.
    pub fn block_bytes(&self) -> usize {
        self.nodes.len() * size_of::<Block>()
    }

    /// The blocks of a contact, in the order of the nodes.
    ///
    /// Shapes: `fields` displacement of every degree of freedom under a unit force along x, y, z; 3 × 3N.
    pub fn blocks(&self, [x, y, z]: [&[f64]; 3]) -> Vec<Block> {
        let block = |&node: &u32| {
            let at = 3 * node as usize;
            let [x, y, z] = [&x[at..at + 3], &y[at..at + 3], &z[at..at + 3]];
            [x[0], x[1], x[2], y[0], y[1], y[2], z[0], z[1], z[2]]
        };
        self.nodes.iter().map(block).collect()
    }
}
