//! A session: reads one client's requests and writes the replies, in order.

use std::net::SocketAddr;
use std::sync::Arc;
use std::time::Instant;

use softgrasp_protocol::{
    Answer, ConnectionError, Frame, FrameError, FrameRequest, Hello, Kind, Limits, ModelHash,
    RejectCode, Rejected, Reply, Request, Welcome,
};
use tokio::io::{AsyncRead, AsyncWrite};
use tokio::sync::watch;

use crate::answer::{
    Readiness, answer_frame, answer_large_frame, prefetch, prove, readiness, solve_large,
    solve_once, upload,
};
use crate::client_connection::{ClientConnection, Patience, SessionError};
use crate::clock::{StageClock, ms_since};
use crate::held_models::HeldModels;
use crate::paths::{Paths, Seat};
use crate::places::Places;
use crate::refusal::Refusal;
use crate::resources::Resources;
use crate::uploads::Uploads;
use crate::workers::Workers;

/// What a session needs of its server.
#[derive(Clone)]
pub(crate) struct ServerHandle {
    pub resources: Arc<Resources>,
    pub uploads: Uploads,
    /// Places for sessions.
    pub places: Places,
    pub stop: watch::Receiver<bool>,
}

impl ServerHandle {
    /// Whether so few sessions are there that one may use the sockets' thread for a moment.
    fn is_quiet(&self) -> bool {
        self.places.taken() <= QUIET_MAX
    }
}

/// With more sessions, frames are shared out among the solving threads however small they are.
const QUIET_MAX: usize = 4;

/// Serves one connection until the client goes, sends bytes that are no frames, or the server
/// stops.
pub(crate) async fn serve<S>(stream: S, peer: SocketAddr, mut server: ServerHandle)
where
    S: AsyncRead + AsyncWrite + Unpin,
{
    let config = &server.resources.config;
    let wants_token = server.resources.access.wants_token();
    let limits = if wants_token { config.limits_of_strangers() } else { config.limits() };
    let mut session = Session {
        connection: ClientConnection::new(stream, limits, Patience::of(config), wants_token),
        peer,
        limits: config.limits(),
        authorised: !wants_token,
        held: HeldModels::new(Arc::clone(&server.resources)),
        paths: Paths::default(),
        out: Vec::new(),
    };
    tracing::info!(%peer, "session begins");
    match session.run(&mut server).await {
        Ok(()) => tracing::info!(%peer, "session ends"),
        Err(error) => tracing::warn!(%peer, %error, "session is given up"),
    }
}

/// Answers a frame: at once, on the sockets' thread, where all that it needs is there and few sessions
/// share the server.
async fn answered_frame(
    server: &ServerHandle,
    request: FrameRequest,
    clock: impl FnOnce() -> StageClock + Send + 'static,
) -> Result<Answer, Refusal> {
    let resources = Arc::clone(&server.resources);
    let workers = &server.resources.workers;
    let request = match server.is_quiet() {
        true => match readiness(&resources, request) {
            Readiness::Ready(kept) => {
                return Workers::run_here(|| kept.answer(&resources, clock()))?;
            }
            Readiness::NotReady(request) => *request,
        },
        false => request,
    };
    workers.run(move || answer_frame(&resources, request, clock())).await?
}

/// Ends when the server is to stop, or when nobody is left who could say so.
pub(crate) async fn stopped(stop: &mut watch::Receiver<bool>) {
    let _ = stop.wait_for(|stop| *stop).await;
}

struct Session<S> {
    connection: ClientConnection<S>,
    peer: SocketAddr,
    limits: Limits,
    authorised: bool,
    held: HeldModels,
    /// The equilibria that this session follows.
    paths: Paths,
    /// Encoded reply, kept so that its memory is reused.
    out: Vec<u8>,
}

