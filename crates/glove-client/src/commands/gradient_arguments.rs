//! The arguments that ask for derivatives beside an answer.

use std::path::PathBuf;

use anyhow::bail;
use clap::Args;
use softgrasp_core::mesh::TetMesh;
use softgrasp_protocol::{Ask, Body, DofValue, Question};

use super::solve_cases::read_values;
use crate::ask::connection::ServerConnection;
use crate::ask::displacement_table::{DISPLACEMENT_COLUMNS, FORCE_COLUMNS};
use crate::ask::gradient::Quantity;
use crate::object::file_writing::write_file;

/// Derivatives of a quantity.
#[derive(Args, Clone, Default)]
pub(super) struct GradientArguments {
    /// File for the derivatives of a quantity J, linear elasticity: node,fx,fy,fz,ux,uy,uz, by a force on
    /// each node where it is free, by its displacement where that is prescribed. One more solve.
    #[arg(long, value_name = "G.csv")]
    gradient: Option<PathBuf>,
    /// What J is: its derivatives by displacements, node,ux,uy,uz; an empty cell is zero.
    #[arg(long, value_name = "J.csv", requires = "gradient")]
    gradient_by: Option<PathBuf>,
    /// What J is: its derivatives by the forces that hold the body, node,fx,fy,fz.
    #[arg(long, value_name = "J.csv", requires = "gradient")]
    gradient_by_reactions: Option<PathBuf>,
}

impl GradientArguments {
    /// Whether derivatives are wanted.
    pub(super) fn is_wanted(&self) -> bool {
        self.gradient.is_some()
    }

    /// Refuses what has no derivatives.
    ///
    /// # Errors
    /// One line for several cases, large deformation, and a quantity that was not told.
    pub(super) fn check(&self, cases: usize, is_linear: bool) -> anyhow::Result<()> {
        if !self.is_wanted() {
            return Ok(());
        }
        if cases > 1 || !is_linear {
            bail!("--gradient is for one --known by linear elasticity");
        }
        if self.gradient_by.is_none() && self.gradient_by_reactions.is_none() {
            bail!("--gradient needs to know of what: --gradient-by or --gradient-by-reactions");
        }
        Ok(())
    }

    /// Asks for the derivatives and writes them.
    ///
    /// # Errors
    /// One line for a table that cannot be read, a refusal, and a file that cannot be written.
    pub(super) fn write(
        &self,
        connection: &mut ServerConnection,
        mesh: &TetMesh,
        (body, question): (&Body, &Question),
    ) -> anyhow::Result<()> {
        let Some(path) = &self.gradient else { return Ok(()) };
        let read = |path: &Option<PathBuf>, columns| -> anyhow::Result<Vec<DofValue>> {
            path.as_ref()
                .map_or(Ok(Vec::new()), |path| read_values(path, columns, mesh.node_count()))
        };
        let quantity = Quantity {
            by_displacements: read(&self.gradient_by, DISPLACEMENT_COLUMNS)?,
            by_reactions: read(&self.gradient_by_reactions, FORCE_COLUMNS)?,
        };
        let adjoint = Ask::new(body.clone(), quantity.adjoint(question)?);
        let answer = connection.answer(adjoint)?;
        Ok(write_file(path, quantity.table(*answer).as_bytes())?)
    }
}
