//! Requests of all reports to a server: to keep a model and to answer frame questions.

use glove_client::ask::connection::{LinkError, ServerConnection, unexpected};
use softgrasp_protocol::{Answer, Ask, Limits, ModelHash, Question, Reply, Request, UploadModel};

use crate::report_error::ReportError;

/// Uploads a model; returns the hash that names it.
///
/// # Errors
/// [`ReportError::Link`].
pub fn upload(
    connection: &mut ServerConnection,
    model: UploadModel,
) -> Result<ModelHash, ReportError> {
    match connection.ask(&Request::UploadModel(model))? {
        Reply::ModelReady(ready) => Ok(ready.model),
        other => Err(unexpected("UploadModel", &other).into()),
    }
}

/// Answer in the reply to a frame question.
///
/// # Errors
/// [`ReportError::Link`] for any other reply.
pub fn answer(reply: Result<Reply, LinkError>) -> Result<Answer, ReportError> {
    match reply? {
        Reply::Answer(answer) => Ok(*answer),
        other => Err(unexpected("Ask", &other).into()),
    }
}

/// Bytes of a frame question.
///
/// # Errors
/// [`ReportError::Link`] if it cannot be encoded.
pub fn encode_request(model: ModelHash, question: Question) -> Result<Vec<u8>, ReportError> {
    let mut bytes = Vec::new();
    Request::from(Ask::new(model, question))
        .encode_into(1, &Limits::default(), &mut bytes)
        .map_err(LinkError::from)?;
    Ok(bytes)
}

/// Bytes of an answer.
///
/// # Errors
/// The same as those of [`encode_request`].
pub fn encode_reply(answer: Answer) -> Result<Vec<u8>, ReportError> {
    let mut bytes = Vec::new();
    Reply::Answer(Box::new(answer))
        .encode_into(1, &Limits::default(), &mut bytes)
        .map_err(LinkError::from)?;
    Ok(bytes)
}

/// Number of nodes that a question holds, one by one or by masks.
pub fn held_nodes(question: &Question) -> usize {
    let of_masks: usize = question.masks.iter().map(|(nodes, _)| nodes.len()).sum();
    question.known.len() / 3 + of_masks
}
