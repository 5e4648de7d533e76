//! Hands views of ticks from the ticks to the window: the newest wins, and nobody waits.

use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

use super::frame::ViewFrame;

/// Slot for the view of one tick.
#[derive(Clone, Default)]
struct Slot(Arc<Mutex<Option<Box<ViewFrame>>>>);

/// The end of the ticks, which offers views.
pub struct Outlet {
    slot: Slot,
    /// Shortest time between two offers: a display shows no more.
    every: Duration,
    published: Option<Instant>,
    /// View that could not be offered because the slot was in use; the next one carries its news.
    kept_back: Option<Box<ViewFrame>>,
}

/// The end of the window, which takes views.
pub struct Inlet {
    slot: Slot,
}

/// Both ends of a way on which views of ticks are offered, no more often than after `every`.
pub fn outlet(every: Duration) -> (Outlet, Inlet) {
    let slot = Slot::default();
    (Outlet { slot: slot.clone(), every, published: None, kept_back: None }, Inlet { slot })
}

impl Outlet {
    /// Whether a view should be offered now.
    pub fn is_due(&self) -> bool {
        self.published.is_none_or(|then| then.elapsed() >= self.every)
    }

    /// Offers the view of a tick in the place of the one before; never waits.
    pub fn publish(&mut self, mut frame: Box<ViewFrame>) {
        self.published = Some(Instant::now());
        if let Some(kept_back) = self.kept_back.take() {
            frame.carry_over(*kept_back);
        }
        // Poisoned or not, the slot holds a whole view.
        let slot = match self.slot.0.try_lock() {
            Ok(slot) => Some(slot),
            Err(std::sync::TryLockError::Poisoned(poisoned)) => Some(poisoned.into_inner()),
            Err(std::sync::TryLockError::WouldBlock) => None,
        };
        match slot {
            Some(mut slot) => {
                if let Some(unseen) = slot.take() {
                    frame.carry_over(*unseen);
                }
                *slot = Some(frame);
            }
            None => self.kept_back = Some(frame),
        }
    }
}

impl Inlet {
    /// The newest view that has not been taken.
    pub fn take(&self) -> Option<Box<ViewFrame>> {
        self.slot.0.lock().unwrap_or_else(PoisonError::into_inner).take()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::view::frame::samples::frame_with_news;

    fn texts(frame: &ViewFrame) -> Vec<&str> {
        frame.news.iter().map(|news| news.text.as_str()).collect()
    }

    #[test]
    fn newest_frame_wins_and_brings_the_news_of_those_that_nobody_saw() {
        let (mut out, inlet) = outlet(Duration::ZERO);
        assert!(inlet.take().is_none());
        out.publish(Box::new(frame_with_news(1, "a")));
        out.publish(Box::new(frame_with_news(2, "b")));
        let seen = inlet.take().unwrap();
        assert_eq!((seen.tick, texts(&seen)), (2, vec!["a", "b"]));
        assert!(inlet.take().is_none());
    }

    #[test]
    fn tick_does_not_wait_while_the_window_looks() {
        let (mut out, inlet) = outlet(Duration::ZERO);
        let looking = inlet.slot.0.lock().unwrap();
        out.publish(Box::new(frame_with_news(1, "a")));
        drop(looking);
        assert!(inlet.take().is_none(), "the frame was kept back");
        out.publish(Box::new(frame_with_news(2, "b")));
        assert_eq!(texts(&inlet.take().unwrap()), ["a", "b"]);
    }

    #[test]
    fn frames_are_due_no_more_often_than_asked_for() {
        let (mut out, _inlet) = outlet(Duration::from_secs(3600));
        assert!(out.is_due());
        out.publish(Box::new(frame_with_news(1, "a")));
        assert!(!out.is_due());
    }
}
