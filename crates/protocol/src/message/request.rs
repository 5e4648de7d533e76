//! All messages of a client as one type.

use super::contact::ContactFrame;
use super::large::{LargeFrame, SolveLarge};
use super::model::{FrameRequest, ModelHash, Prefetch, UploadModel};
use super::question::SolveOnce;
use super::session::Hello;
use super::several::SolveSeveral;
use crate::payload::{PayloadReader, encode_frame};
use crate::{DecodeError, EncodeError, Frame, Kind, Limits};

/// Message from client to server.
#[derive(Clone, Debug, PartialEq)]
pub enum Request {
    /// Introduces the client; answered by `Welcome`.
    Hello(Hello),
    /// One self-contained solve; answered by `Answer`.
    SolveOnce(Box<SolveOnce>),
    /// Is this model known? Answered by `ModelState`.
    HaveModel(ModelHash),
    /// Model to keep; answered by `ModelReady`.
    UploadModel(UploadModel),
    /// Solve on a kept model; answered by `Answer`.
    Frame(FrameRequest),
    /// Hint, not answered.
    Prefetch(Prefetch),
    /// The model is not needed any more; not answered.
    Drop(ModelHash),
    /// Answered by `Pong` with the same number.
    Ping {
        /// Any number.
        nonce: u64,
    },
    /// One self-contained solve for large deformation; answered by `LargeAnswer`.
    SolveLarge(Box<SolveLarge>),
    /// Large deformation of a kept model; answered by `LargeAnswer`.
    LargeFrame(Box<LargeFrame>),
    /// One self-contained solve for several sets of displacements; answered by `SeveralAnswers`.
    SolveSeveral(Box<SolveSeveral>),
    /// One step of a free object among rigid bodies; answered by `ContactAnswer`.
    ContactFrame(Box<ContactFrame>),
}

impl Request {
    /// Its kind.
    pub fn kind(&self) -> Kind {
        match self {
            Self::Hello(_) => Kind::Hello,
            Self::SolveOnce(_) => Kind::SolveOnce,
            Self::HaveModel(_) => Kind::HaveModel,
            Self::UploadModel(_) => Kind::UploadModel,
            Self::Frame(_) => Kind::Frame,
            Self::Prefetch(_) => Kind::Prefetch,
            Self::Drop(_) => Kind::Drop,
            Self::Ping { .. } => Kind::Ping,
            Self::SolveLarge(_) => Kind::SolveLarge,
            Self::LargeFrame(_) => Kind::LargeFrame,
            Self::SolveSeveral(_) => Kind::SolveSeveral,
            Self::ContactFrame(_) => Kind::ContactFrame,
        }
    }

    /// Appends one frame to `out`.
    ///
    /// Of `limits` only the payload's length is compared; give the server's, from `Welcome`.
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
            Self::Hello(hello) => writer.part(hello),
            Self::SolveOnce(solve) => solve.write(writer),
            Self::HaveModel(model) | Self::Drop(model) => writer.part(model),
            Self::UploadModel(upload) => upload.write(writer),
            Self::Frame(frame) => frame.write(writer),
            Self::Prefetch(prefetch) => prefetch.write(writer),
            Self::Ping { nonce } => writer.part(nonce),
            Self::SolveLarge(solve) => solve.write(writer),
            Self::LargeFrame(frame) => frame.write(writer),
            Self::SolveSeveral(solve) => solve.write(writer),
            Self::ContactFrame(frame) => frame.write(writer),
        })
    }

    /// Message in a frame.
    ///
    /// # Errors
    /// [`DecodeError`]; the stream is sound, so the request can be refused and the session go on.
    pub fn decode(frame: &Frame, limits: &Limits) -> Result<Self, DecodeError> {
        let kind = frame.kind().ok_or(DecodeError::UnknownKind { kind: frame.header.kind })?;
        let mut reader = PayloadReader::new(&frame.payload);
        let request = match kind {
            Kind::Hello => {
                let hello: Hello = reader.part()?;
                hello.check(limits)?;
                Self::Hello(hello)
            }
            Kind::SolveOnce => Self::SolveOnce(Box::new(SolveOnce::read(&mut reader, limits)?)),
            Kind::HaveModel => Self::HaveModel(reader.part()?),
            Kind::UploadModel => Self::UploadModel(UploadModel::read(&mut reader, limits)?),
            Kind::Frame => Self::Frame(FrameRequest::read(&mut reader, limits)?),
            Kind::Prefetch => Self::Prefetch(Prefetch::read(&mut reader, limits)?),
            Kind::Drop => Self::Drop(reader.part()?),
            Kind::Ping => Self::Ping { nonce: reader.part()? },
            Kind::SolveLarge => Self::SolveLarge(Box::new(SolveLarge::read(&mut reader, limits)?)),
            Kind::LargeFrame => Self::LargeFrame(Box::new(LargeFrame::read(&mut reader, limits)?)),
            Kind::SolveSeveral => {
                Self::SolveSeveral(Box::new(SolveSeveral::read(&mut reader, limits)?))
            }
            Kind::ContactFrame => {
                Self::ContactFrame(Box::new(ContactFrame::read(&mut reader, limits)?))
            }
            Kind::Welcome
            | Kind::Answer
            | Kind::ModelState
            | Kind::ModelReady
            | Kind::Rejected
            | Kind::Pong
            | Kind::LargeAnswer
            | Kind::SeveralAnswers
            | Kind::ContactAnswer => return Err(DecodeError::WrongDirection { kind }),
        };
        reader.finish()?;
        Ok(request)
    }
}
