//! The link to the server runs beside the tick: one request in flight, the newest wins.
//!
//! The tick never waits for the network: it leaves its newest order here and picks up what has
//! come. A lost server is looked for again with growing pauses, and the model is sent anew only if
//! the server does not know it.

use std::collections::VecDeque;
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use softgrasp_protocol::{
    FrameRequest, ModelHash, ModelReady, NodeChoice, Prefetch, Question, RejectCode, Reply,
    Request, SolveReport, UploadModel,
};

use crate::connection::{LinkError, ServerConnection, unexpected};
use crate::pace::be_urgent;
use crate::prefetch::Hint;

/// What has come from the server, or happened to it.
#[derive(Debug)]
pub enum LinkEvent {
    /// Connected, or connected again.
    Connected {
        /// Name and version of the server.
        server: String,
    },
    /// The server has the model.
    ModelReady(ModelReady),
    /// Displacements for the order of a tick.
    Answer {
        /// Tick the order was given in.
        tick: u64,
        /// Which rest shape it belongs to.
        rest_shape: u64,
        /// Nodes that `displacement` belongs to.
        nodes: NodeChoice,
        /// Displacement of these nodes, m.
        displacement: Vec<[f64; 3]>,
        /// What it cost and how wrong it can be.
        report: Box<SolveReport>,
        /// From sending to having the answer.
        round_trip: Duration,
    },
    /// The server answered that it cannot.
    Refused {
        /// Tick the order was given in; 0 for the model.
        tick: u64,
        /// The server's words.
        text: String,
    },
    /// The connection is lost; it is tried again.
    Lost {
        /// Why.
        text: String,
    },
}

/// The model that frames refer to.
#[derive(Clone)]
pub struct ModelOrder {
    /// Which rest shape it is.
    pub rest_shape: u64,
    /// Its name.
    pub hash: ModelHash,
    /// Itself, kept so that a server that has forgotten it gets it again.
    pub upload: Arc<UploadModel>,
}

struct FrameOrder {
    tick: u64,
    question: Question,
}

#[derive(Default)]
struct Desk {
    address: String,
    model: Option<ModelOrder>,
    /// The model is to be made ready even if no frame is asked for yet.
    model_is_new: bool,
    frame: Option<FrameOrder>,
    /// Contacts whose columns are to be prepared.
    prefetch: Hint,
    /// Tick of the order that is being worked on.
    in_flight: Option<u64>,
    connected: bool,
    events: VecDeque<LinkEvent>,
    stop: bool,
}

/// Owner of the link's thread.
pub struct Link {
    desk: Arc<(Mutex<Desk>, Condvar)>,
    thread: Option<JoinHandle<()>>,
}

/// First pause before a lost server is looked for again; doubles up to the longest.
const PAUSE_MIN: Duration = Duration::from_millis(100);
/// Longest pause.
const PAUSE_MAX: Duration = Duration::from_secs(2);
/// A server that is silent for this long within a request is taken for lost.
const SILENCE_MAX: Duration = Duration::from_secs(60);
/// Events the tick has not picked up; more than this many are not kept.
const EVENTS_MAX: usize = 256;

impl Link {
    /// Starts the link to a server.
    ///
    /// # Errors
    /// The system's, when it gives no thread.
    pub fn start(address: &str) -> std::io::Result<Self> {
        let desk = Desk { address: address.to_owned(), ..Desk::default() };
        let desk = Arc::new((Mutex::new(desk), Condvar::new()));
        let shared = Arc::clone(&desk);
        let thread = std::thread::Builder::new().name("link".to_owned());
        let thread = thread.spawn(move || {
            be_urgent();
            Worker { desk: shared, connection: None }.work();
        })?;
        Ok(Self { desk, thread: Some(thread) })
    }

    /// Sets the model that frames refer to from now on; older orders are dropped.
    pub fn set_model(&self, model: ModelOrder) {
        let mut desk = lock(&self.desk);
        desk.model = Some(model);
        desk.model_is_new = true;
        desk.frame = None;
        desk.prefetch = Hint::default();
        self.desk.1.notify_all();
    }

