//! The adjoint of an equilibrium: one more solve with the tangent there, which is symmetric.
//!
//! For a quantity J of displacements and reactions `R = f_int − f` the adjoint λ is −∂J/∂R where the
//! displacement is known, and `K λ = ∂J/∂u` where it is free, K being the tangent. For any p that the forces
//! depend on, `dJ/dp = −λᵀ ∂(f_int − f)/∂p`; by a known displacement it is `∂J/∂u − (K λ)`.

use super::inverse::{FactorError, Factored};
use super::outcome::Equilibrium;
use super::settle::RESIDUAL_SETTLED;
use super::shape::Shape;

/// What the adjoint of a quantity is loaded with.
///
/// Shapes: `slopes` 3N of the system, `known` one for each known degree of freedom.
#[derive(Clone, Copy, Debug)]
pub struct AdjointLoad<'a> {
    /// ∂J/∂u of all degrees of freedom.
    pub slopes: &'a [f64],
    /// −∂J/∂R of the known degrees of freedom, in the order of the hold.
    pub known: &'a [f64],
}

/// The adjoint of a quantity J at an equilibrium.
#[derive(Clone, Debug, PartialEq)]
pub struct Adjoint {
    /// λ of all degrees of freedom, 3N: dJ per N of a force there.
    pub field: Vec<f64>,
    /// `K λ` of the known degrees of freedom, in the order of the hold.
    pub reactions: Vec<f64>,
}

/// Why an equilibrium has no derivatives.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum NoAdjoint {
    /// Elements have a yield stress.
    #[error(
        "no derivatives: material that flows remembers its way, so an equilibrium is no function of what \
         is prescribed; leave out the yield stress"
    )]
    Plastic,
    /// Masks hold the body.
    #[error("no derivatives: masks hold the body; prescribe displacements of nodes instead")]
    Masks,
    /// The equilibrium was left before it had converged.
    #[error(
        "no derivatives: the equilibrium has not converged (forces out of balance by {residual_rel:.1e} of \
         those that hold the body); ask for it without an allowed error and without a deadline"
    )]
    NotConverged {
        /// Imbalance, relative to the forces that hold the body.
        residual_rel: f64,
    },
    /// The equilibrium is not on the branch that begins at rest.
    #[error(
        "no derivatives: the shape snapped to another branch of equilibria on the way, and across a snap \
         nothing has a derivative"
    )]
    Snapped,
    /// The tangent at the equilibrium is not positive definite.
    #[error(
        "no derivatives: the tangent at the equilibrium is not positive definite, so the shape is about to \
         snap or buckle; move or load it less"
    )]
    NotStable,
    /// The system had no memory for the factor.
    #[error("no derivatives: no memory for a factor of {bytes} bytes")]
    OutOfMemory {
        /// Bytes asked for.
        bytes: usize,
    },
}

/// Corrections of the adjoint after the first solve.
const CORRECTIONS: usize = 2;

impl AdjointLoad<'_> {
    /// Solves for the adjoint at a shape, which is that of an equilibrium.
    ///
    /// # Errors
    /// [`NoAdjoint`].
    ///
    /// # Panics
    /// If the load does not fit the shape.
    pub(super) fn solve(
        &self,
        shape: &Shape,
        equilibrium: &Equilibrium,
    ) -> Result<Adjoint, NoAdjoint> {
        let Shape { elements, pattern, hold, q, .. } = shape;
        assert_eq!(self.slopes.len(), q.len(), "slopes by displacements");
        assert_eq!(self.known.len(), hold.dofs().len(), "slopes by reactions");
        check(shape, equilibrium)?;
        let tangent = |curvature| elements.tangent(pattern, q, curvature);
        let factored = Factored::try_new(hold, false, [0.0], tangent)?;
        let mut field = vec![0.0; q.len()];
        for (&dof, value) in hold.dofs().iter().zip(self.known) {
            field[dof as usize] = *value;
        }
        let mut product = factored.stiffness.mul(&field);
        for _ in 0..=CORRECTIONS {
            let left = |&dof: &u32| self.slopes[dof as usize] - product[dof as usize];
            let left: Vec<f64> = hold.partition.unknown().iter().map(left).collect();
            let step = shape.scattered(&factored.inverse.apply(hold, left, &[]));
            field.iter_mut().zip(step).for_each(|(value, step)| *value += step);
            product = factored.stiffness.mul(&field);
        }
        let reactions = hold.dofs().iter().map(|&dof| product[dof as usize]).collect();
        Ok(Adjoint { field, reactions })
    }
}

/// Whether an equilibrium has derivatives, as far as is known without its tangent.
fn check(shape: &Shape, equilibrium: &Equilibrium) -> Result<(), NoAdjoint> {
    let Equilibrium { residual_rel, jumped, .. } = *equilibrium;
    if shape.elements.is_plastic() {
        return Err(NoAdjoint::Plastic);
    }
    if shape.hold.constraint_count() > 0 {
        return Err(NoAdjoint::Masks);
    }
    if residual_rel.is_nan() || residual_rel > RESIDUAL_SETTLED {
        return Err(NoAdjoint::NotConverged { residual_rel });
    }
    match jumped {
        true => Err(NoAdjoint::Snapped),
        false => Ok(()),
    }
}

impl From<FactorError> for NoAdjoint {
    fn from(error: FactorError) -> Self {
        match error {
            FactorError::NotPositive => Self::NotStable,
            FactorError::OutOfMemory { bytes } => Self::OutOfMemory { bytes },
        }
    }
}
