//! A client's connection: frames may come with any pause between them, but not with a long one inside.

use std::io;
use std::pin::Pin;
use std::task::{Context, Poll};
use std::time::Duration;

use softgrasp_protocol::asynchronous::Connection;
use softgrasp_protocol::{ConnectionError, Frame, HEADER_LEN, Limits};
use tokio::io::{AsyncRead, AsyncWrite, ReadBuf};
use tokio::time::{Instant, sleep, timeout, timeout_at};

use crate::config::ServerConfig;

/// Frames from and bytes to one client, each with a limit on how long the client may hold it up.
pub(crate) struct ClientConnection<S> {
    connection: Connection<TimedStream<S>>,
    patience: Patience,
    /// When a client that has not introduced itself yet is given up.
    stranger_until: Option<Instant>,
    /// Whether it is known only after it has shown a token.
    wants_token: bool,
}

/// How long a client is waited for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Patience {
    /// After its last byte, inside a frame.
    pub stall: Duration,
    /// For its first request from the beginning, and for a whole header from its first byte.
    pub greeting: Duration,
    /// For its next request; `None`: for ever.
    pub idle: Option<Duration>,
    /// For it to take a reply, and a second more for every [`REPLY_BYTES_PER_S`].
    pub reply: Duration,
}

impl Patience {
    /// That of a server.
    pub fn of(config: &ServerConfig) -> Self {
        let ServerConfig { stall_limit, greeting_limit, idle_limit, reply_limit, .. } = *config;
        Self { stall: stall_limit, greeting: greeting_limit, idle: idle_limit, reply: reply_limit }
    }
}

/// Why a session is given up.
#[derive(Debug, thiserror::Error)]
pub(crate) enum SessionError {
    #[error(transparent)]
    Connection(#[from] ConnectionError),
    #[error("the client stopped inside a frame for {} s", .0.as_secs_f64())]
    Stalled(Duration),
    #[error("the client sent no whole header within {} s", .0.as_secs_f64())]
    NoHeader(Duration),
    #[error("the client did not introduce itself within {} s", .0.as_secs_f64())]
    Stranger(Duration),
    #[error("the client sent nothing for {} s", .0.as_secs_f64())]
    Idle(Duration),
    #[error("the client did not take its reply within {} s", .0.as_secs_f64())]
    NotTaken(Duration),
    #[error("the client went while its request was worked on")]
    Gone,
}

/// A client takes its replies at least as fast.
const REPLY_BYTES_PER_S: u64 = 64 * 1024;
/// A client that has closed its sending side may still wait for its reply, but not longer.
const HALF_CLOSED_MAX: Duration = Duration::from_secs(10);
/// Bytes that are taken from a client whose request is worked on, to see whether it goes.
const READ_AHEAD_MAX: usize = 64 * 1024;

impl<S> ClientConnection<S> {
    /// Wraps the stream of a client that is not known yet, until it has spoken or, if a token is
    /// wanted, has shown it; `limits` hold for what is read from it.
    pub fn new(stream: S, limits: Limits, patience: Patience, wants_token: bool) -> Self {
        let now = Instant::now();
        let stream = TimedStream { stream, first_read: None, last_read: now, since_rest: 0 };
        let stranger_until = Some(now + patience.greeting);
        let connection = Connection::new(stream, limits);
        Self { connection, patience, stranger_until, wants_token }
    }

    /// The client has introduced itself: it may rest as long as it likes, and send what `limits` allow.
    pub fn make_known(&mut self, limits: Limits) {
        if self.stranger_until.take().is_some() {
            self.connection.set_limits(limits);
        }
    }
}

impl<S> ClientConnection<S> {
    /// Whether bytes of the next request are there already.
    pub fn is_inside_frame(&self) -> bool {
        self.connection.is_inside_frame()
    }
}

impl<S: AsyncRead + Unpin> ClientConnection<S> {
    /// Waits for ever between frames of a client that is known, and inside one for as long as its
    /// patience says.
    ///
    /// May be dropped at any await: bytes that have come stay. Time in which the server did not read,
    /// because it worked on a request, is not held against the client.
    ///
    /// # Errors
    /// [`SessionError`]: how the client was too slow, or what is wrong with the stream.
    pub async fn next_frame(&mut self) -> Result<Option<Frame>, SessionError> {
        let start = Instant::now();
        self.connection.stream_mut().first_read =
            self.connection.is_inside_frame().then_some(start);
        loop {
            let (until, too_slow) = self.deadline(start);
            if until <= Instant::now() {
                return match too_slow {
                    Some(error) => Err(error),
                    None => continue,
                };
            }
            // Bytes may come meanwhile: then the time begins anew from the last of them.
            if let Ok(frame) = timeout_at(until, self.connection.read_frame()).await {
                return Ok(frame?);
            }
        }
    }

