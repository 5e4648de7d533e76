//! One connection to a cluster: introduces itself, asks, and waits for the reply as long as the other
//! side shows that it lives.

use std::time::Duration;

use socket2::SockRef;
use softgrasp_protocol::asynchronous::Connection;
use softgrasp_protocol::{
    ConnectionError, DecodeError, Frame, Hello, Limits, RejectCode, Reply, Request,
};
use tokio::io::{AsyncRead, AsyncWrite, AsyncWriteExt};
use tokio::net::TcpStream;
use tokio::time::timeout;

use super::endpoint::ClusterEndpoint;

/// A connection over which requests are asked, one at a time.
pub(super) struct Conversation {
    connection: Connection<Box<dyn Stream>>,
}

/// Why a connection is given up.
#[derive(Debug, thiserror::Error)]
pub(super) enum Lost {
    #[error("it cannot be reached: {0}")]
    Connect(std::io::Error),
    #[error("it did not answer within {} s", .0.as_secs())]
    Silent(Duration),
    #[error("it closed the connection")]
    Closed,
    #[error("it is stopping")]
    Stopping,
    #[error(transparent)]
    Stream(#[from] ConnectionError),
    #[error("its reply cannot be decoded: {0}")]
    Decode(#[from] DecodeError),
    #[error("it replied to a question that was not asked")]
    Foreign,
}

/// Bytes in both directions, plain or encrypted.
trait Stream: AsyncRead + AsyncWrite + Send + Unpin {}
impl<S: AsyncRead + AsyncWrite + Send + Unpin> Stream for S {}

/// Time for connection and handshake, each.
const CONNECT_MAX: Duration = Duration::from_secs(5);
/// Silence after which the other side says that it lives.
const ALIVE_EVERY_MS: u32 = 1000;
/// Silence after which it does not: on a machine with more ranks than processors its sockets wait.
const SILENCE_MAX: Duration = Duration::from_secs(60);
/// Id of the request that introduces this server.
const HELLO: u64 = 1;

impl Conversation {
    /// Connects and introduces this server; a refusal is the cluster's, of the introduction.
    pub async fn open(endpoint: &ClusterEndpoint) -> Result<(Self, Reply), Lost> {
        let within = |wait| timeout(CONNECT_MAX, wait);
        let socket = within(TcpStream::connect(&endpoint.address))
            .await
            .map_err(|_| Lost::Silent(CONNECT_MAX))?
            .map_err(Lost::Connect)?;
        socket.set_nodelay(true).map_err(Lost::Connect)?;
        // Dropped in the middle it tells at once that nobody waits any more.
        let on_the_socket = SockRef::from(&socket);
        on_the_socket.set_linger(Some(Duration::ZERO)).map_err(Lost::Connect)?;
        let stream: Box<dyn Stream> = match &endpoint.tls {
            None => Box::new(socket),
            Some((connector, name)) => {
                let handshake = connector.connect(name.clone(), socket);
                let stream = timeout(CONNECT_MAX, handshake)
                    .await
                    .map_err(|_| Lost::Silent(CONNECT_MAX))?
                    .map_err(Lost::Connect)?;
                Box::new(stream)
            }
        };
        let connection = Connection::new(stream, Limits::LARGEST);
        let mut conversation = Self { connection };
        let hello = Hello {
            alive_every_ms: ALIVE_EVERY_MS,
            ..Hello::new("fea-server", endpoint.token.clone())
        };
        let mut bytes = Vec::new();
        if Request::Hello(hello).encode_into(HELLO, &Limits::default(), &mut bytes).is_err() {
            return Err(Lost::Foreign);
        }
        let reply = conversation.ask(&bytes, HELLO).await?;
        Ok((conversation, reply))
    }

    /// Sends an encoded request and waits for its reply.
    pub async fn ask(&mut self, bytes: &[u8], id: u64) -> Result<Reply, Lost> {
        self.connection.write_bytes(bytes).await?;
        loop {
            let frame = timeout(SILENCE_MAX, self.next_bytes())
                .await
                .map_err(|_| Lost::Silent(SILENCE_MAX))??;
            let Some(frame) = frame else { continue };
            let from = frame.request_id();
            let decoding = move || Reply::decode(&frame, &Limits::LARGEST);
            // A million nodes are 24 MB, and other sessions share this thread.
            let decoded = tokio::task::spawn_blocking(decoding).await;
            let reply = decoded.map_err(|_| Lost::Foreign)??;
            match reply {
                Reply::Alive => {}
                Reply::Rejected(rejected) if rejected.code == RejectCode::ShuttingDown => {
                    return Err(Lost::Stopping);
                }
                // One with id 0 is about the connection.
                Reply::Rejected(_) if from == 0 => return Ok(reply),
                _ if from == id => return Ok(reply),
                _ => return Err(Lost::Foreign),
            }
        }
    }

    /// Ends the connection with a farewell; without it, its end is a cut.
    pub async fn end(mut self) {
        // Whoever does not take it has what was asked for all the same.
        let _ = timeout(CONNECT_MAX, self.connection.stream_mut().shutdown()).await;
    }

    /// The next frame, or `None` after some bytes of one: silence is what lasts.
    async fn next_bytes(&mut self) -> Result<Option<Frame>, Lost> {
        if let Some(frame) = self.connection.frame_received().map_err(ConnectionError::from)? {
            return Ok(Some(frame));
        }
        match self.connection.read_ahead().await? {
            true => Ok(None),
            false => Err(Lost::Closed),
        }
    }
}
