//! One request in a fresh process: the wait of a person who types `glove-client solve`.

use std::ffi::OsStr;
use std::path::{Path, PathBuf};

use serde_json::Value;
use softgrasp_core::mesh_io::write_msh41;
use tempfile::TempDir;

use super::round::Problem;
use crate::programs::Programs;
use crate::report::{ReportError, check};

/// Mesh and known displacements in files.
pub struct Files {
    folder: TempDir,
    mesh: PathBuf,
    known: PathBuf,
}

/// Time of each stage of one request, ms.
pub struct Stages {
    pub assemble: f64,
    pub order: f64,
    pub factor: f64,
    pub solve: f64,
}

impl Stages {
    /// Sum of all four stages, ms.
    pub fn all(&self) -> f64 {
        self.assemble + self.order + self.factor + self.solve
    }
}

impl Files {
    /// Writes the files.
    ///
    /// # Errors
    /// [`ReportError`] if they cannot be written.
    pub fn of(problem: &Problem) -> Result<Self, ReportError> {
        let folder = tempfile::tempdir().map_err(failed)?;
        let (mesh, known) = (folder.path().join("cube.msh"), folder.path().join("known.csv"));
        std::fs::write(&mesh, write_msh41(problem.model.mesh())).map_err(failed)?;
        let mut rows = "node,ux,uy,uz\n".to_owned();
        for (k, node) in problem.held.iter().enumerate() {
            rows.push_str(&format!("{node},0,0,{}\n", 1e-3 * k as f64));
        }
        std::fs::write(&known, rows).map_err(failed)?;
        Ok(Self { folder, mesh, known })
    }

    /// Solves the files' problem by `front` in a process of its own.
    ///
    /// # Errors
    /// [`ReportError`] if the client fails, or the residual is large.
    pub fn solve(&self, programs: &Programs, estimate: bool) -> Result<Stages, ReportError> {
        let (out, report) = (self.folder.path().join("u.csv"), self.folder.path().join("r.json"));
        let mut arguments: Vec<&OsStr> =
            ["solve", "--method", "front", "--mesh"].map(OsStr::new).to_vec();
        arguments.push(self.mesh.as_os_str());
        for (option, file) in [("--known", &self.known), ("--out", &out), ("--report", &report)] {
            arguments.extend([OsStr::new(option), file.as_os_str()]);
        }
        if !estimate {
            arguments.push(OsStr::new("--no-estimate"));
        }
        programs.ask(&arguments, self.folder.path(), "solve")?.succeed()?;
        read(&report)
    }
}

fn read(report: &Path) -> Result<Stages, ReportError> {
    let text = std::fs::read_to_string(report).map_err(failed)?;
    let report: Value = serde_json::from_str(&text).map_err(|error| ReportError::Ended {
        what: "glove-client solve".to_owned(),
        said: error.to_string(),
    })?;
    let residual = report["residual_rel"].as_f64().unwrap_or(f64::NAN);
    check(|| "residual of a request".to_owned(), residual, 1e-11)?;
    let ms = |stage: &str| report["ms"][stage].as_f64().unwrap_or(f64::NAN);
    Ok(Stages {
        assemble: ms("assemble"),
        order: ms("order"),
        factor: ms("factor"),
        solve: ms("solve"),
    })
}

fn failed(source: std::io::Error) -> ReportError {
    ReportError::Process { what: "files of a request".to_owned(), source }
}
