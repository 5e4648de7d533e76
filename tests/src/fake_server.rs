//! Server that knows every model and answers every frame question with displacements that the test made.

use std::net::{SocketAddr, TcpListener, TcpStream};

use softgrasp_protocol::blocking::Connection;
use softgrasp_protocol::{
    Answer, Displacements, Limits, NodeChoice, Reply, Request, SolveReport, Welcome,
};

/// Starts the server on a free loopback port; it ends with the process.
///
/// Shapes: `displacements` one for each node.
///
/// # Panics
/// If there is no port.
pub fn start_fake_server(displacements: Vec<[f64; 3]>) -> SocketAddr {
    let listener = TcpListener::bind(("127.0.0.1", 0)).expect("a free port");
    let address = listener.local_addr().expect("an address");
    std::thread::spawn(move || {
        for stream in listener.incoming().flatten() {
            let displacements = displacements.clone();
            std::thread::spawn(move || serve(stream, &displacements));
        }
    });
    address
}

fn serve(stream: TcpStream, displacements: &[[f64; 3]]) {
    let limits = Limits::default();
    let mut connection = Connection::new(stream, limits);
    let mut out = Vec::new();
    // A client that goes, or sends no frame, ends its session.
    while let Ok(Some(frame)) = connection.read_frame() {
        let Ok(request) = Request::decode(&frame, &limits) else { return };
        let Some(reply) = reply_to(&request, displacements) else { continue };
        out.clear();
        if reply.encode_into(frame.request_id(), &limits, &mut out).is_err()
            || connection.write_bytes(&out).is_err()
        {
            return;
        }
    }
}

fn reply_to(request: &Request, displacements: &[[f64; 3]]) -> Option<Reply> {
    match request {
        Request::Hello(_) => Some(Reply::Welcome(Welcome {
            server: "fake".to_owned(),
            version: "0".to_owned(),
            threads: 1,
            ..Welcome::default()
        })),
        Request::HaveModel(_) => Some(Reply::ModelState { known: true }),
        Request::Ask(ask) => {
            let nodes = ask.question.want.nodes.clone();
            let wanted = match &nodes {
                NodeChoice::All => displacements.to_vec(),
                NodeChoice::Nodes(nodes) => {
                    nodes.iter().map(|&node| displacements[node as usize]).collect()
                }
            };
            Some(Reply::Answer(Box::new(Answer {
                report: SolveReport::default(),
                large: None,
                nodes,
                displacements: Displacements::F64(wanted),
                reactions: Vec::new(),
                mask_forces: Vec::new(),
                fields: Vec::new(),
                cases: Vec::new(),
                gradient: None,
            })))
        }
        Request::Ping { nonce } => Some(Reply::Pong { nonce: *nonce }),
        _ => None,
    }
}
