//! Answers the requests of one session, one after the other, with the session's models and paths.

use std::net::SocketAddr;
use std::sync::Arc;
use std::time::{Duration, Instant};

use softgrasp_protocol::{
    Answer, Ask, Body, ContactAnswer, ContactFrame, Frame, Hello, LargeAsk, Limits, ModelHash,
    ModelReady, Question, Reply, ReportLevel, Request, Subject, TraceContext, UploadModel,
    VERSIONS, Welcome,
};
use tokio::task::JoinHandle;

use crate::answer::{
    KeptQuestion, Placed, PosedFrame, Readiness, answer_cases, answer_large_frame, is_finite,
    kept_elsewhere, place_kept, place_once, place_upload, prefetch, prove, readiness,
    reserve_fields, solve_large,
};
use crate::awaited::Waiting;
use crate::budget::Reservation;
use crate::clock::{StageClock, ms_since};
use crate::contact_steps::ContactSteps;
use crate::held_models::HeldModels;
use crate::log_line::foreign_name;
use crate::paths::Paths;
use crate::plan::{large_frame_ms, request_ms};
use crate::refusal::Refusal;
use crate::resources::Resources;
use crate::room::{OWN_BYTES, reserve_for_reading};
use crate::server_handle::{Grasping, ServerHandle};
use crate::tokens::Bearer;
use crate::workers::{Asker, Turn, Workers};

/// State of one session, and the server that works for it.
pub(crate) struct RequestHandler {
    server: ServerHandle,
    peer: SocketAddr,
    /// Identity of the session in the fair queue.
    asker: Asker,
    limits: Limits,
    is_authorised: bool,
    /// Bearer of the token that the client has shown, if tokens are required.
    bearer: Option<Bearer>,
    /// Whether the client has sent `Hello`.
    is_introduced: bool,
    held: HeldModels,
    /// The equilibria that this session follows.
    paths: Paths,
    /// What the contact frames of this session keep.
    contact: ContactSteps,
    /// Task that makes a path in the background of this session.
    making: Option<JoinHandle<()>>,
    /// Counts this session among those that ask frame questions, from its first one on.
    grasping: Option<Grasping>,
    /// Silence of the server after which the client wants an `Alive`.
    alive_every: Option<Duration>,
    /// Trace of the request that is answered, for what the engine is asked.
    trace: Option<TraceContext>,
}

/// Names of this server's capabilities, for `Welcome`.
const CAPABILITIES: [&str; 14] = [
    "large",
    "cases",
    "contact",
    "cancel",
    "newest-wins",
    "report-levels",
    "fields",
    "contact-yield",
    "small-system",
    "loads",
    "mid-edge",
    "gradients",
    "rounded-bodies",
    "contact-deadline",
];
/// The capability of a server with an engine beside it.
const CLUSTER: &str = "cluster";
/// Shortest time between two `Alive`.
const ALIVE_MIN: Duration = Duration::from_millis(100);

/// Predicted cost in ms above which a frame question at large deformation does not run on the pool of
/// frames: others would wait for it.
const FRAME_MS_MAX: f64 = 50.0;
/// Predicted time to decode a request, ms for each byte.
const READ_BYTE_MS: f64 = 1e-6;

impl RequestHandler {
    /// Handler of a session that has not sent anything yet.
    pub fn new(server: ServerHandle, peer: SocketAddr) -> Self {
        let resources = &server.resources;
        Self {
            peer,
            asker: Asker::new(),
            limits: resources.config.limits(),
            is_authorised: !resources.access.wants_token(),
            bearer: None,
            is_introduced: false,
            held: HeldModels::new(Arc::clone(resources)),
            paths: Paths::default(),
            contact: ContactSteps::default(),
            making: None,
            grasping: None,
            alive_every: None,
            trace: None,
            server,
        }
    }

    /// Limits on what is read from a client that has introduced itself.
    pub fn limits(&self) -> Limits {
        self.limits
    }

    /// Silence of the server after which the client wants an `Alive`; `None` if it wants none.
    pub fn alive_every(&self) -> Option<Duration> {
        self.alive_every
    }

    /// Whether the client has shown a right token, or none is required.
    pub fn is_authorised(&self) -> bool {
        self.is_authorised
    }

    /// Sets the trace that the next request belongs to.
    pub fn set_trace(&mut self, trace: Option<TraceContext>) {
        self.trace = trace;
    }

