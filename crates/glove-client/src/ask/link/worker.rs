//! Thread of the link: connects, sends the model, asks, and remembers refusals.

use std::sync::Arc;
use std::time::{Duration, Instant};

use softgrasp_protocol::{
    Answer, Ask, ContactAnswer, ContactFrame, LargeAsk, ModelHash, PathChoice, Prefetch,
    RejectCode, Rejected, Reply, Request, UploadModel,
};

use super::event::{LinkEvent, Reached, ReachedStep, RequestEnd};
use super::outbox::{Activity, LinkState, Shared, TickQuestion, TickRequest};
use crate::ask::connection::{LinkError, ServerConnection, unexpected};
use crate::ask::endpoint::Endpoint;
use crate::ask::model_upload::ModelUpload;
use crate::ask::prefetch::Hint;
use crate::ask::unanswered::Unanswered;
use crate::pace::tick_budget::{Priority, TickBudget};

/// First pause between attempts to find a lost server; it doubles up to the longest.
const PAUSE_MIN: Duration = Duration::from_millis(50);
/// Longest pause if there was no server: one that comes back is found soon.
const PAUSE_MAX: Duration = Duration::from_millis(200);
/// Longest pause if a server refuses the connection for now.
const UNWANTED_PAUSE_MAX: Duration = Duration::from_secs(2);
/// Longest silence of a server whose machine answers: while it prepares a model or the first answer of a
/// grip, and within a grip. After it the server is taken to be lost.
const PREPARING_MAX: Duration = Duration::from_secs(1800);
const SILENCE_MAX: Duration = Duration::from_secs(20);
/// Largest number of characters of the line that tells of a refusal.
const REFUSAL_LEN_MAX: usize = 120;

/// Thread of the link, and its knowledge of the server.
pub struct Worker {
    shared: Arc<Shared>,
    endpoint: Endpoint,
    budget: TickBudget,
    session: Option<Session>,
}

/// One connection, and what the server keeps or refuses on it.
struct Session {
    connection: ServerConnection,
    /// Model that the server keeps.
    model: Option<ModelHash>,
    refusal: Option<Refusal>,
    /// Grip whose first answer has come.
    answered_grip: Option<u64>,
    /// Grip for which a missing equilibrium has been told.
    told_grip: Option<u64>,
}

/// Model or request that the server has refused, so that it is not asked again.
struct Refusal {
    model: ModelHash,
    /// Grip whose requests the server refuses; `None` if it refuses the model itself.
    grip: Option<u64>,
}

/// Next task of the thread.
struct Job {
    model: ModelUpload,
    request: Option<TickRequest>,
    hint: Hint,
}

impl Worker {
    /// A worker that has not connected yet.
    pub fn new(shared: Arc<Shared>, endpoint: Endpoint, priority: Priority) -> Self {
        Self { shared, endpoint, budget: TickBudget::new(priority), session: None }
    }

    /// Runs until the link is to end.
    pub fn work(mut self) {
        let mut pause = Duration::ZERO;
        while let Some(mut job) = self.next_job() {
            let outcome = self.do_job(&mut job);
            let shared = Arc::clone(&self.shared);
            let mut state = shared.lock();
            state.busy = false;
            state.activity = Activity::Waiting;
            match outcome {
                Ok(()) => pause = Duration::ZERO,
                Err(error) => {
                    self.session = None;
                    state.activity = Activity::Connecting;
                    lose(&mut state, &error, job);
                    shared.notify();
                    // Rests, but ends when the link is to end.
                    state = shared.wait_while(state, pause, |state| !state.stop);
                    pause = (2 * pause).clamp(PAUSE_MIN, pause_max(&error));
                }
            }
            drop(state);
            shared.notify();
        }
    }

    /// Waits for something to do; `None` when the link is to end.
    fn next_job(&self) -> Option<Job> {
        let mut state = self.shared.lock();
        loop {
            if state.stop {
                return None;
            }
            let outbox = &mut state.outbox;
            if let Some(model) = outbox.model.clone()
                && (outbox.model_is_new || outbox.request.is_some() || !outbox.hint.is_empty())
            {
                outbox.model_is_new = false;
                let (request, hint) = (outbox.request.take(), std::mem::take(&mut outbox.hint));
                state.busy = true;
                return Some(Job { model, request, hint });
            }
            state = self.shared.wait(state);
        }
    }

