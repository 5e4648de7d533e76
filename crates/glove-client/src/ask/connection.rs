//! Sends requests to a server over one TCP connection, and reads their replies.

use std::fmt;
use std::net::{SocketAddr, TcpStream, ToSocketAddrs};
use std::str::FromStr;
use std::time::{Duration, Instant};

use fea_server::{RunningServer, ServerConfig, StageWatch, StartError};
use softgrasp_core::solve::rates::Rates;
use softgrasp_protocol::blocking::Connection;
use softgrasp_protocol::{
    Answer, Ask, ConnectionError, DecodeError, EncodeError, Frame, FrameError, HEADER_LEN, Hello,
    Limits, Rejected, Reply, Request, TraceContext, Welcome,
};
use softgrasp_telemetry::RequestSpan;

use crate::ask::endpoint::{Endpoint, TrustError};
use crate::ask::server_stream::ServerStream;

/// Finite element server to be used.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum ServerChoice {
    /// Server in this process, still over a loopback socket.
    Embedded,
    /// Server at an address `HOST:PORT`.
    At(String),
}

impl FromStr for ServerChoice {
    type Err = std::convert::Infallible;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        Ok(match text {
            "embedded" => Self::Embedded,
            address => Self::At(address.to_owned()),
        })
    }
}

impl fmt::Display for ServerChoice {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Embedded => f.write_str("embedded"),
            Self::At(address) => f.write_str(address),
        }
    }
}

