//! A server in a process of its own, which a test can kill as a power cut would.
//!
//! The process is the test's own program, started again to run one test that serves, so it is never older
//! than the test.

use std::io::{BufRead, BufReader, Read};
use std::net::SocketAddr;
use std::process::{Child, Command, Stdio};

use fea_server::ServerConfig;

/// Running server; killed when dropped.
#[derive(Debug)]
pub struct ServerProcess {
    child: Child,
    address: SocketAddr,
}

/// Environment variable that makes the program serve, with the address.
const ADDRESS: &str = "SOFTGRASP_TEST_SERVER";
/// Beginning of the line that the server prints when it listens.
const LISTENING: &str = "test server listens on ";

/// Body of the test that serves; returns at once if the program was not started for that.
///
/// # Panics
/// If the server cannot listen.
pub fn serve_if_asked() {
    let Ok(address) = std::env::var(ADDRESS) else { return };
    let listen = address.parse().expect("an address");
    let config = ServerConfig { listen, threads: 2, ..ServerConfig::default() };
    let server = fea_server::start(config).expect("a free address");
    let said = format!("\n{LISTENING}{}\n", server.address());
    std::io::Write::write_all(&mut std::io::stdout(), said.as_bytes()).expect("a standard output");
    // Ends with the test that started it, however that ends.
    let _ = std::io::stdin().read_to_end(&mut Vec::new());
    std::process::exit(0);
}

impl ServerProcess {
    /// Starts a server at an address (port 0 for a free one); `test` is the whole name of this program's
    /// test that calls [`serve_if_asked`].
    ///
    /// # Panics
    /// If the server does not start.
    pub fn start(test: &str, address: SocketAddr) -> Self {
        let program = std::env::current_exe().expect("this program");
        let mut child = Command::new(program)
            .args(["--exact", test, "--nocapture", "--test-threads=1"])
            .env(ADDRESS, address.to_string())
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn()
            .expect("a process");
        let out = BufReader::new(child.stdout.take().expect("its output"));
        let mut lines = out.lines().map_while(Result::ok);
        let address = lines.find_map(|line| line.strip_prefix(LISTENING)?.parse().ok());
        Self { child, address: address.expect("it listens") }
    }

    /// Address that the server listens on.
    pub fn address(&self) -> SocketAddr {
        self.address
    }

    /// Kills the server, whatever it is doing.
    pub fn kill(self) {
        drop(self);
    }
}

impl Drop for ServerProcess {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}