    /// Bearer of the token that the client has shown.
    pub fn bearer(&self) -> Option<&Bearer> {
        self.bearer.as_ref()
    }

    /// Reply to one request; `None` for messages that have no reply. May be dropped at any await: the
    /// work then ends with its stage. `received` is the memory that the request was received in.
    ///
    /// # Errors
    /// [`Refusal`]; the session lives on.
    pub async fn reply_to(
        &mut self,
        frame: Frame,
        received: Reservation,
    ) -> Result<Option<Reply>, Refusal> {
        let start = Instant::now();
        let request = self.read(frame, &received).await?;
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
        let turn = self.turn(request_ms(&request, &resources.rates.known()));
        let level = match &request {
            Request::Ask(ask) => ask.report,
            _ => ReportLevel::Full,
        };
        let mut reply = match request {
            Request::Hello(hello) => self.welcome(&hello)?,
            Request::Ping { nonce } => Reply::Pong { nonce },
            Request::HaveModel(hash) => Reply::ModelState { known: self.held.hold(hash) },
            Request::Drop(hash) => {
                self.paths.leave(hash);
                self.contact.forget(hash);
                self.held.drop_model(hash);
                return Ok(None);
            }
            Request::Prefetch(hint) => {
                workers.in_background(move || prefetch(&resources, &hint));
                return Ok(None);
            }
            // What is under way is cancelled by the session; anything else has been answered.
            Request::Cancel { .. } => return Ok(None),
            Request::Ask(ask) => {
                Reply::Answer(Box::new(self.ask(*ask, turn, received, clock).await?))
            }
            Request::UploadModel(model) => {
                Reply::ModelReady(self.upload(turn, model, received, clock).await?)
            }
            Request::ContactFrame(frame) => {
                Reply::ContactAnswer(Box::new(self.contact_frame(*frame, clock).await?))
            }
        };
        if !is_finite(&reply) {
            return Err(Refusal::NotFinite);
        }
        if let Reply::Answer(answer) = &mut reply {
            answer.report = std::mem::take(&mut answer.report).at_level(level);
        }
        Ok(Some(reply))
    }

    /// Answers a question about a mesh that came along or a kept model, linear or large.
    async fn ask(
        &mut self,
        ask: Ask,
        turn: Turn,
        received: Reservation,
        clock: impl FnOnce() -> StageClock + Send + 'static,
    ) -> Result<Answer, Refusal> {
        let _of_fields = reserve_fields(&self.server.resources, &ask)?;
        let Ask { subject, question, large, cases, without_estimate, .. } = ask;
        if large.is_some() && !cases.is_empty() {
            return Err(Refusal::SeveralLarge);
        }
        if !question.quantity.is_empty() && !cases.is_empty() {
            return Err(Refusal::SeveralGradients);
        }
        if large.is_some() {
            self.check_is_here(match &subject {
                Subject::Model(model) => Some(*model),
                Subject::Mesh(_) => None,
            })?;
        }
        match (subject, large) {
            (Subject::Mesh(body), large) => {
                let how = (large, cases, !without_estimate);
                self.once((*body, question), how, (turn, received), clock).await
            }
            (Subject::Model(model), Some(large)) => {
                self.large_frame((model, large, question), clock).await
            }
            (Subject::Model(model), None) => {
                let asked = (model, question, cases);
                self.about_kept(asked, without_estimate, turn, clock).await
            }
        }
    }

    /// Answers a linear question about a kept model, in one case or several.
    async fn about_kept(
        &mut self,
        asked: KeptQuestion,
        without_estimate: bool,
        turn: Turn,
        clock: impl FnOnce() -> StageClock + Send + 'static,
    ) -> Result<Answer, Refusal> {
        let resources = &self.server.resources;
        let (model, question, cases) = asked;
        if let Some(elsewhere) = kept_elsewhere(resources, model, &question)? {
            self.held.hold(model);
            let asked = (model, question, cases);
            let handed = place_kept(resources, elsewhere, asked, without_estimate, clock())?;
            return handed.answer(self.trace).await;
        }
        if cases.is_empty() {
            return self.frame(model, question, clock).await;
        }
        self.held.hold(model);
        let (resources, workers) = (Arc::clone(resources), &resources.workers);
        let work = move || answer_cases(&resources, model, (question, cases), &clock());
        workers.run(turn, work).await?
    }

