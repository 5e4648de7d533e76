//! The arguments that ask for derivatives beside an answer.

use std::path::PathBuf;

use anyhow::bail;
use clap::Args;
use softgrasp_core::mesh_io::MeshFile;
use softgrasp_protocol::{Answer, DofValue, Quantity, Welcome};

use super::solve_cases::read_values;
use crate::ask::displacement_table::{DISPLACEMENT_COLUMNS, FORCE_COLUMNS};
use crate::ask::gradient::{QuantityTables, table_of_materials, table_of_nodes, table_of_places};
use crate::object::file_writing::write_file;

/// Derivatives of a quantity.
#[derive(Args, Clone, Default)]
pub(super) struct GradientArguments {
    /// File for the derivatives of a quantity J: node,fx,fy,fz,ux,uy,uz, by a force on each node where it
    /// is free, by its displacement where that is prescribed. One more solve.
    #[arg(long, value_name = "G.csv")]
    gradient: Option<PathBuf>,
    /// What J is: its derivatives by displacements, node,ux,uy,uz; an empty cell is zero.
    #[arg(long, value_name = "J.csv", requires = "gradient")]
    gradient_by: Option<PathBuf>,
    /// What J is besides: its second derivatives by displacements, each by its own, node,ux,uy,uz.
    #[arg(long, value_name = "J.csv", requires = "gradient")]
    gradient_by_squares: Option<PathBuf>,
    /// What J is: its derivatives by the forces that hold the body, node,fx,fy,fz.
    #[arg(long, value_name = "J.csv", requires = "gradient")]
    gradient_by_reactions: Option<PathBuf>,
    /// File for the derivatives of J by the material of each region: region,young,poisson.
    #[arg(long, value_name = "M.csv", requires = "gradient")]
    gradient_by_materials: Option<PathBuf>,
    /// File for the derivatives of J by the place of each node at rest: node,x,y,z.
    #[arg(long, value_name = "P.csv", requires = "gradient")]
    gradient_by_places: Option<PathBuf>,
}

impl GradientArguments {
    /// Refuses what has no derivatives.
    ///
    /// # Errors
    /// One line for several cases, and a quantity that was not told.
    pub(super) fn check(&self, cases: usize) -> anyhow::Result<()> {
        if self.gradient.is_none() {
            return Ok(());
        }
        if cases > 1 {
            bail!("--gradient is for one --known");
        }
        let told = [&self.gradient_by, &self.gradient_by_squares, &self.gradient_by_reactions];
        if told.into_iter().all(Option::is_none) {
            bail!(
                "--gradient needs to know of what: --gradient-by, --gradient-by-squares or \
                 --gradient-by-reactions"
            );
        }
        Ok(())
    }

    /// The quantity whose derivatives are wanted; none without `--gradient`.
    ///
    /// # Errors
    /// One line for a table that cannot be read, and for tables without any number.
    pub(super) fn quantity(&self, node_count: usize) -> anyhow::Result<Quantity> {
        if self.gradient.is_none() {
            return Ok(Quantity::default());
        }
        self.check(1)?;
        let read = |path: &Option<PathBuf>, columns| -> anyhow::Result<Vec<DofValue>> {
            path.as_ref().map_or(Ok(Vec::new()), |path| read_values(path, columns, node_count))
        };
        let tables = QuantityTables {
            by_displacements: read(&self.gradient_by, DISPLACEMENT_COLUMNS)?,
            by_squares: read(&self.gradient_by_squares, DISPLACEMENT_COLUMNS)?,
            by_reactions: read(&self.gradient_by_reactions, FORCE_COLUMNS)?,
        };
        let quantity = tables.quantity(self.gradient_by_places.is_some());
        if quantity.is_empty() {
            bail!("--gradient has nothing to derive: the tables of the quantity have no number");
        }
        Ok(quantity)
    }

    /// Refuses to ask a server that answers no derivatives.
    ///
    /// # Errors
    /// One line that names the server.
    pub(super) fn check_server(&self, server: &Welcome) -> anyhow::Result<()> {
        if self.gradient.is_some() && !server.knows("gradients") {
            bail!(
                "{} is an older server and answers no derivatives; leave out --gradient",
                server.program()
            );
        }
        Ok(())
    }

    /// Writes the derivatives of an answer.
    ///
    /// # Errors
    /// One line for an answer without them, and a file that cannot be written.
    pub(super) fn write(&self, file: &MeshFile, answer: &Answer) -> anyhow::Result<()> {
        let Some(path) = &self.gradient else { return Ok(()) };
        let Some(gradient) = &answer.gradient else {
            bail!("the server has answered no derivatives; leave out --gradient");
        };
        write_file(path, table_of_nodes(gradient).as_bytes())?;
        if let Some(path) = &self.gradient_by_materials {
            let mesh = (&file.mesh, file.findings.region_labels.as_slice());
            write_file(path, &table_of_materials(mesh, gradient))?;
        }
        if let Some(path) = &self.gradient_by_places {
            write_file(path, table_of_places(gradient).as_bytes())?;
        }
        Ok(())
    }
}
