//! Servers for the tests of this binary.

use std::net::SocketAddr;

use fea_server::{RunningServer, ServerConfig};
use glove_client::ask::connection::{LinkError, ServerConnection};
use softgrasp_protocol::{Answer, Reply, Request};

/// Settings of a server on a free loopback port with `threads` threads.
pub fn config(threads: usize) -> ServerConfig {
    ServerConfig {
        listen: SocketAddr::from(([127, 0, 0, 1], 0)),
        threads,
        ..ServerConfig::default()
    }
}

/// Server on a free loopback port.
pub fn server(threads: usize) -> RunningServer {
    fea_server::start(config(threads)).unwrap()
}

/// Client that has sent `Hello`.
pub fn client(server: &RunningServer) -> ServerConnection {
    ServerConnection::connect(server.address().to_string()).unwrap()
}

/// Answer to a request that must be answered.
pub fn answer(connection: &mut ServerConnection, request: &Request) -> Answer {
    match connection.ask(request) {
        Ok(Reply::Answer(answer)) => *answer,
        other => panic!("{:?} got {other:?}", request.kind()),
    }
}

/// Code and text of the refusal of a request that must be refused.
pub fn refusal(
    connection: &mut ServerConnection,
    request: &Request,
) -> (softgrasp_protocol::RejectCode, String) {
    match connection.ask(request) {
        Err(LinkError::Rejected(rejected)) => (rejected.code, rejected.text),
        other => panic!("{:?} got {other:?}", request.kind()),
    }
}