    /// Does a job; ends its request unless the server was lost.
    fn do_job(&mut self, job: &mut Job) -> Result<(), LinkError> {
        let Self { shared, endpoint, budget, session } = self;
        let session = match session {
            Some(session) => session,
            None => {
                budget.step_back();
                session.insert(Session::open(endpoint, shared)?)
            }
        };
        let hash = job.model.hash;
        if session.refuses(hash, job.request.as_ref()) {
            // A server that was started anew may think otherwise.
            if session.connection.is_closed() {
                return Err(LinkError::Closed);
            }
            end(shared, job.request.take(), Err(Unanswered::Refused));
            return Ok(());
        }
        if session.model != Some(hash) {
            budget.step_back();
            match session.offer_model(&job.model, shared) {
                Err(LinkError::Rejected(rejected)) if stays(rejected.code) => {
                    session.refuse(
                        shared,
                        "the model",
                        &rejected,
                        Refusal { model: hash, grip: None },
                    );
                    end(shared, job.request.take(), Err(Unanswered::Refused));
                    return Ok(());
                }
                other => other?,
            }
        }
        if !job.hint.is_empty() {
            let Hint { nodes, masks } = std::mem::take(&mut job.hint);
            let hint = Prefetch { model: hash, nodes, masks };
            session.connection.send(&Request::Prefetch(hint))?;
        }
        let Some(request) = &job.request else { return Ok(()) };
        let reached = match session.answer(&job.model, request, shared, budget) {
            // The shape stays where it was, and the next tick may ask for less.
            Err(LinkError::Rejected(rejected)) if is_passing(request, &rejected) => {
                session.tell_no_equilibrium(shared, request.grip, &rejected);
                Err(Unanswered::NoEquilibrium)
            }
            Err(LinkError::Rejected(rejected)) if stays(rejected.code) => {
                let refusal = Refusal { model: hash, grip: Some(request.grip) };
                session.refuse(shared, "the request", &rejected, refusal);
                Err(Unanswered::Refused)
            }
            other => Ok(Box::new(other?)),
        };
        end(shared, job.request.take(), reached);
        Ok(())
    }
}

impl Session {
    fn open(endpoint: &Endpoint, shared: &Shared) -> Result<Self, LinkError> {
        shared.lock().activity = Activity::Connecting;
        let connection = ServerConnection::connect(endpoint)?;
        let welcome = connection.welcome();
        let server =
            format!("{} {} ({} threads)", welcome.server, welcome.version, welcome.threads);
        // Told at once: a model may take long to prepare.
        let mut state = shared.lock();
        (state.connected, state.lost, state.model_refused) = (true, false, false);
        state.tell(LinkEvent::Connected { server });
        Ok(Self { connection, model: None, refusal: None, answered_grip: None, told_grip: None })
    }

    /// Whether the server has refused this before, and nothing has changed since.
    fn refuses(&self, model: ModelHash, request: Option<&TickRequest>) -> bool {
        let Some(refusal) = self.refusal.as_ref().filter(|r| r.model == model) else {
            return false;
        };
        match (refusal.grip, request) {
            (None, _) => true,
            (Some(grip), Some(request)) => grip == request.grip,
            (Some(_), None) => false,
        }
    }

    /// Remembers a refusal and tells of it in one line; the whole text goes to the log.
    fn refuse(&mut self, shared: &Shared, what: &str, rejected: &Rejected, refusal: Refusal) {
        tracing::info!(code = %rejected.code, text = rejected.text, "the server refused {what}");
        let text = format!("{what} ({}): {}", rejected.code, shortened(&rejected.text));
        let mut state = shared.lock();
        state.tell(LinkEvent::Refused { text });
        let newest = state.outbox.model.as_ref().is_some_and(|m| m.hash == refusal.model);
        state.model_refused |= newest && refusal.grip.is_none();
        drop(state);
        self.refusal = Some(refusal);
    }

    /// Tells, once in a grip, that no equilibrium was found, and why.
    fn tell_no_equilibrium(&mut self, shared: &Shared, grip: u64, rejected: &Rejected) {
        tracing::info!(text = rejected.text, "no equilibrium");
        if self.told_grip.replace(grip) != Some(grip) {
            let text = format!("a shape ({}): {}", rejected.code, shortened(&rejected.text));
            shared.lock().tell(LinkEvent::Refused { text });
        }
    }

