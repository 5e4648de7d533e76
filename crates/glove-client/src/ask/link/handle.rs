//! Handle by which the ticks use the link.

use std::sync::Arc;
use std::thread::JoinHandle;
use std::time::Duration;

use softgrasp_protocol::{ContactFrame, LargeAsk, Question};

use super::event::{LinkEvent, RequestEnd};
use super::outbox::{Activity, LinkState, Shared, TickQuestion, TickRequest};
use super::worker::Worker;
use crate::ask::endpoint::Endpoint;
use crate::ask::model_upload::ModelUpload;
use crate::ask::prefetch::Hint;
use crate::ask::unanswered::Unanswered;
use crate::pace::tick_budget::Priority;

/// Handle of the link's thread.
pub struct Link {
    shared: Arc<Shared>,
    thread: Option<JoinHandle<()>>,
}

impl Link {
    /// Starts the link to a server. Its thread has `priority` while it awaits the answer of a tick; it
    /// connects and sends the model with ordinary priority.
    ///
    /// # Errors
    /// Error of the operating system if it starts no thread.
    pub fn start(server: impl Into<Endpoint>, priority: Priority) -> std::io::Result<Self> {
        let shared = Arc::new(Shared::default());
        let worker = Worker::new(Arc::clone(&shared), server.into(), priority);
        let thread = std::thread::Builder::new().name("link".to_owned());
        let thread = thread.spawn(move || worker.work())?;
        Ok(Self { shared, thread: Some(thread) })
    }

    /// Sets the model that later requests refer to; an older request that waits ends.
    pub fn set_model(&self, model: ModelUpload) {
        let mut state = self.shared.lock();
        state.drop_request(Unanswered::GraspEnded);
        state.outbox.model = Some(model);
        state.outbox.model_is_new = true;
        state.model_refused = false;
        state.outbox.hint = Hint::default();
        drop(state);
        self.shared.notify();
    }

    /// Asks for the displacements of a tick; replaces a request that has not been sent yet. `grip` is the
    /// tick in which the grip began; at large deformation its first answer begins at the shape at rest,
    /// the others where the answer before ended.
    pub fn ask(&self, tick: u64, grip: u64, question: Question, large: Option<LargeAsk>) {
        let asked = TickQuestion::Held { question: Box::new(question), large };
        self.replace(TickRequest { tick, grip, asked });
    }

    /// Asks for a step of the free object; replaces a request that has not been sent yet. The link fills
    /// in the model. After a refusal the server is asked again only when `grip` changes.
    pub fn ask_step(&self, tick: u64, grip: u64, frame: ContactFrame) {
        self.replace(TickRequest { tick, grip, asked: TickQuestion::Step(Box::new(frame)) });
    }

    fn replace(&self, request: TickRequest) {
        self.shared.lock().replace_request(request);
        self.shared.notify();
    }

    /// Sends a hint of contacts that may be made soon; there is no answer.
    pub fn prefetch(&self, hint: &Hint) {
        self.shared.lock().outbox.hint.append(hint);
        self.shared.notify();
    }

    /// Ends a request that has not been sent yet, because the grasp is over.
    pub fn cancel(&self) {
        self.shared.lock().drop_request(Unanswered::GraspEnded);
    }

    /// News and ended requests since the last call.
    pub fn take(&self) -> (Vec<LinkEvent>, Vec<RequestEnd>) {
        self.shared.lock().take()
    }

    /// Waits until no request waits or is in flight, the server cannot be found, or the time is up;
    /// returns whether all requests were answered.
    pub fn wait_idle(&self, at_most: Duration) -> bool {
        let state = self.shared.lock();
        let losses = state.losses;
        let waits = |state: &mut LinkState| !state.is_idle() && state.losses == losses;
        self.shared.wait_while(state, at_most, waits).is_idle()
    }

    /// Whether the model is being sent to the server and prepared there: assembled, ordered, factored.
    pub fn is_giving_model(&self) -> bool {
        self.shared.lock().activity == Activity::Uploading
    }

    /// Whether the server is connected and keeps the model, or has refused it.
    pub fn has_model(&self) -> bool {
        self.shared.lock().has_model()
    }

    /// Whether the server is connected.
    pub fn is_connected(&self) -> bool {
        self.shared.lock().connected
    }
}

impl Drop for Link {
    fn drop(&mut self) {
        self.shared.lock().stop = true;
        self.shared.notify();
        if let Some(thread) = self.thread.take()
            && thread.join().is_err()
        {
            tracing::error!("the link's thread ended abnormally");
        }
    }
}
