//! A client's side of one TCP connection: requests out, replies in, one at a time.

use std::fmt;
use std::net::{SocketAddr, TcpStream, ToSocketAddrs};
use std::str::FromStr;
use std::time::Duration;

use fea_server::{RunningServer, ServerConfig, StartError};
use softgrasp_protocol::blocking::Connection;
use softgrasp_protocol::{
    ConnectionError, DecodeError, EncodeError, Hello, Limits, Rejected, Reply, Request, Welcome,
};

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
    connection: Connection<TcpStream>,
    limits: Limits,
    welcome: Welcome,
    request_id: u64,
    out: Vec<u8>,
}

/// An address to connect to, and the server behind it if it is this process's own.
pub struct Host {
    address: String,
    // Stops when dropped.
    _embedded: Option<RunningServer>,
}

/// A server that does not accept within this time is not there.
const CONNECT_MAX: Duration = Duration::from_secs(5);

impl Host {
    /// Starts the embedded server, or takes the address as given.
    ///
    /// # Errors
    /// [`LinkError::Start`].
    pub fn open(choice: &ServerChoice, threads: Option<usize>) -> Result<Self, LinkError> {
        match choice {
            ServerChoice::At(address) => Ok(Self { address: address.clone(), _embedded: None }),
            ServerChoice::Embedded => {
                let usual = ServerConfig::default();
                let threads = threads.unwrap_or(usual.threads);
                let listen = SocketAddr::from(([127, 0, 0, 1], 0));
                let server = fea_server::start(ServerConfig { listen, threads, ..usual })?;
                Ok(Self { address: server.address().to_string(), _embedded: Some(server) })
            }
        }
    }

    /// Connects and introduces this client.
    ///
    /// # Errors
    /// [`LinkError`].
    pub fn connect(&self, token: Option<&str>) -> Result<ServerConnection, LinkError> {
        ServerConnection::connect(&self.address, token)
    }

    /// Address of the server.
    pub fn address(&self) -> &str {
        &self.address
    }
}

impl ServerConnection {
    /// Connects to `HOST:PORT` and says hello.
    ///
    /// # Errors
    /// [`LinkError`].
    pub fn connect(address: &str, token: Option<&str>) -> Result<Self, LinkError> {
        let stream = open_stream(address)?;
        let mut this = Self {
            connection: Connection::new(stream, Limits::default()),
            limits: Limits::default(),
            welcome: Welcome {
                server: String::new(),
                version: String::new(),
                threads: 0,
                limits: Limits::default(),
            },
            request_id: 0,
            out: Vec::new(),
        };
        let hello = Hello {
            client: concat!("glove-client ", env!("CARGO_PKG_VERSION")).to_owned(),
            token: token.map(str::to_owned),
        };
        match this.ask(&Request::Hello(hello))? {
            Reply::Welcome(welcome) => this.welcome = welcome,
            other => return Err(unexpected("Hello", &other)),
        }
        Ok(this)
    }

    /// What the server said of itself.
    pub fn welcome(&self) -> &Welcome {
        &self.welcome
    }

    /// The stream, to set time limits on it or to shut it down.
    pub fn stream(&self) -> &TcpStream {
        self.connection.stream()
    }

    /// Sends a request and waits for its reply; replies to abandoned requests are passed over.
    ///
    /// # Errors
    /// [`LinkError`]; after anything but `Rejected` and `Encode` the connection is to be given up.
    pub fn ask(&mut self, request: &Request) -> Result<Reply, LinkError> {
        let request_id = self.send(request)?;
        loop {
            let frame = self.connection.read_frame()?.ok_or(LinkError::Closed)?;
            // Id 0 is the server speaking on its own: turned away, stopping, bad stream.
            if frame.request_id() != request_id && frame.request_id() != 0 {
                continue;
            }
            return match Reply::decode(&frame, &Limits::default())? {
                Reply::Rejected(rejected) => Err(LinkError::Rejected(rejected)),
                reply => Ok(reply),
            };
        }
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

/// The error for a reply of another kind than the request asks for.
pub fn unexpected(asked: &str, reply: &Reply) -> LinkError {
    LinkError::Unexpected { asked: asked.to_owned(), got: format!("{:?}", reply.kind()) }
}

fn open_stream(address: &str) -> Result<TcpStream, LinkError> {
    let found = address
        .to_socket_addrs()
        .map_err(|source| LinkError::Address { address: address.to_owned(), source })?;
    let mut last = std::io::Error::other("the name has no address");
    for candidate in found {
        match TcpStream::connect_timeout(&candidate, CONNECT_MAX) {
            Ok(stream) => {
                stream.set_nodelay(true).map_err(|e| LinkError::Connection(e.into()))?;
                return Ok(stream);
            }
            Err(error) => last = error,
        }
    }
    Err(LinkError::Connect { address: address.to_owned(), source: last })
}
