//! Starts the program, and finds the data of the tests.

use std::net::{TcpListener, UdpSocket};
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};

/// The program, without standard input.
pub fn command() -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_glove-client"));
    command.env_remove("RUST_LOG").stdin(Stdio::null());
    command
}

/// Runs the program to its end.
pub fn run<S: AsRef<std::ffi::OsStr>>(arguments: &[S]) -> Output {
    command().args(arguments).output().unwrap()
}

/// Runs the program, which must succeed; its standard output.
pub fn succeed<S: AsRef<std::ffi::OsStr> + std::fmt::Debug>(arguments: &[S]) -> String {
    let output = run(arguments);
    let said = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(0), "{arguments:?}: {said}");
    String::from_utf8(output.stdout).unwrap()
}

/// Runs the program, which must fail with this exit code; its standard error.
pub fn fail<S: AsRef<std::ffi::OsStr> + std::fmt::Debug>(code: i32, arguments: &[S]) -> String {
    let output = run(arguments);
    let said = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(code), "{arguments:?}: {said}");
    assert!(output.stdout.is_empty(), "{arguments:?}");
    said
}

/// A folder for one test's files.
pub struct Folder(tempfile::TempDir);

impl Folder {
    pub fn new() -> Self {
        Self(tempfile::tempdir().unwrap())
    }

    /// Path of a file in the folder, whether or not it exists.
    pub fn path(&self, name: &str) -> String {
        self.0.path().join(name).display().to_string()
    }

    /// Writes a file and returns its path.
    pub fn write(&self, name: &str, text: &str) -> String {
        std::fs::write(self.path(name), text).unwrap();
        self.path(name)
    }

    pub fn read(&self, name: &str) -> String {
        std::fs::read_to_string(self.path(name)).unwrap()
    }
}

/// Address of this machine with a port that was free a moment ago, for datagrams and for streams: a run that takes
/// joints listens for both.
pub fn free_address() -> String {
    loop {
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let address = listener.local_addr().unwrap();
        if UdpSocket::bind(address).is_ok() {
            return address.to_string();
        }
    }
}

/// Folder of data made by others: `shared/` beside the workspace, or where `SOFTGRASP_SHARED` says.
/// `None`, with a line that the test is skipped, if there is none.
pub fn shared(name: &str) -> Option<PathBuf> {
    let found = match std::env::var_os("SOFTGRASP_SHARED") {
        Some(path) => Some(PathBuf::from(path)),
        None => Path::new(env!("CARGO_MANIFEST_DIR"))
            .ancestors()
            .map(|folder| folder.join("shared"))
            .find(|shared| shared.is_dir()),
    };
    let folder = found.map(|shared| shared.join(name)).filter(|folder| folder.is_dir());
    if folder.is_none() {
        println!("skipped: there is no folder shared/{name} (SOFTGRASP_SHARED names shared/)");
    }
    folder
}

/// Rows of a table `node,ux,uy,uz`, by node.
pub fn displacements(text: &str) -> Vec<(usize, [f64; 3])> {
    let mut lines = text.lines();
    assert_eq!(lines.next(), Some("node,ux,uy,uz"));
    let row = |line: &str| {
        let cells: Vec<&str> = line.split(',').collect();
        assert_eq!(cells.len(), 4, "{line}");
        let u = |i: usize| cells[i].parse::<f64>().unwrap();
        (cells[0].parse().unwrap(), [u(1), u(2), u(3)])
    };
    lines.map(row).collect()
}

/// Largest component in magnitude, m.
pub fn largest(rows: &[(usize, [f64; 3])]) -> f64 {
    rows.iter().flat_map(|(_, u)| u).fold(0.0, |most: f64, u| most.max(u.abs()))
}