    /// Sends the model unless the server keeps it.
    fn offer_model(&mut self, model: &ModelUpload, shared: &Shared) -> Result<(), LinkError> {
        shared.lock().activity = Activity::Uploading;
        self.wait_at_most(PREPARING_MAX)?;
        match self.connection.ask(&Request::HaveModel(model.hash))? {
            Reply::ModelState { known: true } => {}
            Reply::ModelState { known: false } => {
                let upload = UploadModel::clone(&model.message);
                match self.connection.ask(&Request::UploadModel(upload))? {
                    Reply::ModelReady(ready) => shared.lock().tell(LinkEvent::ModelReady(ready)),
                    other => return Err(unexpected("UploadModel", &other)),
                }
            }
            other => return Err(unexpected("HaveModel", &other)),
        }
        self.model = Some(model.hash);
        Ok(())
    }

    /// Asks for the displacements of a tick.
    fn answer(
        &mut self,
        model: &ModelUpload,
        request: &TickRequest,
        shared: &Shared,
        budget: &mut TickBudget,
    ) -> Result<Reached, LinkError> {
        let first = self.answered_grip != Some(request.grip);
        let activity = if first { Activity::FirstAnswer } else { Activity::LaterAnswer };
        shared.lock().activity = activity;
        self.wait_at_most(if first { PREPARING_MAX } else { SILENCE_MAX })?;
        let reached = match self.ask(model, request, budget) {
            // The server made room or was started anew: give it the model again.
            Err(LinkError::Rejected(r)) if r.code == RejectCode::UnknownModel => {
                budget.step_back();
                self.offer_model(model, shared)?;
                shared.lock().activity = activity;
                self.ask(model, request, budget)?
            }
            other => other?,
        };
        self.answered_grip = Some(request.grip);
        Ok(reached)
    }

    fn wait_at_most(&self, silence: Duration) -> Result<(), LinkError> {
        let timed = self.connection.stream().set_read_timeout(Some(silence));
        timed.map_err(|error| LinkError::Connection(error.into()))
    }

    fn ask(
        &mut self,
        model: &ModelUpload,
        request: &TickRequest,
        budget: &mut TickBudget,
    ) -> Result<Reached, LinkError> {
        budget.begin();
        let start = Instant::now();
        let asked = self.message_of(model, request);
        let from_rest = match &asked {
            Request::Ask(ask) => ask.large.map(|large| large.path),
            Request::ContactFrame(frame) => frame.ask.deformation.map(|_| frame.ask.path),
            _ => None,
        } == Some(PathChoice::FromRest);
        let reply = self.connection.ask_awake(&asked);
        let round_trip = start.elapsed();
        let bytes = self.connection.bytes_of_exchange();
        let reached = |answer: Answer, step: Option<ReachedStep>| Reached {
            rest_shape: model.rest_shape,
            from_rest,
            round_trip,
            bytes,
            nodes: answer.nodes,
            displacement: answer.displacements.into_f64(),
            reactions: answer.reactions,
            mask_forces: answer.mask_forces,
            report: Box::new(answer.report),
            large: answer.large,
            step,
        };
        let reached = match reply? {
            Reply::Answer(answer) => reached(*answer, None),
            Reply::ContactAnswer(answered) => {
                let ContactAnswer { answer, contact, state, points: _, loads, small_system } =
                    *answered;
                reached(answer, Some(ReachedStep { contact, state, loads, small_system }))
            }
            other => return Err(unexpected("Ask", &other)),
        };
        budget.end();
        Ok(reached)
    }

    /// Message of a tick's request.
    fn message_of(&self, model: &ModelUpload, request: &TickRequest) -> Request {
        match &request.asked {
            TickQuestion::Held { question, large } => {
                let is_first = self.answered_grip != Some(request.grip);
                let from_rest = |large: LargeAsk| LargeAsk { path: PathChoice::FromRest, ..large };
                let large = if is_first { large.map(from_rest) } else { *large };
                let ask = Ask { large, ..Ask::new(model.hash, (**question).clone()) };
                Request::Ask(Box::new(ask))
            }
            TickQuestion::Step(frame) => {
                let mut frame = ContactFrame { model: model.hash, ..(**frame).clone() };
                // A new session knows nothing of the step before.
                if self.answered_grip.is_none() {
                    frame.ask.path = PathChoice::FromRest;
                }
                Request::ContactFrame(Box::new(frame))
            }
        }
    }
}

