//! A session: reads one client's requests and writes the replies, in order.

use std::net::SocketAddr;
use std::sync::Arc;
use std::time::Instant;

use softgrasp_protocol::{
    ConnectionError, Frame, FrameError, HEADER_LEN, Header, Kind, Limits, RejectCode, Rejected,
    Reply,
};
use tokio::io::{AsyncRead, AsyncWrite};

use crate::budget::Reservation;
use crate::client_connection::{ClientConnection, Incoming, Patience, SessionError};
use crate::manners::Manners;
use crate::refusal::Refusal;
use crate::request_handler::RequestHandler;
use crate::room::Room;
use crate::server_handle::{ServerHandle, stopped};

/// Serves one connection until the client goes, sends bytes that are no frames, or the server
/// stops.
pub(crate) async fn serve<S>(stream: S, peer: SocketAddr, server: ServerHandle)
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
        handler: RequestHandler::new(server.clone(), peer),
        server,
        out: Vec::new(),
        refused: 0,
        manners: Manners::default(),
    };
    tracing::info!(%peer, "session begins");
    session.server.resources.metrics.session_began();
    match session.run().await {
        Ok(()) => tracing::info!(%peer, "session ends"),
        Err(error) => {
            session.server.resources.metrics.given_up();
            tracing::warn!(%peer, %error, "session is given up");
        }
    }
}

struct Session<S> {
    connection: ClientConnection<S>,
    handler: RequestHandler,
    server: ServerHandle,
    /// Encoded reply, kept so that its memory is reused.
    out: Vec<u8>,
    /// Requests that were refused.
    refused: usize,
    manners: Manners,
}

/// Refusals of one session that are logged; a client that sends nonsense without end must not fill a
/// disk.
const REFUSALS_LOGGED: usize = 20;

/// Memory for replies that a session keeps while it rests, bytes.
const OUT_KEPT: usize = 1 << 20;

impl<S: AsyncRead + AsyncWrite + Unpin> Session<S> {
    async fn run(&mut self) -> Result<(), SessionError> {
        loop {
            let mut stop = self.server.stop.clone();
            let frame = tokio::select! {
                frame = self.connection.next_frame() => frame,
                () = stopped(&mut stop) => {
                    let text = "the server is stopping; connect again later".to_owned();
                    self.reject(0, RejectCode::ShuttingDown, text).await?;
                    return Ok(());
                }
            };
            match frame {
                Ok(Some(incoming)) => {
                    match incoming {
                        Incoming::Request { frame, received } => {
                            self.handle(frame, received).await?;
                        }
                        Incoming::NoRoom { header, why } => {
                            self.refuse(&Refusal::NoRoom(why), &header).await?;
                        }
                    }
                    self.give_way().await;
                }
                Ok(None) => return Ok(()),
                Err(SessionError::Connection(ConnectionError::Frame(error))) => {
                    self.answer_bad_stream(&error).await;
                    return Err(ConnectionError::Frame(error).into());
                }
                Err(error) => return Err(error),
            }
        }
    }

    /// Last words to a client whose bytes make no sense; whether they arrive is of no matter.
    async fn answer_bad_stream(&mut self, error: &FrameError) {
        let code = match error {
            FrameError::Version { .. } => RejectCode::UnsupportedVersion,
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
        self.write(request_id, &Reply::Rejected(Rejected { code, text, detail: String::new() }))
            .await
    }

    async fn write(&mut self, request_id: u64, reply: &Reply) -> Result<(), SessionError> {
        self.out.clear();
        // Replies are limited by the protocol, not by what this server reads.
        if let Err(error) = reply.encode_into(request_id, &Limits::default(), &mut self.out) {
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

    /// Lets other sessions be served before the next request, and rests for a client without manners.
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
        match self.refused {
            ..REFUSALS_LOGGED => tracing::info!(%refusal, "request refused"),
            REFUSALS_LOGGED => {
                tracing::info!(%refusal, "request refused; further ones of this session are not logged");
            }
            _ => tracing::debug!(%refusal, "request refused"),
        }
    }

    /// One request: decoded, worked on, answered. A bad request is answered and the session lives; a
    /// client that goes is not worked for any longer.
    async fn handle(&mut self, frame: Frame, received: Reservation) -> Result<(), SessionError> {
        let (header, kind) = (frame.header, frame.kind());
        let start = Instant::now();
        let metrics = &self.server.resources.metrics;
        metrics.received(HEADER_LEN + frame.payload.len());
        let replied = tokio::select! {
            biased;
            replied = self.handler.reply_to(frame, received) => replied,
            gone = self.connection.gone() => {
                metrics.abandoned();
                return Err(gone);
            }
        };
        let refused = replied.as_ref().err().map(Refusal::code);
        metrics.answered(kind, start.elapsed(), refused);
        if self.handler.is_authorised() {
            self.connection.make_known(self.handler.limits());
        }
        match replied {
            Ok(Some(reply)) => self.write(header.request_id, &reply).await,
            Ok(None) => Ok(()),
            Err(refusal) => self.refuse(&refusal, &header).await,
        }
    }

    /// Tells a client why its request is refused; hints have no reply.
    async fn refuse(&mut self, refusal: &Refusal, header: &Header) -> Result<(), SessionError> {
        self.log(refusal);
        match Kind::from_number(header.kind) {
            Some(Kind::Prefetch | Kind::Drop) => Ok(()),
            _ => {
                let reply = Reply::Rejected(refusal.to_message());
                self.write(header.request_id, &reply).await
            }
        }
    }
}
