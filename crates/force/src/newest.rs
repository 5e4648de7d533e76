//! The newest answer and the newest hand, handed from the ticks of the run to the thread of the force.

use std::sync::{Mutex, PoisonError, TryLockError};
use std::time::Instant;

use nalgebra::Isometry3;

use crate::small_system::SmallSystem;

/// Place for one answer and one hand: the newest wins, and nobody waits for the other.
#[derive(Debug, Default)]
pub struct Newest {
    held: Mutex<Held>,
}

/// What is new since the last look.
#[derive(Debug, Default)]
pub struct Held {
    /// Answer that was not taken yet, with the moment at which its step ended.
    pub answer: Option<(SmallSystem, Instant)>,
    /// Poses of the bodies that were not taken yet, with the moment at which they were measured.
    pub hand: Option<(Vec<Isometry3<f64>>, Instant)>,
    /// Whether the server is gone.
    pub is_server_lost: bool,
}

impl Newest {
    /// Puts an answer there. `asked_at` is the moment at which the hand was where the step ended.
    pub fn answer(&self, system: SmallSystem, asked_at: Instant) {
        self.change(|held| held.answer = Some((system, asked_at)));
    }

    /// Puts the poses of the bodies there, world from body, in the order of the step's bodies.
    pub fn hand(&self, world_from_bodies: Vec<Isometry3<f64>>, seen_at: Instant) {
        self.change(|held| held.hand = Some((world_from_bodies, seen_at)));
    }

    /// Says whether the server is there.
    pub fn server(&self, is_lost: bool) {
        self.change(|held| held.is_server_lost = is_lost);
    }

    fn change(&self, change: impl FnOnce(&mut Held)) {
        change(&mut self.held.lock().unwrap_or_else(PoisonError::into_inner));
    }

    /// Takes what is new; `None` while another thread puts something there.
    pub fn take(&self) -> Option<Held> {
        let mut held = match self.held.try_lock() {
            Ok(held) => held,
            Err(TryLockError::Poisoned(poisoned)) => poisoned.into_inner(),
            Err(TryLockError::WouldBlock) => return None,
        };
        let Held { answer, hand, is_server_lost } = &mut *held;
        Some(Held { answer: answer.take(), hand: hand.take(), is_server_lost: *is_server_lost })
    }
}
