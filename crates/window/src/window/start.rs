//! Begins a run beside the window, so that the window is alive from its first picture on.

use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::mpsc::{Receiver, TryRecvError, channel};

use softgrasp_core::fem::Material;
use softgrasp_grasp::object::{ContactModel, ObjectChoice};

use super::running::{About, Ticks};
use crate::view::camera::ViewCamera;
use crate::view::display::Display;
use crate::view::loading::LoadObject;
use crate::view::outlet::Inlet;

/// A run that is ready.
pub struct Started {
    /// Starts its thread.
    pub play: Box<dyn FnOnce() -> std::io::Result<Ticks> + Send>,
    /// Where its frames come out.
    pub inlet: Inlet,
    /// What can be said of it.
    pub about: About,
}

/// A run that is about to begin.
pub struct Start {
    step: Arc<AtomicUsize>,
    result: Receiver<anyhow::Result<Started>>,
}

impl Start {
    /// Begins on a thread of its own. `begin` says at which step of the loading card it is.
    ///
    /// # Errors
    /// The system's, when it gives no thread.
    pub fn begin(
        begin: impl FnOnce(&dyn Fn(usize)) -> anyhow::Result<Started> + Send + 'static,
    ) -> std::io::Result<Self> {
        let step = Arc::new(AtomicUsize::new(0));
        let (sender, result) = channel();
        let shared = Arc::clone(&step);
        std::thread::Builder::new().name("start".to_owned()).spawn(move || {
            let started = begin(&|step| shared.store(step, Ordering::Relaxed));
            // The window may have been closed.
            let _ = sender.send(started);
        })?;
        Ok(Self { step, result })
    }

    /// The step it is at.
    pub fn step(&self) -> usize {
        self.step.load(Ordering::Relaxed)
    }

    /// The run, once it has begun.
    pub fn take(&self) -> Option<anyhow::Result<Started>> {
        match self.result.try_recv() {
            Ok(started) => Some(started),
            Err(TryRecvError::Empty) => None,
            Err(TryRecvError::Disconnected) => Some(Err(anyhow::anyhow!(
                "the run could not begin; this is a fault of the program"
            ))),
        }
    }
}

/// What a window is opened for.
pub struct Opening {
    /// What is shown at first.
    pub display: Display,
    /// Where the eye is at first.
    pub camera: ViewCamera,
    /// Whether the person chose what the colours show; else a script shows strain while it squeezes.
    pub shading_is_chosen: bool,
    /// Whether the person chose where the eye is; else the first hand does.
    pub eye_is_chosen: bool,
    /// Whether the person chose the level of drawing; else the machine does.
    pub level_is_chosen: bool,
    /// The object.
    pub object: ObjectChoice,
    /// What the fingertips of hands hold that the person chooses.
    pub contact: ContactModel,
    /// Loads another object in its place.
    pub load: LoadObject,
    /// Material of the object.
    pub material: Material,
}
