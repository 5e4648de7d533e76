//! A tracker: hears commands and sends replies and records.

use std::collections::VecDeque;

use nalgebra::{Isometry3, Vector3};
use softgrasp_hand::devices::fastrak::{Encoding, LengthUnit, Station, world_from_transmitter};

use super::command::{Command, next_command};
use super::record::record;
use super::settings::{Refusal, Settings, error_record, station_index};
use crate::fault::{Fault, FaultSetting, Faults};
use crate::line::OutLine;

/// Kind of the tracker that is emulated.
#[derive(Clone, Debug, PartialEq)]
pub struct EmulatedTrackerKind {
    /// Whether a receiver is plugged into each of the four sockets.
    pub plugged: [bool; 4],
    /// Speed of the serial line, bits per second.
    pub baud: u32,
    /// How long re-initialisation (Ctrl-Y) takes, s; about 10 in the real one.
    pub restart_s: f64,
    /// Faults that are switched on.
    pub faults: Vec<FaultSetting>,
    /// Seed of the random numbers that decide when a fault occurs.
    pub seed: u64,
}

impl Default for EmulatedTrackerKind {
    /// A tracker with one receiver.
    fn default() -> Self {
        Self {
            plugged: [true, false, false, false],
            baud: 115_200,
            restart_s: 10.0,
            faults: Vec::new(),
            seed: 2,
        }
    }
}

/// An emulated tracker; times are the caller's, s, and never go back.
///
/// Its filters, metal compensation, alignment, increment and envelopes are settings without effect.
#[derive(Clone, Debug)]
pub struct EmulatedTracker {
    kind: EmulatedTrackerKind,
    settings: Settings,
    /// Settings that Ctrl-K has saved.
    saved: Settings,
    faults: Faults,
    line: OutLine,
    inbox: Vec<u8>,
    /// Requests that need the pose at their time, s.
    requests: VecDeque<(f64, Request)>,
    /// Time of the next record in continuous mode, s.
    next_s: f64,
    /// Position of the station that was measured last.
    turn: usize,
    suspended: bool,
    deaf_until_s: f64,
    /// Number of records on the wrong side that are still to come.
    flipped: u32,
    /// The side on which each receiver was last, where the tracker follows it.
    side: [Vector3<f64>; 4],
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Request {
    Poll,
    Boresight(usize),
}

/// Measurements per second, shared among the active stations.
const RATE_HZ: f64 = 120.0;
/// Number of records that a flip lasts.
const FLIP_RECORDS: u32 = 30;
/// Records of continuous mode are not made up for if nobody has asked to be sent for longer than this, s.
const BEHIND_MAX_S: f64 = 5.0;
/// Letters of failed self-tests that the fault shows.
const ERROR_LETTERS: [u8; 5] = [b'a', b'j', b'k', b'x', b'y'];

impl EmulatedTracker {
    /// A tracker that was just switched on.
    pub fn new(kind: EmulatedTrackerKind) -> Self {
        let settings = Settings::factory(kind.plugged);
        Self {
            saved: settings.clone(),
            settings,
            faults: Faults::new(&kind.faults, kind.seed),
            line: OutLine::new(kind.baud),
            inbox: Vec::new(),
            requests: VecDeque::new(),
            next_s: 0.0,
            turn: 0,
            suspended: false,
            deaf_until_s: f64::NEG_INFINITY,
            flipped: 0,
            side: [Vector3::x(); 4],
            kind,
        }
    }

    /// Kind of the tracker.
    pub fn kind(&self) -> &EmulatedTrackerKind {
        &self.kind
    }

    /// Whether a client has asked for records that are still to come.
    pub fn is_asked(&self) -> bool {
        self.settings.continuous || !self.requests.is_empty()
    }

    /// Takes bytes that the client has sent.
    pub fn receive(&mut self, bytes: &[u8], now_s: f64) {
        for &byte in bytes {
            if now_s < self.deaf_until_s || self.line.is_silent(now_s) {
                return;
            }
            self.inbox.push(byte);
            // At most one: a command is complete with its last byte.
            if let Some((command, length)) = next_command(&self.inbox) {
                self.inbox.drain(..length);
                self.obey(command, now_s);
            }
        }
    }

    /// The bytes that have left by now; `stand_from_receiver` is where a receiver is at a time, s.
    ///
    /// Frame: stand, the transmitter's Y-up frame (`docs/frames.md`), m.
    pub fn send(
        &mut self,
        now_s: f64,
        mut stand_from_receiver: impl FnMut(Station, f64) -> Isometry3<f64>,
    ) -> Vec<u8> {
        let mut pose = |station, time_s| {
            world_from_transmitter().inverse() * stand_from_receiver(station, time_s)
        };
        while let Some((time_s, request)) = self.next_due(now_s) {
            match request {
                Some(Request::Poll) => {
                    let active: Vec<Station> = self.settings.active().collect();
                    for station in active {
                        let place = pose(station, time_s);
                        let bytes = self.measure(station, time_s, place);
                        self.line.send_record(bytes, time_s, &mut self.faults);
                    }
                }
                Some(Request::Boresight(index)) => {
                    if let Ok(station) = Station::try_new(index as u8 + 1) {
                        let attitude = pose(station, time_s).rotation;
                        self.settings.stations[index].boresight = attitude.inverse();
                    }
                }
                None => {
                    let active: Vec<Station> = self.settings.active().collect();
                    // One station after the other.
                    self.turn = (self.turn + 1) % active.len().max(1);
                    let Some(&station) = active.get(self.turn) else { continue };
                    let bytes = self.measure(station, time_s, pose(station, time_s));
                    // A line that is too slow loses records, it does not collect them.
                    self.line.advance(time_s);
                    if self.line.waiting() <= 2 * bytes.len() {
                        self.line.send_record(bytes, time_s, &mut self.faults);
                    }
                }
            }
        }
        match self.suspended {
            true => Vec::new(),
            false => self.line.take(now_s),
        }
    }