    /// Asks for a frame; an order that has not been sent yet is replaced.
    pub fn ask(&self, tick: u64, question: Question) {
        lock(&self.desk).frame = Some(FrameOrder { tick, question });
        self.desk.1.notify_all();
    }

    /// Hints at contacts that may be made soon; there is no answer.
    pub fn prefetch(&self, hint: Hint) {
        let mut desk = lock(&self.desk);
        desk.prefetch.nodes.extend_from_slice(&hint.nodes);
        desk.prefetch.masks.append(&hint.masks);
        drop(desk);
        self.desk.1.notify_all();
    }

    /// Drops an order that has not been sent yet.
    pub fn cancel(&self) {
        lock(&self.desk).frame = None;
    }

    /// What has come since the last call.
    pub fn take_events(&self) -> Vec<LinkEvent> {
        lock(&self.desk).events.drain(..).collect()
    }

    /// Waits until nothing is asked for and nothing in flight, the server is lost, or the time is
    /// up; whether all is answered.
    pub fn wait_idle(&self, at_most: Duration) -> bool {
        let end = Instant::now() + at_most;
        let mut desk = lock(&self.desk);
        loop {
            let idle = desk.frame.is_none() && desk.in_flight.is_none() && !desk.model_is_new;
            let left = end.saturating_duration_since(Instant::now());
            let lost = desk.events.iter().any(|e| matches!(e, LinkEvent::Lost { .. }));
            if idle || lost || left.is_zero() {
                return idle;
            }
            let waited = self.desk.1.wait_timeout(desk, left);
            desk = waited.unwrap_or_else(PoisonError::into_inner).0;
        }
    }

    /// Whether the server is there.
    pub fn is_connected(&self) -> bool {
        lock(&self.desk).connected
    }
}

impl Drop for Link {
    fn drop(&mut self) {
        lock(&self.desk).stop = true;
        self.desk.1.notify_all();
        if let Some(thread) = self.thread.take()
            && thread.join().is_err()
        {
            tracing::error!("the link's thread ended abnormally");
        }
    }
}

fn lock(desk: &Arc<(Mutex<Desk>, Condvar)>) -> MutexGuard<'_, Desk> {
    desk.0.lock().unwrap_or_else(PoisonError::into_inner)
}

/// The link's thread.
struct Worker {
    desk: Arc<(Mutex<Desk>, Condvar)>,
    connection: Option<(ServerConnection, Option<ModelHash>)>,
}

/// What the thread is to do next.
struct Job {
    model: ModelOrder,
    frame: Option<FrameOrder>,
    prefetch: Hint,
}

impl Worker {
    fn work(mut self) {
        let mut pause = PAUSE_MIN;
        while let Some(job) = self.next_job() {
            let tick = job.frame.as_ref().map_or(0, |f| f.tick);
            let outcome = self.do_job(&job);
            let mut desk = lock(&self.desk);
            desk.in_flight = None;
            match outcome {
                Ok(events) => {
                    pause = PAUSE_MIN;
                    events.into_iter().for_each(|event| push(&mut desk, event));
                }
                Err(LinkError::Rejected(rejected)) if stays(rejected.code) => {
                    // Asking the same again would be refused again: drop it.
                    push(&mut desk, LinkEvent::Refused { tick, text: rejected.text });
                }
                Err(error) => {
                    self.connection = None;
                    desk.connected = false;
                    push(&mut desk, LinkEvent::Lost { text: error.to_string() });
                    // The order is tried again unless a newer one has come.
                    desk.model_is_new |= job.frame.is_none();
                    if desk.frame.is_none() {
                        desk.frame = job.frame;
                    }
                    self.desk.1.notify_all();
                    desk = self.rest(desk, pause);
                    pause = (2 * pause).min(PAUSE_MAX);
                }
            }
            drop(desk);
            self.desk.1.notify_all();
        }
    }

    /// Sleeps, but wakes when the link is to stop.
    fn rest<'a>(&'a self, desk: MutexGuard<'a, Desk>, pause: Duration) -> MutexGuard<'a, Desk> {
        let waited = self.desk.1.wait_timeout_while(desk, pause, |desk| !desk.stop);
        waited.unwrap_or_else(PoisonError::into_inner).0
    }

