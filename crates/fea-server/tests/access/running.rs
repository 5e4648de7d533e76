//! A running server with its pages and its log, and clients for tests.

use std::io::{BufRead, BufReader, Read, Write};
use std::net::{SocketAddr, TcpStream};
use std::process::{Child, Command, Output, Stdio};
use std::sync::mpsc::{Receiver, channel};
use std::time::Duration;

use softgrasp_protocol::blocking::Connection;
use softgrasp_protocol::{Hello, Limits, RejectCode, Reply, Request};

/// Time after which a test gives up waiting.
pub const LONG: Duration = Duration::from_secs(30);

/// A running server; killed if a test fails.
pub struct Running {
    child: Child,
    pub address: SocketAddr,
    pub pages: SocketAddr,
    log: Receiver<String>,
}

fn command() -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_fea-server"));
    command.env_remove("RUST_LOG").stdin(Stdio::null());
    command
}

/// Runs the program to its end.
pub fn run(arguments: &[&str]) -> Output {
    command().args(arguments).output().unwrap()
}

impl Running {
    /// Starts a server with one thread, free ports and these arguments.
    pub fn start(arguments: &[&str]) -> Self {
        Self::start_on("127.0.0.1:0", arguments)
    }

    /// Starts the same server on the address `listen`.
    pub fn start_on(listen: &str, arguments: &[&str]) -> Self {
        let mut child = command()
            .args(["--listen", listen, "--metrics", "127.0.0.1:0", "--threads", "1"])
            .args(arguments)
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        let stderr = BufReader::new(child.stderr.take().unwrap());
        let (line, log) = channel();
        std::thread::spawn(move || {
            stderr.lines().map_while(Result::ok).try_for_each(|said| line.send(said))
        });
        let mut out = BufReader::new(child.stdout.take().unwrap());
        let mut next = |begins: &str| -> SocketAddr {
            let mut said = String::new();
            out.read_line(&mut said).unwrap();
            let address = said.strip_prefix(begins).unwrap_or_else(|| panic!("{said:?}"));
            address.trim_end().parse().unwrap()
        };
        let (address, pages) = (next("listening on "), next("metrics on "));
        Self { child, address, pages, log }
    }

    /// Next line of the log that contains a text; earlier lines are dropped.
    pub fn log_line(&self, text: &str) -> String {
        loop {
            let line = self.log.recv_timeout(LONG).unwrap_or_else(|_| panic!("no line: {text}"));
            if line.contains(text) {
                return line;
            }
        }
    }

    /// Lines of the log up to the first one that contains a text; waits for more as needed.
    pub fn log_until(&self, text: &str) -> Vec<String> {
        let mut lines = Vec::new();
        while !lines.last().is_some_and(|line: &String| line.contains(text)) {
            lines.push(self.log.recv_timeout(LONG).unwrap_or_else(|_| panic!("no line: {text}")));
        }
        lines
    }

    /// Sends a signal by its name.
    pub fn signal(&self, name: &str) {
        let kill = format!("kill -{name} {}", self.child.id());
        assert!(Command::new("sh").args(["-c", &kill]).status().unwrap().success());
    }

    /// Status code and text of a page.
    pub fn page(&self, path: &str) -> (u16, String) {
        let mut stream = TcpStream::connect(self.pages).unwrap();
        stream.set_read_timeout(Some(LONG)).unwrap();
        stream.write_all(format!("GET {path} HTTP/1.1\r\n\r\n").as_bytes()).unwrap();
        let mut answer = String::new();
        stream.read_to_string(&mut answer).unwrap();
        let (head, text) = answer.split_once("\r\n\r\n").unwrap();
        (head.split(' ').nth(1).unwrap().parse().unwrap(), text.to_owned())
    }

    /// Value of a metric on the page `/metrics`.
    pub fn metric(&self, name: &str) -> f64 {
        let (_, text) = self.page("/metrics");
        let values = text.lines().filter_map(|line| line.rsplit_once(' '));
        let found = values.filter(|(named, _)| *named == name).map(|(_, value)| value).next();
        found.unwrap_or_else(|| panic!("no {name} in {text}")).parse().unwrap()
    }

    /// Waits until a metric has this value.
    pub fn await_metric(&self, name: &str, value: f64) {
        let start = std::time::Instant::now();
        while self.metric(name) != value {
            assert!(start.elapsed() < LONG, "{name} is {}, not {value}", self.metric(name));
            std::thread::yield_now();
        }
    }

    /// Connection that sends nothing.
    pub fn silent(&self) -> TcpStream {
        TcpStream::connect(self.address).unwrap()
    }

    /// A connection that sends messages.
    pub fn client(&self) -> Client {
        Client::over(TcpStream::connect(self.address).unwrap())
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// A connection that sends messages.
pub struct Client {
    connection: Connection<TcpStream>,
    id: u64,
}

impl Client {
    /// Client over a socket that is connected.
    pub fn over(stream: TcpStream) -> Self {
        stream.set_nodelay(true).unwrap();
        stream.set_read_timeout(Some(LONG)).unwrap();
        Self { connection: Connection::new(stream, Limits::default()), id: 0 }
    }

    /// Sends bytes as they are.
    pub fn send(&mut self, bytes: &[u8]) {
        let _ = self.connection.stream().write_all(bytes);
    }

    /// Reply to a request, or another message of the server; `None` at the end of the stream.
    pub fn ask(&mut self, request: &Request) -> Option<Reply> {
        self.id += 1;
        let mut bytes = Vec::new();
        request.encode_into(self.id, &Limits::default(), &mut bytes).unwrap();
        self.send(&bytes);
        self.reply()
    }

    /// Next message of the server.
    pub fn reply(&mut self) -> Option<Reply> {
        let frame = self.connection.read_frame().ok()??;
        Some(Reply::decode(&frame, &Limits::default()).unwrap())
    }

    /// Sends `Hello` with a token or without one; `Err` with the code of a refusal.
    pub fn hello(&mut self, client: &str, token: Option<&str>) -> Result<(), RejectCode> {
        let hello = Hello::new(client, token.map(str::to_owned));
        match self.ask(&Request::Hello(hello)) {
            Some(Reply::Welcome(_)) => Ok(()),
            Some(Reply::Rejected(rejected)) => Err(rejected.code),
            other => panic!("{other:?}"),
        }
    }

    /// Address of the client, as the server sees it.
    pub fn peer(&self) -> SocketAddr {
        self.connection.stream().local_addr().unwrap()
    }

    /// Whether the server answers this client.
    pub fn is_served(&mut self) -> bool {
        self.ask(&Request::Ping { nonce: 7 }) == Some(Reply::Pong { nonce: 7 })
    }
}
