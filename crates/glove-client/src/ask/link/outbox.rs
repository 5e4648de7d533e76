//! The state that the ticks and the link's thread share: what is to be sent, and what has come.

use std::collections::VecDeque;
use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use softgrasp_protocol::{ContactFrame, LargeAsk, Question};

use super::event::{LinkEvent, RequestEnd};
use crate::ask::model_upload::ModelUpload;
use crate::ask::prefetch::Hint;
use crate::ask::unanswered::Unanswered;

/// The request of one tick.
pub struct TickRequest {
    /// The tick.
    pub tick: u64,
    /// Tick in which the grip began that it belongs to.
    pub grip: u64,
    /// What is asked.
    pub asked: TickQuestion,
}

/// What a tick asks.
pub enum TickQuestion {
    /// The shape under prescribed displacements.
    Held {
        /// The displacements.
        question: Box<Question>,
        /// What is asked of large deformation; `None` for a linear answer. Where its path begins is
        /// the link's to say.
        large: Option<LargeAsk>,
    },
    /// A step of the free object among rigid bodies. Its model is the link's to say.
    Step(Box<ContactFrame>),
}

/// What the link's thread is doing.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Activity {
    /// It waits for something to do.
    #[default]
    Waiting,
    /// It looks for the server, or rests until it looks again.
    Connecting,
    /// It gives the server the model.
    Uploading,
    /// It waits for the first answer of a grip.
    FirstAnswer,
    /// It waits for another answer of a grip.
    LaterAnswer,
}

/// Everything that waits to be sent: of each kind the newest only.
#[derive(Default)]
pub struct Outbox {
    /// The model that requests refer to.
    pub model: Option<ModelUpload>,
    /// The model is to be made ready even if no request comes.
    pub model_is_new: bool,
    /// The newest request that has not been sent.
    pub request: Option<TickRequest>,
    /// Contacts whose columns are to be prepared.
    pub hint: Hint,
}

/// What ticks and link share.
#[derive(Default)]
pub struct LinkState {
    /// To be sent.
    pub outbox: Outbox,
    /// What the thread is doing.
    pub activity: Activity,
    /// Whether something is in flight.
    pub busy: bool,
    /// Whether the server is there.
    pub connected: bool,
    /// Whether the server has refused the newest model.
    pub model_refused: bool,
    /// Whether the ticks know that the server is not there.
    pub lost: bool,
    /// How often the server was looked for and not found, or went away.
    pub losses: u64,
    /// The link is to end.
    pub stop: bool,
    /// News that no tick has picked up.
    events: VecDeque<LinkEvent>,
    /// Requests that have ended; no more than ticks have made requests since they last looked.
    ended: Vec<RequestEnd>,
}

/// News that no tick picks up are not kept beyond this many; the oldest go.
const EVENTS_MAX: usize = 256;

impl LinkState {
    /// Puts a request in the place of the one that waits, which ends.
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

    /// A request has ended.
    pub fn end(&mut self, end: RequestEnd) {
        self.ended.push(end);
    }

    /// There is news.
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

    /// Whether the server is there and nothing is to be done about the newest model any more.
    pub fn has_model(&self) -> bool {
        let is_done = match self.activity {
            // A job that has just been begun may be that of the model.
            Activity::Waiting => !self.busy,
            Activity::FirstAnswer | Activity::LaterAnswer => true,
            Activity::Connecting | Activity::Uploading => false,
        };
        self.connected && !self.outbox.model_is_new && is_done
    }

    /// Whether nothing waits and nothing is in flight.
    pub fn is_idle(&self) -> bool {
        self.outbox.request.is_none() && !self.busy && !self.outbox.model_is_new
    }
}

/// The state behind its lock, and the signal that it has changed.
#[derive(Default)]
pub struct Shared {
    state: Mutex<LinkState>,
    changed: Condvar,
}

impl Shared {
    /// The state, for as short as possible.
    pub fn lock(&self) -> MutexGuard<'_, LinkState> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Wakes whoever waits for a change.
    pub fn notify(&self) {
        self.changed.notify_all();
    }

    /// Waits for a change.
    pub fn wait<'a>(&'a self, state: MutexGuard<'a, LinkState>) -> MutexGuard<'a, LinkState> {
        self.changed.wait(state).unwrap_or_else(PoisonError::into_inner)
    }

    /// Waits until the condition does not hold any more, at most so long.
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