    /// Ends when the client has gone, while its request is worked on: its connection is broken, or it has
    /// sent nothing more for so long after it has closed its side. Takes a little of what it sends
    /// meanwhile.
    ///
    /// May be dropped at any await: bytes that have come stay.
    pub async fn gone(&mut self) -> SessionError {
        while self.connection.received() < READ_AHEAD_MAX {
            match self.connection.read_ahead().await {
                Ok(true) => {}
                Ok(false) => {
                    sleep(HALF_CLOSED_MAX).await;
                    return SessionError::Gone;
                }
                Err(_) => return SessionError::Gone,
            }
        }
        std::future::pending().await
    }

    /// When to look at the client again, and what it is if it has not gone on by then; `None` for one
    /// that may rest.
    fn deadline(&self, start: Instant) -> (Instant, Option<SessionError>) {
        let Patience { stall, greeting, idle, .. } = self.patience;
        let stream = self.connection.stream();
        let received = self.connection.received();
        let has_header = received >= HEADER_LEN;
        let stalled = (received > 0)
            .then(|| (stream.last_read.max(start) + stall, SessionError::Stalled(stall)));
        let first_read = stream.first_read.unwrap_or(start);
        let no_header = (received > 0 && !has_header)
            .then(|| (first_read + greeting, SessionError::NoHeader(greeting)));
        // Without a token a first request may be a large one: its header is waited for so long.
        let stranger_until = self.stranger_until.filter(|_| self.wants_token || !has_header);
        let stranger = stranger_until.map(|until| (until, SessionError::Stranger(greeting)));
        let idle = idle.filter(|_| received == 0);
        let idle = idle.map(|limit| (start + limit, SessionError::Idle(limit)));
        let ends = [stalled, no_header, stranger, idle];
        match ends.into_iter().flatten().min_by_key(|(until, _)| *until) {
            Some((until, error)) => (until, Some(error)),
            // Its next header may begin at any time.
            None => (Instant::now() + stall.min(greeting), None),
        }
    }
}

impl<S: AsyncWrite + Unpin> ClientConnection<S> {
    /// Writes all bytes of one or more frames.
    ///
    /// # Errors
    /// [`SessionError`]; the session is to be given up, for a part may have been written.
    pub async fn write_bytes(&mut self, bytes: &[u8]) -> Result<(), SessionError> {
        let for_size = Duration::from_secs(bytes.len() as u64 / REPLY_BYTES_PER_S);
        let limit = self.patience.reply + for_size;
        match timeout(limit, self.connection.write_bytes(bytes)).await {
            Ok(written) => Ok(written?),
            Err(_) => Err(SessionError::NotTaken(limit)),
        }
    }
}

/// A stream that knows when bytes came.
struct TimedStream<S> {
    stream: S,
    /// First read since it was last set to `None`.
    first_read: Option<Instant>,
    last_read: Instant,
    /// Bytes since other sessions were let in.
    since_rest: usize,
}

/// A client that sends without a pause is left for others after so many bytes.
const REST_EVERY: usize = 128 * 1024;

impl<S: AsyncRead + Unpin> AsyncRead for TimedStream<S> {
    fn poll_read(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
        buffer: &mut ReadBuf<'_>,
    ) -> Poll<io::Result<()>> {
        if self.since_rest >= REST_EVERY {
            self.since_rest = 0;
            context.waker().wake_by_ref();
            return Poll::Pending;
        }
        let before = buffer.filled().len();
        let polled = Pin::new(&mut self.stream).poll_read(context, buffer);
        self.since_rest += buffer.filled().len() - before;
        if polled.is_ready() {
            self.last_read = Instant::now();
            self.first_read = self.first_read.or(Some(self.last_read));
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
    use super::*;
    use softgrasp_protocol::Request;
    use tokio::io::{AsyncReadExt, AsyncWriteExt, DuplexStream, duplex};

    const PATIENCE: Patience = Patience {
        stall: Duration::from_secs(30),
        greeting: Duration::from_secs(10),
        idle: None,
        reply: Duration::from_secs(60),
    };
    const MOMENT: Duration = Duration::from_millis(2);

    /// A connection, the client's end of it, and the bytes of a request. The clock of these tests
    /// stands still, and goes to the next thing that is waited for when all else rests.
    fn connected() -> (ClientConnection<DuplexStream>, DuplexStream, Vec<u8>) {
        let (client, server) = duplex(1 << 10);
        let mut bytes = Vec::new();
        Request::Ping { nonce: 7 }.encode_into(1, &Limits::default(), &mut bytes).unwrap();
        let mut connection = ClientConnection::new(server, Limits::default(), PATIENCE, true);
        connection.make_known(Limits::default());
        (connection, client, bytes)
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
            assert!(matches!(ended, Err(SessionError::Stalled(_))), "{ended:?}");
            // The runtime's timer counts milliseconds.
            let over = last_byte.elapsed().checked_sub(PATIENCE.stall).expect("not too soon");
            assert!(over <= MOMENT, "{over:?} late after {idle:?} between frames");
        }
    }

    #[tokio::test(start_paused = true)]
    async fn client_whose_bytes_come_slowly_is_waited_for() {
        let (mut connection, mut client, bytes) = connected();
        let sender = async {
            let (header, payload) = bytes.split_at(HEADER_LEN);
            client.write_all(header).await.unwrap();
            for byte in payload {
                sleep(PATIENCE.stall - Duration::from_millis(10)).await;
                client.write_all(&[*byte]).await.unwrap();
            }
        };
        let (frame, ()) = tokio::join!(connection.next_frame(), sender);
        assert_eq!(frame.unwrap().unwrap().request_id(), 1);
    }

    #[tokio::test(start_paused = true)]
    async fn header_that_comes_byte_by_byte_is_there_in_time_or_given_up() {
        for (pause_ms, is_in_time) in [(300, true), (350, false)] {
            for idle in [0, 7, 3600].map(Duration::from_secs) {
                let (mut connection, mut client, bytes) = connected();
                let sender = async {
                    sleep(idle).await;
                    let start = Instant::now();
                    for byte in &bytes {
                        if client.write_all(&[*byte]).await.is_err() {
                            break;
                        }
                        sleep(Duration::from_millis(pause_ms)).await;
                    }
                    start
                };
                let ended = async {
                    let ended = connection.next_frame().await;
                    (ended, Instant::now())
                };
                let ((ended, at), start) = tokio::join!(ended, sender);
                match is_in_time {
                    true => assert!(ended.unwrap().is_some()),
                    false => {
                        assert!(matches!(ended, Err(SessionError::NoHeader(_))), "{ended:?}");
                        let took = at.duration_since(start);
                        assert!(took >= PATIENCE.greeting && took <= PATIENCE.greeting + MOMENT);
                    }
                }
            }
        }
    }

    #[tokio::test(start_paused = true)]
    async fn stranger_that_does_not_speak_is_given_up_and_a_known_client_is_not() {
        for wants_token in [false, true] {
            let (client, server) = duplex(1 << 10);
            let mut connection =
                ClientConnection::new(server, Limits::default(), PATIENCE, wants_token);
            let start = Instant::now();
            let ended = connection.next_frame().await;
            assert!(matches!(ended, Err(SessionError::Stranger(_))), "{ended:?}");
            let over = start.elapsed().checked_sub(PATIENCE.greeting).expect("not too soon");
            assert!(over <= MOMENT);
            drop(client);
        }
        let (mut connection, mut client, bytes) = connected();
        let sender = async {
            sleep(Duration::from_secs(24 * 3600)).await;
            client.write_all(&bytes).await.unwrap();
        };
        let (frame, ()) = tokio::join!(connection.next_frame(), sender);
        assert!(frame.unwrap().is_some());
    }

    #[tokio::test(start_paused = true)]
    async fn first_request_may_be_long_only_where_no_token_is_wanted() {
        for wants_token in [false, true] {
            let (mut client, server) = duplex(1 << 10);
            let (_, _, bytes) = connected();
            let mut connection =
                ClientConnection::new(server, Limits::default(), PATIENCE, wants_token);
            let sender = async {
                let (first, last) = bytes.split_at(HEADER_LEN);
                client.write_all(first).await.unwrap();
                sleep(2 * PATIENCE.greeting).await;
                let _ = client.write_all(last).await;
            };
            let (frame, ()) = tokio::join!(connection.next_frame(), sender);
            assert_eq!(frame.is_ok(), !wants_token, "{frame:?}");
        }
    }

    #[tokio::test(start_paused = true)]
    async fn time_in_which_the_server_does_not_read_is_not_held_against_the_client() {
        for left in [1, HEADER_LEN] {
            let (mut connection, mut client, bytes) = connected();
            let (first, last) = bytes.split_at(bytes.len() - left);
            client.write_all(&[&bytes, first].concat()).await.unwrap();
            assert!(connection.next_frame().await.unwrap().is_some());
            sleep(10 * PATIENCE.stall).await;
            let sender = async {
                sleep(PATIENCE.greeting / 2).await;
                client.write_all(last).await.unwrap();
            };
            let (frame, ()) = tokio::join!(connection.next_frame(), sender);
            assert!(frame.unwrap().is_some());
        }
    }

    #[tokio::test(start_paused = true)]
    async fn client_that_rests_is_given_up_when_its_time_is_over_and_not_before() {
        let limit = Duration::from_secs(50);
        for (rests, is_in_time) in [(49, true), (51, false)] {
            let (mut connection, mut client, bytes) = connected();
            connection.patience.idle = Some(limit);
            let start = Instant::now();
            let sender = async {
                sleep(Duration::from_secs(rests)).await;
                let _ = client.write_all(&bytes).await;
            };
            let ended = async { (connection.next_frame().await, start.elapsed()) };
            let ((ended, took), ()) = tokio::join!(ended, sender);
            match is_in_time {
                true => assert!(ended.unwrap().is_some()),
                false => {
                    assert!(matches!(ended, Err(SessionError::Idle(_))), "{ended:?}");
                    assert!((limit..limit + MOMENT).contains(&took), "{took:?}");
                }
            }
        }
    }

    #[tokio::test(start_paused = true)]
    async fn reply_that_is_not_taken_is_given_up_after_the_time_for_its_size() {
        // 3 s for its size; the pipe holds the first KiB.
        let reply = vec![0; 3 * REPLY_BYTES_PER_S as usize];
        let limit = PATIENCE.reply + Duration::from_secs(3);
        for (pause, is_taken) in [(limit - MOMENT, true), (limit + MOMENT, false)] {
            let (mut connection, mut client, _) = connected();
            let start = Instant::now();
            let writer = async { (connection.write_bytes(&reply).await, start.elapsed()) };
            let reader = async {
                sleep(pause).await;
                let mut taken = vec![0; reply.len()];
                client.read_exact(&mut taken).await
            };
            let (written, took) = match is_taken {
                true => tokio::join!(writer, reader).0,
                false => writer.await,
            };
            assert_eq!(written.is_ok(), is_taken, "{written:?} after {took:?}");
            assert!(is_taken || (limit..limit + MOMENT).contains(&took), "{took:?}");
        }
    }

    #[tokio::test(start_paused = true)]
    async fn client_that_goes_during_its_request_is_noticed_and_one_that_waits_is_not() {
        // It is gone without a word.
        let (mut connection, client, _) = connected();
        let start = Instant::now();
        let goes = async {
            sleep(Duration::from_secs(3)).await;
            drop(client);
        };
        let (gone, ()) = tokio::join!(connection.gone(), goes);
        assert!(matches!(gone, SessionError::Gone));
        assert!(start.elapsed() >= Duration::from_secs(3) + HALF_CLOSED_MAX);
        // It waits, and has sent its next request meanwhile.
        let (mut connection, mut client, bytes) = connected();
        client.write_all(&bytes).await.unwrap();
        let waits = timeout(Duration::from_secs(3600), connection.gone()).await;
        assert!(waits.is_err(), "{:?}", waits.map(|gone| gone.to_string()));
        assert!(connection.next_frame().await.unwrap().is_some(), "nothing is lost");
        // It sends without end: only a little is taken.
        let (mut connection, mut client, _) = connected();
        let sends = async {
            let mut sent = 0;
            while let Ok(Ok(())) =
                timeout(Duration::from_secs(1), client.write_all(&[0; 256])).await
            {
                sent += 256;
            }
            sent
        };
        let gone = timeout(Duration::from_secs(60), connection.gone());
        let (gone, sent) = tokio::join!(gone, sends);
        assert!(gone.is_err() && sent <= 4 * READ_AHEAD_MAX, "{sent}");
    }
}
