//! Emulated devices on lines of their own, whose records carry their number.

use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, AtomicU64, AtomicUsize, Ordering};
use std::sync::{Arc, Mutex};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use nalgebra::Isometry3;
use softgrasp_emulator::emulation::{GloveLine, PseudoTerminal, TrackerLine};
use softgrasp_emulator::{EmulatedGlove, EmulatedGloveKind, EmulatedTracker, EmulatedTrackerKind};
use softgrasp_hand::devices::cyberglove::{GloveRecord, RawSensors, Sensor, SensorCount};
use softgrasp_hand::serial::{
    GloveMode, GloveSettings, PortName, SerialDevices, SerialSettings, TrackerSettings,
};

/// Time that only a hang takes.
pub(super) const HANG: Duration = Duration::from_secs(120);

/// A thread that serves a line until it is told to stop, and gives it back.
pub(super) struct Served<Line> {
    pub(super) path: PathBuf,
    pub(super) stop: Arc<AtomicBool>,
    /// Number of records made so far.
    pub(super) made: Arc<AtomicUsize>,
    /// Longest time between two steps, s: how much the machine has stalled.
    pub(super) stall_s: Arc<Mutex<f64>>,
    /// Time for which the line is not served, once, ms.
    pub(super) pause_ms: Arc<AtomicU64>,
    pub(super) thread: JoinHandle<Line>,
}

impl<Line: Send + 'static> Served<Line> {
    pub(super) fn start(
        path: &Path,
        mut line: Line,
        mut step: impl FnMut(&mut Line, f64, &AtomicUsize) + Send + 'static,
    ) -> Self {
        let (stop, made) = (Arc::new(AtomicBool::new(false)), Arc::new(AtomicUsize::new(0)));
        let stall_s = Arc::new(Mutex::new(0.0f64));
        let (stopped, count, stall) = (Arc::clone(&stop), Arc::clone(&made), Arc::clone(&stall_s));
        let pause_ms = Arc::new(AtomicU64::new(0));
        let pause = Arc::clone(&pause_ms);
        let thread = std::thread::spawn(move || {
            let begun = Instant::now();
            let mut last_s = 0.0;
            while !stopped.load(Ordering::Relaxed) {
                let now_s = begun.elapsed().as_secs_f64();
                step(&mut line, now_s, &count);
                let mut stall = stall.lock().unwrap();
                *stall = stall.max(now_s - last_s);
                last_s = now_s;
                drop(stall);
                std::thread::sleep(Duration::from_millis(1 + pause.swap(0, Ordering::Relaxed)));
            }
            line
        });
        Self { path: path.to_owned(), stop, made, stall_s, pause_ms, thread }
    }

    pub(super) fn made(&self) -> usize {
        self.made.load(Ordering::Relaxed)
    }

    /// Longest time for which the device was not served, s.
    pub(super) fn stall_s(&self) -> f64 {
        *self.stall_s.lock().unwrap()
    }

    pub(super) fn end(self) -> Line {
        self.stop.store(true, Ordering::Relaxed);
        self.thread.join().unwrap()
    }
}

/// Sensor values that carry the number of their record.
pub(super) fn numbered(count: SensorCount, number: usize) -> RawSensors {
    RawSensors::from_fn(count, |sensor| match sensor {
        Sensor::ThumbRotation => (number % 250 + 1) as u8,
        Sensor::ThumbMcp => (number / 250 % 250 + 1) as u8,
        other => other.index() as u8 + 100,
    })
}

/// The number that a record carries, if it carries one.
pub(super) fn number_of(record: &GloveRecord) -> Option<usize> {
    let values = record.sensors.as_slice();
    let number = usize::from(values[0]) - 1 + 250 * (usize::from(values[1]) - 1);
    (record.sensors == numbered(record.sensors.count(), number)).then_some(number)
}

pub(super) fn glove_line(kind: EmulatedGloveKind, link: Option<&Path>) -> Served<GloveLine> {
    let kind = EmulatedGloveKind { restart_s: 0.1, ..kind };
    let count = kind.sensors;
    let glove = EmulatedGlove::new(kind);
    let line = GloveLine { terminal: PseudoTerminal::open(link).unwrap(), glove };
    let path = line.terminal.path().to_owned();
    Served::start(&path, line, move |line, now_s, made| {
        line.hear(now_s);
        line.speak(now_s, |_| numbered(count, made.fetch_add(1, Ordering::Relaxed)));
    })
}

/// A pose that carries the number of its record: so many millimetres to the right.
pub(super) fn place(number: usize) -> Isometry3<f64> {
    Isometry3::translation(1e-3 * number as f64, 0.05, -0.4)
}

pub(super) fn tracker_line(kind: EmulatedTrackerKind, link: Option<&Path>) -> Served<TrackerLine> {
    let tracker = EmulatedTracker::new(kind);
    let line = TrackerLine { terminal: PseudoTerminal::open(link).unwrap(), tracker };
    let path = line.terminal.path().to_owned();
    Served::start(&path, line, move |line, now_s, made| {
        line.hear(now_s);
        line.speak(now_s, |_, _| place(made.fetch_add(1, Ordering::Relaxed)));
    })
}

pub(super) fn port(path: &Path) -> PortName {
    PortName { path: path.to_owned(), baud: 115_200 }
}

pub(super) fn glove_settings(path: &Path, mode: GloveMode) -> GloveSettings {
    GloveSettings { mode, ..GloveSettings::new(port(path)) }
}

pub(super) fn open_glove(settings: GloveSettings) -> SerialDevices {
    SerialDevices::open(SerialSettings { glove: Some(settings), tracker: None }).unwrap()
}

pub(super) fn open_tracker(settings: TrackerSettings) -> SerialDevices {
    SerialDevices::open(SerialSettings { glove: None, tracker: Some(settings) }).unwrap()
}
