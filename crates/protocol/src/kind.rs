//! The number of each message on the wire.

use std::fmt;

/// Kind of message that a frame carries; the high bit of its number says who sends it (0 client, 1
/// server).
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
#[repr(u16)]
pub enum Kind {
    /// The client introduces itself.
    Hello = 0x0001,
    /// A question about a mesh that comes along, or about a kept model.
    Ask = 0x0002,
    /// Question whether the server keeps a model of this name.
    HaveModel = 0x0003,
    /// Mesh, material and fixed degrees of freedom that the server shall keep as a model.
    UploadModel = 0x0004,
    /// Cancels an earlier request, which the client does not want any more; never answered itself.
    Cancel = 0x0005,
    /// Hint which nodes and masks will be asked about soon; never answered.
    Prefetch = 0x0006,
    /// The client does not need a kept model any more; never answered.
    Drop = 0x0007,
    /// Question whether the server still answers.
    Ping = 0x0008,
    /// One step of a free object among rigid bodies, with contact and friction.
    ContactFrame = 0x0009,
    /// The server introduces itself.
    Welcome = 0x8001,
    /// Displacements, forces and the report of the solve.
    Answer = 0x8002,
    /// Answer to `HaveModel`: whether the server keeps the model.
    ModelState = 0x8003,
    /// Answer to `UploadModel`: the uploaded model can be used.
    ModelReady = 0x8004,
    /// Refusal: the request was understood but not granted, or not understood.
    Rejected = 0x8005,
    /// Sign that the server is there, whether it works or is idle.
    Alive = 0x8006,
    /// Answer to `Ping`.
    Pong = 0x8008,
    /// Answer to `ContactFrame`: state, contacts and displacements at the end of the step.
    ContactAnswer = 0x8009,
}

impl Kind {
    /// All kinds, in the order of their numbers.
    pub const ALL: [Self; 17] = [
        Self::Hello,
        Self::Ask,
        Self::HaveModel,
        Self::UploadModel,
        Self::Cancel,
        Self::Prefetch,
        Self::Drop,
        Self::Ping,
        Self::ContactFrame,
        Self::Welcome,
        Self::Answer,
        Self::ModelState,
        Self::ModelReady,
        Self::Rejected,
        Self::Alive,
        Self::Pong,
        Self::ContactAnswer,
    ];

    /// Name of the kind, as in `docs/wire.md`.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Hello => "Hello",
            Self::Ask => "Ask",
            Self::HaveModel => "HaveModel",
            Self::UploadModel => "UploadModel",
            Self::Cancel => "Cancel",
            Self::Prefetch => "Prefetch",
            Self::Drop => "Drop",
            Self::Ping => "Ping",
            Self::ContactFrame => "ContactFrame",
            Self::Welcome => "Welcome",
            Self::Answer => "Answer",
            Self::ModelState => "ModelState",
            Self::ModelReady => "ModelReady",
            Self::Rejected => "Rejected",
            Self::Alive => "Alive",
            Self::Pong => "Pong",
            Self::ContactAnswer => "ContactAnswer",
        }
    }

    /// Number of the kind in the header.
    pub const fn number(self) -> u16 {
        self as u16
    }

    /// Kind with this number, if one exists.
    pub fn from_number(number: u16) -> Option<Self> {
        Self::ALL.into_iter().find(|kind| kind.number() == number)
    }

    /// Whether the server sends this kind of message.
    pub const fn is_reply(self) -> bool {
        self.number() & 0x8000 != 0
    }
}

impl fmt::Display for Kind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_number_names_at_most_one_kind() {
        let mut found = 0;
        for number in 0..=u16::MAX {
            if let Some(kind) = Kind::from_number(number) {
                assert_eq!(kind.number(), number);
                assert_eq!(kind.name(), format!("{kind:?}"));
                found += 1;
            }
        }
        assert_eq!(found, Kind::ALL.len());
        assert!(Kind::ALL.is_sorted());
    }
}
