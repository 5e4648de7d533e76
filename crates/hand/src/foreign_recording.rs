//! A hand that repeats a recording made by another program: tracker poses, or joints from a camera.

use std::path::{Path, PathBuf};

use crate::devices::recordings::{LeapError, LeapRecording, TrajError, Trajectory};
use crate::hand_setup::HandSetup;
use crate::joints::JointsRecord;
use crate::sent::Sent;
use crate::sent::{Arrival, Device};
use crate::serial::motion::Motion;

/// A recording that is played at its own speed.
pub struct ForeignHand {
    source: Source,
    name: String,
    tick_s: f64,
    time_s: f64,
}

enum Source {
    /// A tracker's poses; the hand stays flat.
    Trajectory { setup: Box<HandSetup>, motion: Motion },
    /// Lines of joints with their times, s, and the next one.
    Joints { lines: Vec<(f64, String)>, next: usize },
}

/// Why a recording cannot be played.
#[derive(Debug, thiserror::Error)]
pub enum ForeignError {
    /// The file cannot be read.
    #[error("cannot read {path}: {source}")]
    Read {
        /// Path of the file.
        path: PathBuf,
        /// Error of the operating system.
        source: std::io::Error,
    },
    /// The file is no trajectory of a tracker.
    #[error("{path}: {source}")]
    Trajectory {
        /// Path of the file.
        path: PathBuf,
        /// What is wrong with the trajectory.
        source: TrajError,
    },
    /// The file is no recording of a Leap camera.
    #[error("{path}: {source}")]
    Leap {
        /// Path of the file.
        path: PathBuf,
        /// What is wrong with the recording.
        source: LeapError,
    },
}

/// Whether the ending of a file's name is that of a trajectory (`traj`) or of a camera's recording
/// (`csv`).
pub fn is_foreign(path: &Path) -> bool {
    has_ending(path, "traj") || has_ending(path, "csv")
}

fn has_ending(path: &Path, ending: &str) -> bool {
    path.extension().is_some_and(|found| found.eq_ignore_ascii_case(ending))
}

impl ForeignHand {
    /// Reads a recording: `.traj` (4 × 4 matrices at 100 Hz), or `.csv` (joints of a Leap camera).
    ///
    /// Units: `tick_s` from tick to tick, s.
    ///
    /// # Errors
    /// [`ForeignError`].
    pub fn read(path: &Path, setup: &HandSetup, tick_s: f64) -> Result<Self, ForeignError> {
        let text = std::fs::read_to_string(path)
            .map_err(|source| ForeignError::Read { path: path.to_owned(), source })?;
        let source = if has_ending(path, "traj") {
            let trajectory = Trajectory::parse(&text)
                .map_err(|source| ForeignError::Trajectory { path: path.to_owned(), source })?;
            let motion = Motion::trajectory(setup.clone(), &trajectory);
            Source::Trajectory { setup: Box::new(setup.clone()), motion }
        } else {
            let recording = LeapRecording::parse(&text)
                .map_err(|source| ForeignError::Leap { path: path.to_owned(), source })?;
            let line = |frame| (frame, JointsRecord::from(frame).to_line());
            let lines = recording.frames.iter().map(line);
            let lines = lines.map(|(frame, line)| (frame.time_s, line)).collect();
            Source::Joints { lines, next: 0 }
        };
        Ok(Self { source, name: path.display().to_string(), tick_s, time_s: 0.0 })
    }

    /// Path of the recording's file.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Goes back to the beginning of the recording.
    pub fn restart(&mut self) {
        self.time_s = 0.0;
        if let Source::Joints { next, .. } = &mut self.source {
            *next = 0;
        }
    }

    /// Moves on by the time of so many ticks and returns the bytes that devices send in that time.
    pub fn next_after(&mut self, ticks: u64) -> Sent {
        self.time_s += ticks as f64 * self.tick_s;
        let time_s = self.time_s;
        match &mut self.source {
            Source::Trajectory { setup, motion } => {
                let raw = setup.calibration.angles(&motion.raw(time_s), setup.calibration.dead());
                let world_from_receiver =
                    setup.world_from_stand * motion.stand_from_receiver(time_s);
                let hand = setup.dimensions.handedness;
                let palm = setup.mount.world_from_palm(&world_from_receiver, &raw, hand);
                let arrivals = setup.arrivals_of(&raw, &palm);
                Sent { arrivals, over: time_s > motion.duration_s(), ..Sent::default() }
            }
            Source::Joints { lines, next } => {
                let come = lines[*next..].iter().take_while(|(at_s, _)| *at_s <= time_s).count();
                let arrivals = lines[*next..*next + come].iter();
                let arrival = |(_, line): &(f64, String)| {
                    Arrival::with_tick(Device::Joints, line.clone().into_bytes())
                };
                let arrivals = arrivals.map(arrival).collect();
                *next += come;
                Sent { arrivals, over: *next == lines.len(), ..Sent::default() }
            }
        }
    }
}
