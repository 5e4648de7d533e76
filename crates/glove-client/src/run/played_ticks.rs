//! Records of the ticks of a run: the newest in memory, older ones in a file.

use std::collections::VecDeque;
use std::collections::vec_deque::Iter;
use std::fs::File;
use std::io::{BufRead, BufReader, Read, Seek, SeekFrom, Write};
use std::path::Path;

use serde::ser::{Error as _, SerializeSeq as _};
use serde::{Serialize, Serializer};
use softgrasp_grasp::grasp::StateName;
use softgrasp_protocol::solve_report::SolveSummary;

use crate::run::contact_ledger::StepRecord;

/// Record of one tick that was played.
#[derive(Clone, Debug, Default, Serialize)]
pub struct TickRecord {
    /// Number of the tick, from 0.
    pub tick: u64,
    /// Time at which the tick began, ms since the first tick was due.
    pub at_ms: f64,
    /// State of the grasp after the tick.
    pub state: String,
    /// Whether each fingertip touches: thumb, index, middle, ring, little.
    pub tips: [bool; 5],
    /// Number of segments shown at their last free pose, for each finger.
    pub recalled: [u8; 5],
    /// Answer to the tick's question; null if nothing was asked or no answer came.
    pub solve: Option<SolveSummary>,
    /// Step of a grasp by friction that the tick asked for; null if it was not answered.
    pub contact: Option<StepRecord>,
    /// Reason why a deforming tick has no answer; null for all other ticks.
    pub unanswered: Option<&'static str>,
    /// Tick whose answer the object shows after this one; null if it shows none of this grip.
    pub shown_tick: Option<u64>,
    /// Computing time of the tick, ms.
    pub compute_ms: f64,
    /// The further objects, in their order; absent in a run of one.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub further: Vec<FurtherRecord>,
}

impl TickRecord {
    /// Whether the fingers deformed the object in this tick.
    pub(crate) fn deforms(&self) -> bool {
        self.state == StateName::Deforming.to_string()
    }

    /// Whether the fingers deformed the object, and there is neither an answer nor a reason yet.
    pub(crate) fn is_open(&self) -> bool {
        self.deforms() && self.solve.is_none() && self.unanswered.is_none()
    }
}

/// Record of a further object in one tick that was played.
#[derive(Clone, Debug, Serialize)]
pub struct FurtherRecord {
    /// Number of the object, from 2.
    pub object: usize,
    /// State of its grasp after the tick.
    pub state: String,
    /// Whether each fingertip of the first hand touches it, thumb first.
    pub tips: [bool; 5],
    /// Step that the tick asked for; null if it was not answered.
    pub contact: Option<StepRecord>,
    /// Reason why a tick in which it was touched has no answer; null for all other ticks.
    pub unanswered: Option<&'static str>,
    /// Tick whose answer the object shows after this one; null if it shows none.
    pub shown_tick: Option<u64>,
}

impl FurtherRecord {
    /// Whether a hand touched the object in this tick.
    pub(crate) fn deforms(&self) -> bool {
        self.state == StateName::Deforming.to_string()
    }

    /// Whether a hand touched it, and there is neither an answer nor a reason yet.
    pub(crate) fn is_open(&self) -> bool {
        self.deforms() && self.contact.is_none() && self.unanswered.is_none()
    }
}

/// Records of a run, in order. Memory does not grow with the run: older records are written to a file
/// without a name, if they are wanted at all.
#[derive(Debug, Default)]
pub struct PlayedTicks {
    newest: VecDeque<TickRecord>,
    /// File of older records, one line of JSON each; `None` if they are not wanted.
    older: Option<File>,
    /// Lines that are still to be written to the file.
    to_write: Vec<u8>,
    count: u64,
    /// Reason why there is no file although records are wanted.
    no_file: Option<String>,
    /// Reason why older records are incomplete.
    failed: Option<String>,
}

/// Number of records in memory: more than a minute at 60 ticks a second. No answer comes later.
const NEWEST_MAX: usize = 4096;
/// Length of the pieces in which the file is written, bytes.
const PIECE_BYTES: usize = 1 << 16;

impl PlayedTicks {
    /// Keeps older records for a report at this path, in a file without a name beside it, or in the
    /// system's folder for temporary files.
    pub fn keep_older(&mut self, report: &Path) {
        let folder = report.parent().filter(|folder| *folder != Path::new(""));
        let beside = tempfile::tempfile_in(folder.unwrap_or(Path::new(".")));
        match beside.or_else(|_| tempfile::tempfile()) {
            Ok(file) => self.older = Some(file),
            Err(error) => self.no_file = Some(error.to_string()),
        }
    }