    /// Refuses large deformation and contact where the engine answers: for everything, or for this model.
    fn check_is_here(&self, model: Option<ModelHash>) -> Result<(), Refusal> {
        let Resources { config, meshes, .. } = &*self.server.resources;
        let Some(engine) = &config.engine else { return Ok(()) };
        match engine.takes_all() || model.is_some_and(|model| meshes.find(model).is_some()) {
            true => Err(Refusal::NotByCluster {
                what: "large deformation and contact",
                instead: "ask a server with memory for the model",
            }),
            false => Ok(()),
        }
    }

    /// Answers a question about a mesh that came along.
    async fn once(
        &self,
        asked: (Body, Question),
        (large, cases, estimate): (Option<LargeAsk>, Vec<Vec<f64>>, bool),
        (turn, received): (Turn, Reservation),
        clock: impl FnOnce() -> StageClock + Send + 'static,
    ) -> Result<Answer, Refusal> {
        let resources = Arc::clone(&self.server.resources);
        let workers = &self.server.resources.workers;
        let work = move || match large {
            Some(large) => solve_large(&resources, asked, large, received, clock())
                .map(|answer| Placed::Here(Box::new(answer))),
            None => place_once(&resources, asked, (cases, estimate), received, clock()),
        };
        match workers.run(turn, work).await?? {
            Placed::Here(answer) => Ok(*answer),
            Placed::Elsewhere(handed) => handed.answer(self.trace).await,
        }
    }

    /// Turn of this session's work in the fair queue, with its predicted cost.
    fn turn(&self, cost_ms: f64) -> Turn {
        Turn { asker: self.asker, cost_ms }
    }

    /// Decodes a request; a large one on a solving thread, since all sessions share the thread of the
    /// sockets.
    async fn read(&self, frame: Frame, received: &Reservation) -> Result<Request, Refusal> {
        let bytes = frame.payload.len();
        if bytes <= OWN_BYTES {
            return Ok(Request::decode(&frame, &self.limits)?);
        }
        reserve_for_reading(received, bytes)?;
        self.server.resources.models.make_room(None);
        let limits = self.limits;
        let turn = self.turn(bytes as f64 * READ_BYTE_MS);
        let workers = &self.server.resources.workers;
        let reading = move || {
            let request = Request::decode(&frame, &limits);
            drop(frame);
            softgrasp_os::give_back_freed_memory();
            request
        };
        let request = workers.run(turn, reading).await??;
        // What was received has gone; what was made of it has about its size.
        received.settle(bytes as u64);
        Ok(request)
    }

    async fn upload(
        &mut self,
        turn: Turn,
        model: UploadModel,
        received: Reservation,
        clock: impl FnOnce() -> StageClock + Send + 'static,
    ) -> Result<ModelReady, Refusal> {
        let ServerHandle { resources, uploads, .. } = &self.server;
        let workers = &resources.workers;
        let named = move || (ModelHash::of(&model), model);
        let (hash, model) = workers.run(turn, named).await?;
        let right = uploads.turn(hash).await;
        let (shared, later) = (Arc::clone(resources), Arc::clone(resources));
        let work = move || place_upload(&shared, hash, model, received, clock());
        let ready = workers.run(turn, work).await??;
        drop(right);
        self.held.hold(hash);
        workers.in_background(move || prove(&later, hash));
        Ok(ready)
    }

    /// Answers a frame question: at once on the sockets' thread if all that it needs is kept and few
    /// sessions are open; else on the pool of frames, unless something has to be made first.
    async fn frame(
        &mut self,
        model: ModelHash,
        question: Question,
        clock: impl FnOnce() -> StageClock + Send + 'static,
    ) -> Result<Answer, Refusal> {
        self.held.hold(model);
        let resources = Arc::clone(&self.server.resources);
        let workers = &self.server.resources.workers;
        self.grasping.get_or_insert_with(|| self.server.grasping());
        let question = match self.server.has_few_frames() {
            true => match readiness(&resources, model, question) {
                Readiness::Ready(kept) => {
                    return Workers::run_here(|| kept.answer(&resources, clock()))?;
                }
                Readiness::NotReady(question) => *question,
            },
            false => question,
        };
        let shared = Arc::clone(&resources);
        let among_frames = move || match PosedFrame::new(&shared, model, question) {
            Err(refusal) => Ok(Err(refusal)),
            Ok(frame) if frame.is_prepared() => Ok(frame.answer(&shared, clock())),
            Ok(frame) => Err((Box::new(frame), clock)),
        };
        match workers.run_frame(among_frames).await? {
            Ok(answered) => answered,
            Err((frame, clock)) => {
                let turn = self.turn(frame.predicted_ms(&resources));
                workers.run(turn, move || frame.answer(&resources, clock())).await?
            }
        }
    }

