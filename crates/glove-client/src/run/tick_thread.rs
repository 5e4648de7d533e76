//! A run on a thread of its own, so that no tick waits for a window.

use std::sync::mpsc::{Receiver, Sender, channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::JoinHandle;

use softgrasp_grasp::object::ObjectError;
use softgrasp_hand::notice::Notice;
use softgrasp_window::view::control::Control;

use crate::pace::Due;
use crate::run::run_report::RunReport;
use crate::run::session::Session;
use crate::run::tick_loop::{TickLoop, Timing};
use crate::run::tick_outcome::TickOutcome;

/// Thread that plays a run. Dropping this stops the run.
pub struct TickThread {
    controls: Sender<Control>,
    notices: Option<Receiver<Notice>>,
    end: RunEnd,
}

/// Handle of the thread that plays a run.
type Ticks = JoinHandle<Result<RunReport, RunError>>;

/// End of a run; one of those who share it may wait for it.
#[derive(Clone)]
pub struct RunEnd {
    thread: Arc<Mutex<Option<Ticks>>>,
}

/// Why a run has no report.
#[derive(Debug, thiserror::Error)]
pub enum RunError {
    /// The object cannot be shown any more.
    #[error(transparent)]
    Object(#[from] ObjectError),
    /// The thread has ended without a report.
    #[error("the run ended abnormally; this is a fault of the program")]
    Lost,
}

impl TickThread {
    /// Starts the thread and the run. To be called from a thread without real-time priority. If the
    /// session is to have it, the new thread asks for it with its first tick; `sink`, which is called
    /// after each tick, must then be brief.
    ///
    /// # Errors
    /// Error of the operating system if it starts no thread.
    pub fn start(
        mut session: Session,
        timing: Timing,
        asked_to_end: impl Fn() -> bool + Send + 'static,
        mut sink: impl FnMut(&Session, &TickOutcome, Due, f64) + Send + 'static,
    ) -> std::io::Result<Self> {
        let (controls, to_obey) = channel();
        let (to_tell, notices) = channel();
        let work = move || {
            let ticks = TickLoop::new(&mut session, timing, &to_obey, &to_tell);
            let ended = ticks.play(asked_to_end, |session, outcome, due, now_s| {
                sink(session, outcome, due, now_s);
                Ok::<(), ObjectError>(())
            })?;
            Ok(session.finish(ended)?)
        };
        let thread = std::thread::Builder::new().name("ticks".to_owned()).spawn(work)?;
        let end = RunEnd { thread: Arc::new(Mutex::new(Some(thread))) };
        Ok(Self { controls, notices: Some(notices), end })
    }

    /// Sends a control; a run that is over ignores it. Never waits.
    pub fn ask(&self, control: Control) {
        let _ = self.controls.send(control);
    }

    /// Sender of controls for another thread.
    pub fn controls(&self) -> Sender<Control> {
        self.controls.clone()
    }

    /// The next sentence for the person, if there is one; never waits.
    pub fn notice(&self) -> Option<Notice> {
        self.notices.as_ref()?.try_recv().ok()
    }

    /// Receiver of all sentences for the person, for another one who shows them from now on.
    pub fn take_notices(&mut self) -> Option<Receiver<Notice>> {
        self.notices.take()
    }

    /// End of the run, for another thread.
    pub fn run_end(&self) -> RunEnd {
        self.end.clone()
    }

    /// Whether the run is over and [`TickThread::join`] does not wait.
    pub fn is_over(&self) -> bool {
        self.end.is_there()
    }

    /// Waits for the end of the run; returns its report.
    ///
    /// # Errors
    /// [`RunError`] if the run has no report.
    pub fn join(self) -> Result<RunReport, RunError> {
        self.end.wait()
    }
}

impl Drop for TickThread {
    fn drop(&mut self) {
        let Some(thread) = self.end.take() else { return };
        self.ask(Control::Stop);
        if thread.join().is_err() {
            tracing::error!("the thread of the ticks ended abnormally");
        }
    }
}

impl RunEnd {
    /// Whether the run has ended, or another thread waits for its end already.
    pub fn is_there(&self) -> bool {
        let thread = self.thread.lock().unwrap_or_else(PoisonError::into_inner);
        thread.as_ref().is_none_or(JoinHandle::is_finished)
    }

    /// Waits for the end of the run; returns its report.
    ///
    /// # Errors
    /// [`RunError`]; also [`RunError::Lost`] if another thread waits for it.
    pub fn wait(&self) -> Result<RunReport, RunError> {
        let Some(thread) = self.take() else { return Err(RunError::Lost) };
        thread.join().unwrap_or(Err(RunError::Lost))
    }

    fn take(&self) -> Option<Ticks> {
        self.thread.lock().unwrap_or_else(PoisonError::into_inner).take()
    }
}
