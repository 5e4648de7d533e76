//! What the thread that asks a runtime hands on: records of joints, and what is wrong.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, PoisonError};

use crate::joints::JointsFeed;
use crate::notice::Notice;

/// Queue of joints of a runtime's hands, with what the person is to be told of the runtime.
#[derive(Debug, Default)]
pub(super) struct RuntimeFeed {
    /// Queue of joints.
    pub(super) joints: JointsFeed,
    complaint: Mutex<Option<Notice>>,
    is_over: AtomicBool,
}

impl RuntimeFeed {
    /// What is wrong with the runtime, or what it waits for.
    pub(super) fn complaint(&self) -> Option<Notice> {
        self.complaint.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }

    /// Sets what is wrong with the runtime.
    #[cfg(any(feature = "openxr", test))]
    pub(super) fn complain(&self, complaint: Option<Notice>) {
        *self.complaint.lock().unwrap_or_else(PoisonError::into_inner) = complaint;
    }

    /// Ends the thread that asks.
    pub(super) fn end(&self) {
        self.is_over.store(true, Ordering::Relaxed);
    }

    /// Whether the thread that asks is to end.
    #[cfg(any(feature = "openxr", test))]
    pub(super) fn is_over(&self) -> bool {
        self.is_over.load(Ordering::Relaxed)
    }
}
