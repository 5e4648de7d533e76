//! Starts the two programs as processes, waits for them and ends them.

use std::ffi::OsStr;
use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use crate::report_error::ReportError;

/// Paths of the two programs.
pub(crate) struct Programs {
    client: PathBuf,
    server: PathBuf,
}

/// Time after which a program that has not ended is taken to hang.
const RUN_MAX: Duration = Duration::from_secs(300);
/// Time between two looks at a running program, which must not be disturbed.
const LOOK: Duration = Duration::from_millis(50);

impl Programs {
    /// Finds the programs beside this one, or beside the folder of a test.
    ///
    /// # Errors
    /// [`ReportError::NoProgram`], which says how to build them.
    pub fn find() -> Result<Self, ReportError> {
        let this = std::env::current_exe()
            .map_err(|source| ReportError::Process { what: "this program".to_owned(), source })?;
        let beside = this.parent().unwrap_or(Path::new(""));
        let folder = match beside.file_name().and_then(OsStr::to_str) {
            Some("deps") => beside.parent().unwrap_or(beside),
            _ => beside,
        };
        let program = |name: &str| {
            let path = folder.join(format!("{name}{}", std::env::consts::EXE_SUFFIX));
            if path.is_file() { Ok(path) } else { Err(ReportError::NoProgram { path }) }
        };
        Ok(Self { client: program("glove-client")?, server: program("fea-server")? })
    }

    /// Starts a server on a free port of this machine; it asks for real-time scheduling, as an embedded
    /// one does.
    ///
    /// # Errors
    /// [`ReportError::Process`] if it cannot be started.
    pub fn serve(&self, threads: usize) -> Result<Server, ReportError> {
        let threads = threads.to_string();
        self.serve_as(&["--listen", "127.0.0.1:0", "--real-time", "--threads", &threads])
    }

    /// Starts a server with these arguments and waits until it listens.
    ///
    /// # Errors
    /// [`ReportError::Process`], and [`ReportError::Ended`] if it does not listen.
    pub fn serve_as(&self, arguments: &[&str]) -> Result<Server, ReportError> {
        let mut command = Command::new(&self.server);
        command.args(arguments);
        command.stdout(Stdio::piped()).stderr(Stdio::null());
        let failed = |source| ReportError::Process { what: "fea-server".to_owned(), source };
        let mut process = Process(command.spawn().map_err(failed)?);
        let mut line = String::new();
        if let Some(out) = process.0.stdout.take() {
            BufReader::new(out).read_line(&mut line).map_err(failed)?;
        }
        match line.trim().strip_prefix("listening on ") {
            Some(address) => Ok(Server { address: address.to_owned(), process }),
            None => Err(ReportError::Ended { what: "fea-server".to_owned(), said: line }),
        }
    }

    /// Starts `glove-client` with these arguments; its output goes to a file of the folder.
    ///
    /// # Errors
    /// [`ReportError::Process`] if it cannot be started.
    pub fn ask(
        &self,
        arguments: &[&OsStr],
        folder: &Path,
        name: &str,
    ) -> Result<Client, ReportError> {
        let what = format!("glove-client {}", arguments.join(OsStr::new(" ")).display());
        let failed = |source| ReportError::Process { what: what.clone(), source };
        let said = folder.join(format!("{name}.txt"));
        let file = std::fs::File::create(&said).map_err(failed)?;
        let mut command = Command::new(&self.client);
        command.args(arguments).stdin(Stdio::null()).stdout(Stdio::null()).stderr(file);
        let process = Process(command.spawn().map_err(failed)?);
        Ok(Client { what, said, process, begun: Instant::now() })
    }
}

/// Process that is killed when this is dropped.
struct Process(Child);

impl Drop for Process {
    fn drop(&mut self) {
        // It may have ended by itself.
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// Running server.
pub(crate) struct Server {
    pub address: String,
    process: Process,
}

/// Unit of processor times in `/proc`, 1/s.
const CLOCK_TICKS: f64 = 100.0;

impl Server {
    /// Processor time that the server has used, s; `None` where the system does not tell.
    pub fn busy_s(&self) -> Option<f64> {
        let stat = std::fs::read_to_string(format!("/proc/{}/stat", self.process.0.id())).ok()?;
        // The name in brackets may hold spaces.
        let fields: Vec<&str> = stat.rsplit_once(')')?.1.split_whitespace().collect();
        let ticks = |at: usize| fields.get(at)?.parse::<f64>().ok();
        Some((ticks(11)? + ticks(12)?) / CLOCK_TICKS)
    }

    /// Resident memory of the server, bytes; `None` where the system does not tell.
    pub fn resident_bytes(&self) -> Option<f64> {
        let status =
            std::fs::read_to_string(format!("/proc/{}/status", self.process.0.id())).ok()?;
        let line = status.lines().find_map(|line| line.strip_prefix("VmRSS:"))?;
        Some(line.split_whitespace().next()?.parse::<f64>().ok()? * 1024.0)
    }
}

/// Running client.
pub(crate) struct Client {
    what: String,
    said: PathBuf,
    process: Process,
    begun: Instant,
}

impl Client {
    /// Waits until the client has ended; returns how long it ran, or its output if it failed.
    ///
    /// # Errors
    /// [`ReportError::Process`], and [`ReportError::Ended`] if it hangs.
    pub fn wait(mut self) -> Result<Result<Duration, String>, ReportError> {
        loop {
            let ended = self.process.0.try_wait();
            let ended =
                ended.map_err(|source| ReportError::Process { what: self.what.clone(), source })?;
            if let Some(status) = ended {
                let said = std::fs::read_to_string(&self.said).unwrap_or_default();
                let lasted = self.begun.elapsed();
                return Ok(if status.success() { Ok(lasted) } else { Err(said) });
            }
            if self.begun.elapsed() > RUN_MAX {
                let said = format!("still running after {} s", RUN_MAX.as_secs());
                return Err(ReportError::Ended { what: self.what.clone(), said });
            }
            std::thread::sleep(LOOK);
        }
    }

    /// Waits for a client that must not fail; returns how long it ran.
    ///
    /// # Errors
    /// The same as those of [`Self::wait`], and [`ReportError::Ended`] with its output.
    pub fn succeed(self) -> Result<Duration, ReportError> {
        let what = self.what.clone();
        self.wait()?.map_err(|said| ReportError::Ended { what, said })
    }
}
