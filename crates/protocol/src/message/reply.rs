//! All messages of a server as one type.

use super::answer::Answer;
use super::contact::ContactAnswer;
use super::large::LargeAnswer;
use super::model::ModelReady;
use super::reject::Rejected;
use super::session::Welcome;
use super::several::SeveralAnswers;
use crate::payload::{PayloadReader, encode_frame};
use crate::{DecodeError, EncodeError, Frame, Kind, Limits};

/// Message from server to client; carries the request id of the request it answers.
#[derive(Clone, Debug, PartialEq)]
pub enum Reply {
    /// Answer to `Hello`.
    Welcome(Welcome),
    /// Answer to `SolveOnce` and `Frame`.
    Answer(Box<Answer>),
    /// Answer to `HaveModel`.
    ModelState {
        /// Whether the model can be used without an upload.
        known: bool,
    },
    /// Answer to `UploadModel`.
    ModelReady(ModelReady),
    /// Refusal of any request.
    Rejected(Rejected),
    /// Answer to `Ping`.
    Pong {
        /// The number of the `Ping`.
        nonce: u64,
    },
    /// Answer to `SolveLarge` and `LargeFrame`.
    LargeAnswer(Box<LargeAnswer>),
    /// Answer to `SolveSeveral`.
    SeveralAnswers(Box<SeveralAnswers>),
    /// Answer to `ContactFrame`.
    ContactAnswer(Box<ContactAnswer>),
}

impl Reply {
    /// Its kind.
    pub fn kind(&self) -> Kind {
        match self {
            Self::Welcome(_) => Kind::Welcome,
            Self::Answer(_) => Kind::Answer,
            Self::ModelState { .. } => Kind::ModelState,
            Self::ModelReady(_) => Kind::ModelReady,
            Self::Rejected(_) => Kind::Rejected,
            Self::Pong { .. } => Kind::Pong,
            Self::LargeAnswer(_) => Kind::LargeAnswer,
            Self::SeveralAnswers(_) => Kind::SeveralAnswers,
            Self::ContactAnswer(_) => Kind::ContactAnswer,
        }
    }

    /// Appends one frame to `out`; of `limits` only the payload's length is compared.
    ///
    /// # Errors
    /// [`EncodeError`] if the message is too large or its lists do not fit together; `out` is then
    /// as before.
    pub fn encode_into(
        &self,
        request_id: u64,
        limits: &Limits,
        out: &mut Vec<u8>,
    ) -> Result<(), EncodeError> {
        encode_frame(self.kind(), request_id, limits, out, |writer| match self {
            Self::Welcome(welcome) => writer.part(welcome),
            Self::Answer(answer) => answer.write(writer),
            Self::ModelState { known } => writer.part(known),
            Self::ModelReady(ready) => writer.part(ready),
            Self::Rejected(rejected) => writer.part(rejected),
            Self::Pong { nonce } => writer.part(nonce),
            Self::LargeAnswer(answer) => answer.write(writer),
            Self::SeveralAnswers(answers) => answers.write(writer),
            Self::ContactAnswer(answer) => answer.write(writer),
        })
    }

    /// Message in a frame.
    ///
    /// # Errors
    /// [`DecodeError`]; the stream is sound.
    pub fn decode(frame: &Frame, limits: &Limits) -> Result<Self, DecodeError> {
        let kind = frame.kind().ok_or(DecodeError::UnknownKind { kind: frame.header.kind })?;
        let mut reader = PayloadReader::new(&frame.payload);
        let reply = match kind {
            Kind::Welcome => {
                let welcome: Welcome = reader.part()?;
                welcome.check(limits)?;
                Self::Welcome(welcome)
            }
            Kind::Answer => Self::Answer(Box::new(Answer::read(&mut reader, limits)?)),
            Kind::ModelState => Self::ModelState { known: reader.part()? },
            Kind::ModelReady => Self::ModelReady(reader.part()?),
            Kind::Rejected => {
                let rejected: Rejected = reader.part()?;
                rejected.check(limits)?;
                Self::Rejected(rejected)
            }
            Kind::Pong => Self::Pong { nonce: reader.part()? },
            Kind::LargeAnswer => {
                Self::LargeAnswer(Box::new(LargeAnswer::read(&mut reader, limits)?))
            }
            Kind::SeveralAnswers => {
                Self::SeveralAnswers(Box::new(SeveralAnswers::read(&mut reader, limits)?))
            }
            Kind::ContactAnswer => {
                Self::ContactAnswer(Box::new(ContactAnswer::read(&mut reader, limits)?))
            }
            Kind::Hello
            | Kind::SolveOnce
            | Kind::HaveModel
            | Kind::UploadModel
            | Kind::Frame
            | Kind::Prefetch
            | Kind::Drop
            | Kind::Ping
            | Kind::SolveLarge
            | Kind::LargeFrame
            | Kind::SolveSeveral
            | Kind::ContactFrame => return Err(DecodeError::WrongDirection { kind }),
        };
        reader.finish()?;
        Ok(reply)
    }
}
