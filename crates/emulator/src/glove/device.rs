//! A glove with its interface unit: hears commands and sends replies and records.

use std::collections::VecDeque;

use softgrasp_grasp::hand::Handedness;
use softgrasp_hand::devices::cyberglove::{
    GloveStatus, GloveTicks, RawSensors, RecordKind, SensorCount, SensorSet,
};

use super::command::{Command, next_command};
use super::unit::Unit;
use crate::fault::{Fault, FaultSetting, Faults};
use crate::line::OutLine;

/// Kind of the glove that is emulated.
#[derive(Clone, Debug, PartialEq)]
pub struct EmulatedGloveKind {
    /// Number of sensors of the glove.
    pub sensors: SensorCount,
    /// Hand that the glove is made for.
    pub hand: Handedness,
    /// Speed of the serial line, bits per second.
    pub baud: u32,
    /// How long a restart (Ctrl-R) takes, s; 1.75 in the real one.
    pub restart_s: f64,
    /// Faults that are switched on.
    pub faults: Vec<FaultSetting>,
    /// Seed of the random numbers that decide when a fault occurs.
    pub seed: u64,
}

impl Default for EmulatedGloveKind {
    fn default() -> Self {
        Self {
            sensors: SensorCount::TwentyTwo,
            hand: Handedness::Right,
            baud: 115_200,
            restart_s: 1.75,
            faults: Vec::new(),
            seed: 1,
        }
    }
}

/// An emulated glove; times are the caller's, s, and never go back.
///
/// What its quantised output, external synchronisation and vibration would change is not emulated.
#[derive(Clone, Debug)]
pub struct EmulatedGlove {
    kind: EmulatedGloveKind,
    unit: Unit,
    faults: Faults,
    dead: SensorSet,
    line: OutLine,
    inbox: Vec<u8>,
    /// Requests for one record: when each came, s, and whether the record is text.
    polls: VecDeque<(f64, bool)>,
    /// Time of the stream's next record, s, and whether it is text.
    stream: Option<(f64, bool)>,
    /// Time until which the unit hears nothing because it restarts, s.
    deaf_until_s: f64,
    clock_zero_s: f64,
}

/// Fastest sampling with and without the filter, 1/s.
const FASTEST_FILTERED_HZ: f64 = 100.0;
const FASTEST_HZ: f64 = 150.0;
/// A stream's records are not made up for if nobody has asked to be sent for longer than this, s.
const BEHIND_MAX_S: f64 = 5.0;

impl EmulatedGlove {
    /// A glove that was just switched on; its clock starts at 0.
    pub fn new(kind: EmulatedGloveKind) -> Self {
        let mut faults = Faults::new(&kind.faults, kind.seed);
        let dead = dead_sensors(kind.sensors, &mut faults);
        Self {
            unit: Unit::new(kind.sensors, kind.hand),
            faults,
            dead,
            line: OutLine::new(kind.baud),
            inbox: Vec::new(),
            polls: VecDeque::new(),
            stream: None,
            deaf_until_s: f64::NEG_INFINITY,
            clock_zero_s: 0.0,
            kind,
        }
    }

    /// Kind of the glove.
    pub fn kind(&self) -> &EmulatedGloveKind {
        &self.kind
    }