impl<S: AsyncRead + AsyncWrite + Unpin> Session<S> {
    async fn run(&mut self, server: &mut ServerHandle) -> Result<(), SessionError> {
        loop {
            let mut stop = server.stop.clone();
            let frame = tokio::select! {
                frame = self.connection.next_frame() => frame,
                () = stopped(&mut stop) => {
                    let text = "the server is stopping; connect again later".to_owned();
                    self.reject(0, RejectCode::ShuttingDown, text).await?;
                    return Ok(());
                }
            };
            match frame {
                Ok(Some(frame)) => self.handle(frame, server).await?,
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
        self.connection.write_bytes(&self.out).await
    }

    /// One request: decoded, worked on, answered. A bad request is answered and the session lives.
    async fn handle(&mut self, frame: Frame, server: &ServerHandle) -> Result<(), SessionError> {
        let request_id = frame.request_id();
        let has_reply = !matches!(frame.kind(), Some(Kind::Prefetch | Kind::Drop));
        match self.reply_to(frame, server).await {
            Ok(Some(reply)) => self.write(request_id, &reply).await,
            Ok(None) => Ok(()),
            Err(refusal) => {
                tracing::info!(%refusal, "request refused");
                match has_reply {
                    true => self.write(request_id, &Reply::Rejected(refusal.to_message())).await,
                    false => Ok(()),
                }
            }
        }
    }

    async fn reply_to(
        &mut self,
        frame: Frame,
        server: &ServerHandle,
    ) -> Result<Option<Reply>, Refusal> {
        let start = Instant::now();
        let request = Request::decode(&frame, &self.limits)?;
        drop(frame);
        let decode_ms = ms_since(start);
        if !self.authorised && !matches!(request, Request::Hello(_)) {
            return Err(Refusal::Token);
        }
        if !matches!(request, Request::Hello(_)) {
            self.connection.make_known(self.limits);
        }
        let resources = Arc::clone(&server.resources);
        let queued = Instant::now();
        let watch = resources.config.stage.clone();
        let clock = move || StageClock::new(decode_ms, queued, watch);
        let workers = &server.resources.workers;
        Ok(Some(match request {
            Request::Hello(hello) => self.welcome(&hello, server)?,
            Request::Ping { nonce } => Reply::Pong { nonce },
            Request::HaveModel(hash) => Reply::ModelState { known: self.held.hold(hash) },
            Request::Drop(hash) => {
                self.paths.leave(hash);
                self.held.drop_model(hash);
                return Ok(None);
            }
            Request::Prefetch(hint) => {
                workers.in_background(move || prefetch(&resources, &hint));
                return Ok(None);
            }
            Request::SolveOnce(once) => {
                let work = move || solve_once(&resources, *once, clock());
                Reply::Answer(Box::new(workers.run(work).await??))
            }
            Request::SolveLarge(once) => {
                let work = move || solve_large(&resources, *once, clock());
                Reply::LargeAnswer(Box::new(workers.run(work).await??))
            }
            Request::LargeFrame(request) => {
                let seat = self.seat(request.model);
                let work = move || answer_large_frame(&resources, &seat, *request, clock());
                Reply::LargeAnswer(Box::new(workers.run(work).await??))
            }
            Request::UploadModel(model) => {
                let hashed = workers.run(move || (ModelHash::of(&model), model)).await?;
                let (hash, model) = hashed;
                let turn = server.uploads.turn(hash).await;
                let later = Arc::clone(&resources);
                let work = move || upload(&resources, hash, model, clock());
                let ready = workers.run(work).await??;
                drop(turn);
                self.held.hold(hash);
                workers.in_background(move || prove(&later, hash));
                Reply::ModelReady(ready)
            }
            Request::Frame(request) => {
                self.held.hold(request.model);
                Reply::Answer(Box::new(answered_frame(server, request, clock).await?))
            }
        }))
    }

    /// The path of a model that this session holds from now on.
    fn seat(&mut self, model: ModelHash) -> Seat {
        self.held.hold(model);
        self.paths.seat(model)
    }

    fn welcome(&mut self, hello: &Hello, server: &ServerHandle) -> Result<Reply, Refusal> {
        let shown = hello.token.as_deref();
        if let Err(refusal) = server.resources.access.check(self.peer.ip(), shown, Instant::now()) {
            tracing::warn!(peer = %self.peer, %refusal, "a token was refused");
            return Err(refusal);
        }
        self.authorised = true;
        self.connection.make_known(self.limits);
        tracing::info!(client = hello.client, "client introduced itself");
        Ok(Reply::Welcome(Welcome {
            server: "fea-server".to_owned(),
            version: env!("CARGO_PKG_VERSION").to_owned(),
            threads: server.resources.workers.threads() as u32,
            limits: self.limits,
        }))
    }
}