    async fn large_frame(
        &mut self,
        (model, large, question): (ModelHash, LargeAsk, Question),
        clock: impl FnOnce() -> StageClock + Send + 'static,
    ) -> Result<Answer, Refusal> {
        self.held.hold(model);
        let seat = self.paths.seat(model);
        let resources = Arc::clone(&self.server.resources);
        let workers = &self.server.resources.workers;
        let goes_on = seat.with(|kept| kept.is_some());
        let stored = resources.models.find(model);
        let cost_ms = stored
            .map_or(0.0, |stored| large_frame_ms(&stored.model, goes_on, &resources.rates.known()));
        // One path at a time is made beside the frames of a session.
        let may_make = self.making.as_ref().is_none_or(JoinHandle::is_finished);
        let asked = (model, large, question);
        let work = move || answer_large_frame(&resources, &seat, asked, clock(), may_make);
        let answered = match goes_on && cost_ms <= FRAME_MS_MAX {
            true => workers.run_frame(work).await??,
            false => workers.run(self.turn(cost_ms), work).await??,
        };
        if let Some(making) = answered.making {
            let (workers, turn) = (workers.clone(), self.turn(cost_ms));
            self.making = Some(tokio::spawn(async move {
                // What ends abnormally is in the log; the next frame begins anew.
                let _ = workers.run(turn, making).await;
            }));
        }
        Ok(answered.answer)
    }

    async fn contact_frame(
        &mut self,
        frame: ContactFrame,
        clock: impl FnOnce() -> StageClock + Send + 'static,
    ) -> Result<ContactAnswer, Refusal> {
        self.check_is_here(Some(frame.model))?;
        self.held.hold(frame.model);
        self.grasping.get_or_insert_with(|| self.server.grasping());
        let resources = &self.server.resources;
        self.contact.answer(resources, self.asker, frame, clock).await
    }

    /// Logs the client's first introduction; later ones are not logged.
    fn log_introduction(&mut self, client: &str) {
        let is_first = !std::mem::replace(&mut self.is_introduced, true);
        if is_first && self.server.resources.log_lines.has_room(self.peer.ip()) {
            let token = self.bearer.as_ref().and_then(|bearer| bearer.name.as_deref());
            tracing::info!(client = foreign_name(client), token, "client introduced itself");
        }
    }

    fn welcome(&mut self, hello: &Hello) -> Result<Reply, Refusal> {
        self.check_token(hello)?;
        let wire = VERSIONS.common(hello.versions).ok_or(Refusal::NoCommonVersion {
            lowest: hello.versions.lowest,
            highest: hello.versions.highest,
        })?;
        self.log_introduction(&hello.client);
        self.alive_every = match hello.alive_every_ms {
            0 => None,
            ms => Some(Duration::from_millis(u64::from(ms)).max(ALIVE_MIN)),
        };
        let idle = self.server.resources.config.idle_limit;
        Ok(Reply::Welcome(Welcome {
            server: "fea-server".to_owned(),
            version: env!("CARGO_PKG_VERSION").to_owned(),
            threads: self.server.resources.workers.threads() as u32,
            limits: self.limits,
            wire,
            capabilities: self.capabilities(),
            idle_ms: idle.map_or(0, |limit| limit.as_millis() as u64),
        }))
    }

    fn capabilities(&self) -> Vec<String> {
        let of_engine = self.server.resources.config.engine.as_ref().map(|_| CLUSTER);
        CAPABILITIES.into_iter().chain(of_engine).map(str::to_owned).collect()
    }

    fn check_token(&mut self, hello: &Hello) -> Result<(), Refusal> {
        let resources = &self.server.resources;
        let shown = hello.token.as_deref();
        match resources.access.check(self.peer.ip(), shown, Instant::now()) {
            Ok(bearer) => {
                // A session stays that of the token it began with.
                self.bearer = self.bearer.take().or(bearer);
                self.is_authorised = true;
                Ok(())
            }
            Err(refusal) => {
                if resources.log_lines.has_room(self.peer.ip()) {
                    tracing::warn!(%refusal, "a token was refused");
                }
                Err(refusal)
            }
        }
    }
}