/// Books the loss of the server; the request is tried again unless a newer one has come.
fn lose(state: &mut LinkState, error: &LinkError, job: Job) {
    // Said once; that it is still not there is no news.
    if !state.lost {
        state.tell(LinkEvent::Lost { text: error.to_string() });
    }
    tracing::debug!(%error, "the server is not there");
    (state.connected, state.lost) = (false, true);
    state.losses += 1;
    state.outbox.model_is_new |= job.request.is_none();
    match job.request {
        Some(request) if state.outbox.request.is_some() => {
            state.end(RequestEnd { tick: request.tick, reached: Err(Unanswered::ServerLost) });
        }
        request => state.outbox.request = state.outbox.request.take().or(request),
    }
}

fn end(shared: &Shared, request: Option<TickRequest>, reached: Result<Box<Reached>, Unanswered>) {
    if let Some(TickRequest { tick, .. }) = request {
        shared.lock().end(RequestEnd { tick, reached });
    }
}

/// Whether the refusal is due to this tick's displacements and not to the grip.
fn is_passing(request: &TickRequest, rejected: &Rejected) -> bool {
    matches!(&request.asked, TickQuestion::Held { large: Some(_), .. })
        && rejected.code == RejectCode::Uncertain
}

/// Longest pause after a loss.
fn pause_max(error: &LinkError) -> Duration {
    match error {
        // It would have to count and refuse this client again and again.
        LinkError::Rejected(rejected) if rejected.code != RejectCode::ShuttingDown => {
            UNWANTED_PAUSE_MAX
        }
        LinkError::Encryption(_) | LinkError::WantsEncryption { .. } => UNWANTED_PAUSE_MAX,
        _ => PAUSE_MAX,
    }
}

/// Whether a refusal stays as long as the request is the same; other refusals are due to the server's
/// state.
fn stays(code: RejectCode) -> bool {
    !matches!(code, RejectCode::Busy | RejectCode::ShuttingDown)
}

/// First statement of a text, cut if it is too long.
fn shortened(text: &str) -> String {
    let ends = ["; ", ". ", "\n"].iter().filter_map(|end| text.find(end));
    let first = &text[..ends.min().unwrap_or(text.len())];
    match first.char_indices().nth(REFUSAL_LEN_MAX) {
        Some((at, _)) => format!("{} …", first[..at].trim_end()),
        None => first.to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn refusals_are_told_in_a_short_line() {
        assert_eq!(shortened("too stiff; take less\nor more"), "too stiff");
        assert_eq!(shortened("too stiff"), "too stiff");
        let long = "ä".repeat(500);
        assert_eq!(shortened(&long).chars().count(), REFUSAL_LEN_MAX + 2);
    }

    #[test]
    fn lost_request_waits_for_the_server_and_ends_when_a_newer_one_has_come() {
        let request = |tick| {
            let asked = TickQuestion::Held { question: Default::default(), large: None };
            TickRequest { tick, grip: 0, asked }
        };
        let upload = UploadModel {
            mesh: softgrasp_protocol::MeshData::default(),
            materials: vec![],
            element: softgrasp_protocol::ElementName::T4,
            fixed: vec![],
        };
        let hash = ModelHash::of(&upload);
        let model = ModelUpload { rest_shape: 1, hash, message: Arc::new(upload) };
        let job = |tick| Job {
            model: model.clone(),
            request: Some(request(tick)),
            hint: Hint::default(),
        };
        let mut state = LinkState::default();
        lose(&mut state, &LinkError::Closed, job(1));
        assert_eq!(state.outbox.request.as_ref().map(|r| r.tick), Some(1));
        let (events, ended) = state.take();
        assert!(events.len() == 1 && ended.is_empty());
        state.outbox.request = Some(request(3));
        lose(&mut state, &LinkError::Closed, job(1));
        assert_eq!(state.outbox.request.as_ref().map(|r| r.tick), Some(3));
        let (events, ended) = state.take();
        assert!(events.is_empty(), "the loss is told once: {events:?}");
        assert!(ended.len() == 1 && ended[0].tick == 1);
    }
}
