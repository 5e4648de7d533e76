//! A session: reads one client's requests and writes the replies, in order.

use std::io::ErrorKind;
use std::net::SocketAddr;
use std::pin::pin;
use std::sync::Arc;
use std::time::Instant;

use softgrasp_protocol::{
    Ask, ConnectionError, Frame, FrameError, HEADER_LEN, Header, Kind, Limits, RejectCode,
    Rejected, Reply,
};
use tokio::io::{AsyncRead, AsyncWrite};

use crate::budget::Reservation;
use crate::client_connection::{ClientConnection, Incoming, Patience, SessionError, Watched};
use crate::config::STRANGER_PAYLOAD_MAX;
use crate::log_line::foreign_sentence;
use crate::manners::Manners;
use crate::refusal::Refusal;
use crate::request_handler::RequestHandler;
use crate::request_trace;
use crate::room::Room;
use crate::server_handle::{ServerHandle, stopped};
use crate::standing::Standing;
use crate::tokens::Bearer;

/// The other side of a connection.
#[derive(Clone, Copy)]
pub(crate) struct Peer {
    pub address: SocketAddr,
    /// Number of the connection, different from all others of this server.
    number: u64,
}

impl Peer {
    /// The other side of a new connection.
    pub fn new(address: SocketAddr, server: &ServerHandle) -> Self {
        Self { address, number: server.next_connection() }
    }

    /// Span of all log lines about the connection: its number and its peer.
    pub fn span(&self) -> tracing::Span {
        // Of the highest level, so that no filter takes it from a line that passes.
        tracing::error_span!("session", id = self.number, peer = %self.address)
    }
}

/// Serves one connection until the client goes, sends damaged bytes, or the server stops; one that has
/// not introduced itself also until its time or its room ends.
pub(crate) async fn serve<S>(stream: S, peer: Peer, server: ServerHandle, standing: Standing)
where
    S: AsyncRead + AsyncWrite + Unpin,
{
    let config = &server.resources.config;
    let wants_token = server.resources.access.wants_token();
    let limits = if wants_token { config.limits_of_strangers() } else { config.limits() };
    let mut session = Session {
        connection: ClientConnection::new(
            stream,
            limits,
            Patience::of(config),
            wants_token,
            Room::new(Arc::clone(&server.resources)),
        ),
        handler: RequestHandler::new(server.clone(), peer.address),
        server,
        peer,
        standing,
        out: Vec::new(),
        refused: 0,
        manners: Manners::default(),
    };
    if !session.standing.is_stranger() {
        session.begin();
    }
    let ended = session.run().await;
    session.end(ended);
}

struct Session<S> {
    connection: ClientConnection<S>,
    handler: RequestHandler,
    server: ServerHandle,
    peer: Peer,
    standing: Standing,
    /// Encoded reply; kept so that its memory is reused.
    out: Vec<u8>,
    /// Number of requests that were refused.
    refused: usize,
    manners: Manners,
}

/// Number of refusals of one session that are logged, so that bad requests cannot fill a disk.
const REFUSALS_LOGGED: usize = 20;

/// Time in ms after which a client may try again, if the server is full or stopping.
const AGAIN_AFTER_MS: u32 = 1000;

/// Bytes of the reply's buffer that an idle session keeps.
const OUT_KEPT: usize = 1 << 20;

impl<S: AsyncRead + AsyncWrite + Unpin> Session<S> {
    async fn run(&mut self) -> Result<(), SessionError> {
        loop {
            let mut stop = self.server.stop.clone();
            let next = tokio::select! {
                next = next(&mut self.connection, &self.standing) => next,
                () = stopped(&mut stop) => {
                    let text = "the server is stopping; connect again later".to_owned();
                    self.reject(0, RejectCode::ShuttingDown, text).await?;
                    return Ok(());
                }
            };
            match next {
                Ok(Incoming::Request { frame, received }) => {
                    self.handle(frame, received).await?;
                    self.give_way().await;
                }
                Ok(Incoming::NoRoom { header, why }) => {
                    self.refuse(&Refusal::NoRoom(why), &header).await?;
                    self.give_way().await;
                }
                Ok(Incoming::Cancelled { header }) => {
                    self.refuse(&Refusal::Cancelled, &header).await?;
                }
                Ok(Incoming::Silent) => say_alive(&mut self.connection).await?,
                // It takes its time to come, which a stranger has not.
                Ok(Incoming::Longer) => self.introduced().await?,
                Ok(Incoming::End) => return Ok(()),
                Err(SessionError::Connection(ConnectionError::Frame(error))) => {
                    self.answer_bad_stream(&error).await;
                    return Err(ConnectionError::Frame(error).into());
                }
                // TLS tells an end without a farewell; between two frames it is one all the same.
                Err(SessionError::Connection(ConnectionError::Io(error)))
                    if error.kind() == ErrorKind::UnexpectedEof
                        && !self.connection.is_inside_frame() =>
                {
                    return Ok(());
                }
                Err(error) => return Err(error),
            }
        }
    }

