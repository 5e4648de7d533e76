//! Client that sends any bytes, valid or not.

use std::io::Write;
use std::net::{Shutdown, SocketAddr, TcpStream};
use std::time::Duration;

use softgrasp_protocol::blocking::Connection;
use softgrasp_protocol::{ConnectionError, HEADER_LEN, Limits, Reply, Request, VERSION};

/// TCP connection on which nothing is checked before it is sent.
#[derive(Debug)]
pub struct RawSession {
    connection: Connection<TcpStream>,
}

/// Longest wait for a reply: longer than a small question takes, even on a busy machine.
const REPLY_MAX: Duration = Duration::from_secs(20);

/// Time after which a server that takes no bytes counts as not reading.
const FULL_AFTER: Duration = Duration::from_millis(500);

impl RawSession {
    /// Connects, without a `Hello`.
    ///
    /// # Panics
    /// If no server listens there.
    pub fn open(address: SocketAddr) -> Self {
        let stream = TcpStream::connect(address).expect("a server listens there");
        stream.set_nodelay(true).expect("TCP_NODELAY");
        stream.set_read_timeout(Some(REPLY_MAX)).expect("a read timeout");
        stream.set_write_timeout(Some(REPLY_MAX)).expect("a write timeout");
        Self { connection: Connection::new(stream, Limits::default()) }
    }

    /// Sends bytes; that the server has closed already is no error here.
    pub fn send(&mut self, bytes: &[u8]) {
        let mut stream = self.connection.stream();
        let _ = stream.write_all(bytes);
    }

    /// Sends the same bytes again and again until the server takes no more.
    ///
    /// # Panics
    /// If the socket refuses a time limit.
    pub fn send_until_full(&mut self, bytes: &[u8]) {
        let mut stream = self.connection.stream();
        stream.set_write_timeout(Some(FULL_AFTER)).expect("a write timeout");
        while stream.write_all(bytes).is_ok() {}
    }

    /// Closes the sending side.
    pub fn finish(&mut self) {
        let _ = self.connection.stream().shutdown(Shutdown::Write);
    }

    /// Next reply with its request id; `None` when the server has closed or reset the connection.
    ///
    /// # Panics
    /// If nothing comes for a long time, or a frame that is no reply.
    pub fn reply(&mut self) -> Option<(u64, Reply)> {
        match self.connection.read_frame() {
            Ok(Some(frame)) => {
                let reply = Reply::decode(&frame, &Limits::default()).expect("a sound reply");
                Some((frame.request_id(), reply))
            }
            Ok(None) | Err(ConnectionError::Io(_)) => None,
            Err(error) => panic!("neither a reply nor an end: {error}"),
        }
    }

    /// Sends a valid request and waits for the reply.
    ///
    /// # Panics
    /// If the server closes, or answers another request.
    pub fn ask(&mut self, request_id: u64, request: &Request) -> Reply {
        self.send(&request_frame(request_id, request));
        let (id, reply) = self.reply().expect("the session lives");
        assert_eq!(id, request_id, "{reply:?}");
        reply
    }
}

/// Request as a frame.
///
/// # Panics
/// If the request is too large to be sent.
pub fn request_frame(request_id: u64, request: &Request) -> Vec<u8> {
    let mut bytes = Vec::new();
    request.encode_into(request_id, &Limits::default(), &mut bytes).expect("small enough");
    bytes
}

/// Header with right checksums and any content; `payload` is covered by the second checksum,
/// `payload_len` is the announced length.
pub fn raw_header(
    version: u16,
    kind: u16,
    request_id: u64,
    payload_len: u32,
    payload: &[u8],
) -> [u8; HEADER_LEN] {
    let mut raw = [0; HEADER_LEN];
    raw[0..4].copy_from_slice(b"SGRP");
    raw[4..6].copy_from_slice(&version.to_le_bytes());
    raw[6..8].copy_from_slice(&kind.to_le_bytes());
    raw[12..16].copy_from_slice(&payload_len.to_le_bytes());
    raw[16..24].copy_from_slice(&request_id.to_le_bytes());
    let header_crc = crc32c::crc32c(&raw[..24]);
    raw[24..28].copy_from_slice(&header_crc.to_le_bytes());
    let frame_crc = crc32c::crc32c_append(crc32c::crc32c(&raw[..28]), payload);
    raw[28..32].copy_from_slice(&frame_crc.to_le_bytes());
    raw
}

/// Frame with right checksums around any payload.
///
/// # Panics
/// If the length of the payload needs more than 32 bits.
pub fn raw_frame(kind: u16, request_id: u64, payload: &[u8]) -> Vec<u8> {
    let payload_len = u32::try_from(payload.len()).expect("a short payload");
    let mut bytes = raw_header(VERSION, kind, request_id, payload_len, payload).to_vec();
    bytes.extend_from_slice(payload);
    bytes
}
