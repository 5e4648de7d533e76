//! A client's connection: frames may come with any pause between them, but not with a long one inside.

use std::io;
use std::pin::Pin;
use std::task::{Context, Poll};
use std::time::Duration;

use softgrasp_protocol::asynchronous::Connection;
use softgrasp_protocol::{ConnectionError, Frame, Limits};
use tokio::io::{AsyncRead, AsyncWrite, ReadBuf};
use tokio::time::{Instant, timeout};

/// Frames from and bytes to one client, each with a limit on how long the client may hold it up.
pub(crate) struct ClientConnection<S> {
    connection: Connection<TimedStream<S>>,
    stall_limit: Duration,
}

/// Why a session is given up.
#[derive(Debug, thiserror::Error)]
pub(crate) enum SessionError {
    #[error(transparent)]
    Connection(#[from] ConnectionError),
    #[error("the client stopped inside a frame for {} s", .0.as_secs_f64())]
    Stalled(Duration),
    #[error("the client did not take its reply for {} s", WRITE_MAX.as_secs())]
    NotTaken,
}

/// A client that does not take its reply for this long is given up.
const WRITE_MAX: Duration = Duration::from_secs(60);

impl<S> ClientConnection<S> {
    /// Wraps a stream; `limits` hold for what is read, `stall_limit` for a pause inside a frame.
    pub fn new(stream: S, limits: Limits, stall_limit: Duration) -> Self {
        let stream = TimedStream { stream, last_read: Instant::now() };
        Self { connection: Connection::new(stream, limits), stall_limit }
    }
}

impl<S: AsyncRead + Unpin> ClientConnection<S> {
    /// Waits for ever between frames, and inside one for `stall_limit` after the last byte.
    ///
    /// May be dropped at any await: bytes that have come stay. Time in which the server did not read,
    /// because it worked on a request, is not held against the client.
    ///
    /// # Errors
    /// [`SessionError::Stalled`], or what is wrong with the stream.
    pub async fn next_frame(&mut self) -> Result<Option<Frame>, SessionError> {
        let start = Instant::now();
        loop {
            let silent = match self.connection.is_inside_frame() {
                true => self.connection.stream().last_read.max(start).elapsed(),
                false => Duration::ZERO,
            };
            let left = self.stall_limit.saturating_sub(silent);
            if left.is_zero() {
                return Err(SessionError::Stalled(self.stall_limit));
            }
            // Bytes may come meanwhile: then the time begins anew from the last of them.
            if let Ok(frame) = timeout(left, self.connection.read_frame()).await {
                return Ok(frame?);
            }
        }
    }
}

impl<S: AsyncWrite + Unpin> ClientConnection<S> {
    /// Writes all bytes of one or more frames.
    ///
    /// # Errors
    /// [`SessionError`]; the session is to be given up, for a part may have been written.
    pub async fn write_bytes(&mut self, bytes: &[u8]) -> Result<(), SessionError> {
        match timeout(WRITE_MAX, self.connection.write_bytes(bytes)).await {
            Ok(written) => Ok(written?),
            Err(_) => Err(SessionError::NotTaken),
        }
    }
}

/// A stream that knows when bytes last came.
struct TimedStream<S> {
    stream: S,
    last_read: Instant,
}

impl<S: AsyncRead + Unpin> AsyncRead for TimedStream<S> {
    fn poll_read(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
        buffer: &mut ReadBuf<'_>,
    ) -> Poll<io::Result<()>> {
        let polled = Pin::new(&mut self.stream).poll_read(context, buffer);
        if polled.is_ready() {
            self.last_read = Instant::now();
        }
        polled
    }
}

impl<S: AsyncWrite + Unpin> AsyncWrite for TimedStream<S> {
    fn poll_write(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
        bytes: &[u8],
    ) -> Poll<io::Result<usize>> {
        Pin::new(&mut self.stream).poll_write(context, bytes)
    }

    fn poll_flush(mut self: Pin<&mut Self>, context: &mut Context<'_>) -> Poll<io::Result<()>> {
        Pin::new(&mut self.stream).poll_flush(context)
    }

    fn poll_shutdown(mut self: Pin<&mut Self>, context: &mut Context<'_>) -> Poll<io::Result<()>> {
        Pin::new(&mut self.stream).poll_shutdown(context)
    }
}

#[cfg(test)]
mod tests {
    use softgrasp_protocol::Request;
    use tokio::io::{AsyncWriteExt, DuplexStream, duplex};
    use tokio::time::sleep;

    use super::*;

    const LIMIT: Duration = Duration::from_secs(30);

    /// A connection, the client's end of it, and the bytes of a request. The clock of these tests
    /// stands still, and goes to the next thing that is waited for when all else rests.
    fn connected() -> (ClientConnection<DuplexStream>, DuplexStream, Vec<u8>) {
        let (client, server) = duplex(1 << 10);
        let mut bytes = Vec::new();
        Request::Ping { nonce: 7 }.encode_into(1, &Limits::default(), &mut bytes).unwrap();
        (ClientConnection::new(server, Limits::default(), LIMIT), client, bytes)
    }

    #[tokio::test(start_paused = true)]
    async fn client_that_stops_inside_a_frame_is_not_waited_for_twice_as_long_as_said() {
        for idle in [0, 1, 29, 31, 3600].map(Duration::from_secs) {
            let (mut connection, mut client, bytes) = connected();
            let sender = async {
                sleep(idle).await;
                client.write_all(&bytes[..bytes.len() - 1]).await.unwrap();
                Instant::now()
            };
            let (ended, last_byte) = tokio::join!(connection.next_frame(), sender);
            assert!(matches!(ended, Err(SessionError::Stalled(LIMIT))));
            // The runtime's timer counts milliseconds.
            let over = last_byte.elapsed().checked_sub(LIMIT).expect("not before its time");
            assert!(
                over <= Duration::from_millis(2),
                "{over:?} late after {idle:?} between frames"
            );
        }
    }

    #[tokio::test(start_paused = true)]
    async fn client_whose_bytes_come_slowly_is_waited_for() {
        let (mut connection, mut client, bytes) = connected();
        let sender = async {
            for byte in &bytes {
                sleep(LIMIT - Duration::from_millis(10)).await;
                client.write_all(&[*byte]).await.unwrap();
            }
        };
        let (frame, ()) = tokio::join!(connection.next_frame(), sender);
        assert_eq!(frame.unwrap().unwrap().request_id(), 1);
    }

    #[tokio::test(start_paused = true)]
    async fn time_in_which_the_server_does_not_read_is_not_held_against_the_client() {
        let (mut connection, mut client, bytes) = connected();
        let (first, last) = bytes.split_at(bytes.len() - 1);
        client.write_all(&[&bytes, first].concat()).await.unwrap();
        assert!(connection.next_frame().await.unwrap().is_some());
        sleep(10 * LIMIT).await;
        let sender = async {
            sleep(LIMIT / 2).await;
            client.write_all(last).await.unwrap();
        };
        let (frame, ()) = tokio::join!(connection.next_frame(), sender);
        assert!(frame.unwrap().is_some());
    }
}
