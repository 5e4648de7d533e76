//! A load of unit amount, and the displacement of the held shape under it.

use std::sync::Arc;

use super::base::Base;
use super::columns::{ContactColumns, Field};
use super::error::CondensedError;
use super::held_inverse::HeldAnswer;

/// The displacement of the held shape under some forces, `g = K_B⁻¹ f`, and how well it solves its equations.
///
/// Units: m and N for one unit of the load's amount.
pub struct LoadColumn {
    /// Degrees of freedom, ascending, and forces that are not zero.
    forces: Vec<(u32, f64)>,
    field: Field,
}

/// A load whose amount a question says.
#[derive(Clone)]
pub enum UnitLoad {
    /// One newton on a node along x, y or z, by the columns of that node.
    Node {
        /// The node's columns.
        columns: Arc<ContactColumns>,
        /// Axis of the force: 0, 1 or 2.
        axis: usize,
    },
    /// Any forces.
    Forces(Arc<LoadColumn>),
}

impl LoadColumn {
    /// Solves once, on the current rayon pool.
    ///
    /// Shapes: `forces` 3N. Units: N.
    ///
    /// # Errors
    /// [`CondensedError::NotConverged`] where the base has no factor.
    pub fn try_new(base: &Base, forces: &[f64]) -> Result<Self, CondensedError> {
        let unknown = base.partition.unknown();
        // Always one by one: the kernels sum in another order for another number of columns.
        let asked: Vec<f64> = unknown.iter().map(|&dof| forces[dof as usize]).collect();
        let load: Vec<(usize, f64)> =
            asked.iter().copied().enumerate().filter(|(_, force)| *force != 0.0).collect();
        let mut answers = base.inverse.solve(base.held_system(), asked)?;
        let nothing = || HeldAnswer { field: vec![0.0; base.dof_count()], error: 0.0 };
        let answer = answers.pop().unwrap_or_else(nothing);
        let acting = (0u32..).zip(forces).filter(|(_, force)| **force != 0.0);
        Ok(Self {
            forces: acting.map(|(dof, force)| (dof, *force)).collect(),
            field: Field::check(base, &load, answer),
        })
    }

    /// Bytes that it takes.
    pub fn bytes(&self) -> usize {
        8 * self.field.field.len() + size_of_val(self.forces.as_slice())
    }
}

impl UnitLoad {
    /// Displacement of every degree of freedom, 3N.
    pub(super) fn field(&self) -> &Vec<f64> {
        match self {
            Self::Node { columns, axis } => &columns.fields[*axis],
            Self::Forces(column) => &column.field.field,
        }
    }

    /// Norm of the field as computed.
    pub(super) fn norm(&self) -> f64 {
        match self {
            Self::Node { columns, axis } => columns.norms[*axis],
            Self::Forces(column) => column.field.norm,
        }
    }

    /// Norm of `f − K_B g` as computed, and a bound of it.
    pub(super) fn residual(&self) -> (f64, f64) {
        match self {
            Self::Node { columns, axis } => {
                (columns.residuals[*axis], columns.residual_bounds[*axis])
            }
            Self::Forces(column) => (column.field.residual, column.field.residual_bound),
        }
    }

    /// Estimated norm of the error that conjugate gradients left.
    pub(super) fn error(&self) -> f64 {
        match self {
            Self::Node { columns, axis } => columns.errors[*axis],
            Self::Forces(column) => column.field.error,
        }
    }

    /// Degrees of freedom, ascending, and forces.
    pub(super) fn forces(&self) -> Vec<(u32, f64)> {
        match self {
            Self::Node { columns, axis } => {
                let of_axis = |(node, weight): (u32, f64)| (3 * node + *axis as u32, weight);
                columns.contact.entries().into_iter().map(of_axis).collect()
            }
            Self::Forces(column) => column.forces.clone(),
        }
    }
}
