//! What a frame is in bytes, for an echo that moves as many.

use glove_client::connection::LinkError;
use softgrasp_protocol::{Answer, FrameRequest, Limits, ModelHash, Question, Reply, Request};

use crate::report_error::ReportError;

/// The bytes that ask for a frame.
///
/// # Errors
/// [`ReportError::Link`] for what cannot be sent.
pub fn encode_request(model: ModelHash, question: Question) -> Result<Vec<u8>, ReportError> {
    let mut bytes = Vec::new();
    Request::Frame(FrameRequest { model, question })
        .encode_into(1, &Limits::default(), &mut bytes)
        .map_err(LinkError::from)?;
    Ok(bytes)
}

/// The bytes of an answer.
///
/// # Errors
/// As [`encode_request`].
pub fn encode_reply(answer: Answer) -> Result<Vec<u8>, ReportError> {
    let mut bytes = Vec::new();
    Reply::Answer(Box::new(answer))
        .encode_into(1, &Limits::default(), &mut bytes)
        .map_err(LinkError::from)?;
    Ok(bytes)
}

/// Nodes that a question holds, one by one or by masks.
pub fn held_nodes(question: &Question) -> usize {
    let of_masks: usize = question.masks.iter().map(|(nodes, _)| nodes.len()).sum();
    question.known.len() / 3 + of_masks
}
