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

/// A run that is ready to be played.
pub struct Started {
    /// Starts the thread that plays the ticks.
    pub play: Box<dyn FnOnce() -> std::io::Result<Ticks> + Send>,
    /// Inlet from which the views of its ticks are taken.
    pub inlet: Inlet,
    /// Facts of the run that the window shows.
    pub about: About,
}

/// A run that is about to begin, on a thread of its own.
pub struct Start {
    step: Arc<AtomicUsize>,
    result: Receiver<anyhow::Result<Started>>,
}

impl Start {
    /// Begins a run on a thread of its own. `begin` says at which step of the loading card it is.
    ///
    /// # Errors
    /// The error of the operating system, when it starts no thread.
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

    /// Step of loading that the run is at.
    pub fn step(&self) -> usize {
        self.step.load(Ordering::Relaxed)
    }

    /// The run, or why it could not begin, as soon as that is known.
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

/// What a window opens with.
pub struct Opening {
    /// What of the scene is shown at first.
    pub display: Display,
    /// Camera at the beginning.
    pub camera: ViewCamera,
    /// Whether the person chose what the colours show; otherwise a script shows strain while it squeezes.
    pub shading_is_chosen: bool,
    /// Whether the person chose where the eye is; otherwise the first hand decides.
    pub eye_is_chosen: bool,
    /// Whether the person chose the level of the light; otherwise the machine decides.
    pub level_is_chosen: bool,
    /// Choice of the object at the beginning.
    pub object: ObjectChoice,
    /// Contact model of the hands that the person chooses: what their fingertips hold.
    pub contact: ContactModel,
    /// Function that loads another object.
    pub load: LoadObject,
    /// Material of the object at the beginning.
    pub material: Material,
}
