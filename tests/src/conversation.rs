//! Conversation of one client with a server, which tests repeat under other conditions.

use std::net::SocketAddr;

use glove_client::ask::connection::{LinkError, ServerConnection};
use softgrasp_protocol::asynchronous::Connection;
use softgrasp_protocol::{
    ConnectionError, Hello, Limits, ModelHash, NodeChoice, Precision, Reply, Request,
};
use tokio::io::{AsyncRead, AsyncWrite};

use crate::heard::Heard;
use crate::questions::{cube, frame, once, upload};
use crate::raw_session::request_frame;

/// Requests that one connection sends one after the other, after its `Hello`.
#[derive(Clone, Debug)]
pub struct Conversation {
    requests: Vec<Request>,
}

/// Replies of a conversation, and its error.
#[derive(Debug)]
pub struct Outcome {
    /// Replies in order, the `Welcome` first.
    pub heard: Vec<Heard>,
    /// Error that ended the conversation early, if there was one.
    pub error: Option<LinkError>,
}

impl Conversation {
    /// Every kind of request that has a reply, on a small cube: asks for the model, uploads it, two frame
    /// questions (one quantised and for listed nodes), one request with its own mesh, `Ping`.
    pub fn small() -> Self {
        let mesh = cube(27);
        let upload = upload(&mesh);
        let mut listed = frame(&mesh, 0.5, "dense-inverse");
        listed.question.want.nodes = NodeChoice::Nodes(vec![13, 0, 26]);
        listed.question.want.precision = Precision::F32Quantised;
        Self {
            requests: vec![
                Request::HaveModel(ModelHash::of(&upload)),
                Request::UploadModel(upload),
                Request::from(frame(&mesh, 1.0, "sparse-cholesky")),
                Request::from(listed),
                Request::from(once(&mesh, "dense-cholesky")),
                Request::Ping { nonce: 7 },
            ],
        }
    }

    /// Number of replies if nothing goes wrong, the `Welcome` included.
    pub fn reply_count(&self) -> usize {
        self.requests.len() + 1
    }

    /// Requests after the `Hello`.
    pub fn requests(&self) -> &[Request] {
        &self.requests
    }

    /// The whole conversation with its Hello as frames, one after the other.
    ///
    /// # Panics
    /// If a message is too large to be sent.
    pub fn frames(&self) -> Vec<Vec<u8>> {
        let hello = Hello::new("a conversation", None);
        let all = [Request::Hello(hello)].into_iter().chain(self.requests.iter().cloned());
        (1..).zip(all).map(|(id, request)| request_frame(id, &request)).collect()
    }

    /// Holds the conversation over any stream; returns the replies, and the error or end of the stream
    /// that cut it short.
    ///
    /// # Panics
    /// If an undamaged frame is no reply.
    pub async fn hold_over(
        &self,
        stream: impl AsyncRead + AsyncWrite + Unpin,
    ) -> (Vec<Heard>, Option<ConnectionError>) {
        let mut connection = Connection::new(stream, Limits::default());
        let mut heard = Vec::new();
        for frame in self.frames() {
            if let Err(error) = connection.write_bytes(&frame).await {
                return (heard, Some(error));
            }
            match connection.read_frame().await {
                Ok(Some(reply)) => {
                    let reply = Reply::decode(&reply, &Limits::default()).expect("a sound reply");
                    heard.push(Heard::of(&reply));
                }
                Ok(None) => return (heard, Some(ConnectionError::Closed { written: 0 })),
                Err(error) => return (heard, Some(error)),
            }
        }
        (heard, None)
    }

    /// Holds the conversation; a refusal is a reply, any other fault ends it.
    pub fn hold(&self, address: SocketAddr) -> Outcome {
        let mut heard = Vec::new();
        let mut connection = match ServerConnection::connect(address.to_string()) {
            Ok(connection) => connection,
            Err(error) => return Outcome { heard, error: Some(error) },
        };
        heard.push(Heard::Welcome);
        for request in &self.requests {
            match connection.ask(request) {
                Ok(reply) => heard.push(Heard::of(&reply)),
                Err(LinkError::Rejected(r)) => heard.push(Heard::Rejected(r.code, r.text)),
                Err(error) => return Outcome { heard, error: Some(error) },
            }
        }
        Outcome { heard, error: None }
    }
}

impl Outcome {
    /// Replies of a conversation that must have been completed.
    ///
    /// # Panics
    /// If it ended early.
    pub fn all(self) -> Vec<Heard> {
        match self.error {
            None => self.heard,
            Some(error) => panic!("after {} replies: {error}", self.heard.len()),
        }
    }

    /// Whether the error is the end of the connection, not a decoding fault or a wrong reply.
    pub fn ended_cleanly(&self) -> bool {
        matches!(self.error, None | Some(LinkError::Closed | LinkError::Connection(_)))
    }
}
