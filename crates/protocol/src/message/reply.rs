//! All messages of a server as one type.

use super::answer::Answer;
use super::contact::ContactAnswer;
use super::model::ModelReady;
use super::reject::Rejected;
use super::session::Welcome;
use crate::payload::{PayloadReader, encode_frame};
use crate::{DecodeError, EncodeError, Frame, Kind, Limits};

/// Message from server to client; carries the request id of the request it answers.
#[derive(Clone, Debug, PartialEq)]
pub enum Reply {
    /// Answer to `Hello`.
    Welcome(Welcome),
    /// Answer to `Ask`.
    Answer(Box<Answer>),
    /// Answer to `HaveModel`.
    ModelState {
        /// Whether the server keeps the model, so that no upload is needed.
        known: bool,
    },
    /// Answer to `UploadModel`.
    ModelReady(ModelReady),
    /// Refusal of any request that has a reply.
    Rejected(Rejected),
    /// Says that the server is there, to a client whose `Hello` asked for it; request id 0.
    Alive,
    /// Answer to `Ping`.
    Pong {
        /// The number that the `Ping` carried.
        nonce: u64,
    },
    /// Answer to `ContactFrame`.
    ContactAnswer(Box<ContactAnswer>),
}

impl Reply {
    /// Kind of the reply.
    pub fn kind(&self) -> Kind {
        match self {
            Self::Welcome(_) => Kind::Welcome,
            Self::Answer(_) => Kind::Answer,
            Self::ModelState { .. } => Kind::ModelState,
            Self::ModelReady(_) => Kind::ModelReady,
            Self::Rejected(_) => Kind::Rejected,
            Self::Alive => Kind::Alive,
            Self::Pong { .. } => Kind::Pong,
            Self::ContactAnswer(_) => Kind::ContactAnswer,
        }
    }

    /// Appends one frame to `out`; of `limits` only the payload's length is compared.
    ///
    /// # Errors
    /// [`EncodeError`] if the message is too large or its lists do not fit together; `out` is then
    /// unchanged.
    pub fn encode_into(
        &self,
        request_id: u64,
        limits: &Limits,
        out: &mut Vec<u8>,
    ) -> Result<(), EncodeError> {
        encode_frame(self.kind(), request_id, limits, out, |writer| match self {
            Self::Welcome(welcome) => welcome.write(writer),
            Self::Answer(answer) => answer.write(writer),
            Self::ModelState { known } => writer.part(known),
            Self::ModelReady(ready) => writer.part(ready),
            Self::Rejected(rejected) => rejected.write(writer),
            Self::Alive => writer.part(&()),
            Self::Pong { nonce } => writer.part(nonce),
            Self::ContactAnswer(answer) => answer.write(writer),
        })
    }

    /// Decodes the reply in a frame.
    ///
    /// # Errors
    /// [`DecodeError`]; the stream is sound and the session can go on.
    pub fn decode(frame: &Frame, limits: &Limits) -> Result<Self, DecodeError> {
        let kind = frame.kind().ok_or(DecodeError::UnknownKind { kind: frame.header.kind })?;
        let mut reader = PayloadReader::new(&frame.payload);
        let reply = match kind {
            Kind::Welcome => Self::Welcome(Welcome::read(&mut reader, limits)?),
            Kind::Answer => Self::Answer(Box::new(Answer::read(&mut reader, limits)?)),
            Kind::ModelState => Self::ModelState { known: reader.part()? },
            Kind::ModelReady => Self::ModelReady(reader.part()?),
            Kind::Rejected => Self::Rejected(Rejected::read(&mut reader, limits)?),
            Kind::Alive => {
                reader.part::<()>()?;
                Self::Alive
            }
            Kind::Pong => Self::Pong { nonce: reader.part()? },
            Kind::ContactAnswer => {
                Self::ContactAnswer(Box::new(ContactAnswer::read(&mut reader, limits)?))
            }
            Kind::Hello
            | Kind::Ask
            | Kind::HaveModel
            | Kind::UploadModel
            | Kind::Cancel
            | Kind::Prefetch
            | Kind::Drop
            | Kind::Ping
            | Kind::ContactFrame => return Err(DecodeError::WrongDirection { kind }),
        };
        reader.finish()?;
        Ok(reply)
    }
}
