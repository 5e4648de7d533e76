//! The link to a device: a thread that speaks with it, and what thread and ticks tell each other.

use std::ops::{Deref, DerefMut};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;

use super::error::DeviceError;

/// A thread that speaks with a device until the link is dropped.
#[derive(Debug)]
pub(super) struct Link<T> {
    /// What the device is called in the log.
    device: &'static str,
    said: Said<T>,
    thread: Option<JoinHandle<()>>,
}

/// What thread and ticks tell each other; both sides have one.
#[derive(Debug)]
pub(super) struct Said<T>(Arc<Mutex<State<T>>>);

/// What is told, and whether and why the link ends.
#[derive(Debug)]
pub(super) struct State<T> {
    told: T,
    /// Whether the thread is to end.
    pub ends: bool,
    /// Last reason why there is no connection.
    pub why_lost: Option<String>,
}

impl<T: Send + 'static> Link<T> {
    /// Starts a thread of a name, which speaks until [`State::ends`].
    ///
    /// # Errors
    /// [`DeviceError::Thread`].
    pub fn start(
        device: &'static str,
        told: T,
        speak: impl FnOnce(Said<T>) + Send + 'static,
    ) -> Result<Self, DeviceError> {
        let state = Arc::new(Mutex::new(State { told, ends: false, why_lost: None }));
        let of_thread = Said(Arc::clone(&state));
        let thread = std::thread::Builder::new()
            .name(device.to_lowercase())
            .spawn(move || speak(of_thread))
            .map_err(DeviceError::Thread)?;
        Ok(Self { device, said: Said(state), thread: Some(thread) })
    }

    /// What thread and ticks tell each other, to be held for as short a time as possible.
    pub fn said(&self) -> MutexGuard<'_, State<T>> {
        self.said.lock()
    }

    /// Ends the thread; why there was no connection, if there was none.
    pub fn close(mut self) -> Option<String> {
        self.end();
        self.said().why_lost.clone()
    }
}

impl<T> Link<T> {
    fn end(&mut self) {
        self.said.lock().ends = true;
        if let Some(thread) = self.thread.take()
            && thread.join().is_err()
        {
            tracing::error!(device = self.device, "the thread of a device ended abnormally");
        }
    }
}

impl<T> Drop for Link<T> {
    fn drop(&mut self) {
        self.end();
    }
}

impl<T> Said<T> {
    /// Locks what is told, to be held for as short a time as possible.
    pub fn lock(&self) -> MutexGuard<'_, State<T>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl<T> Deref for State<T> {
    type Target = T;

    fn deref(&self) -> &T {
        &self.told
    }
}

impl<T> DerefMut for State<T> {
    fn deref_mut(&mut self) -> &mut T {
        &mut self.told
    }
}

/// Whether a read or a write that brought nothing may be tried again.
pub(super) fn is_later(kind: std::io::ErrorKind) -> bool {
    use std::io::ErrorKind::{Interrupted, TimedOut, WouldBlock};
    matches!(kind, Interrupted | TimedOut | WouldBlock)
}
