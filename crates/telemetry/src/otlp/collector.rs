//! HTTP to the collector, by ureq, on the threads of the export.

use std::fmt;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use async_trait::async_trait;
use opentelemetry_http::{Bytes, HttpClient, HttpError, Request, Response};

/// Way to the collector. Tells the log once that it does not answer, and once that it does again.
pub(super) struct Collector {
    agent: ureq::Agent,
    is_lost: AtomicBool,
}

/// Time for one request, from the connection to the whole reply. The end of a program waits for it.
const REQUEST_MAX: Duration = Duration::from_secs(2);

impl Collector {
    pub fn new() -> Self {
        let settings = ureq::Agent::config_builder()
            .timeout_global(Some(REQUEST_MAX))
            // What a status means the exporter knows.
            .http_status_as_error(false)
            .build();
        Self { agent: settings.new_agent(), is_lost: AtomicBool::new(false) }
    }

    /// Sends a request and reads the reply.
    fn send(&self, request: Request<Bytes>) -> Result<Response<Bytes>, ureq::Error> {
        let (head, body) = request.into_parts();
        let response = self.agent.run(Request::from_parts(head, body.as_ref()))?;
        let (head, mut body) = response.into_parts();
        let body = body.read_to_vec()?;
        Ok(Response::from_parts(head, body.into()))
    }
}

#[async_trait]
impl HttpClient for Collector {
    async fn send_bytes(&self, request: Request<Bytes>) -> Result<Response<Bytes>, HttpError> {
        let address = request.uri().to_string();
        let sent = self.send(request);
        let is_lost = !matches!(&sent, Ok(response) if response.status().is_success());
        if self.is_lost.swap(is_lost, Ordering::Relaxed) != is_lost {
            match &sent {
                Ok(response) if is_lost => {
                    let status = response.status().as_u16();
                    tracing::warn!(%address, status, "the collector refuses traces or metrics");
                }
                Err(error) => {
                    tracing::warn!(%address, %error, "the collector cannot be reached");
                }
                Ok(_) => tracing::info!(%address, "the collector answers again"),
            }
        }
        Ok(sent?)
    }
}

impl fmt::Debug for Collector {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Collector").field("is_lost", &self.is_lost).finish_non_exhaustive()
    }
}
