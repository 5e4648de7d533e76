//! What both drivers share: a thread that keeps a port open for as long as it is wanted.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use super::arrivals::{Arrivals, Arrived};
use super::port::{Lost, Port};
use super::record_assembler::Piece;
use super::source::PortName;
use crate::sent::Device;

/// State of a device on a serial port.
#[derive(Clone, Debug, PartialEq)]
pub enum DeviceState {
    /// The device is not used.
    NotUsed,
    /// The device's port has not been there, or could not be opened, so far; it is tried again and again.
    Absent {
        /// Reason, in words.
        why: String,
    },
    /// The device's port is open and the device is being set up.
    SettingUp,
    /// Records of the device arrive.
    Talking,
    /// The device's port is open and nothing arrives; it is asked and set up again and again.
    Silent {
        /// How long the silence has lasted, s.
        for_s: f64,
    },
    /// The device's port was open and is gone; it is opened again as soon as it is back.
    Lost {
        /// Reason, in words.
        why: String,
    },
}

/// State of the device, as the thread knows it.
#[derive(Clone, Debug)]
pub(super) enum Told {
    Absent(String),
    SettingUp,
    Talking,
    SilentSince(Instant),
    Lost(String),
}

/// Why a driver let go of its open port.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Ended {
    /// The driver was asked to end.
    Stopped,
    /// Nothing arrives; perhaps another opening helps.
    Silent,
}

/// The port, the queue and the state with which a driver's thread works.
pub(super) struct DriverContext {
    device: Device,
    port: PortName,
    arrivals: Arc<Arrivals>,
    shared: Arc<Shared>,
}

struct Shared {
    stop: AtomicBool,
    told: Mutex<Told>,
}

/// Time between two tries to open a port.
const RETRY: Duration = Duration::from_millis(300);
/// Time between two looks whether the thread is to end.
const SLICE: Duration = Duration::from_millis(25);

impl DriverContext {
    /// Whether the thread is to end.
    pub(super) fn stopped(&self) -> bool {
        self.shared.stop.load(Ordering::Relaxed)
    }

    /// Waits for a time, but not once the thread is to end.
    pub(super) fn pause(&self, duration: Duration) {
        let end = Instant::now() + duration;
        while !self.stopped() {
            let left = end.saturating_duration_since(Instant::now());
            if left.is_zero() {
                return;
            }
            std::thread::sleep(left.min(SLICE));
        }
    }

    /// Sets the state of the device.
    pub(super) fn tell(&self, told: Told) {
        let mut slot = self.shared.lock();
        let changed = std::mem::discriminant(&*slot) != std::mem::discriminant(&told);
        if changed {
            tracing::info!(device = self.device.name(), port = %self.port, ?told, "serial device");
        }
        *slot = told;
    }

    /// Sets the state to silent; the time since which it is silent stays if it was silent before.
    pub(super) fn tell_silent(&self, since: Instant) {
        let mut slot = self.shared.lock();
        if !matches!(*slot, Told::SilentSince(_)) {
            *slot = Told::SilentSince(since);
        }
    }

    pub(super) fn is_silent(&self) -> bool {
        matches!(*self.shared.lock(), Told::SilentSince(_))
    }

    /// The port's path and speed.
    pub(super) fn port(&self) -> &PortName {
        &self.port
    }

    /// Hands a piece of bytes over to whoever takes the arrivals.
    pub(super) fn hand_over(&self, piece: Piece) {
        let Piece { bytes, arrived, .. } = piece;
        self.arrivals.push(Arrived { device: self.device, arrived, bytes });
    }

    /// Opens the port again and again, and lets `serve` work with it while it is open.
    fn keep_open(&self, mut serve: impl FnMut(&Self, &mut Port) -> Result<Ended, Lost>) {
        let mut was_open = false;
        while !self.stopped() {
            let PortName { path, baud } = &self.port;
            let served = Port::open(path, *baud).and_then(|mut port| {
                was_open = true;
                if !self.is_silent() {
                    self.tell(Told::SettingUp);
                }
                serve(self, &mut port)
            });
            match served {
                Ok(Ended::Stopped) => return,
                Ok(Ended::Silent) => continue,
                Err(Lost { why }) if was_open => self.tell(Told::Lost(why)),
                Err(Lost { why }) => self.tell(Told::Absent(why)),
            }
            self.pause(RETRY);
        }
    }
}

impl Shared {
    fn lock(&self) -> MutexGuard<'_, Told> {
        self.told.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Owner of a driver's thread; the thread ends when it is dropped.
pub(super) struct DriverThread {
    shared: Arc<Shared>,
    thread: Option<JoinHandle<()>>,
}

impl DriverThread {
    /// Starts a driver that serves its open port.
    ///
    /// # Errors
    /// The error of the operating system, when it starts no thread.
    pub(super) fn start(
        device: Device,
        port: PortName,
        arrivals: Arc<Arrivals>,
        serve: impl FnMut(&DriverContext, &mut Port) -> Result<Ended, Lost> + Send + 'static,
    ) -> std::io::Result<Self> {
        let shared = Arc::new(Shared {
            stop: AtomicBool::new(false),
            told: Mutex::new(Told::Absent("its port has not been opened yet".to_owned())),
        });
        let context = DriverContext { device, port, arrivals, shared: Arc::clone(&shared) };
        let work = move || context.keep_open(serve);
        let thread = std::thread::Builder::new().name(device.name().to_owned()).spawn(work)?;
        Ok(Self { shared, thread: Some(thread) })
    }

    /// State of the device now.
    pub(super) fn state(&self) -> DeviceState {
        match self.shared.lock().clone() {
            Told::Absent(why) => DeviceState::Absent { why },
            Told::SettingUp => DeviceState::SettingUp,
            Told::Talking => DeviceState::Talking,
            Told::SilentSince(since) => {
                DeviceState::Silent { for_s: since.elapsed().as_secs_f64() }
            }
            Told::Lost(why) => DeviceState::Lost { why },
        }
    }

    /// Asks the thread to end, without waiting for it.
    pub(super) fn ask_to_end(&self) {
        self.shared.stop.store(true, Ordering::Relaxed);
    }
}

impl Drop for DriverThread {
    fn drop(&mut self) {
        self.ask_to_end();
        let Some(thread) = self.thread.take() else { return };
        if thread.join().is_err() {
            tracing::error!("the thread of a serial device ended abnormally");
        }
    }
}
