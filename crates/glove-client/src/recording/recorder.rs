//! Writes a recording beside the ticks, which never wait for the disk.

use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use mcap::{McapError, McapResult};
use serde::Serialize;
use serde_json::json;

use super::channels::Channel;
use super::file::{DeviceBytes, RecordingFile, hex_of};
use super::stages::StageDigests;
use super::tick::{AnswerSeen, Intervention, RecordedSetup, TickSeen};
use crate::arrival::Arrival;
use crate::grasp_loop::GraspLoop;
use crate::pace::Due;
use crate::sent::Sent;
use crate::springback::SPRINGBACK;
use crate::tick_outcome::{LoopEvent, TickOutcome};

/// A recording that is being written.
pub struct Recorder {
    path: PathBuf,
    messages: Option<Sender<Message>>,
    thread: Option<JoinHandle<McapResult<()>>>,
    /// What was taken between the ticks, and belongs to the next one.
    between: Between,
}

/// Why a recording is not complete.
#[derive(Debug, thiserror::Error)]
pub enum RecordError {
    /// The file cannot be written.
    #[error("cannot record to {path}: {source}")]
    Write {
        /// The file.
        path: PathBuf,
        /// The reason.
        source: McapError,
    },
    /// The thread that writes cannot be started, or ended abnormally.
    #[error("cannot record to {path}: the thread that writes is not there")]
    Thread {
        /// The file.
        path: PathBuf,
    },
}

/// What happened while no tick was played.
#[derive(Default)]
struct Between {
    interventions: Vec<Intervention>,
    answers: Vec<AnswerSeen>,
    events: Vec<LoopEvent>,
    took_work: bool,
}

/// What is written at once.
enum Message {
    Setup(Box<RecordedSetup>),
    Tick(Box<TickMessage>),
}

/// A tick with all that belongs to it.
struct TickMessage {
    now_s: f64,
    arrivals: Vec<Arrival>,
    pose: Option<Pose>,
    events: Vec<LoopEvent>,
    answers: Vec<AnswerSeen>,
    seen: TickSeen,
}

#[derive(Serialize)]
struct Pose {
    tick: u64,
    palm_m: [f64; 3],
    palm_xyzw: [f64; 4],
    fingertips_m: [[f64; 3]; 5],
    object_m: [f64; 3],
    object_xyzw: [f64; 4],
}

/// The file is made readable so often: that much a crash loses.
const FLUSH_EVERY: Duration = Duration::from_millis(250);

impl Recorder {
    /// Begins a recording; the file is there when this returns.
    ///
    /// # Errors
    /// [`RecordError`].
    pub fn start(path: &Path, setup: RecordedSetup) -> Result<Self, RecordError> {
        let path = path.to_owned();
        let file = RecordingFile::create(&path);
        let file = file.map_err(|source| RecordError::Write { path: path.clone(), source })?;
        let (messages, to_write) = channel();
        // Nobody hears it yet.
        let _ = messages.send(Message::Setup(Box::new(setup)));
        let thread = std::thread::Builder::new().name("recorder".to_owned());
        let thread = thread.spawn(move || write_all(file, &to_write));
        let thread = thread.map_err(|_| RecordError::Thread { path: path.clone() })?;
        let (messages, thread) = (Some(messages), Some(thread));
        Ok(Self { path, messages, thread, between: Between::default() })
    }

    /// Something was done to the object.
    pub fn intervene(&mut self, intervention: Intervention) {
        self.between.interventions.push(intervention);
    }

    /// Something was taken while no tick was played.
    pub fn idle(&mut self, outcome: &TickOutcome) {
        self.between.answers.extend(answers(outcome));
        self.between.events.extend(outcome.events.iter().cloned());
        self.between.took_work |= outcome.took_work;
    }