    /// Whether a client has asked for records that are still to come.
    pub fn is_asked(&self) -> bool {
        self.stream.is_some() || !self.polls.is_empty()
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

    /// The bytes that have left by now; `pose` is what the sensors measure at a time, s.
    pub fn send(&mut self, now_s: f64, mut pose: impl FnMut(f64) -> RawSensors) -> Vec<u8> {
        while let Some((time_s, text, kind)) = self.next_due(now_s) {
            let record = self.record(time_s, text, kind, &pose(time_s));
            self.line.send_record(record, time_s, &mut self.faults);
        }
        self.line.take(now_s)
    }

    /// The next record that is due by now.
    fn next_due(&mut self, now_s: f64) -> Option<(f64, bool, RecordKind)> {
        let polled = self.polls.front().copied();
        let streamed = self.stream.filter(|(due_s, _)| *due_s <= now_s);
        if let Some((due_s, text)) = polled
            && streamed.is_none_or(|(other_s, _)| due_s <= other_s)
        {
            self.polls.pop_front();
            return Some((due_s, text, RecordKind::Polled));
        }
        let (due_s, text) = streamed?;
        let due_s = due_s.max(now_s - BEHIND_MAX_S);
        self.stream = Some((due_s + self.period_s().0, text));
        Some((due_s, text, RecordKind::Streamed))
    }

    /// Time between the records of a stream, s, and whether it is longer than was asked for.
    fn period_s(&self) -> (f64, bool) {
        let [first, second] = self.unit.period.map(f64::from);
        let asked = first * second / GloveTicks::PER_SECOND;
        let fastest = if self.unit.filter { FASTEST_FILTERED_HZ } else { FASTEST_HZ };
        let record = 2 + self.unit.sent + 6 * usize::from(self.unit.timestamp);
        let possible = (1.0 / fastest).max(self.line.duration_s(record));
        // 0 asks for as fast as possible.
        (asked.max(possible), asked > 0.0 && asked < possible * (1.0 - 1e-9))
    }

    fn record(&mut self, time_s: f64, text: bool, kind: RecordKind, raw: &RawSensors) -> Vec<u8> {
        let unplugged = self.faults.hits(Fault::NotPluggedIn);
        let too_fast = kind == RecordKind::Streamed && self.period_s().1;
        let error: &[u8] = match (unplugged, too_fast || self.faults.hits(Fault::TooFast)) {
            (true, _) => b"eg",
            (false, true) => b"es",
            (false, false) => b"",
        };
        let dead = self.dead;
        let mut values: Vec<u8> = (self.unit.sensors())
            .map(|sensor| match dead.contains(sensor) {
                // Some break open and some closed.
                true => [1, 254][sensor.index() % 2],
                false => raw.get(sensor).unwrap_or(1),
            })
            .collect();
        if self.faults.hits(Fault::ZeroByte) {
            let place = self.faults.chance.below(values.len());
            values.get_mut(place).into_iter().for_each(|value| *value = 0);
        }
        if text {
            let mut line = vec![kind.letter().to_ascii_lowercase()];
            values.iter().for_each(|value| line.extend(format!(" {value}").bytes()));
            return [&line, error, b"\r\n\0"].concat();
        }
        let mut bytes = vec![kind.letter()];
        bytes.extend(values);
        if self.unit.timestamp {
            let ticks = ((time_s - self.clock_zero_s) * GloveTicks::PER_SECOND).max(0.0);
            // The unit's clock wraps.
            bytes.extend(GloveTicks(ticks as u64 as u32).encode());
        }
        if self.unit.status {
            let Unit { switch: switch_on, light: light_on, .. } = self.unit;
            let status = GloveStatus { plugged_in: !unplugged, switch_on, light_on };
            bytes.push(status.encode());
        }
        [&bytes, error, b"\0"].concat()
    }

    fn obey(&mut self, command: Command, now_s: f64) {
        let reply = match command {
            Command::Nothing => Vec::new(),
            Command::Poll { text } => {
                self.polls.push_back((now_s, text));
                Vec::new()
            }
            Command::Stream { text } => {
                self.stream = Some((now_s + self.period_s().0, text));
                Vec::new()
            }
            Command::Stop => {
                self.stream = None;
                vec![0x03, 0]
            }
            Command::Reinitialise => vec![0x09, 0],
            Command::Restart => return self.restart(now_s),
            Command::Query { letter, small } => self.answer(letter, small),
            Command::SetBytes { letter, bytes } => match self.unit.set_bytes(letter, &bytes) {
                true => vec![letter, 0],
                false => b"e?\0".to_vec(),
            },
            Command::SetNumbers { letter, numbers } => {
                match self.unit.set_numbers(letter, &numbers) {
                    true => vec![letter, b'\r', b'\n', 0],
                    false => b"e?\0".to_vec(),
                }
            }
            Command::Unknown => b"e?\0".to_vec(),
            Command::TooManyNumbers => b"en\0".to_vec(),
        };
        self.line.send(reply, now_s);
    }

    fn restart(&mut self, now_s: f64) {
        self.unit = Unit::new(self.kind.sensors, self.kind.hand);
        (self.stream, self.clock_zero_s) = (None, now_s);
        self.polls.clear();
        self.line.clear();
        self.deaf_until_s = now_s + self.kind.restart_s;
        self.line.send(b"\x12\r\n\0".to_vec(), self.deaf_until_s);
    }

    fn answer(&self, letter: u8, small: bool) -> Vec<u8> {
        let text = match letter {
            b'i' => format!("CyberGlove emulator, {} sensors", self.kind.sensors.number()),
            b'v' | b'V' => "2.0".to_owned(),
            _ => {
                let Some(payload) = self.unit.answer(letter, true) else { return b"e?\0".to_vec() };
                if !small {
                    return [&[b'?', letter][..], &payload, &[0]].concat();
                }
                let numbers: Vec<String> = payload.iter().map(u8::to_string).collect();
                let small = char::from(letter.to_ascii_lowercase());
                return format!("{small} {}\r\n\0", numbers.join(" ")).into_bytes();
            }
        };
        format!("?{}{text}\r\n\0", char::from(letter)).into_bytes()
    }
}

/// The sensors that a fault has broken: a share of all, at least one.
fn dead_sensors(count: SensorCount, faults: &mut Faults) -> SensorSet {
    let Some(rate) = faults.rate(Fault::DeadSensor) else { return SensorSet::EMPTY };
    let wanted = ((rate * count.number() as f64).round() as usize).max(1);
    let mut left: Vec<_> = count.wire_order().collect();
    let drawn = (0..wanted.min(left.len())).map(|_| {
        let place = faults.chance.below(left.len());
        left.swap_remove(place)
    });
    drawn.collect()
}

#[cfg(test)]
#[path = "device_tests.rs"]
mod tests;
