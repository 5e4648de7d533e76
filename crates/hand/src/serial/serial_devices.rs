//! Glove and tracker as one source of bytes.

use std::sync::{Arc, Mutex, PoisonError};

use super::arrivals::{Arrivals, Arrived};
use super::driver::{DeviceState, DriverThread};
use super::facts::{GloveFacts, TrackerFacts};
use super::glove_driver::serve_glove;
use super::settings::{SerialSettings, SettingsError};
use super::tracker_driver::serve_tracker;
use crate::sent::Device;

/// Why the drivers cannot be started.
#[derive(Debug, thiserror::Error)]
pub enum SerialError {
    /// The settings can never work.
    #[error(transparent)]
    Settings(#[from] SettingsError),
    /// The system starts no thread.
    #[error("the thread of the {device} cannot be started")]
    Thread {
        /// `glove` or `tracker`.
        device: &'static str,
        /// Error of the operating system.
        source: std::io::Error,
    },
}

/// The drivers of glove and tracker. Dropping it ends them within some 100 ms; a stream is stopped.
///
/// A port that is not there is no error: it is tried again and again, and so is one that goes.
pub struct SerialDevices {
    settings: SerialSettings,
    arrivals: Arc<Arrivals>,
    glove_facts: Arc<Mutex<GloveFacts>>,
    tracker_facts: Arc<Mutex<TrackerFacts>>,
    glove: Option<DriverThread>,
    tracker: Option<DriverThread>,
}

impl SerialDevices {
    /// Starts the drivers; a `&SerialSource` stands for its default settings.
    ///
    /// # Errors
    /// [`SerialError`] for settings that can never work.
    pub fn open(settings: impl Into<SerialSettings>) -> Result<Self, SerialError> {
        let settings = settings.into();
        settings.check()?;
        let mut devices = Self {
            settings: settings.clone(),
            arrivals: Arc::default(),
            glove_facts: Arc::default(),
            tracker_facts: Arc::default(),
            glove: None,
            tracker: None,
        };
        if let Some(settings) = settings.glove {
            let (port, arrivals) = (settings.port.clone(), Arc::clone(&devices.arrivals));
            let facts = Arc::clone(&devices.glove_facts);
            let thread =
                DriverThread::start(Device::Glove, port, arrivals, move |context, port| {
                    serve_glove(context, port, &settings, &facts)
                });
            devices.glove =
                Some(thread.map_err(|source| SerialError::Thread { device: "glove", source })?);
        }
        if let Some(settings) = settings.tracker {
            let (port, arrivals) = (settings.port.clone(), Arc::clone(&devices.arrivals));
            let facts = Arc::clone(&devices.tracker_facts);
            let thread =
                DriverThread::start(Device::Tracker, port, arrivals, move |context, port| {
                    serve_tracker(context, port, &settings, &facts)
                });
            devices.tracker =
                Some(thread.map_err(|source| SerialError::Thread { device: "tracker", source })?);
        }
        Ok(devices)
    }

    /// Settings to which the devices are set.
    pub fn settings(&self) -> &SerialSettings {
        &self.settings
    }

    /// Everything that has arrived since the last call, in order of arrival; never waits for a device.
    ///
    /// Each piece is a record or a reply, or bytes that look like neither; fed to a parser one after
    /// another they are the device's stream, without a byte lost or repeated.
    pub fn take(&mut self) -> Vec<Arrived> {
        self.arrivals.take()
    }

    /// Pieces that were dropped, the oldest first, because nobody took them for some half minute.
    pub fn dropped(&self) -> u64 {
        self.arrivals.dropped()
    }

    /// States of glove and tracker, in this order.
    pub fn states(&self) -> [DeviceState; 2] {
        [&self.glove, &self.tracker].map(|driver| match driver {
            Some(driver) => driver.state(),
            None => DeviceState::NotUsed,
        })
    }

    /// What the glove told when it was set up last.
    pub fn glove_facts(&self) -> GloveFacts {
        self.glove_facts.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }

    /// What the tracker told when it was set up last.
    pub fn tracker_facts(&self) -> TrackerFacts {
        self.tracker_facts.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }
}

impl Drop for SerialDevices {
    fn drop(&mut self) {
        // Both at once, then each is waited for.
        [&self.glove, &self.tracker].into_iter().flatten().for_each(DriverThread::ask_to_end);
    }
}
