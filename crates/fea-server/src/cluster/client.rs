//! Asks a cluster, and asks once more where it was lost and came back.

use std::sync::Arc;
use std::time::Duration;

use softgrasp_protocol::{
    Answer, Ask, Body, EncodeError, Kind, Limits, RejectCode, Rejected, Reply, Request, Subject,
    TraceContext, UploadModel,
};
use softgrasp_telemetry::RequestSpan;
use tokio::time::{Instant, sleep};

use super::conversation::{Conversation, Lost};
use super::endpoint::ClusterEndpoint;
use crate::engine::{Answered, Engine, Task};

/// A cluster that answers what is too large for this server.
#[derive(Debug)]
pub struct Cluster {
    endpoint: ClusterEndpoint,
    /// Time in which a cluster that was lost may come back.
    patience: Duration,
}

/// The requests that one task takes.
struct Requests {
    ask: Vec<u8>,
    /// The model that the question is about, if it is to be kept by the cluster.
    model: Option<Arc<UploadModel>>,
    /// Trace that they belong to.
    trace: Option<TraceContext>,
}

/// Ids of the question and of an upload.
const ASK: u64 = 2;
const UPLOAD: u64 = 3;
/// Time in which a cluster that was lost may come back: a supervisor starts it again.
const BACK_WITHIN: Duration = Duration::from_secs(30);
/// Pause between two attempts to reach it.
const PAUSE: Duration = Duration::from_millis(250);
/// Time in ms after which a client may ask again if it did not come back.
const AGAIN_AFTER_MS: u32 = 10_000;
/// How often a question is asked.
const ATTEMPTS: usize = 2;

impl Cluster {
    /// The cluster at an address; nothing is sent before the first question.
    pub fn new(endpoint: ClusterEndpoint) -> Self {
        Self { endpoint, patience: BACK_WITHIN }
    }

    /// The same, that waits so long for a cluster which is being started.
    #[must_use]
    pub fn with_patience(self, patience: Duration) -> Self {
        Self { patience, ..self }
    }

    async fn asked(&self, task: Task) -> Result<Answer, Rejected> {
        let mut span = RequestSpan::client_of(task.trace, Kind::Ask.name(), ASK);
        span.set("server.address", self.endpoint.address.as_str());
        let trace = span.context();
        self.asked_within(task, trace).await.inspect_err(|rejected| {
            span.fail(rejected.code.to_string(), || rejected.text.clone());
        })
    }

    /// Asks as part of a trace.
    async fn asked_within(
        &self,
        task: Task,
        trace: Option<TraceContext>,
    ) -> Result<Answer, Rejected> {
        let encoding = tokio::task::spawn_blocking(move || Requests::of(task, trace));
        let requests = match encoding.await {
            Ok(Ok(requests)) => requests,
            Ok(Err(error)) => return Err(Rejected::new(RejectCode::TooLarge, error.to_string())),
            Err(_) => {
                return Err(Rejected::new(RejectCode::Internal, "the request was not encoded"));
            }
        };
        let mut lost = Lost::Closed;
        for attempt in 1..=ATTEMPTS {
            let reached = match self.reach().await {
                Ok(reached) => reached?,
                // It has had its time to come back.
                Err(why) => {
                    lost = why;
                    break;
                }
            };
            lost = match attempted(reached, &requests).await {
                Ok(replied) => return replied,
                Err(lost) => lost,
            };
            let address = &self.endpoint.address;
            tracing::warn!(%address, attempt, why = %lost, "the cluster was lost");
        }
        let text = format!("the cluster at {} was lost: {lost}", self.endpoint.address);
        let rejected = Rejected::new(RejectCode::ClusterLost, text);
        Err(Rejected { retry_after_ms: AGAIN_AFTER_MS, ..rejected })
    }

    /// A connection on which this server is known; waits for a cluster that is being started again.
    async fn reach(&self) -> Result<Result<Conversation, Rejected>, Lost> {
        let until = Instant::now() + self.patience;
        let (conversation, reply) = loop {
            match Conversation::open(&self.endpoint).await {
                Err(lost) if Instant::now() + PAUSE > until => return Err(lost),
                Err(_) => sleep(PAUSE).await,
                Ok(opened) => break opened,
            }
        };
        match reply {
            Reply::Welcome(_) => Ok(Ok(conversation)),
            // The client's own token is not meant.
            Reply::Rejected(rejected) if rejected.code == RejectCode::NotAuthorised => {
                let text = "the cluster refuses this server's token (--cluster-token-file)";
                Ok(Err(Rejected::new(RejectCode::Internal, text)))
            }
            Reply::Rejected(rejected) => Ok(Err(rejected)),
            _ => Err(Lost::Foreign),
        }
    }
}

/// Asks once; uploads the model if the cluster does not have it.
async fn attempted(
    mut conversation: Conversation,
    requests: &Requests,
) -> Result<Result<Answer, Rejected>, Lost> {
    let mut reply = conversation.ask(&requests.ask, ASK).await?;
    if let (Reply::Rejected(rejected), Some(model)) = (&reply, &requests.model)
        && rejected.code == RejectCode::UnknownModel
    {
        let (model, trace) = (Arc::clone(model), requests.trace);
        let encoding = tokio::task::spawn_blocking(move || {
            encoded(&Request::UploadModel((*model).clone()), UPLOAD, trace)
        });
        let bytes = match encoding.await {
            Ok(Ok(bytes)) => bytes,
            _ => return Err(Lost::Foreign),
        };
        if let Reply::Rejected(rejected) = conversation.ask(&bytes, UPLOAD).await? {
            return Ok(Err(rejected));
        }
        reply = conversation.ask(&requests.ask, ASK).await?;
    }
    conversation.end().await;
    match reply {
        Reply::Answer(answer) => Ok(Ok(*answer)),
        Reply::Rejected(rejected) => Ok(Err(rejected)),
        _ => Err(Lost::Foreign),
    }
}

impl Engine for Cluster {
    fn takes_all(&self) -> bool {
        false
    }

    fn answer(&self, task: Task) -> Answered<'_> {
        Box::pin(self.asked(task))
    }
}

impl Requests {
    fn of(task: Task, trace: Option<TraceContext>) -> Result<Self, EncodeError> {
        let Task { model, kept, question, cases, without_estimate, trace: _ } = task;
        let (subject, model) = match kept {
            Some(hash) => (Subject::Model(hash), Some(model)),
            None => {
                let model = Arc::try_unwrap(model).unwrap_or_else(|shared| (*shared).clone());
                let UploadModel { mesh, materials, element, .. } = model;
                (Body { mesh, materials, element: element.into() }.into(), None)
            }
        };
        let ask = Ask { cases, without_estimate, ..Ask::new(subject, question) };
        Ok(Self { ask: encoded(&Request::Ask(Box::new(ask)), ASK, trace)?, model, trace })
    }
}

fn encoded(
    request: &Request,
    id: u64,
    trace: Option<TraceContext>,
) -> Result<Vec<u8>, EncodeError> {
    let mut bytes = Vec::new();
    request.encode_traced_into(id, trace, &Limits::LARGEST, &mut bytes)?;
    Ok(bytes)
}