    /// Gives a client that has introduced itself a session's place, or tells it that there is none.
    async fn introduced(&mut self) -> Result<(), SessionError> {
        if !self.standing.is_stranger() {
            return Ok(());
        }
        let place = self.server.places.take(self.peer.address.ip()).and_then(|place| {
            let of_token = self.handler.bearer().map(Bearer::take_place).transpose()?;
            Ok(Standing::Known { _place: place, _of_token: of_token })
        });
        match place {
            Ok(known) => {
                self.standing = known;
                self.begin();
                Ok(())
            }
            Err(why) => {
                self.reject(0, RejectCode::Busy, why.to_string()).await?;
                Err(why.into())
            }
        }
    }

    fn begin(&self) {
        self.server.resources.metrics.session_began();
        if self.may_log() {
            tracing::info!("session begins");
        }
    }

    fn end(&self, ended: Result<(), SessionError>) {
        let metrics = &self.server.resources.metrics;
        let is_stranger = self.standing.is_stranger();
        match &ended {
            Err(SessionError::NoPlace(_)) => metrics.turned_away(),
            _ if is_stranger => metrics.not_introduced(),
            Err(_) => metrics.given_up(),
            Ok(()) => {}
        }
        if !self.may_log() {
            return;
        }
        let text = ended.as_ref().err().map(foreign_sentence);
        match (ended, text) {
            (Err(SessionError::NoPlace(_)), why) => tracing::warn!(why, "turned away"),
            (_, error) if is_stranger => tracing::info!(error, "connection ends before a session"),
            (Err(_), error) => tracing::warn!(error, "session is given up"),
            (Ok(()), _) => tracing::info!("session ends"),
        }
    }

    /// Whether a line about this client may be logged.
    fn may_log(&self) -> bool {
        self.server.resources.log_lines.has_room(self.peer.address.ip())
    }

    /// Sends a last `Rejected` to a client whose bytes are damaged or foreign; it need not arrive.
    async fn answer_bad_stream(&mut self, error: &FrameError) {
        let code = match error {
            FrameError::Version { found } => {
                let rejected = Rejected::new(RejectCode::UnsupportedVersion, error.to_string());
                let bytes = rejected.encode_for_version(*found);
                let _ = self.connection.write_bytes(&bytes).await;
                return;
            }
            FrameError::PayloadTooLong { .. } => RejectCode::TooLarge,
            _ => RejectCode::BadRequest,
        };
        let _ = self.reject(0, code, error.to_string()).await;
    }

    async fn reject(
        &mut self,
        request_id: u64,
        code: RejectCode,
        text: String,
    ) -> Result<(), SessionError> {
        let retry_after_ms = match code {
            RejectCode::Busy | RejectCode::ShuttingDown => AGAIN_AFTER_MS,
            _ => 0,
        };
        let rejected = Rejected { retry_after_ms, ..Rejected::new(code, text) };
        self.write(request_id, &Reply::Rejected(rejected)).await
    }

    async fn write(&mut self, request_id: u64, reply: &Reply) -> Result<(), SessionError> {
        self.out.clear();
        // Replies are limited by the protocol, not by what this server reads.
        if let Err(error) = reply.encode_into(request_id, &Limits::LARGEST, &mut self.out) {
            tracing::error!(%error, "a reply cannot be encoded");
            let rejected = Reply::Rejected(Refusal::Internal.to_message());
            if rejected.encode_into(request_id, &Limits::default(), &mut self.out).is_err() {
                return Ok(());
            }
        }
        // A reply that its client does not take counts as long as it is held.
        let held = self.server.resources.budget.reservation();
        if self.out.len() > OUT_KEPT {
            held.settle(self.out.capacity() as u64);
            self.server.resources.models.make_room(None);
        }
        let written = self.connection.write_bytes(&self.out).await;
        self.server.resources.metrics.sent(self.out.len());
        if self.out.capacity() > OUT_KEPT {
            self.out = Vec::new();
        }
        written
    }

    /// Lets other sessions run before the next request, and pauses for a client that [`Manners`] slows
    /// down.
    async fn give_way(&mut self) {
        let is_ahead = self.connection.is_inside_frame();
        match self.manners.rest(is_ahead, self.server.is_quiet()) {
            Some(rest) => tokio::time::sleep(rest).await,
            None => tokio::task::yield_now().await,
        }
    }

    fn log(&mut self, refusal: &Refusal) {
        self.refused += 1;
        self.manners.refused(refusal.code());
        if self.refused > REFUSALS_LOGGED {
            return tracing::debug!(refusal = foreign_sentence(refusal), "request refused");
        }
        if !self.may_log() {
            return;
        }
        let (refusal, code) = (foreign_sentence(refusal), refusal.code());
        match self.refused {
            ..REFUSALS_LOGGED => tracing::info!(%code, refusal, "request refused"),
            _ => tracing::info!(
                %code, refusal, "request refused; further ones of this session are not logged"
            ),
        }
    }

