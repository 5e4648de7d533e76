//! Starts the programs as processes, waits for them and ends them.

use std::ffi::OsStr;
use std::fs::File;
use std::io::{BufRead, BufReader, Read, Seek};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use crate::report_error::ReportError;
use crate::threads::processors;

/// Paths of the programs.
pub(crate) struct Programs {
    client: PathBuf,
    server: PathBuf,
    /// Program of a cluster, which need not be there.
    worker: PathBuf,
}

/// Time after which a program that has not ended is taken to hang.
const RUN_MAX: Duration = Duration::from_secs(300);
/// Time between two looks at a running program, which must not be disturbed.
const LOOK: Duration = Duration::from_millis(50);
/// Time for the processes of a job to end after they were asked to.
const END_MAX: Duration = Duration::from_secs(10);

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
        let path = |name: &str| folder.join(format!("{name}{}", std::env::consts::EXE_SUFFIX));
        let program = |name: &str| match path(name) {
            path if path.is_file() => Ok(path),
            path => Err(ReportError::NoProgram { path }),
        };
        let (client, server) = (program("glove-client")?, program("fea-server")?);
        Ok(Self { client, server, worker: path("fea-worker") })
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
        listening("fea-server", command, false)
    }

    /// Starts a worker with these arguments on so many ranks of this machine and waits until it listens.
    ///
    /// # Errors
    /// [`ReportError::NoProgram`], [`ReportError::Process`] without `mpirun`, and [`ReportError::Ended`] if
    /// it does not listen, because it was built without PETSc for example.
    pub fn serve_on(&self, ranks: usize, arguments: &[&str]) -> Result<Server, ReportError> {
        if !self.worker.is_file() {
            return Err(ReportError::NoProgram { path: self.worker.clone() });
        }
        let mut command = Command::new("mpirun");
        command.args(["--oversubscribe", "--bind-to", "none", "-n", &ranks.to_string()]);
        if ranks > processors() {
            // Ranks that wait give way to those that compute.
            command.args(["--mca", "mpi_yield_when_idle", "1"]);
        }
        command.arg(&self.worker).args(arguments);
        command.env("OMP_NUM_THREADS", "1");
        // Open MPI asks for both where everything runs as root, as in a container.
        command.env("OMPI_ALLOW_RUN_AS_ROOT", "1").env("OMPI_ALLOW_RUN_AS_ROOT_CONFIRM", "1");
        listening("fea-worker", command, true)
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
        let process = Process { child: command.spawn().map_err(failed)?, is_job: false };
        Ok(Client { what, said, process, begun: Instant::now() })
    }
}

/// Starts a command and waits until it listens.
fn listening(what: &str, mut command: Command, is_job: bool) -> Result<Server, ReportError> {
    let started = command.get_program().display().to_string();
    let failed = |source| ReportError::Process { what: started.clone(), source };
    let mut said = tempfile::tempfile().map_err(failed)?;
    command.stdin(Stdio::null()).stdout(Stdio::piped()).stderr(match is_job {
        true => Stdio::from(said.try_clone().map_err(failed)?),
        // Its log would take part in what is measured.
        false => Stdio::null(),
    });
    let mut process = Process { child: command.spawn().map_err(failed)?, is_job };
    let out = process.child.stdout.take().map(BufReader::new);
    let mut lines = out.into_iter().flat_map(BufRead::lines).map_while(Result::ok);
    let address =
        lines.find_map(|line| Some(line.trim().strip_prefix("listening on ")?.to_owned()));
    match address {
        Some(address) => Ok(Server { address, process }),
        None => {
            let said = words_of(what, &mut said).unwrap_or_default();
            Err(ReportError::Ended { what: what.to_owned(), said })
        }
    }
}

/// The line of a file that a program has written under its own name, or else the first with words.
fn words_of(program: &str, file: &mut File) -> Option<String> {
    let mut text = String::new();
    file.rewind().ok()?;
    file.read_to_string(&mut text).ok()?;
    let lines = || text.lines().map(str::trim).filter(|line| line.contains(char::is_alphanumeric));
    let own = lines().find_map(|line| line.strip_prefix(program)?.strip_prefix(": "));
    own.or_else(|| lines().next()).map(str::to_owned)
}

/// Process that is ended when this is dropped.
struct Process {
    child: Child,
    /// Whether it started the processes that count, which must not be left behind.
    is_job: bool,
}

impl Drop for Process {
    fn drop(&mut self) {
        if self.is_job {
            let id = self.child.id().to_string();
            // Where there is no such command, it is killed below all the same.
            let _ = Command::new("kill").args(["-TERM", &id]).stderr(Stdio::null()).status();
            let until = Instant::now() + END_MAX;
            while matches!(self.child.try_wait(), Ok(None)) && Instant::now() < until {
                std::thread::sleep(LOOK);
            }
        }
        // It may have ended by itself.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// Running server, or the ranks of a worker.
pub(crate) struct Server {
    pub address: String,
    process: Process,
}

/// Unit of processor times in `/proc`, 1/s.
const CLOCK_TICKS: f64 = 100.0;

impl Server {
    /// Processor time that the server has used, s; `None` where the system does not tell.
    pub fn busy_s(&self) -> Option<f64> {
        let stat =
            std::fs::read_to_string(format!("/proc/{}/stat", self.process.child.id())).ok()?;
        // The name in brackets may hold spaces.
        let fields: Vec<&str> = stat.rsplit_once(')')?.1.split_whitespace().collect();
        let ticks = |at: usize| fields.get(at)?.parse::<f64>().ok();
        Some((ticks(11)? + ticks(12)?) / CLOCK_TICKS)
    }

    /// Resident memory of the server, bytes; `None` where the system does not tell.
    pub fn resident_bytes(&self) -> Option<f64> {
        memory_of(self.process.child.id(), "VmRSS:")
    }

    /// Largest resident memory of the server so far, or the sum over the ranks of a worker, bytes; `None`
    /// where the system does not tell.
    pub fn peak_bytes(&self) -> Option<f64> {
        let id = self.process.child.id();
        let processes = if self.process.is_job { children_of(id) } else { vec![id] };
        let peaks: Option<Vec<f64>> =
            processes.into_iter().map(|id| memory_of(id, "VmHWM:")).collect();
        peaks.filter(|peaks| !peaks.is_empty()).map(|peaks| peaks.iter().sum())
    }
}

/// A figure of a process's memory, bytes.
fn memory_of(id: u32, name: &str) -> Option<f64> {
    let status = std::fs::read_to_string(format!("/proc/{id}/status")).ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix(name))?;
    Some(line.split_whitespace().next()?.parse::<f64>().ok()? * 1024.0)
}

/// Processes that a process has started.
fn children_of(id: u32) -> Vec<u32> {
    let parent_of = |child: u32| {
        let status = std::fs::read_to_string(format!("/proc/{child}/status")).ok()?;
        let line = status.lines().find_map(|line| line.strip_prefix("PPid:"))?;
        line.trim().parse::<u32>().ok()
    };
    let all = std::fs::read_dir("/proc").into_iter().flatten().flatten();
    let ids = all.filter_map(|entry| entry.file_name().to_str()?.parse::<u32>().ok());
    ids.filter(|&child| parent_of(child) == Some(id)).collect()
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
            let ended = self.process.child.try_wait();
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