    /// A tick is over.
    ///
    /// Units: `now_s` s on the client's clock.
    pub fn tick(
        &mut self,
        due: Due,
        now_s: f64,
        sent: &Sent,
        outcome: &TickOutcome,
        grasp_loop: &GraspLoop,
    ) {
        let Between { interventions, answers: mut taken, mut events, took_work } =
            std::mem::take(&mut self.between);
        taken.extend(answers(outcome));
        events.extend(outcome.events.iter().cloned());
        let seen = TickSeen {
            tick: due.tick,
            skipped: due.skipped,
            now_s,
            command: sent.command.map(|command| command.to_string()),
            interventions,
            answers: taken.iter().map(|answer| answer.tick).collect(),
            took_work: took_work || outcome.took_work,
            state: outcome.state.map(|state| state.to_string()),
            contacts: grasp_loop.contacts().map(|contact| contact.map(|c| c.node)),
            stages: StageDigests::of(grasp_loop, outcome),
        };
        let message = TickMessage {
            now_s,
            arrivals: sent.arrivals.clone(),
            pose: pose(due.tick, grasp_loop),
            events,
            answers: taken,
            seen,
        };
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

fn answers(outcome: &TickOutcome) -> impl Iterator<Item = AnswerSeen> {
    let of_ticks = outcome.answers.iter().map(|(tick, solve)| AnswerSeen {
        tick: *tick,
        method: solve.method.clone(),
        element: solve.element.to_owned(),
        residual_rel: solve.residual_rel,
        round_trip_ms: solve.round_trip_ms,
    });
    let springback = outcome.sprung_back.then(|| AnswerSeen {
        tick: SPRINGBACK,
        method: "springback".to_owned(),
        element: String::new(),
        residual_rel: 0.0,
        round_trip_ms: 0.0,
    });
    of_ticks.chain(springback)
}

fn pose(tick: u64, grasp_loop: &GraspLoop) -> Option<Pose> {
    let hand = grasp_loop.hand()?;
    let (palm, object) = (hand.world_from_palm, grasp_loop.world_from_object());
    Some(Pose {
        tick,
        palm_m: palm.translation.vector.into(),
        palm_xyzw: palm.rotation.coords.into(),
        fingertips_m: hand.fingers.map(|finger| finger.tip().into()),
        object_m: object.translation.vector.into(),
        object_xyzw: object.rotation.coords.into(),
    })
}

fn write_all(mut file: RecordingFile, messages: &Receiver<Message>) -> McapResult<()> {
    let mut flushed = Instant::now();
    loop {
        match messages.recv_timeout(FLUSH_EVERY) {
            Ok(Message::Setup(setup)) => {
                file.write(Channel::Setup, 0.0, &setup)?;
                file.flush()?;
            }
            Ok(Message::Tick(tick)) => write_tick(&mut file, &tick)?,
            Err(RecvTimeoutError::Timeout) => {}
            Err(RecvTimeoutError::Disconnected) => return file.finish(),
        }
        if flushed.elapsed() >= FLUSH_EVERY {
            file.flush()?;
            flushed = Instant::now();
        }
    }
}

fn write_tick(file: &mut RecordingFile, message: &TickMessage) -> McapResult<()> {
    let TickMessage { now_s, arrivals, pose, events, answers, seen } = message;
    for Arrival { device, at_s, is_datagram, bytes } in arrivals {
        let data = DeviceBytes { at_s: *at_s, datagram: *is_datagram, hex: hex_of(bytes) };
        file.write(Channel::Device(*device), at_s.unwrap_or(*now_s), &data)?;
    }
    if let Some(pose) = pose {
        file.write(Channel::Pose, *now_s, pose)?;
    }
    for event in events {
        let (kind, what) = event.kind_and_words();
        let event = json!({"tick": seen.tick, "kind": kind, "what": what});
        file.write(Channel::Event, *now_s, &event)?;
    }
    if !seen.stages.request.is_empty() {
        let request = json!({"tick": seen.tick, "digest": seen.stages.request});
        file.write(Channel::Request, *now_s, &request)?;
    }
    for answer in answers {
        file.write(Channel::Answer, *now_s, answer)?;
    }
    file.write(Channel::Tick, *now_s, seen)
}
