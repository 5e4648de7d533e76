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
    Limits, Rejected, Reply, Request, Welcome,
};

use crate::ask::endpoint::{Endpoint, TrustError};
use crate::ask::server_stream::ServerStream;

/// Where the finite element server is.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum ServerChoice {
    /// In this process, still over a loopback socket.
    Embedded,
    /// Elsewhere, `HOST:PORT`.
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

/// What can go wrong between client and server.
#[derive(Debug, thiserror::Error)]
pub enum LinkError {
    /// The embedded server did not start.
    #[error("the embedded server did not start: {0}")]
    Start(#[from] StartError),
    /// The address means nothing.
    #[error("--server {address} is no address: {source}; write HOST:PORT, or embedded")]
    Address {
        /// As given.
        address: String,
        /// The system's reason.
        source: std::io::Error,
    },
    /// Nobody answers there.
    #[error(
        "no server answers at {address}: {source}; start one with `fea-server --listen {address}`, or use --server embedded"
    )]
    Connect {
        /// As given.
        address: String,
        /// The system's reason.
        source: std::io::Error,
    },
    /// The server speaks TLS and this client does not.
    #[error(
        "the server at {address} is encrypted; give its certificate or authority with --tls-ca"
    )]
    WantsEncryption {
        /// Address of the server.
        address: String,
    },
    /// Encryption cannot be used.
    #[error(transparent)]
    Encryption(#[from] TrustError),
    /// The connection broke.
    #[error("the connection to the server broke: {0}")]
    Connection(#[from] ConnectionError),
    /// The server closed the connection instead of answering.
    #[error("the server closed the connection instead of answering")]
    Closed,
    /// A request that cannot be put on the wire.
    #[error("the request cannot be sent: {0}")]
    Encode(#[from] EncodeError),
    /// A reply that cannot be read.
    #[error("the server's reply cannot be decoded: {0}")]
    Decode(#[from] DecodeError),
    /// The server refused.
    #[error("the server refused ({}): {}", .0.code, .0.text)]
    Rejected(Rejected),
    /// Another reply than the request asks for.
    #[error("the server answered a {asked} with a {got}")]
    Unexpected {
        /// Kind of the request.
        asked: String,
        /// Kind of the reply.
        got: String,
    },
}

/// A connection that has been introduced.
pub struct ServerConnection {
    connection: Connection<ServerStream>,
    limits: Limits,
    welcome: Welcome,
    request_id: u64,
    out: Vec<u8>,
    /// Bytes of the newest reply.
    reply_bytes: usize,
}

/// An address to connect to, and the server behind it if it is this process's own.
pub struct Host {
    endpoint: Endpoint,
    stage: StageWatch,
    // Stops when dropped.
    _embedded: Option<RunningServer>,
}

/// A server that does not accept within this time is not there.
const CONNECT_MAX: Duration = Duration::from_secs(2);
/// A server that says no welcome within this time is not one.
const WELCOME_MAX: Duration = Duration::from_secs(10);
/// A server's machine that is silent is asked whether it is there after this long, and again so often.
const ALIVE_EVERY: Duration = Duration::from_secs(1);
/// A machine that has confirmed nothing for this long, though it was asked or sent something, is gone.
/// Links that pause for less are waited for.
const ALIVE_MAX: Duration = Duration::from_secs(5);
/// First byte of what a TLS server answers to bytes that are not TLS.
const TLS_ALERT: u8 = 0x15;
/// A reply that has not begun to come by then is slept for.
const AWAKE_MAX: Duration = Duration::from_micros(300);

impl Host {
    /// Starts the embedded server, or takes the address as given.
    ///
    /// # Errors
    /// [`LinkError::Start`].
    pub fn open(choice: &ServerChoice, threads: Option<usize>) -> Result<Self, LinkError> {
        Self::open_within(choice, threads, None)
    }

    /// The same with a memory limit for the embedded server; another server has its own.
    ///
    /// Units: `memory_limit` bytes.
    ///
    /// # Errors
    /// [`LinkError::Start`].
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
                let config = ServerConfig {
                    listen: SocketAddr::from(([127, 0, 0, 1], 0)),
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

    /// A server elsewhere.
    pub fn at(endpoint: Endpoint) -> Self {
        Self { endpoint, stage: StageWatch::default(), _embedded: None }
    }

    /// What the embedded server is doing now, in a word; empty while it does nothing, and for a
    /// server elsewhere.
    pub fn stage(&self) -> impl Fn() -> &'static str + Send + Sync + Clone + 'static {
        let stage = self.stage.clone();
        move || stage.now()
    }

    /// Connects and introduces this client.
    ///
    /// # Errors
    /// [`LinkError`].
    pub fn connect(&self) -> Result<ServerConnection, LinkError> {
        ServerConnection::connect(&self.endpoint)
    }

    /// The server.
    pub fn endpoint(&self) -> &Endpoint {
        &self.endpoint
    }
}

impl ServerConnection {
    /// Connects to a server and says hello, with the token if there is one.
    ///
    /// # Errors
    /// [`LinkError`].
    pub fn connect(to: impl Into<Endpoint>) -> Result<Self, LinkError> {
        let endpoint = to.into();
        let stream = ServerStream::new(open_socket(&endpoint.address)?, &endpoint)?;
        stream.set_read_timeout(Some(WELCOME_MAX)).map_err(|e| LinkError::Connection(e.into()))?;
        let mut this = Self {
            connection: Connection::new(stream, Limits::default()),
            limits: Limits::default(),
            welcome: Welcome::default(),
            request_id: 0,
            out: Vec::new(),
            reply_bytes: 0,
        };
        let client = concat!("glove-client ", env!("CARGO_PKG_VERSION"));
        let hello = Hello::new(client, endpoint.token);
        match this.ask(&Request::Hello(hello)) {
            Ok(Reply::Welcome(welcome)) => this.welcome = welcome,
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

    /// What the server said of itself.
    pub fn welcome(&self) -> &Welcome {
        &self.welcome
    }

    /// The stream, to set time limits on it or to shut it down.
    pub fn stream(&self) -> &TcpStream {
        self.connection.stream().socket()
    }

    /// Whether the server has closed the connection, or has said something that nobody asked for,
    /// as it does before it closes; never waits. To be called while no reply is awaited.
    pub fn is_closed(&mut self) -> bool {
        !self.connection.stream_mut().is_quiet()
    }

    /// Sends a request and waits for its reply; replies to abandoned requests are passed over.
    ///
    /// # Errors
    /// [`LinkError`]; after anything but `Rejected` and `Encode` the connection is to be given up.
    pub fn ask(&mut self, request: &Request) -> Result<Reply, LinkError> {
        self.ask_by(request, |this| this.connection.read_frame())
    }

    /// Asks for displacements and waits for the answer.
    ///
    /// # Errors
    /// As [`Self::ask`].
    pub fn answer(&mut self, ask: Ask) -> Result<Box<Answer>, LinkError> {
        match self.ask(&Request::Ask(Box::new(ask)))? {
            Reply::Answer(answer) => Ok(answer),
            other => Err(unexpected("Ask", &other)),
        }
    }

    /// [`Self::ask`] for what is answered within a tick: looks for the reply without sleeping for a
    /// moment, because waking a thread takes as long as solving a frame.
    ///
    /// # Errors
    /// As [`Self::ask`].
    pub fn ask_awake(&mut self, request: &Request) -> Result<Reply, LinkError> {
        self.ask_by(request, Self::read_frame_awake)
    }

    fn ask_by(
        &mut self,
        request: &Request,
        read_frame: impl Fn(&mut Self) -> Result<Option<Frame>, ConnectionError>,
    ) -> Result<Reply, LinkError> {
        let request_id = self.send(request)?;
        loop {
            let frame = read_frame(self)?.ok_or(LinkError::Closed)?;
            // Id 0 is the server speaking on its own: turned away, stopping, bad stream.
            if frame.request_id() != request_id && frame.request_id() != 0 {
                continue;
            }
            self.reply_bytes = HEADER_LEN + frame.payload.len();
            return match Reply::decode(&frame, &Limits::default())? {
                Reply::Rejected(rejected) => Err(LinkError::Rejected(rejected)),
                Reply::Alive => continue,
                reply => Ok(reply),
            };
        }
    }

    /// Bytes of the newest request and of its reply, headers included.
    pub fn bytes_of_exchange(&self) -> [u64; 2] {
        [self.out.len() as u64, self.reply_bytes as u64]
    }

    /// Next frame; sleeps only for one that has not come after [`AWAKE_MAX`].
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

    /// Sends a request without waiting; the id its reply will carry.
    ///
    /// # Errors
    /// [`LinkError::Encode`], [`LinkError::Connection`].
    pub fn send(&mut self, request: &Request) -> Result<u64, LinkError> {
        self.request_id += 1;
        self.out.clear();
        request.encode_into(self.request_id, &self.limits, &mut self.out)?;
        self.connection.write_bytes(&self.out)?;
        Ok(self.request_id)
    }
}

/// Speed and memory of this machine, as an embedded server would find them.
pub struct OwnMachine {
    /// Speeds of its threads; `None` where they cannot be measured.
    pub rates: Option<Rates>,
    /// Threads of an embedded server.
    pub threads: usize,
    /// Bytes it has to spare; `None` where the system does not tell.
    pub available_bytes: Option<u64>,
    /// Memory limit of a server that was not told another, bytes.
    pub usual_limit_bytes: u64,
}

impl OwnMachine {
    /// Measures the speeds; takes some hundredths of a second.
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

/// The error for a reply of another kind than the request asks for.
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

/// A frame is sent at once, and a machine that is gone without a word is noticed while a reply is awaited,
/// however long that may take.
fn make_ready(stream: &TcpStream) -> std::io::Result<()> {
    stream.set_nodelay(true)?;
    let socket = socket2::SockRef::from(stream);
    let alive = socket2::TcpKeepalive::new().with_time(ALIVE_EVERY).with_interval(ALIVE_EVERY);
    socket.set_tcp_keepalive(&alive)?;
    #[cfg(target_os = "linux")]
    socket.set_tcp_user_timeout(Some(ALIVE_MAX))?;
    Ok(())
}
