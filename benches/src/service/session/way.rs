//! Runs of one object with one arrangement of client and server, added up.

use std::ffi::{OsStr, OsString};
use std::path::Path;

use super::record::Record;
use crate::programs::Programs;
use crate::report_error::ReportError;

/// Arrangement of client and server.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Arrangement {
    /// The server runs in the client's process.
    Embedded,
    /// Client and server are two processes.
    TwoProcesses,
    /// As many clients at the same time, and one server for all.
    ManySessions(usize),
}

impl Arrangement {
    /// Name of the arrangement in the tables.
    pub fn name(self) -> String {
        match self {
            Self::Embedded => "embedded".to_owned(),
            Self::TwoProcesses => "two processes".to_owned(),
            Self::ManySessions(count) => format!("{count} sessions on one server"),
        }
    }

    /// Number of clients at the same time.
    fn clients(self) -> usize {
        if let Self::ManySessions(count) = self { count } else { 1 }
    }
}

/// Object that is grasped, and the equations of its deformation.
pub(super) struct Object {
    pub name: String,
    /// Arguments of `run` that name it.
    pub arguments: Vec<OsString>,
    /// Equations that `run` is asked for.
    pub deformation: &'static str,
}

/// Ticks per second.
pub(super) const RATE_HZ: u32 = 100;

/// Plays an object several times in one arrangement, each time with a new server.
///
/// # Errors
/// [`ReportError`], also for a run that fails or hangs.
pub(super) fn play(
    programs: &Programs,
    object: &Object,
    arrangement: Arrangement,
    times: usize,
    threads: usize,
    folder: &Path,
) -> Result<Record, ReportError> {
    let mut all = Record::default();
    for _ in 0..times {
        let server = match arrangement {
            Arrangement::Embedded => None,
            _ => Some(programs.serve(threads)?),
        };
        let address = server.as_ref().map_or("embedded", |server| server.address.as_str());
        let names: Vec<String> = (0..arrangement.clients()).map(|n| format!("run-{n}")).collect();
        let mut clients = Vec::new();
        for name in &names {
            let report = folder.join(format!("{name}.json"));
            let rate = RATE_HZ.to_string();
            let mut arguments: Vec<&OsStr> = [
                "run",
                "--headless",
                "--deformation",
                object.deformation,
                "--rate",
                &rate,
                "--server",
            ]
            .map(OsStr::new)
            .to_vec();
            arguments.extend([OsStr::new(address), OsStr::new("--report"), report.as_os_str()]);
            let threads = threads.to_string();
            if server.is_none() {
                arguments.extend(["--threads", &threads].map(OsStr::new));
            }
            arguments.extend(object.arguments.iter().map(OsString::as_os_str));
            clients.push(programs.ask(&arguments, folder, name)?);
        }
        for (client, name) in clients.into_iter().zip(&names) {
            // A run in which nothing was answered fails; its report says why, and this one too.
            let ended = client.wait()?;
            let report = folder.join(format!("{name}.json"));
            if let (Err(said), false) = (ended, report.is_file()) {
                let what = format!("run of {}", object.name);
                return Err(ReportError::Ended { what, said });
            }
            all.append(Record::read(&report)?);
            std::fs::remove_file(&report)
                .map_err(|source| ReportError::Write { path: report.clone(), source })?;
        }
    }
    Ok(all)
}
