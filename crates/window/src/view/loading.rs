//! An object that is being loaded beside the window, with its progress to be seen.

use std::sync::Arc;
use std::sync::atomic::{AtomicU8, Ordering};
use std::sync::mpsc::{Receiver, TryRecvError, channel};

use softgrasp_grasp::object::ObjectChoice;
use softgrasp_hand::loaded_object::{LoadStage, LoadedObject};

/// The object that a person wants.
#[derive(Clone, Debug, PartialEq)]
pub struct ObjectWish {
    /// The object that is to be loaded.
    pub choice: ObjectChoice,
    /// Nodes of a built-in object, where another number than that of the run is wanted.
    pub nodes: Option<usize>,
    /// Longest extent of the object, m, where another one than that of the run is wanted.
    pub size_m: Option<f64>,
}

impl From<ObjectChoice> for ObjectWish {
    /// An object as fine and as large as it usually is.
    fn from(choice: ObjectChoice) -> Self {
        Self { choice, nodes: None, size_m: None }
    }
}

/// Loads an object. It says at which stage it is and asks whether to go on; an object that nobody
/// wants any more gives `None`, one that cannot be loaded a sentence.
pub type LoadObject = Arc<
    dyn Fn(ObjectWish, &mut dyn FnMut(LoadStage) -> bool) -> Option<Result<LoadedObject, String>>
        + Send
        + Sync,
>;

/// An object that is being loaded on a thread of its own. Dropping it cancels.
pub struct Loading {
    /// [`LoadStage`] as a number, or [`CANCELLED`].
    stage: Arc<AtomicU8>,
    result: Receiver<Result<LoadedObject, String>>,
}

/// Value of the stage that says that nobody wants the object any more.
const CANCELLED: u8 = u8::MAX;

impl Loading {
    /// Begins to load an object. To be called from a thread without real-time priority.
    ///
    /// # Errors
    /// The error of the operating system, when it starts no thread.
    pub fn start(load: LoadObject, wish: ObjectWish) -> std::io::Result<Self> {
        let stage = Arc::new(AtomicU8::new(0));
        let (sender, result) = channel();
        let shared = Arc::clone(&stage);
        std::thread::Builder::new().name("loading".to_owned()).spawn(move || {
            let mut goes_on = |at: LoadStage| {
                let tell = |was| (was != CANCELLED).then_some(at as u8);
                shared.fetch_update(Ordering::Relaxed, Ordering::Relaxed, tell).is_ok()
            };
            if let Some(loaded) = load(wish, &mut goes_on) {
                // Whoever cancelled does not listen.
                let _ = sender.send(loaded);
            }
        })?;
        Ok(Self { stage, result })
    }

    /// Stage at which the loading is.
    pub fn stage(&self) -> LoadStage {
        let at = usize::from(self.stage.load(Ordering::Relaxed));
        LoadStage::ALL.get(at).copied().unwrap_or(LoadStage::Ready)
    }

    /// The object, or why there is none, as soon as that is known; never waits. It can be taken once.
    pub fn take(&self) -> Option<Result<LoadedObject, String>> {
        match self.result.try_recv() {
            Ok(loaded) => Some(loaded),
            Err(TryRecvError::Empty) => None,
            Err(TryRecvError::Disconnected) => {
                Some(Err("loading ended abnormally; this is a fault of the program".to_owned()))
            }
        }
    }
}

impl Drop for Loading {
    fn drop(&mut self) {
        self.stage.store(CANCELLED, Ordering::Relaxed);
    }
}

#[cfg(test)]
mod tests {
    use softgrasp_core::mesh::{BuiltIn, generate};
    use softgrasp_grasp::object::SoftObject;
    use softgrasp_hand::loaded_object::ObjectSummary;
    use softgrasp_hand::scripted::NoGrasp;

    use super::*;

    fn cube() -> LoadedObject {
        let object = SoftObject::try_new(generate(BuiltIn::Cube, 64).unwrap()).unwrap();
        let summary = ObjectSummary {
            name: "cube".to_owned(),
            nodes: object.rest().node_count(),
            tets: object.rest().tets().len(),
            size_m: object.rest().size(),
            notes: Vec::new(),
        };
        let plan = Err(NoGrasp::OutOfReach { extent_m: 0.1 });
        LoadedObject { summary, brought_to_m: None, object, plan }
    }

    fn wait(loading: &Loading) -> Result<LoadedObject, String> {
        loop {
            if let Some(loaded) = loading.take() {
                return loaded;
            }
            std::thread::yield_now();
        }
    }

    #[test]
    fn object_comes_once_after_its_stages_and_what_fails_comes_as_a_sentence() {
        let (gate, passed) = channel::<()>();
        let passed = std::sync::Mutex::new(passed);
        let load: LoadObject = Arc::new(move |wish, goes_on| {
            assert!(goes_on(LoadStage::Plan));
            let _ = passed.lock().unwrap().recv();
            assert!(goes_on(LoadStage::Ready));
            Some(match wish.choice {
                ObjectChoice::BuiltIn(_) => Ok(cube()),
                ObjectChoice::File(path) => Err(format!("cannot read {}", path.display())),
            })
        });
        let wish = |name: &str| ObjectWish::from(name.parse::<ObjectChoice>().unwrap());
        let loading = Loading::start(Arc::clone(&load), wish("cube")).unwrap();
        while loading.stage() < LoadStage::Plan {
            std::thread::yield_now();
        }
        assert!(loading.take().is_none());
        gate.send(()).unwrap();
        assert_eq!(wait(&loading).unwrap().summary.nodes, 64);
        assert_eq!(loading.stage(), LoadStage::Ready);
        let refused = Loading::start(load, wish("no-such-file.msh")).unwrap();
        gate.send(()).unwrap();
        assert_eq!(wait(&refused).err().unwrap(), "cannot read no-such-file.msh");
    }

    #[test]
    fn object_that_is_not_wanted_any_more_is_told_to_stop() {
        let (told, stopped) = channel();
        let load: LoadObject = Arc::new(move |_, goes_on| {
            while goes_on(LoadStage::Mesh) {
                std::thread::yield_now();
            }
            told.send(()).unwrap();
            None
        });
        let cube: ObjectChoice = "cube".parse().unwrap();
        drop(Loading::start(load, cube.into()).unwrap());
        stopped.recv().unwrap();
    }
}