/// Errors between client and server.
#[derive(Debug, thiserror::Error)]
pub enum LinkError {
    /// The embedded server did not start.
    #[error("the embedded server did not start: {0}")]
    Start(#[from] StartError),
    /// The server's address cannot be resolved.
    #[error("--server {address} is no address: {source}; write HOST:PORT, or embedded")]
    Address {
        /// Address as it was given.
        address: String,
        /// Error of the operating system.
        source: std::io::Error,
    },
    /// No server accepts a connection at the address.
    #[error(
        "no server answers at {address}: {source}; start one with `fea-server --listen {address}`, or use --server embedded"
    )]
    Connect {
        /// Address as it was given.
        address: String,
        /// Error of the operating system.
        source: std::io::Error,
    },
    /// The server requires TLS and this client has no trusted certificate.
    #[error(
        "the server at {address} is encrypted; give its certificate or authority with --tls-ca"
    )]
    WantsEncryption {
        /// Address of the server.
        address: String,
    },
    /// The settings of the encryption cannot be used.
    #[error(transparent)]
    Encryption(#[from] TrustError),
    /// The connection broke, or its bytes were damaged.
    #[error("the connection to the server broke: {0}")]
    Connection(#[from] ConnectionError),
    /// The server closed the connection instead of answering.
    #[error("the server closed the connection instead of answering")]
    Closed,
    /// A request cannot be encoded.
    #[error("the request cannot be sent: {0}")]
    Encode(#[from] EncodeError),
    /// A reply cannot be decoded.
    #[error("the server's reply cannot be decoded: {0}")]
    Decode(#[from] DecodeError),
    /// The server refused the request.
    #[error("the server refused ({}): {}", .0.code, .0.text)]
    Rejected(Rejected),
    /// The reply is of another kind than the request asks for.
    #[error("the server answered a {asked} with a {got}")]
    Unexpected {
        /// Kind of the request.
        asked: String,
        /// Kind of the reply.
        got: String,
    },
}

impl LinkError {
    /// The error in one word, for metrics: the server's code of a refusal, or what broke.
    fn code(&self) -> String {
        match self {
            Self::Rejected(rejected) => rejected.code.to_string(),
            Self::Encode(_) => "Encode".to_owned(),
            Self::Decode(_) => "Decode".to_owned(),
            Self::Unexpected { .. } => "Unexpected".to_owned(),
            _ => "Connection".to_owned(),
        }
    }
}

/// Connection to a server that has received `Hello` and sent `Welcome`.
pub struct ServerConnection {
    /// Address of the server, as it was given.
    address: String,
    connection: Connection<ServerStream>,
    limits: Limits,
    welcome: Welcome,
    request_id: u64,
    out: Vec<u8>,
    /// Length of the newest reply, bytes.
    reply_bytes: usize,
}

/// Address to connect to, and the server behind it if it runs in this process.
pub struct Host {
    endpoint: Endpoint,
    stage: StageWatch,
    // Stops when dropped.
    _embedded: Option<RunningServer>,
}

/// Longest time for a server to accept the connection.
const CONNECT_MAX: Duration = Duration::from_secs(2);
/// Longest time for a server to send `Welcome`.
const WELCOME_MAX: Duration = Duration::from_secs(10);
/// Time of silence after which the system asks the server's machine whether it is there, and between such
/// questions.
const ALIVE_EVERY: Duration = Duration::from_secs(1);
/// Time after which a machine that has confirmed nothing, though it was asked or sent something, is taken
/// to be gone. Shorter pauses of the link are waited for.
const ALIVE_MAX: Duration = Duration::from_secs(5);
/// First byte of a TLS server's response to bytes that are not TLS.
const TLS_ALERT: u8 = 0x15;
/// Time for which a thread looks for a reply without sleeping.
const AWAKE_MAX: Duration = Duration::from_micros(300);

impl Host {
    /// Starts the embedded server, or takes the address as it was given.
    ///
    /// # Errors
    /// [`LinkError::Start`] if the embedded server cannot start.
    pub fn open(choice: &ServerChoice, threads: Option<usize>) -> Result<Self, LinkError> {
        Self::open_within(choice, threads, None)
    }

    /// Opens a host whose embedded server has a memory limit; another server has its own.
    ///
    /// Units: `memory_limit` bytes.
    ///
    /// # Errors
    /// [`LinkError::Start`] if the embedded server cannot start.
    pub fn open_within(
        choice: &ServerChoice,
        threads: Option<usize>,
        memory_limit: Option<u64>,
    ) -> Result<Self, LinkError> {
        match choice {
            ServerChoice::At(address) => Ok(Self::at(address.into())),
            ServerChoice::Embedded => {
                let stage = StageWatch::default();
                let usual = ServerConfig::default();
                let largest = Limits::LARGEST;
                let config = ServerConfig {
                    listen: SocketAddr::from(([127, 0, 0, 1], 0)),
                    // Nobody else asks it: memory alone is its limit.
                    max_nodes: largest.node_count_max,
                    max_elements: largest.tet_count_max,
                    max_frame: largest.payload_len_max,
                    threads: threads.unwrap_or(usual.threads),
                    memory_limit: memory_limit.unwrap_or(usual.memory_limit),
                    stage: stage.clone(),
                    real_time: true,
                    ..usual
                };
                let server = fea_server::start(config)?;
                let endpoint = server.address().to_string().into();
                Ok(Self { endpoint, stage, _embedded: Some(server) })
            }
        }
    }

    /// Host with a server at an address.
    pub fn at(endpoint: Endpoint) -> Self {
        Self { endpoint, stage: StageWatch::default(), _embedded: None }
    }

    /// Name of the stage that the embedded server works on; empty while it has no request, and for a
    /// server at an address.
    pub fn stage(&self) -> impl Fn() -> &'static str + Send + Sync + Clone + 'static {
        let stage = self.stage.clone();
        move || stage.now()
    }

    /// Connects and sends `Hello`.
    ///
    /// # Errors
    /// [`LinkError`] if there is no server, or it refuses.
    pub fn connect(&self) -> Result<ServerConnection, LinkError> {
        ServerConnection::connect(&self.endpoint)
    }

    /// Address of the server, with its token and encryption.
    pub fn endpoint(&self) -> &Endpoint {
        &self.endpoint
    }
}

impl ServerConnection {
    /// Connects to a server and sends `Hello`, with the token if there is one.
    ///
    /// # Errors
    /// [`LinkError`] if there is no server, or it refuses.
    pub fn connect(to: impl Into<Endpoint>) -> Result<Self, LinkError> {
        let endpoint = to.into();
        let stream = ServerStream::new(open_socket(&endpoint.address)?, &endpoint)?;
        stream.set_read_timeout(Some(WELCOME_MAX)).map_err(|e| LinkError::Connection(e.into()))?;
        let mut this = Self {
            address: endpoint.address.clone(),
            connection: Connection::new(stream, Limits::LARGEST),
            limits: Limits::default(),
            welcome: Welcome::default(),
            request_id: 0,
            out: Vec::new(),
            reply_bytes: 0,
        };
        let client = concat!("glove-client ", env!("CARGO_PKG_VERSION"));
        let hello = Hello::new(client, endpoint.token);
        match this.ask(&Request::Hello(hello)) {
            Ok(Reply::Welcome(welcome)) => {
                // What the server would not read is refused here, with the numbers, before it is sent.
                this.limits.payload_len_max = welcome.limits.payload_len_max;
                this.welcome = welcome;
            }
            Ok(other) => return Err(unexpected("Hello", &other)),
            Err(LinkError::Connection(ConnectionError::Frame(FrameError::Magic { found })))
                if found.first() == Some(&TLS_ALERT) =>
            {
                return Err(LinkError::WantsEncryption { address: endpoint.address });
            }
            Err(error) => return Err(error),
        }
        // What a request takes is its own matter.
        this.stream().set_read_timeout(None).map_err(|e| LinkError::Connection(e.into()))?;
        Ok(this)
    }

    /// `Welcome` that the server sent.
    pub fn welcome(&self) -> &Welcome {
        &self.welcome
    }

    /// TCP stream of the connection, to set time limits on it or to shut it down.
    pub fn stream(&self) -> &TcpStream {
        self.connection.stream().socket()
    }

    /// Whether the server has closed the connection, or has sent a message without a request, as it does
    /// before it closes; never waits. To be called while no reply is awaited.
    pub fn is_closed(&mut self) -> bool {
        !self.connection.stream_mut().is_quiet()
    }

    /// Sends a request and waits for its reply; ignores replies to abandoned requests.
    ///
    /// # Errors
    /// [`LinkError`]; after anything but `Rejected` and `Encode` the connection is to be given up.
    pub fn ask(&mut self, request: &Request) -> Result<Reply, LinkError> {
        self.ask_by(request, |this| this.connection.read_frame())
    }

    /// Asks for displacements and waits for the answer.
    ///
    /// # Errors
    /// The same as those of [`Self::ask`].
    pub fn answer(&mut self, ask: Ask) -> Result<Box<Answer>, LinkError> {
        match self.ask(&Request::Ask(Box::new(ask)))? {
            Reply::Answer(answer) => Ok(answer),
            other => Err(unexpected("Ask", &other)),
        }
    }

    /// [`Self::ask`] for requests that are answered within a tick: looks for the reply without sleeping
    /// for a moment, because waking a thread takes as long as a frame question.
    ///
    /// # Errors
    /// The same as those of [`Self::ask`].
    pub fn ask_awake(&mut self, request: &Request) -> Result<Reply, LinkError> {
        self.ask_by(request, Self::read_frame_awake)
    }

    fn ask_by(
        &mut self,
        request: &Request,
        read_frame: impl Fn(&mut Self) -> Result<Option<Frame>, ConnectionError>,
    ) -> Result<Reply, LinkError> {
        let mut span = RequestSpan::client(request.kind().name(), self.request_id + 1);
        span.set("server.address", self.address.as_str());
        self.ask_within(request, span.context(), read_frame).inspect_err(|error| {
            span.fail(error.code(), || error.to_string());
        })
    }

    /// Asks as part of a trace.
    fn ask_within(
        &mut self,
        request: &Request,
        trace: Option<TraceContext>,
        read_frame: impl Fn(&mut Self) -> Result<Option<Frame>, ConnectionError>,
    ) -> Result<Reply, LinkError> {
        let request_id = self.send_within(request, trace)?;
        loop {
            let frame = read_frame(self)?.ok_or(LinkError::Closed)?;
            // Id 0 is the server speaking on its own: turned away, stopping, bad stream.
            if frame.request_id() != request_id && frame.request_id() != 0 {
                continue;
            }
            self.reply_bytes = HEADER_LEN + frame.payload.len();
            return match Reply::decode(&frame, &Limits::LARGEST)? {
                Reply::Rejected(rejected) => Err(LinkError::Rejected(rejected)),
                Reply::Alive => continue,
                reply => Ok(reply),
            };
        }
    }

    /// Lengths of the newest request and of its reply, headers included, bytes.
    pub fn bytes_of_exchange(&self) -> [u64; 2] {
        [self.out.len() as u64, self.reply_bytes as u64]
    }

    /// Next message; sleeps only if it has not come after [`AWAKE_MAX`].
    fn read_frame_awake(&mut self) -> Result<Option<Frame>, ConnectionError> {
        let start = Instant::now();
        self.stream().set_nonblocking(true)?;
        let early = loop {
            match self.connection.read_frame() {
                Err(ConnectionError::ReadTimedOut { .. }) if start.elapsed() < AWAKE_MAX => {
                    // Whoever is to answer may need this processor.
                    std::thread::yield_now();
                }
                Err(ConnectionError::ReadTimedOut { .. }) => break None,
                frame => break Some(frame),
            }
        };
        self.stream().set_nonblocking(false)?;
        early.unwrap_or_else(|| self.connection.read_frame())
    }

    /// Sends a request without waiting; returns the id that its reply will carry.
    ///
    /// # Errors
    /// [`LinkError::Encode`] for a request that is too large, [`LinkError::Connection`] for a broken
    /// connection.
    pub fn send(&mut self, request: &Request) -> Result<u64, LinkError> {
        self.send_within(request, None)
    }

    fn send_within(
        &mut self,
        request: &Request,
        trace: Option<TraceContext>,
    ) -> Result<u64, LinkError> {
        self.request_id += 1;
        self.out.clear();
        request.encode_traced_into(self.request_id, trace, &self.limits, &mut self.out)?;
        self.connection.write_bytes(&self.out)?;
        Ok(self.request_id)
    }
}

/// Rates and memory of this machine, as an embedded server would find them.
pub struct OwnMachine {
    /// Rates of its threads; `None` if they cannot be measured.
    pub rates: Option<Rates>,
    /// Number of threads of an embedded server.
    pub threads: usize,
    /// Free memory, bytes; `None` where the system does not tell.
    pub available_bytes: Option<u64>,
    /// Memory limit of a server by default, bytes.
    pub usual_limit_bytes: u64,
}

impl OwnMachine {
    /// Measures the rates; takes some hundredths of a second.
    pub fn measure() -> Self {
        let ServerConfig { threads, memory_limit, .. } = ServerConfig::default();
        Self {
            rates: fea_server::measure_rates(threads),
            threads,
            available_bytes: fea_server::available_bytes(),
            usual_limit_bytes: memory_limit,
        }
    }
}

/// Error for a reply of another kind than the request asks for.
pub fn unexpected(asked: &str, reply: &Reply) -> LinkError {
    LinkError::Unexpected { asked: asked.to_owned(), got: format!("{:?}", reply.kind()) }
}

fn open_socket(address: &str) -> Result<TcpStream, LinkError> {
    let found = address
        .to_socket_addrs()
        .map_err(|source| LinkError::Address { address: address.to_owned(), source })?;
    let mut last = std::io::Error::other("the name has no address");
    for candidate in found {
        match TcpStream::connect_timeout(&candidate, CONNECT_MAX) {
            Ok(stream) => {
                make_ready(&stream).map_err(|e| LinkError::Connection(e.into()))?;
                return Ok(stream);
            }
            Err(error) => last = error,
        }
    }
    Err(LinkError::Connect { address: address.to_owned(), source: last })
}

/// Sets the socket's options: bytes are sent at once, and a machine that is gone is noticed while a reply
/// is awaited, however long that may take.
fn make_ready(stream: &TcpStream) -> std::io::Result<()> {
    stream.set_nodelay(true)?;
    let socket = socket2::SockRef::from(stream);
    let alive = socket2::TcpKeepalive::new().with_time(ALIVE_EVERY).with_interval(ALIVE_EVERY);
    // Linux counts time, also while something that was sent is not confirmed; others count questions.
    #[cfg(any(windows, target_vendor = "apple"))]
    let alive = alive.with_retries((ALIVE_MAX.as_secs() / ALIVE_EVERY.as_secs()) as u32 - 1);
    socket.set_tcp_keepalive(&alive)?;
    #[cfg(target_os = "linux")]
    socket.set_tcp_user_timeout(Some(ALIVE_MAX))?;
    Ok(())
}
