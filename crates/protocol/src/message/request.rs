//! All messages of a client as one type.

use super::ask::Ask;
use super::contact::ContactFrame;
use super::model::{ModelHash, Prefetch, UploadModel};
use super::session::Hello;
use crate::payload::{PayloadReader, PayloadWriter, encode_frame};
use crate::trace::TraceContext;
use crate::{DecodeError, EncodeError, Frame, Kind, Limits};

/// Message from client to server.
#[derive(Clone, Debug, PartialEq)]
pub enum Request {
    /// Introduces the client; answered by `Welcome`.
    Hello(Hello),
    /// Question about a mesh or a kept model; answered by `Answer`.
    Ask(Box<Ask>),
    /// Question whether the server keeps a model of this name; answered by `ModelState`.
    HaveModel(ModelHash),
    /// Model that the server shall keep; answered by `ModelReady`.
    UploadModel(UploadModel),
    /// Cancels the request with this id: it is refused with `Cancelled` unless it has been answered. Not
    /// answered itself.
    Cancel {
        /// Id of the request to be cancelled.
        request_id: u64,
    },
    /// Hint which nodes and masks will be touched soon; not answered.
    Prefetch(Prefetch),
    /// The client does not need this model any more; not answered.
    Drop(ModelHash),
    /// Answered by `Pong` with the same number.
    Ping {
        /// Any number; the `Pong` repeats it.
        nonce: u64,
    },
    /// One step of a free object among rigid bodies; answered by `ContactAnswer`.
    ContactFrame(Box<ContactFrame>),
}

impl From<Ask> for Request {
    fn from(ask: Ask) -> Self {
        Self::Ask(Box::new(ask))
    }
}

impl Request {
    /// Kind of the request.
    pub fn kind(&self) -> Kind {
        match self {
            Self::Hello(_) => Kind::Hello,
            Self::Ask(_) => Kind::Ask,
            Self::HaveModel(_) => Kind::HaveModel,
            Self::UploadModel(_) => Kind::UploadModel,
            Self::Cancel { .. } => Kind::Cancel,
            Self::Prefetch(_) => Kind::Prefetch,
            Self::Drop(_) => Kind::Drop,
            Self::Ping { .. } => Kind::Ping,
            Self::ContactFrame(_) => Kind::ContactFrame,
        }
    }

    /// Appends one frame to `out`.
    ///
    /// Of `limits` only the payload's length is compared; pass the server's limits from `Welcome`.
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
        self.encode_traced_into(request_id, None, limits, out)
    }

    /// [`Self::encode_into`] for a request that belongs to a trace. Only `Ask`, `UploadModel` and
    /// `ContactFrame` carry one; others are encoded as without.
    ///
    /// # Errors
    /// As [`Self::encode_into`].
    pub fn encode_traced_into(
        &self,
        request_id: u64,
        trace: Option<TraceContext>,
        limits: &Limits,
        out: &mut Vec<u8>,
    ) -> Result<(), EncodeError> {
        let carries = matches!(self, Self::Ask(_) | Self::UploadModel(_) | Self::ContactFrame(_));
        let trace = trace.filter(|_| carries);
        encode_frame(self.kind(), request_id, limits, out, |writer| {
            writer.belongs_to(trace);
            self.write(writer)
        })
    }

    fn write(&self, writer: &mut PayloadWriter<'_>) -> Result<(), EncodeError> {
        match self {
            Self::Hello(hello) => writer.part(hello),
            Self::Ask(ask) => ask.write(writer),
            Self::HaveModel(model) | Self::Drop(model) => writer.part(model),
            Self::UploadModel(upload) => upload.write(writer),
            Self::Cancel { request_id } => writer.part(request_id),
            Self::Prefetch(prefetch) => prefetch.write(writer),
            Self::Ping { nonce } => writer.part(nonce),
            Self::ContactFrame(frame) => frame.write(writer),
        }
    }

    /// Trace that the request in a frame belongs to; `None` for one of another kind, without a trace, or
    /// with an identity of zeros. Decodes the part only.
    pub fn trace(frame: &Frame) -> Option<TraceContext> {
        let trace = match frame.kind()? {
            Kind::Ask => Ask::trace(frame),
            Kind::UploadModel => UploadModel::trace(frame),
            Kind::ContactFrame => ContactFrame::trace(frame),
            _ => None,
        };
        trace.filter(TraceContext::is_valid)
    }

    /// Decodes the request in a frame.
    ///
    /// # Errors
    /// [`DecodeError`]; the stream is sound, so the request can be refused and the session can go on.
    pub fn decode(frame: &Frame, limits: &Limits) -> Result<Self, DecodeError> {
        let kind = frame.kind().ok_or(DecodeError::UnknownKind { kind: frame.header.kind })?;
        let mut reader = PayloadReader::new(&frame.payload);
        let request = match kind {
            Kind::Hello => {
                let hello: Hello = reader.part()?;
                hello.check(limits)?;
                Self::Hello(hello)
            }
            Kind::Ask => Self::Ask(Box::new(Ask::read(&mut reader, limits)?)),
            Kind::HaveModel => Self::HaveModel(reader.part()?),
            Kind::UploadModel => Self::UploadModel(UploadModel::read(&mut reader, limits)?),
            Kind::Cancel => Self::Cancel { request_id: reader.part()? },
            Kind::Prefetch => Self::Prefetch(Prefetch::read(&mut reader, limits)?),
            Kind::Drop => Self::Drop(reader.part()?),
            Kind::Ping => Self::Ping { nonce: reader.part()? },
            Kind::ContactFrame => {
                Self::ContactFrame(Box::new(ContactFrame::read(&mut reader, limits)?))
            }
            Kind::Welcome
            | Kind::Answer
            | Kind::ModelState
            | Kind::ModelReady
            | Kind::Rejected
            | Kind::Alive
            | Kind::Pong
            | Kind::ContactAnswer => return Err(DecodeError::WrongDirection { kind }),
        };
        reader.finish()?;
        Ok(request)
    }
}