    /// Adds a record; returns the one that leaves memory for it.
    pub fn push(&mut self, record: TickRecord) -> Option<TickRecord> {
        self.count += 1;
        self.newest.push_back(record);
        let oldest = (self.newest.len() > NEWEST_MAX).then(|| self.newest.pop_front()).flatten();
        if let Some(oldest) = &oldest {
            self.write_older(oldest);
        }
        oldest
    }

    fn write_older(&mut self, record: &TickRecord) {
        let Some(file) = &mut self.older else {
            let why = self.no_file.as_ref();
            self.failed = why.map(|error| format!("older ticks could not be kept: {error}"));
            return;
        };
        // Plain numbers and texts have a JSON form.
        if serde_json::to_writer(&mut self.to_write, record).is_err() {
            return;
        }
        self.to_write.push(b'\n');
        if self.to_write.len() < PIECE_BYTES {
            return;
        }
        if let Err(error) = file.write_all(&self.to_write) {
            self.no_file = Some(error.to_string());
            self.older = None;
        }
        self.to_write.clear();
    }

    /// Reason why older records are missing, if they are wanted and incomplete.
    pub fn why_missing(&self) -> Option<&str> {
        self.failed.as_deref()
    }

    /// Number of ticks that were played.
    pub fn count(&self) -> u64 {
        self.count
    }

    /// Records in memory, oldest first.
    pub fn iter(&self) -> Iter<'_, TickRecord> {
        self.newest.iter()
    }

    /// Records in memory, oldest first, for changes.
    pub fn iter_mut(&mut self) -> impl Iterator<Item = &mut TickRecord> {
        self.newest.iter_mut()
    }

    /// The newest record.
    pub fn last(&self) -> Option<&TickRecord> {
        self.newest.back()
    }

    /// The newest record, for changes.
    pub fn last_mut(&mut self) -> Option<&mut TickRecord> {
        self.newest.back_mut()
    }

    /// The record of a tick, if it was played and is in memory.
    pub fn get(&self, tick: u64) -> Option<&TickRecord> {
        let at = self.newest.binary_search_by_key(&tick, |record| record.tick).ok()?;
        self.newest.get(at)
    }

    /// Record of a tick, for changes, if it is in memory.
    pub fn get_mut(&mut self, tick: u64) -> Option<&mut TickRecord> {
        let at = self.newest.binary_search_by_key(&tick, |record| record.tick).ok()?;
        self.newest.get_mut(at)
    }
}

impl<'a> IntoIterator for &'a PlayedTicks {
    type Item = &'a TickRecord;
    type IntoIter = Iter<'a, TickRecord>;

    fn into_iter(self) -> Self::IntoIter {
        self.iter()
    }
}

/// Serialises all records; older ones as they are read from their file.
impl Serialize for PlayedTicks {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut all = serializer.serialize_seq(None)?;
        if let Some(mut file) = self.older.as_ref() {
            file.seek(SeekFrom::Start(0)).map_err(S::Error::custom)?;
            for line in BufReader::new(file).chain(&self.to_write[..]).lines() {
                let line = line.map_err(S::Error::custom)?;
                // Numbers come back from their text as they were.
                let record: serde_json::Value =
                    serde_json::from_str(&line).map_err(S::Error::custom)?;
                all.serialize_element(&record)?;
            }
        }
        self.newest.iter().try_for_each(|record| all.serialize_element(record))?;
        all.end()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn record(tick: u64) -> TickRecord {
        TickRecord {
            tick,
            at_ms: 16.7 * tick as f64,
            state: "Free".to_owned(),
            tips: [false; 5],
            recalled: [0; 5],
            solve: None,
            contact: None,
            unanswered: None,
            shown_tick: None,
            compute_ms: 0.25,
            further: Vec::new(),
        }
    }

    #[test]
    fn memory_of_a_long_run_is_bounded_and_its_report_has_every_tick() {
        let folder = tempfile::tempdir().unwrap();
        let mut played = PlayedTicks::default();
        played.keep_older(&folder.path().join("report.json"));
        let all = 3 * NEWEST_MAX as u64 + 17;
        let left: Vec<u64> =
            (0..all).filter_map(|tick| played.push(record(tick))).map(|r| r.tick).collect();
        assert_eq!(left, (0..all - NEWEST_MAX as u64).collect::<Vec<_>>(), "each leaves once");
        assert_eq!((played.newest.len(), played.count()), (NEWEST_MAX, all));
        assert!(played.to_write.len() < PIECE_BYTES);
        assert!(played.get(0).is_none() && played.get(all - 1).is_some());
        let text = serde_json::to_string_pretty(&played).unwrap();
        let read: Vec<serde_json::Value> = serde_json::from_str(&text).unwrap();
        let ticks: Vec<u64> = read.iter().map(|r| r["tick"].as_u64().unwrap()).collect();
        assert_eq!(ticks, (0..all).collect::<Vec<_>>());
        assert_eq!(read[0]["compute_ms"], 0.25);
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0, "nothing is left behind");
    }
}
