//! The client in Python: a process that asks blocks of frames when it is told to.

use std::io::{BufRead, BufReader, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};

use super::asked::Trip;
use crate::report::ReportError;

/// Prints what it is, if all that the client needs is installed.
const WHAT_IT_IS: &str = "import numpy, platform, softgrasp
print(f'Python {platform.python_version()}, numpy {numpy.__version__}')";

/// An interpreter with all that the client needs.
pub(super) struct Interpreter {
    program: String,
    /// Its version, and that of numpy.
    pub version: String,
}

impl Interpreter {
    /// The interpreter that `PYTHON` names, or `python3`.
    ///
    /// # Errors
    /// Why it cannot run the client, in one line.
    pub fn find() -> Result<Self, String> {
        let program = std::env::var("PYTHON").unwrap_or_else(|_| "python3".to_owned());
        let asked = command(&program).args(["-c", WHAT_IT_IS]).output();
        let said = asked.map_err(|error| format!("there is no {program}: {error}"))?;
        let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).trim().to_owned();
        match said.status.success() {
            true => Ok(Self { program, version: text(&said.stdout) }),
            false => {
                let error = text(&said.stderr);
                let last = error.lines().last().unwrap_or("it ended with an error");
                Err(format!("{program} cannot import the client: {last}"))
            }
        }
    }
}

/// The client in Python with the model of a question.
pub(super) struct Python {
    process: Child,
    input: ChildStdin,
    output: BufReader<ChildStdout>,
}

impl Python {
    /// Starts it on a server, with the question of a folder.
    ///
    /// # Errors
    /// [`ReportError::Process`] if it cannot be started.
    pub fn start(
        interpreter: &Interpreter,
        address: &str,
        folder: &Path,
    ) -> Result<Self, ReportError> {
        let failed = |source| ReportError::Process { what: interpreter.program.clone(), source };
        let script = package().join("benchmarks/turns.py");
        let mut started = command(&interpreter.program);
        started.arg(script).arg(address).arg(folder);
        started.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::inherit());
        let mut process = started.spawn().map_err(failed)?;
        let pipes = process.stdin.take().zip(process.stdout.take());
        let (input, output) = pipes.ok_or_else(|| ended("it has no pipes"))?;
        Ok(Self { process, input, output: BufReader::new(output) })
    }

    /// Has it ask a block of frames, one after the other.
    ///
    /// # Errors
    /// [`ReportError::Ended`] if it says something else than times and errors.
    pub fn block(&mut self, first: usize, count: usize) -> Result<Vec<Trip>, ReportError> {
        let failed = |error: std::io::Error| ended(&error.to_string());
        writeln!(self.input, "{first} {count}").map_err(failed)?;
        self.input.flush().map_err(failed)?;
        let mut line = String::new();
        self.output.read_line(&mut line).map_err(failed)?;
        let numbers: Result<Vec<f64>, _> = line.split_whitespace().map(str::parse).collect();
        match numbers {
            Ok(numbers) if numbers.len() == 2 * count => {
                let pairs = numbers.as_chunks::<2>().0.iter();
                Ok(pairs.map(|&[ms, error_rel]| Trip { ms, error_rel }).collect())
            }
            _ => Err(ended(&line)),
        }
    }
}

impl Drop for Python {
    fn drop(&mut self) {
        // It may have ended by itself.
        let _ = self.process.kill();
        let _ = self.process.wait();
    }
}

fn ended(said: &str) -> ReportError {
    ReportError::Ended { what: "the client in Python".to_owned(), said: said.to_owned() }
}

/// Folder of the client.
fn package() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../clients/python")
}

/// The interpreter with the client on its path; writes nothing beside the sources.
fn command(program: &str) -> Command {
    let mut command = Command::new(program);
    command.env("PYTHONPATH", package().join("src")).env("PYTHONDONTWRITEBYTECODE", "1");
    command
}