    /// Waits for an order; `None` when the link is to stop.
    fn next_job(&self) -> Option<Job> {
        let mut desk = lock(&self.desk);
        loop {
            if desk.stop {
                return None;
            }
            if let Some(model) = desk.model.clone()
                && (desk.model_is_new || desk.frame.is_some() || !desk.prefetch.is_empty())
            {
                desk.model_is_new = false;
                let frame = desk.frame.take();
                let prefetch = std::mem::take(&mut desk.prefetch);
                desk.in_flight = Some(frame.as_ref().map_or(0, |f| f.tick));
                return Some(Job { model, frame, prefetch });
            }
            desk = self.desk.1.wait(desk).unwrap_or_else(PoisonError::into_inner);
        }
    }

    fn do_job(&mut self, job: &Job) -> Result<Vec<LinkEvent>, LinkError> {
        let mut events = Vec::new();
        let address = lock(&self.desk).address.clone();
        if self.connection.is_none() {
            let connection = ServerConnection::connect(&address, None)?;
            let timed = connection.stream().set_read_timeout(Some(SILENCE_MAX));
            timed.map_err(|e| LinkError::Connection(e.into()))?;
            let welcome = connection.welcome();
            let server =
                format!("{} {} ({} threads)", welcome.server, welcome.version, welcome.threads);
            // Told at once: a model may take long to prepare.
            let mut desk = lock(&self.desk);
            desk.connected = true;
            push(&mut desk, LinkEvent::Connected { server });
            drop(desk);
            self.connection = Some((connection, None));
        }
        let Some((connection, on_server)) = self.connection.as_mut() else {
            return Err(LinkError::Closed);
        };
        if *on_server != Some(job.model.hash) {
            events.extend(offer_model(connection, &job.model)?);
            *on_server = Some(job.model.hash);
        }
        if !job.prefetch.is_empty() {
            let Hint { nodes, masks } = job.prefetch.clone();
            let hint = Prefetch { model: job.model.hash, nodes, masks };
            connection.send(&Request::Prefetch(hint))?;
        }
        if let Some(frame) = &job.frame {
            let answer = match ask_frame(connection, &job.model, frame) {
                // The server made room or was started anew: give it the model again.
                Err(LinkError::Rejected(r)) if r.code == RejectCode::UnknownModel => {
                    events.extend(offer_model(connection, &job.model)?);
                    ask_frame(connection, &job.model, frame)?
                }
                other => other?,
            };
            events.push(answer);
        }
        Ok(events)
    }
}

/// Sends the model unless the server knows it.
fn offer_model(
    connection: &mut ServerConnection,
    model: &ModelOrder,
) -> Result<Option<LinkEvent>, LinkError> {
    match connection.ask(&Request::HaveModel(model.hash))? {
        Reply::ModelState { known: true } => return Ok(None),
        Reply::ModelState { known: false } => {}
        other => return Err(unexpected("HaveModel", &other)),
    }
    match connection.ask(&Request::UploadModel(UploadModel::clone(&model.upload)))? {
        Reply::ModelReady(ready) => Ok(Some(LinkEvent::ModelReady(ready))),
        other => Err(unexpected("UploadModel", &other)),
    }
}

fn ask_frame(
    connection: &mut ServerConnection,
    model: &ModelOrder,
    frame: &FrameOrder,
) -> Result<LinkEvent, LinkError> {
    let question = frame.question.clone();
    let start = Instant::now();
    let asked = Request::Frame(FrameRequest { model: model.hash, question });
    match connection.ask_awake(&asked)? {
        Reply::Answer(answer) => Ok(LinkEvent::Answer {
            tick: frame.tick,
            rest_shape: model.rest_shape,
            round_trip: start.elapsed(),
            nodes: answer.nodes,
            displacement: answer.displacements.into_f64(),
            report: Box::new(answer.report),
        }),
        other => Err(unexpected("Frame", &other)),
    }
}

/// Whether a refusal is about the request; the others are about the server's state and pass.
fn stays(code: RejectCode) -> bool {
    !matches!(code, RejectCode::Busy | RejectCode::ShuttingDown)
}

fn push(desk: &mut Desk, event: LinkEvent) {
    if desk.events.len() >= EVENTS_MAX {
        desk.events.pop_front();
    }
    desk.events.push_back(event);
}
