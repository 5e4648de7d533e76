//! `glove-client inspect F [--json] [--repair OUT]`: reports on a mesh file, and writes it mended.

use std::path::{Path, PathBuf};

use anyhow::{Context, bail};
use clap::Args;
use softgrasp_core::mesh::Surface;
use softgrasp_core::mesh_io::{self, MeshFile, keeps_labels};
use softgrasp_core::solve::memory::Bytes;

use super::output::print;
use crate::ask::connection::OwnMachine;
use crate::commands::output::Progress;
use crate::inspect::inspection::Inspection;
use crate::object::file_writing::write_file;
use crate::object::mesh_file::encode_mesh;
use crate::object::mesh_file::read_mesh_file;

/// Tell what is in a mesh file, whether it can be used, and what an answer would cost.
#[derive(Args)]
pub struct InspectCommand {
    /// Mesh file; the format is recognised by its content.
    file: PathBuf,
    /// Print JSON.
    #[arg(long)]
    json: bool,
    /// Memory limit of the server that is to solve: bytes, or 8GiB, 512MiB [default: 8GiB]. A mesh
    /// that needs more by every way is refused (exit code 1).
    #[arg(long, value_name = "BYTES", allow_hyphen_values = true)]
    memory_limit: Option<Bytes>,
    /// Write the mended mesh: .msh (Gmsh 4.1), .vtu, or .txt (the three lists of the thesis).
    #[arg(long, value_name = "OUT")]
    repair: Option<PathBuf>,
}

impl InspectCommand {
    /// Reads and mends the mesh, and prints the report.
    ///
    /// # Errors
    /// A file that cannot be read, used or written, or that no way could answer within the memory
    /// limit, in one line.
    pub fn run(&self) -> anyhow::Result<()> {
        let progress = Progress::start("reading the mesh");
        let read = read_mesh_file(&self.file)?;
        progress.now("measuring this machine");
        let machine = OwnMachine::measure();
        progress.now("looking at the mesh");
        let limit = self.memory_limit.map(|Bytes(bytes)| bytes);
        let inspection = Inspection::new(self.file.display().to_string(), &read, limit, &machine);
        let repaired = match &self.repair {
            Some(out) => {
                progress.now("writing the mended mesh");
                Some(repair(&read, out)?)
            }
            None => None,
        };
        drop(progress);
        match self.json {
            true => print(&format!("{}\n", serde_json::to_string_pretty(&inspection)?))?,
            false => print(&inspection.to_string())?,
        }
        if let Some(told) = repaired {
            // Standard output is JSON and nothing else where that was asked for.
            match self.json {
                true => eprintln!("glove-client: {}", told.trim_end()),
                false => print(&told)?,
            }
        }
        match inspection.refused_because {
            Some(reason) => bail!("{}: {reason}", self.file.display()),
            None => Ok(()),
        }
    }
}

/// Writes the mended mesh, after a check that nothing is left to mend; returns the sentence for the
/// person.
fn repair(read: &MeshFile, out: &Path) -> anyhow::Result<String> {
    let MeshFile { mesh, findings, .. } = read;
    let labels = &findings.region_labels;
    let bytes = encode_mesh(out, mesh, labels, &Surface::from_mesh(mesh), &[])?;
    let name = out.display().to_string();
    let again = mesh_io::parse(&name, &bytes, &mut |_| None)
        .context("the mended mesh cannot be read back")?;
    if again.findings.mending.is_some() || again.mesh != *mesh {
        bail!("{name} was not written: the mended mesh does not come back as it is");
    }
    write_file(out, &bytes)?;
    let turned = findings.flipped.len();
    let dropped = findings.degenerate.len() + findings.repeated.len();
    let mut told = format!(
        "mended mesh written to {name}: {} nodes with the same numbers, {} tetrahedra, {turned} \
         turned, {dropped} dropped\n",
        mesh.node_count(),
        mesh.tets().len(),
    );
    if findings.orphans > 0 {
        told.push_str(&format!(
            "{} nodes in no tetrahedron stay in the file, so that all nodes keep their numbers\n",
            findings.orphans
        ));
    }
    if again.findings.region_labels != *labels && !keeps_labels(mesh, labels) {
        let pairs = labels.iter().zip(&again.findings.region_labels);
        let pairs: Vec<String> = pairs.map(|(was, is)| format!("{was} is {is}")).collect();
        told.push_str(&format!(
            "regions have numbers only in this format: {}; .msh keeps names\n",
            pairs.join(", ")
        ));
    }
    Ok(told)
}
