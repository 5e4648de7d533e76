//! What the ticks have to say to the person, in a sentence.

/// A sentence for the person.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Notice {
    /// The sentence: what happened, or what did not, why, and what to do.
    pub text: String,
    /// Whether what was asked for is done, waits or is refused.
    pub kind: NoticeKind,
}

/// Kinds of notices.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NoticeKind {
    /// What was asked for is done.
    Done,
    /// What was asked for takes its time, or needs something first.
    Waits,
    /// What was asked for is not done.
    Refused,
}

impl Notice {
    /// A notice that what was asked for is done.
    pub fn done(text: impl Into<String>) -> Self {
        Self { text: text.into(), kind: NoticeKind::Done }
    }

    /// A notice that what was asked for takes its time, or needs something first.
    pub fn waits(text: impl Into<String>) -> Self {
        Self { text: text.into(), kind: NoticeKind::Waits }
    }

    /// A notice that what was asked for is not done.
    pub fn refused(text: impl Into<String>) -> Self {
        Self { text: text.into(), kind: NoticeKind::Refused }
    }
}
