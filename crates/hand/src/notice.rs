//! What the ticks have to say to the person, in a sentence.

/// A sentence for the person.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Notice {
    /// The sentence: what happened, or what did not, why, and what to do.
    pub text: String,
    /// What kind of news it is.
    pub kind: NoticeKind,
}

/// Kinds of news.
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
    /// What was asked for is done.
    pub fn done(text: impl Into<String>) -> Self {
        Self { text: text.into(), kind: NoticeKind::Done }
    }

    /// What was asked for takes its time, or needs something first.
    pub fn waits(text: impl Into<String>) -> Self {
        Self { text: text.into(), kind: NoticeKind::Waits }
    }

    /// What was asked for is not done.
    pub fn refused(text: impl Into<String>) -> Self {
        Self { text: text.into(), kind: NoticeKind::Refused }
    }
}
