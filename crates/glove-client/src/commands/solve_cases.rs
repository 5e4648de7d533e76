//! Files of `glove-client solve`: known displacements, displacements and reactions of each case.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use anyhow::{Context, bail};
use softgrasp_core::mesh::TetMesh;
use softgrasp_protocol::{DofValue, FieldValues};

use crate::ask::displacement_table::{
    DISPLACEMENT_COLUMNS, read_table, write_displacements, write_reactions,
};
use crate::commands::field_arguments::is_vtu;
use crate::object::field_writing::{NodeVectors, encode_fields};
use crate::object::file_writing::write_file;

/// Files of all cases, in the order of the command line.
#[derive(Clone, Copy)]
pub(super) struct CaseFiles<'a> {
    pub known: &'a [PathBuf],
    pub out: &'a [PathBuf],
    pub reactions: &'a [PathBuf],
}

/// Mesh of all cases, and the names of its regions in its file.
#[derive(Clone, Copy)]
pub(super) struct CaseMesh<'a> {
    pub mesh: &'a TetMesh,
    pub labels: &'a [String],
}

/// Answer to one case.
#[derive(Clone, Copy)]
pub(super) struct CaseResult<'a> {
    pub displacements: &'a [[f64; 3]],
    pub reactions: &'a [DofValue],
    pub fields: Option<&'a FieldValues>,
}

impl CaseFiles<'_> {
    /// Checks that the numbers of files agree.
    ///
    /// # Errors
    /// One line if a file is missing or there is one too many.
    pub fn check(self) -> anyhow::Result<()> {
        let cases = self.known.len();
        if self.out.len() != cases {
            bail!(
                "{cases} --known and {} --out were given; give one --out for each",
                self.out.len()
            );
        }
        if !self.reactions.is_empty() && self.reactions.len() != cases {
            let given = self.reactions.len();
            bail!("{cases} --known and {given} --reactions were given; give one for each, or none");
        }
        Ok(())
    }

    /// Known displacements of the further cases, m, in the order of those of the first.
    pub fn further(self, mesh: &TetMesh, first: &[DofValue]) -> anyhow::Result<Vec<Vec<f64>>> {
        let mut cases = Vec::new();
        for path in self.known.iter().skip(1) {
            let known = read_values(path, DISPLACEMENT_COLUMNS, mesh.node_count())?;
            let by_dof: BTreeMap<u32, f64> = known.iter().map(|k| (k.dof, k.value)).collect();
            let dofs: BTreeSet<u32> = first.iter().map(|k| k.dof).collect();
            if let Some(dof) = dofs.iter().find(|dof| !by_dof.contains_key(dof)) {
                bail!(other_directions(
                    path,
                    *dof,
                    "leaves free what the first --known prescribes"
                ));
            }
            if let Some(dof) = by_dof.keys().find(|dof| !dofs.contains(dof)) {
                bail!(other_directions(
                    path,
                    *dof,
                    "prescribes what the first --known leaves free"
                ));
            }
            cases.push(first.iter().map(|k| by_dof[&k.dof]).collect());
        }
        Ok(cases)
    }

    /// Writes the files of one case.
    pub fn write(
        self,
        case: usize,
        mesh: CaseMesh<'_>,
        result: CaseResult<'_>,
    ) -> anyhow::Result<()> {
        if let Some(path) = self.out.get(case) {
            write_file(path, &encode(path, mesh, result)?)?;
        }
        if let Some(path) = self.reactions.get(case) {
            write_file(path, write_reactions(result.reactions).as_bytes())?;
        }
        Ok(())
    }
}

fn other_directions(path: &Path, dof: u32, what: &str) -> String {
    let axis = ["ux", "uy", "uz"][dof as usize % 3];
    format!(
        "{} {what}: {axis} of node {}; several --known prescribe the same directions",
        path.display(),
        dof / 3
    )
}

/// Reads a table of values by node.
///
/// # Errors
/// One line with file and row.
pub(super) fn read_values(
    path: &Path,
    columns: [&'static str; 4],
    node_count: usize,
) -> anyhow::Result<Vec<DofValue>> {
    let name = path.display().to_string();
    let bytes = std::fs::read(path).with_context(|| format!("cannot read {name}"))?;
    Ok(read_table(&name, &bytes, columns, node_count)?)
}

fn encode(path: &Path, of: CaseMesh<'_>, result: CaseResult<'_>) -> anyhow::Result<Vec<u8>> {
    let values = result.displacements;
    if !is_vtu(path) {
        return Ok(write_displacements(values).into_bytes());
    }
    let vectors = [NodeVectors { name: "displacement", unit: "m", values }];
    encode_fields(of.mesh, of.labels, &vectors, result.fields).context("cannot form the VTU file")
}
