//! Writes a recording beside the ticks, which never wait for the disk.

use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use mcap::{McapError, McapResult};
use serde_json::json;
use softgrasp_grasp::hand::{ANGLE_NAMES, HandDimensions};

use super::channels::Channel;
use super::file::{DeviceBytes, RecordingFile, hex_of};
use super::foxglove;
use super::tick::{AnswerSeen, EventSeen, Intervention, RecordedSetup, SceneSeen, TickSeen};
use crate::sent::{Arrival, Sent, WhichHand};

/// A recording that is being written.
pub struct Recorder {
    path: PathBuf,
    messages: Option<Sender<Message>>,
    thread: Option<JoinHandle<McapResult<()>>>,
    /// Events and answers that were taken between the ticks, and belong to the next one.
    between: Between,
    /// When a surface was last recorded, s.
    surface_at_s: Option<f64>,
}

/// Why a recording is not complete.
#[derive(Debug, thiserror::Error)]
pub enum RecordError {
    /// The file cannot be written.
    #[error("cannot record to {path}: {source}")]
    Write {
        /// Path of the file.
        path: PathBuf,
        /// Error of the operating system or of the MCAP library.
        source: McapError,
    },
    /// The thread that writes cannot be started, or ended abnormally.
    #[error("cannot record to {path}: the thread that writes is not there")]
    Thread {
        /// Path of the file.
        path: PathBuf,
    },
}

/// Changes and answers that came while no tick was played.
#[derive(Default)]
struct Between {
    interventions: Vec<Intervention>,
    news: TickNews,
}

/// Events, answers and results of one tick, or of the time between two ticks.
#[derive(Clone, Debug, Default)]
pub struct TickNews {
    /// Events that happened, in order.
    pub events: Vec<EventSeen>,
    /// Answers of the server that were taken, in that order.
    pub answers: Vec<AnswerSeen>,
    /// Whether a rest shape was taken that was made beside the ticks.
    pub took_work: bool,
    /// Whether the step of a free object that had been asked for was given up.
    pub gave_up_step: bool,
}

/// One message to the thread that writes.
enum Message {
    Setup(Box<RecordedSetup>),
    Tick(Box<TickMessage>),
}

/// A tick with all that belongs to it.
struct TickMessage {
    arrivals: Vec<Arrival>,
    scene: Option<SceneSeen>,
    events: Vec<EventSeen>,
    answers: Vec<AnswerSeen>,
    seen: TickSeen,
}

/// Time after which the file is made readable again: a crash loses what came within it.
const FLUSH_EVERY: Duration = Duration::from_millis(250);
/// Time between two surfaces of the object in the file, s …
const SURFACE_EVERY_S: f64 = 0.1;
/// … which has no surface of an object with more surface nodes than this: half a megabyte a time.
const SURFACE_NODES_MAX: usize = 5000;

impl Recorder {
    /// Begins a recording; the file is there when this returns.
    ///
    /// # Errors
    /// [`RecordError`].
    pub fn start(path: &Path, setup: RecordedSetup) -> Result<Self, RecordError> {
        let path = path.to_owned();
        let file = RecordingFile::create(&path, setup.second_hand.is_some());
        let file = file.map_err(|source| RecordError::Write { path: path.clone(), source })?;
        let (messages, to_write) = channel();
        // Nobody hears it yet.
        let _ = messages.send(Message::Setup(Box::new(setup)));
        let thread = std::thread::Builder::new().name("recorder".to_owned());
        let thread = thread.spawn(move || write_all(file, &to_write));
        let thread = thread.map_err(|_| RecordError::Thread { path: path.clone() })?;
        let (messages, thread) = (Some(messages), Some(thread));
        Ok(Self { path, messages, thread, between: Between::default(), surface_at_s: None })
    }

    /// Notes what a person did to the object between two ticks.
    pub fn intervene(&mut self, intervention: Intervention) {
        self.between.interventions.push(intervention);
    }

    /// Notes what was taken while no tick was played.
    pub fn idle(&mut self, news: TickNews) {
        self.between.news.add(news);
    }

    /// Whether a tick at this time is to bring the surface of an object of so many surface nodes: ten
    /// times a second, and not of large ones.
    ///
    /// Units: s.
    pub fn wants_surface(&mut self, now_s: f64, nodes: usize) -> bool {
        let is_due = self.surface_at_s.is_none_or(|at_s| now_s - at_s >= SURFACE_EVERY_S);
        let wants = is_due && nodes <= SURFACE_NODES_MAX;
        if wants {
            self.surface_at_s = Some(now_s);
        }
        wants
    }

