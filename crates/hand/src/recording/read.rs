//! Reads a recording, up to where it was cut off.

use std::collections::BTreeSet;
use std::fs::File;
use std::io::BufReader;
use std::path::{Path, PathBuf};

use mcap::McapError;
use mcap::io::MessageReader;
use mcap::sans_io::LinearReaderOptions;

use super::channels::Channel;
use super::file::{DeviceBytes, bytes_of};
use super::tick::{AnswerSeen, RecordedSetup, RecordedTick, SPRINGBACK_REFUSED, TickSeen};
use crate::sent::Arrival;

/// A recording of a run, as it was read from a file.
#[derive(Clone, Debug, PartialEq)]
pub struct Recording {
    /// Set-up of the run: enough to play it again.
    pub setup: RecordedSetup,
    /// Ticks of the run, in order.
    pub ticks: Vec<RecordedTick>,
    /// Why reading ended before the end of the file, if it did.
    pub cut: Option<String>,
}

/// Why a recording cannot be read.
#[derive(Debug, thiserror::Error)]
pub enum ReadError {
    /// The file cannot be read.
    #[error("cannot read the recording {path}: {source}")]
    Open {
        /// Path of the file.
        path: PathBuf,
        /// Error of the operating system.
        source: std::io::Error,
    },
    /// The file is no MCAP file.
    #[error("{path} is no recording: {source}")]
    NotMcap {
        /// Path of the file.
        path: PathBuf,
        /// What the MCAP library found.
        source: McapError,
    },
    /// The file does not say how the run was set up.
    #[error("{path} is no recording of this program: it has no /setup message that can be read")]
    NoSetup {
        /// Path of the file.
        path: PathBuf,
    },
    /// The file was written by a newer program.
    #[error("{path} is of version {found}; this program reads {VERSION_OF_ONE_HAND} to {VERSION}")]
    Version {
        /// Path of the file.
        path: PathBuf,
        /// Version of the file's messages.
        found: u32,
    },
}

/// Newest version of the messages; raised when an old reader would misread a new file. This is that of a run
/// whose hands move evenly between their samples.
pub const VERSION: u32 = 3;
/// Version of the messages of a run of two hands.
pub const VERSION_OF_TWO_HANDS: u32 = 2;
/// Version of the messages of a run of one hand.
pub const VERSION_OF_ONE_HAND: u32 = 1;
/// No message of ours is longer; a file that says so is not followed.
const RECORD_MAX: usize = 64 << 20;

/// Reads a recording. One that was cut off is read up to the last whole tick.
///
/// # Errors
/// [`ReadError`].
pub fn read_recording(path: &Path) -> Result<Recording, ReadError> {
    let path = path.to_owned();
    let file = match File::open(&path) {
        Ok(file) => file,
        Err(source) => return Err(ReadError::Open { path, source }),
    };
    // Every check sum is looked at, that of a chunk before its messages are taken.
    let options = LinearReaderOptions::default()
        .with_record_length_limit(RECORD_MAX)
        .with_prevalidate_chunk_crcs(true)
        .with_validate_data_section_crc(true)
        .with_validate_summary_section_crc(true);
    let messages = MessageReader::new_with_options(BufReader::new(file), options);
    let mut setup: Option<RecordedSetup> = None;
    let mut ticks: Vec<RecordedTick> = Vec::new();
    let mut next = RecordedTick::default();
    let mut answers: Vec<AnswerSeen> = Vec::new();
    let mut cut = None;
    for message in messages {
        let message = match message {
            Ok(message) => message,
            Err(source) if setup.is_none() => return Err(ReadError::NotMcap { path, source }),
            Err(error) => {
                cut = Some(why_cut(&error));
                break;
            }
        };
        let data = message.data.as_ref();
        let taken = match Channel::of_topic(&message.channel.topic) {
            Some(Channel::Setup) => {
                setup = serde_json::from_slice(data).ok();
                setup.is_some()
            }
            Some(Channel::Device(hand, device)) => {
                let arrival = serde_json::from_slice::<DeviceBytes>(data).ok().and_then(|read| {
                    let DeviceBytes { at_s, datagram: is_datagram, hex } = read;
                    Some(Arrival { hand, device, at_s, is_datagram, bytes: bytes_of(&hex)? })
                });
                next.arrivals.extend(arrival.clone());
                arrival.is_some()
            }
            Some(Channel::Answer) => {
                let answer: Option<AnswerSeen> = serde_json::from_slice(data).ok();
                next.springback_refused |=
                    answer.as_ref().is_some_and(|answer| answer.method == SPRINGBACK_REFUSED);
                answers.extend(answer.clone());
                answer.is_some()
            }
            Some(Channel::Tick) => match serde_json::from_slice::<TickSeen>(data) {
                Ok(seen) if ticks.last().is_some_and(|last| last.seen.tick >= seen.tick) => false,
                Ok(seen) => {
                    next.seen = seen;
                    ticks.push(std::mem::take(&mut next));
                    true
                }
                Err(_) => false,
            },
            // What a replay does not need.
            Some(_) | None => true,
        };
        if !taken {
            cut = Some(format!("a message on {} makes no sense", message.channel.topic));
            break;
        }
    }
    let Some(setup) = setup else { return Err(ReadError::NoSetup { path }) };
    if !(VERSION_OF_ONE_HAND..=VERSION).contains(&setup.version) {
        return Err(ReadError::Version { path, found: setup.version });
    }
    join_answers(&mut ticks, &answers);
    Ok(Recording { setup, ticks, cut })
}

/// Why a file ends before its end.
fn why_cut(error: &McapError) -> String {
    match error {
        McapError::UnexpectedEof => {
            "the file ends in the middle: whoever wrote it was ended, or the disk was full"
                .to_owned()
        }
        error => format!("the file is damaged: {error}"),
    }
}

/// Tells each tick which method answered what it asked, where a tick took the answer.
fn join_answers(ticks: &mut [RecordedTick], answers: &[AnswerSeen]) {
    let taken: BTreeSet<u64> = ticks.iter().flat_map(|tick| tick.seen.answers.clone()).collect();
    for answer in answers.iter().filter(|answer| taken.contains(&answer.tick)) {
        if let Ok(at) = ticks.binary_search_by_key(&answer.tick, |tick| tick.seen.tick) {
            ticks[at].answered_by = Some(answer.method.clone());
            ticks[at].from_rest = answer.from_rest;
        }
    }
}