    /// Decodes and answers one request. A bad request is refused and the session goes on; work for a
    /// client that has gone ends.
    async fn handle(&mut self, frame: Frame, received: Reservation) -> Result<(), SessionError> {
        let (header, kind) = (frame.header, frame.kind());
        let kept_model = Ask::kept_model(&frame);
        let is_request = kind.is_some_and(|kind| !kind.is_reply());
        let start = Instant::now();
        let named = kept_model.map(|(model, _)| model);
        let mut span = request_trace::begin(&frame, named, self.peer.number);
        // Without a token any request introduces a client, before it is worked for.
        if self.handler.is_authorised() && is_request {
            self.introduced().await?;
        }
        let metrics = &self.server.resources.metrics;
        metrics.received(HEADER_LEN + frame.payload.len());
        let replied = match kept_model {
            Some((model, true)) if self.connection.has_newer(model).await => {
                Err(Refusal::Superseded)
            }
            _ => {
                self.handler.set_trace(span.context());
                work(&mut self.handler, &mut self.connection, frame, received).await.inspect_err(
                    |gone| {
                        metrics.abandoned();
                        span.fail("Abandoned", || foreign_sentence(gone));
                    },
                )?
            }
        };
        request_trace::tell(&mut span, &replied);
        let refused = replied.as_ref().err().map(Refusal::code);
        metrics.answered((kind, kept_model.is_some()), start.elapsed(), refused);
        if self.handler.is_authorised() && is_request {
            self.introduced().await?;
            self.connection.make_known(self.handler.limits());
            self.connection.set_alive(self.handler.alive_every());
        }
        if let Some(bearer) = self.handler.bearer() {
            bearer.count(refused.is_some());
        }
        match replied {
            Ok(Some(reply)) => self.write(header.request_id, &reply).await,
            Ok(None) => Ok(()),
            Err(refusal) => self.refuse(&refusal, &header).await,
        }
    }

    /// Tells a client why its request is refused; nothing for messages that have no reply.
    async fn refuse(&mut self, refusal: &Refusal, header: &Header) -> Result<(), SessionError> {
        // What the client has wanted itself is no news.
        if !matches!(refusal, Refusal::Cancelled | Refusal::Superseded) {
            self.log(refusal);
        }
        match Kind::from_number(header.kind) {
            Some(Kind::Prefetch | Kind::Drop | Kind::Cancel) => Ok(()),
            _ => {
                let reply = Reply::Rejected(refusal.to_message());
                self.write(header.request_id, &reply).await
            }
        }
    }
}

/// Works on a request while the client is watched: the client may cancel it, and work for a client that
/// has gone ends.
///
/// # Errors
/// [`SessionError`]: the client has gone, or does not take its reply.
async fn work<S: AsyncRead + AsyncWrite + Unpin>(
    handler: &mut RequestHandler,
    connection: &mut ClientConnection<S>,
    frame: Frame,
    received: Reservation,
) -> Result<Result<Option<Reply>, Refusal>, SessionError> {
    let request_id = frame.request_id();
    let mut reply = pin!(handler.reply_to(frame, received));
    loop {
        let watched = tokio::select! {
            biased;
            replied = &mut reply => return Ok(replied),
            watched = connection.watch(request_id) => watched,
        };
        match watched {
            Watched::Cancelled => return Ok(Err(Refusal::Cancelled)),
            Watched::Silent => say_alive(connection).await?,
            Watched::Gone(gone) => return Err(gone),
        }
    }
}

/// Sends `Alive` to a client.
async fn say_alive<S: AsyncWrite + Unpin>(
    connection: &mut ClientConnection<S>,
) -> Result<(), SessionError> {
    let mut bytes = Vec::new();
    match Reply::Alive.encode_into(0, &Limits::default(), &mut bytes) {
        Ok(()) => connection.write_bytes(&bytes).await,
        Err(error) => {
            tracing::error!(%error, "a reply cannot be encoded");
            Ok(())
        }
    }
}

/// Next message of a client; of a client not introduced yet, only the header if the frame is long.
async fn next<S: AsyncRead + Unpin>(
    connection: &mut ClientConnection<S>,
    standing: &Standing,
) -> Result<Incoming, SessionError> {
    match standing {
        Standing::Known { .. } => connection.next_frame().await,
        Standing::Stranger(greeting) => tokio::select! {
            next = connection.next_frame_up_to(HEADER_LEN + STRANGER_PAYLOAD_MAX as usize) => next,
            too_late = greeting.ends() => Err(too_late),
        },
    }
}
