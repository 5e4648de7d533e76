//! The thread that asks a runtime for its hands, and looks for it when it is lost.

use std::sync::Arc;
use std::sync::mpsc::{SyncSender, sync_channel};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use super::error::RuntimeError;
use super::runtime_feed::RuntimeFeed;
use super::session::{HandSession, Loader};
use super::wanted::WantedHands;
use crate::notice::Notice;

/// Shortest and longest time from one question to the next: a hand that is not heard of for 0.25 s counts
/// as lost, and nothing behind this reads more than a thousand a second.
const PERIODS: (Duration, Duration) = (Duration::from_millis(1), Duration::from_millis(33));
/// Longest wait for the runtime to grant a session.
const ANSWER_MAX: Duration = Duration::from_secs(20);
/// A runtime that is lost is looked for so often.
const LOOK_EVERY: Duration = Duration::from_secs(1);
/// Time without any hand after which the person is told.
const UNSEEN_MAX: Duration = Duration::from_secs(1);
/// Longest sleep: the end of the run is heard after it.
const SLEEP_MAX: Duration = Duration::from_millis(20);

/// Follows the hands on a new thread, once the runtime has granted a session.
///
/// # Errors
/// [`RuntimeError`].
pub(super) fn start(
    wanted: WantedHands,
    period: Duration,
    feed: Arc<RuntimeFeed>,
) -> Result<JoinHandle<()>, RuntimeError> {
    let (opened, outcome) = sync_channel(1);
    let period = period.clamp(PERIODS.0, PERIODS.1);
    let of_thread = Arc::clone(&feed);
    let follow = move || Follower { wanted, period, feed: of_thread }.run(&opened);
    let thread = std::thread::Builder::new().name("openxr".to_owned());
    let thread = thread.spawn(follow).map_err(|source| RuntimeError::Thread { source })?;
    match outcome.recv_timeout(ANSWER_MAX) {
        Ok(granted) => granted.map(|()| thread),
        Err(_) => {
            // Whoever waits inside the runtime ends when that lets go.
            feed.end();
            Err(RuntimeError::NoAnswer { seconds: ANSWER_MAX.as_secs() })
        }
    }
}

struct Follower {
    wanted: WantedHands,
    period: Duration,
    feed: Arc<RuntimeFeed>,
}

impl Follower {
    fn run(self, opened: &SyncSender<Result<(), RuntimeError>>) {
        let first = Loader::open().and_then(|loader| {
            let session = HandSession::open(&loader, self.wanted)?;
            Ok((loader, session))
        });
        // Who no longer waits for the answer has ended the feed.
        let _ = match first {
            Ok((loader, session)) => {
                let sent = opened.send(Ok(()));
                self.follow(&loader, session);
                sent
            }
            Err(error) => opened.send(Err(error)),
        };
    }

    fn follow(&self, loader: &Loader, first: HandSession) {
        let mut session = Some(first);
        let mut seen = Instant::now();
        let mut due = seen;
        while !self.feed.is_over() {
            session = match session {
                Some(open) => self.ask(open, &mut seen),
                None => self.look(loader, &mut seen),
            };
            let pause = if session.is_some() { self.period } else { LOOK_EVERY };
            // What was late is not made up for.
            due = (due + pause).max(Instant::now());
            self.sleep_until(due);
        }
    }

    /// Asks for the hands and hands them on; returns the session, if it goes on.
    fn ask(&self, mut session: HandSession, seen: &mut Instant) -> Option<HandSession> {
        match session.locate() {
            Ok(records) => {
                let now = Instant::now();
                records.iter().for_each(|record| self.feed.joints.hand_on(record, now));
                if !records.is_empty() {
                    *seen = now;
                    self.feed.complain(None);
                } else if now.saturating_duration_since(*seen) > UNSEEN_MAX {
                    let runtime = session.runtime();
                    let text = format!("the OpenXR runtime {runtime} sees no hand");
                    self.feed.complain(Some(Notice::waits(text)));
                }
                Some(session)
            }
            Err(error) => {
                tracing::warn!(%error, "openxr");
                let text = format!("{error}: it is looked for every second");
                self.feed.complain(Some(Notice::refused(text)));
                None
            }
        }
    }

    /// Looks for a runtime that was lost. Until it is there the person is told why it was.
    fn look(&self, loader: &Loader, seen: &mut Instant) -> Option<HandSession> {
        match HandSession::open(loader, self.wanted) {
            Ok(session) => {
                *seen = Instant::now();
                self.feed.complain(None);
                Some(session)
            }
            Err(error) => {
                tracing::debug!(%error, "openxr");
                None
            }
        }
    }

    fn sleep_until(&self, due: Instant) {
        while !self.feed.is_over() {
            let left = due.saturating_duration_since(Instant::now());
            if left.is_zero() {
                return;
            }
            std::thread::sleep(left.min(SLEEP_MAX));
        }
    }
}
