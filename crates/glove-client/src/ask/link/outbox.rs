//! State shared by the ticks and the link's thread: requests to be sent, and news that has come.

use std::collections::VecDeque;
use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use softgrasp_protocol::{ContactFrame, LargeAsk, Question};

use super::event::{LinkEvent, RequestEnd};
use crate::ask::model_upload::ModelUpload;
use crate::ask::prefetch::Hint;
use crate::ask::unanswered::Unanswered;

/// Request of one tick.
pub struct TickRequest {
    /// Number of the tick.
    pub tick: u64,
    /// Tick in which the grip of this request began.
    pub grip: u64,
    /// Question of the request.
    pub asked: TickQuestion,
}

/// Question of a tick.
pub enum TickQuestion {
    /// Shape under prescribed displacements.
    Held {
        /// Known displacements and wanted results.
        question: Box<Question>,
        /// Wish for large deformation; `None` for linear elasticity. The link decides where its path
        /// begins.
        large: Option<LargeAsk>,
    },
    /// Step of the free object among rigid bodies. The link fills in its model.
    Step(Box<ContactFrame>),
}

/// Activity of the link's thread.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Activity {
    /// Waits for a request.
    #[default]
    Waiting,
    /// Connects to the server, or pauses before the next attempt.
    Connecting,
    /// Sends the model to the server.
    Uploading,
    /// Waits for the first answer of a grip.
    FirstAnswer,
    /// Waits for another answer of a grip.
    LaterAnswer,
}

/// Messages to be sent: of each kind only the newest.
#[derive(Default)]
pub struct Outbox {
    /// Model that requests refer to.
    pub model: Option<ModelUpload>,
    /// Whether the server is to prepare the model even if no request comes.
    pub model_is_new: bool,
    /// Newest request that has not been sent.
    pub request: Option<TickRequest>,
    /// Contacts whose columns are to be prepared.
    pub hint: Hint,
}

/// State shared by the ticks and the link's thread.
#[derive(Default)]
pub struct LinkState {
    /// Messages to be sent.
    pub outbox: Outbox,
    /// Activity of the link's thread.
    pub activity: Activity,
    /// Whether a request is in flight.
    pub busy: bool,
    /// Whether the server is connected.
    pub connected: bool,
    /// Whether the server has refused the newest model.
    pub model_refused: bool,
    /// Whether the ticks have been told that the server is lost.
    pub lost: bool,
    /// Number of times that the server was not found, or was lost.
    pub losses: u64,
    /// Whether the link is to end.
    pub stop: bool,
    /// News that no tick has taken.
    events: VecDeque<LinkEvent>,
    /// Requests that have ended; no more than ticks have made since they last took them.
    ended: Vec<RequestEnd>,
}

/// Largest number of news that are kept; the oldest are dropped.
const EVENTS_MAX: usize = 256;

impl LinkState {
    /// Replaces the request that waits, which ends.
    pub fn replace_request(&mut self, request: TickRequest) {
        let why = match self.activity {
            _ if !self.connected => Unanswered::ServerLost,
            Activity::Connecting => Unanswered::ServerLost,
            _ if self.model_refused => Unanswered::Refused,
            Activity::Uploading => Unanswered::ModelNotReady,
            Activity::FirstAnswer => Unanswered::NewGrip,
            Activity::LaterAnswer | Activity::Waiting => Unanswered::AnswerLate,
        };
        self.drop_request(why);
        self.outbox.request = Some(request);
    }

    /// Ends the request that waits, if there is one.
    pub fn drop_request(&mut self, why: Unanswered) {
        if let Some(request) = self.outbox.request.take() {
            self.end(RequestEnd { tick: request.tick, reached: Err(why) });
        }
    }

    /// Adds the end of a request.
    pub fn end(&mut self, end: RequestEnd) {
        self.ended.push(end);
    }

    /// Adds news.
    pub fn tell(&mut self, event: LinkEvent) {
        if self.events.len() >= EVENTS_MAX {
            self.events.pop_front();
        }
        self.events.push_back(event);
    }

    /// All news and ended requests since the last call.
    pub fn take(&mut self) -> (Vec<LinkEvent>, Vec<RequestEnd>) {
        (self.events.drain(..).collect(), std::mem::take(&mut self.ended))
    }

    /// Whether the server is connected, and keeps the newest model or has refused it.
    pub fn has_model(&self) -> bool {
        let is_done = match self.activity {
            // A job that has just been begun may be that of the model.
            Activity::Waiting => !self.busy,
            Activity::FirstAnswer | Activity::LaterAnswer => true,
            Activity::Connecting | Activity::Uploading => false,
        };
        self.connected && !self.outbox.model_is_new && is_done
    }

    /// Whether no request waits and none is in flight.
    pub fn is_idle(&self) -> bool {
        self.outbox.request.is_none() && !self.busy && !self.outbox.model_is_new
    }
}

/// State behind its lock, and the signal that it has changed.
#[derive(Default)]
pub struct Shared {
    state: Mutex<LinkState>,
    changed: Condvar,
}

impl Shared {
    /// Locks the state; to be held for as short a time as possible.
    pub fn lock(&self) -> MutexGuard<'_, LinkState> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Wakes the threads that wait for a change.
    pub fn notify(&self) {
        self.changed.notify_all();
    }

    /// Waits for a change of the state.
    pub fn wait<'a>(&'a self, state: MutexGuard<'a, LinkState>) -> MutexGuard<'a, LinkState> {
        self.changed.wait(state).unwrap_or_else(PoisonError::into_inner)
    }

    /// Waits until the condition does not hold any more, for at most `at_most`.
    pub fn wait_while<'a>(
        &'a self,
        state: MutexGuard<'a, LinkState>,
        at_most: Duration,
        condition: impl FnMut(&mut LinkState) -> bool,
    ) -> MutexGuard<'a, LinkState> {
        let waited = self.changed.wait_timeout_while(state, at_most, condition);
        waited.unwrap_or_else(PoisonError::into_inner).0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn request(tick: u64) -> TickRequest {
        let asked = TickQuestion::Held { question: Box::default(), large: None };
        TickRequest { tick, grip: 0, asked }
    }

    #[test]
    fn replaced_request_ends_with_what_the_link_was_doing() {
        let mut state = LinkState { connected: true, ..LinkState::default() };
        let doing = [
            (Activity::Uploading, Unanswered::ModelNotReady),
            (Activity::FirstAnswer, Unanswered::NewGrip),
            (Activity::LaterAnswer, Unanswered::AnswerLate),
            (Activity::Waiting, Unanswered::AnswerLate),
            (Activity::Connecting, Unanswered::ServerLost),
        ];
        state.replace_request(request(0));
        for (tick, (activity, why)) in (0..).zip(doing) {
            state.activity = activity;
            state.replace_request(request(tick + 1));
            let (_, ended) = state.take();
            let [RequestEnd { tick: ended_tick, reached: Err(reason) }] = &ended[..] else {
                panic!("{activity:?}: {ended:?}")
            };
            assert_eq!((*ended_tick, *reason), (tick, why), "{activity:?}");
        }
        state.model_refused = true;
        state.activity = Activity::Waiting;
        state.replace_request(request(6));
        let (_, ended) = state.take();
        assert!(matches!(ended[..], [RequestEnd { tick: 5, reached: Err(Unanswered::Refused) }]));
        state.drop_request(Unanswered::GraspEnded);
        state.drop_request(Unanswered::GraspEnded);
        assert_eq!(state.take().1.len(), 1, "it ends once");
        assert!(state.is_idle());
    }
}