    /// The next thing to measure by now: a request, or a record of continuous mode.
    fn next_due(&mut self, now_s: f64) -> Option<(f64, Option<Request>)> {
        let continuous = self.settings.continuous.then_some(self.next_s);
        let streamed = continuous.filter(|due_s| *due_s <= now_s);
        if let Some(&(asked_s, request)) = self.requests.front()
            && streamed.is_none_or(|due_s| asked_s <= due_s)
        {
            self.requests.pop_front();
            return Some((asked_s, Some(request)));
        }
        let due_s = streamed?.max(now_s - BEHIND_MAX_S);
        self.next_s = due_s + 1.0 / RATE_HZ;
        Some((due_s, None))
    }

    /// The record of one station.
    fn measure(&mut self, station: Station, time_s: f64, mut pose: Isometry3<f64>) -> Vec<u8> {
        let index = station.index();
        let settings = &self.settings.stations[index];
        let place = &mut pose.translation.vector;
        // The field is the same at the opposite place: the hemisphere decides.
        let side = match settings.hemisphere.norm() > 0.0 {
            true => settings.hemisphere,
            false => self.side[index],
        };
        if place.dot(&side) < 0.0 {
            *place = -*place;
        }
        self.side[index] = *place;
        if self.flipped == 0 && self.faults.hits(Fault::HemisphereFlip) {
            self.flipped = FLIP_RECORDS;
        }
        if self.flipped > 0 {
            self.flipped -= 1;
            *place = -*place;
        }
        pose.rotation *= settings.boresight;
        let error = match self.faults.hits(Fault::StationError) {
            true => ERROR_LETTERS[self.faults.chance.below(ERROR_LETTERS.len())],
            false => b' ',
        };
        let Settings { encoding, units, .. } = self.settings;
        let bytes = record(station, error, &settings.items, &pose, encoding, units);
        if self.faults.hits(Fault::ErrorRecord) {
            let complaint = error_record(b'O', Refusal::OutOfRange, station.number());
            self.line.send(complaint, time_s);
        }
        bytes
    }

    fn obey(&mut self, command: Command, now_s: f64) {
        let reply = match command {
            Command::Nothing => Vec::new(),
            Command::Unknown(letter) => error_record(letter, Refusal::Unknown, 1),
            Command::Text(text) => {
                self.settings.id = text;
                Vec::new()
            }
            Command::Single(letter) => self.obey_letter(letter, now_s),
            Command::Fields { letter: b'B', fields } => match station_index(&fields) {
                Ok(index) => {
                    self.requests.push_back((now_s, Request::Boresight(index)));
                    Vec::new()
                }
                Err(refusal) => error_record(b'B', refusal, 1),
            },
            Command::Fields { letter, fields } => {
                let reply = self.settings.obey(letter, &fields);
                reply.unwrap_or_else(|refusal| {
                    let station = station_index(&fields).map_or(1, |index| index as u8 + 1);
                    error_record(letter, refusal, station)
                })
            }
        };
        self.line.send(reply, now_s);
    }

    fn obey_letter(&mut self, letter: u8, now_s: f64) -> Vec<u8> {
        let settings = &mut self.settings;
        match letter {
            b'P' => self.requests.push_back((now_s, Request::Poll)),
            b'C' => {
                if !settings.continuous {
                    self.next_s = now_s + 1.0 / RATE_HZ;
                }
                settings.continuous = true;
            }
            b'c' => settings.continuous = false,
            b'F' => settings.encoding = Encoding::Ascii,
            b'f' => settings.encoding = Encoding::Binary,
            b'U' => settings.units = LengthUnit::Inches,
            b'u' => settings.units = LengthUnit::Centimetres,
            b'D' => settings.compensation = true,
            b'd' => settings.compensation = false,
            b'S' => return settings.status(),
            b'T' => return b"21T no fault\r\n".to_vec(),
            b'W' => *settings = Settings::factory(self.kind.plugged),
            0x0B => self.saved = settings.clone(),
            0x19 => {
                *settings = Settings { continuous: false, ..self.saved.clone() };
                self.requests.clear();
                self.line.clear();
                self.deaf_until_s = now_s + self.kind.restart_s;
            }
            0x13 => self.suspended = true,
            0x11 => self.suspended = false,
            _ => return error_record(letter, Refusal::Unknown, 1),
        }
        Vec::new()
    }
}

#[cfg(test)]
#[path = "device_tests.rs"]
mod tests;
