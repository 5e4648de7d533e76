//! Answers the requests of one session, one after the other, with what the session holds.

use std::net::SocketAddr;
use std::sync::Arc;
use std::time::Instant;

use softgrasp_protocol::{
    Answer, Frame, FrameRequest, Hello, LargeAnswer, LargeFrame, Limits, ModelHash, ModelReady,
    Reply, Request, UploadModel, Welcome,
};

use crate::answer::{
    PosedFrame, Readiness, answer_large_frame, prefetch, prove, readiness, solve_large, solve_once,
    solve_several, upload,
};
use crate::awaited::Waiting;
use crate::clock::{StageClock, ms_since};
use crate::held_models::HeldModels;
use crate::paths::Paths;
use crate::refusal::Refusal;
use crate::server_handle::{Grasping, ServerHandle};
use crate::workers::Workers;

/// What one session holds, and the server that works for it.
pub(crate) struct RequestHandler {
    server: ServerHandle,
    peer: SocketAddr,
    limits: Limits,
    is_authorised: bool,
    held: HeldModels,
    /// The equilibria that this session follows.
    paths: Paths,
    /// Counts this session from its first frame on.
    grasping: Option<Grasping>,
}

impl RequestHandler {
    /// For a session that has not said anything yet.
    pub fn new(server: ServerHandle, peer: SocketAddr) -> Self {
        let resources = &server.resources;
        Self {
            peer,
            limits: resources.config.limits(),
            is_authorised: !resources.access.wants_token(),
            held: HeldModels::new(Arc::clone(resources)),
            paths: Paths::default(),
            grasping: None,
            server,
        }
    }

    /// What is read from a client that is known.
    pub fn limits(&self) -> Limits {
        self.limits
    }

    /// Whether the client has shown the token, or none is wanted.
    pub fn is_authorised(&self) -> bool {
        self.is_authorised
    }

    /// The reply to one request; `None` to a hint. May be dropped at any await: the work then ends when
    /// its stage does.
    ///
    /// # Errors
    /// [`Refusal`]; the session lives on.
    pub async fn reply_to(&mut self, frame: Frame) -> Result<Option<Reply>, Refusal> {
        let start = Instant::now();
        let request = Request::decode(&frame, &self.limits)?;
        drop(frame);
        let decode_ms = ms_since(start);
        if !self.is_authorised && !matches!(request, Request::Hello(_)) {
            return Err(Refusal::Token);
        }
        let waiting = Waiting::default();
        let (queued, awaited) = (Instant::now(), waiting.awaited());
        let watch = self.server.resources.config.stage.clone();
        let clock = move || StageClock::new(decode_ms, queued, watch, awaited);
        let resources = Arc::clone(&self.server.resources);
        let workers = &self.server.resources.workers;
        Ok(Some(match request {
            Request::Hello(hello) => self.welcome(&hello)?,
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
            Request::SolveSeveral(several) => {
                let work = move || solve_several(&resources, *several, clock());
                Reply::SeveralAnswers(Box::new(workers.run(work).await??))
            }
            Request::UploadModel(model) => Reply::ModelReady(self.upload(model, clock).await?),
            Request::Frame(request) => Reply::Answer(Box::new(self.frame(request, clock).await?)),
            Request::LargeFrame(request) => {
                Reply::LargeAnswer(Box::new(self.large_frame(*request, clock).await?))
            }
        }))
    }

    async fn upload(
        &mut self,
        model: UploadModel,
        clock: impl FnOnce() -> StageClock + Send + 'static,
    ) -> Result<ModelReady, Refusal> {
        let ServerHandle { resources, uploads, .. } = &self.server;
        let workers = &resources.workers;
        let (hash, model) = workers.run(move || (ModelHash::of(&model), model)).await?;
        let turn = uploads.turn(hash).await;
        let (shared, later) = (Arc::clone(resources), Arc::clone(resources));
        let ready = workers.run(move || upload(&shared, hash, model, clock())).await??;
        drop(turn);
        self.held.hold(hash);
        workers.in_background(move || prove(&later, hash));
        Ok(ready)
    }

    /// Answers a frame: at once, on the sockets' thread, where all that it needs is there and few
    /// sessions share the server; else among the frames, unless something has to be made first.
    async fn frame(
        &mut self,
        request: FrameRequest,
        clock: impl FnOnce() -> StageClock + Send + 'static,
    ) -> Result<Answer, Refusal> {
        self.held.hold(request.model);
        let resources = Arc::clone(&self.server.resources);
        let workers = &self.server.resources.workers;
        self.grasping.get_or_insert_with(|| self.server.grasping());
        let request = match self.server.has_few_frames() {
            true => match readiness(&resources, request) {
                Readiness::Ready(kept) => {
                    return Workers::run_here(|| kept.answer(&resources, clock()))?;
                }
                Readiness::NotReady(request) => *request,
            },
            false => request,
        };
        let shared = Arc::clone(&resources);
        let among_frames = move || match PosedFrame::new(&shared, request) {
            Err(refusal) => Ok(Err(refusal)),
            Ok(frame) if frame.is_prepared() => Ok(frame.answer(&shared, clock())),
            Ok(frame) => Err((Box::new(frame), clock)),
        };
        match workers.run_frame(among_frames).await? {
            Ok(answered) => answered,
            Err((frame, clock)) => workers.run(move || frame.answer(&resources, clock())).await?,
        }
    }

    async fn large_frame(
        &mut self,
        request: LargeFrame,
        clock: impl FnOnce() -> StageClock + Send + 'static,
    ) -> Result<LargeAnswer, Refusal> {
        self.held.hold(request.model);
        let seat = self.paths.seat(request.model);
        let resources = Arc::clone(&self.server.resources);
        let workers = &self.server.resources.workers;
        let goes_on = seat.with(|kept| kept.is_some());
        let work = move || answer_large_frame(&resources, &seat, request, clock());
        match goes_on {
            true => workers.run_frame(work).await?,
            false => workers.run(work).await?,
        }
    }

    fn welcome(&mut self, hello: &Hello) -> Result<Reply, Refusal> {
        let resources = &self.server.resources;
        let shown = hello.token.as_deref();
        if let Err(refusal) = resources.access.check(self.peer.ip(), shown, Instant::now()) {
            tracing::warn!(peer = %self.peer, %refusal, "a token was refused");
            return Err(refusal);
        }
        self.is_authorised = true;
        tracing::info!(client = hello.client, "client introduced itself");
        Ok(Reply::Welcome(Welcome {
            server: "fea-server".to_owned(),
            version: env!("CARGO_PKG_VERSION").to_owned(),
            threads: resources.workers.threads() as u32,
            limits: self.limits,
        }))
    }
}