    /// Records a tick that is over. `made` is what it made, but for what [`Recorder`] knows itself: the
    /// command, and what was done and taken since the tick before.
    pub fn tick(&mut self, sent: &Sent, news: TickNews, scene: Option<SceneSeen>, made: TickSeen) {
        let Between { interventions, news: mut all } = std::mem::take(&mut self.between);
        all.add(news);
        let TickNews { events, answers, took_work, gave_up_step } = all;
        let seen = TickSeen {
            command: sent.command.map(|command| command.to_string()),
            interventions,
            answers: answers.iter().map(|answer| answer.tick).collect(),
            took_work,
            gave_up_step,
            ..made
        };
        let message = TickMessage { arrivals: sent.arrivals.clone(), scene, events, answers, seen };
        if let Some(messages) = &self.messages {
            // A thread that could not write says so at the end.
            let _ = messages.send(Message::Tick(Box::new(message)));
        }
    }

    /// Ends the recording.
    ///
    /// # Errors
    /// [`RecordError`]: what is missing in the file.
    pub fn finish(mut self) -> Result<(), RecordError> {
        self.end().unwrap_or(Ok(()))
    }

    fn end(&mut self) -> Option<Result<(), RecordError>> {
        drop(self.messages.take());
        let thread = self.thread.take()?;
        let path = self.path.clone();
        Some(match thread.join() {
            Ok(Ok(())) => Ok(()),
            Ok(Err(source)) => Err(RecordError::Write { path, source }),
            Err(_) => Err(RecordError::Thread { path }),
        })
    }
}

impl Drop for Recorder {
    fn drop(&mut self) {
        if let Some(Err(error)) = self.end() {
            tracing::error!(%error, "recording");
        }
    }
}

fn write_all(mut file: RecordingFile, messages: &Receiver<Message>) -> McapResult<()> {
    let mut flushed = Instant::now();
    let mut drawn = [None; 2];
    loop {
        match messages.recv_timeout(FLUSH_EVERY) {
            Ok(Message::Setup(setup)) => {
                file.write(Channel::Setup, 0.0, &setup)?;
                file.flush()?;
            }
            Ok(Message::Tick(tick)) => write_tick(&mut file, &tick, &mut drawn)?,
            Err(RecvTimeoutError::Timeout) => {}
            Err(RecvTimeoutError::Disconnected) => return file.finish(),
        }
        if flushed.elapsed() >= FLUSH_EVERY {
            file.flush()?;
            flushed = Instant::now();
        }
    }
}

/// Writes a tick; `drawn` are the sizes of the hands that were drawn last.
fn write_tick(
    file: &mut RecordingFile,
    message: &TickMessage,
    drawn: &mut [Option<HandDimensions>; 2],
) -> McapResult<()> {
    let TickMessage { arrivals, scene, events, answers, seen } = message;
    let now_s = seen.now_s;
    for Arrival { hand, device, at_s, is_datagram, bytes } in arrivals {
        let data = DeviceBytes { at_s: *at_s, datagram: *is_datagram, hex: hex_of(bytes) };
        file.write(Channel::Device(*hand, *device), at_s.unwrap_or(now_s), &data)?;
    }
    if let Some(scene) = scene {
        write_scene(file, seen, scene, drawn)?;
    }
    for EventSeen { kind, what } in events {
        let event = json!({"tick": seen.tick, "kind": kind, "what": what});
        file.write(Channel::Event, now_s, &event)?;
        file.write(Channel::Log, now_s, &foxglove::log_line(kind, what, now_s))?;
    }
    if !seen.stages.request.is_empty() {
        let request = json!({"tick": seen.tick, "digest": seen.stages.request});
        file.write(Channel::Request, now_s, &request)?;
    }
    for answer in answers {
        file.write(Channel::Answer, now_s, answer)?;
    }
    file.write(Channel::Tick, now_s, seen)
}

fn write_scene(
    file: &mut RecordingFile,
    seen: &TickSeen,
    scene: &SceneSeen,
    drawn: &mut [Option<HandDimensions>; 2],
) -> McapResult<()> {
    let now_s = seen.now_s;
    if let Some(pose) = &scene.pose {
        file.write(Channel::Pose, now_s, pose)?;
    }
    if let Some(hand) = &scene.hands[0] {
        let angles = json!({"tick": seen.tick, "names": ANGLE_NAMES, "rad": hand.angles_rad});
        file.write(Channel::Angles, now_s, &angles)?;
    }
    let transforms = foxglove::frame_transforms(&scene.hands, &scene.world_from_object, now_s);
    file.write(Channel::Transforms, now_s, &transforms)?;
    for ((which, hand), drawn) in WhichHand::ALL.into_iter().zip(&scene.hands).zip(drawn) {
        let Some(dimensions) = hand.as_ref().map(|hand| hand.dimensions) else { continue };
        if drawn.replace(dimensions) != Some(dimensions) {
            let shapes = foxglove::hand_scene(which, &dimensions, now_s);
            file.write(Channel::Scene, now_s, &shapes)?;
        }
    }
    if let Some(surface) = &scene.surface {
        file.write(Channel::Scene, now_s, &foxglove::object_scene(surface, now_s))?;
    }
    Ok(())
}

impl TickNews {
    fn add(&mut self, later: Self) {
        self.events.extend(later.events);
        self.answers.extend(later.answers);
        self.took_work |= later.took_work;
        self.gave_up_step |= later.gave_up_step;
    }
}
