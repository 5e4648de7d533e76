//! A client's connection: any pause may lie between two messages, but no long one inside a message.

use std::collections::VecDeque;
use std::io;
use std::pin::Pin;
use std::task::{Context, Poll};
use std::time::Duration;

use softgrasp_protocol::asynchronous::Connection;
use softgrasp_protocol::{
    Ask, ConnectionError, Frame, HEADER_LEN, Header, Kind, Limits, ModelHash, Request,
};
use tokio::io::{AsyncRead, AsyncWrite, ReadBuf};
use tokio::time::{Instant, sleep, sleep_until, timeout, timeout_at};

use crate::budget::Reservation;
use crate::config::ServerConfig;
use crate::no_room::NoRoom;
use crate::places::NoPlace;
use crate::room::Room;

/// Reads messages from one client and writes bytes to it, each within a time limit.
pub(crate) struct ClientConnection<S> {
    connection: Connection<TimedStream<S>>,
    room: Room,
    patience: Patience,
    /// Time at which a client that has not introduced itself yet is given up.
    stranger_until: Option<Instant>,
    /// Whether the client counts as introduced only after it has shown a token.
    wants_token: bool,
    /// Requests that came while another one was worked on, oldest first.
    ahead: VecDeque<Ahead>,
    /// Bytes of the requests that came while the present one is worked on.
    ahead_bytes: usize,
    /// Time since which the next request is waited for.
    waiting_since: Option<Instant>,
    /// Silence of the server after which this client wants an `Alive`.
    alive_every: Option<Duration>,
    last_sent: Instant,
}

/// A request that waits for its turn.
struct Ahead {
    frame: Frame,
    received: Reservation,
    is_cancelled: bool,
}

/// What the next read from a client brought.
#[derive(Debug)]
pub(crate) enum Incoming {
    /// A request, with the memory that it was received in.
    Request { frame: Frame, received: Reservation },
    /// A request for which there is no memory; the rest of its bytes is skipped as they come.
    NoRoom { header: Header, why: NoRoom },
    /// A request that its client has cancelled before its turn came.
    Cancelled { header: Header },
    /// The server has been silent for as long as the client accepts: an `Alive` is due.
    Silent,
    /// The header of a frame that is longer than allowed; reading goes on once it is allowed.
    Longer,
    /// The client has closed the connection between two frames.
    End,
}

/// What a client did while its request was worked on.
#[derive(Debug)]
pub(crate) enum Watched {
    /// The client has cancelled the request.
    Cancelled,
    /// The server has been silent for as long as the client accepts: an `Alive` is due.
    Silent,
    /// The client has gone.
    Gone(SessionError),
}

/// Time limits that a client must keep.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Patience {
    /// Longest time between two bytes inside a frame.
    pub stall: Duration,
    /// Longest time for the first request, from the beginning, and for a whole header from its first
    /// byte.
    pub greeting: Duration,
    /// Longest time until the next request; `None`: no limit.
    pub idle: Option<Duration>,
    /// Time to take a reply, and one second more for every [`REPLY_BYTES_PER_S`] of it.
    pub reply: Duration,
}

impl Patience {
    /// Time limits from a server's settings.
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
    #[error("others came while the client had not introduced itself")]
    SentAway,
    #[error(transparent)]
    NoPlace(#[from] NoPlace),
    #[error("the client sent nothing for {} s", .0.as_secs_f64())]
    Idle(Duration),
    #[error("the client did not take its reply within {} s", .0.as_secs_f64())]
    NotTaken(Duration),
    #[error("the client went while its request was worked on")]
    Gone,
}

/// Rate at which a client must at least take its replies, bytes per second.
const REPLY_BYTES_PER_S: u64 = 64 * 1024;
/// Longest time that a client which has closed its sending side may wait for its reply.
const HALF_CLOSED_MAX: Duration = Duration::from_secs(10);
/// Bytes read from a client whose request is worked on, to notice whether it goes.
const READ_AHEAD_MAX: usize = 64 * 1024;

impl<S> ClientConnection<S> {
    /// Connection over the stream of a client that has not introduced itself yet: that counts as done
    /// with its first message or, if a token is required, with the token; `limits` hold for what is read.
    pub fn new(
        stream: S,
        limits: Limits,
        patience: Patience,
        wants_token: bool,
        room: Room,
    ) -> Self {
        let now = Instant::now();
        let stream = TimedStream { stream, first_read: None, last_read: now, since_rest: 0 };
        let stranger_until = Some(now + patience.greeting);
        let connection = Connection::new(stream, limits);
        Self {
            connection,
            room,
            patience,
            stranger_until,
            wants_token,
            ahead: VecDeque::new(),
            ahead_bytes: 0,
            waiting_since: None,
            alive_every: None,
            last_sent: now,
        }
    }

    /// Sets the longest silence of the server towards this client; `None`: no limit.
    pub fn set_alive(&mut self, every: Option<Duration>) {
        self.alive_every = every;
    }

    fn alive_at(&self) -> Option<Instant> {
        self.alive_every.map(|every| self.last_sent + every)
    }

    /// Marks the client as introduced: it may be silent for as long as it likes, and send what `limits`
    /// allow.
    pub fn make_known(&mut self, limits: Limits) {
        if self.stranger_until.take().is_some() {
            self.connection.set_limits(limits);
        }
    }
}

impl<S> ClientConnection<S> {
    /// Whether bytes of the next request have come.
    pub fn is_inside_frame(&self) -> bool {
        !self.ahead.is_empty() || self.connection.is_inside_frame()
    }

    /// Collects the whole requests that have come; returns whether they cancel the `current` one.
    fn collect(&mut self, current: Option<u64>) -> bool {
        let mut is_cancelled = false;
        while self.ahead_bytes < READ_AHEAD_MAX {
            // What is wrong with the stream is told when its turn comes.
            let Ok(Some(frame)) = self.connection.frame_received() else { break };
            let received = self.room.hand_over();
            self.ahead_bytes += frame.header.frame_len();
            match cancelled_id(&frame) {
                None => self.ahead.push_back(Ahead { frame, received, is_cancelled: false }),
                id if id == current => is_cancelled = true,
                Some(id) => {
                    let waiting = self.ahead.iter_mut().filter(|one| one.frame.request_id() == id);
                    waiting.for_each(|one| one.is_cancelled = true);
                }
            }
        }
        is_cancelled
    }
}

/// Id of the request that a `Cancel` frame names; `None` for other frames.
fn cancelled_id(frame: &Frame) -> Option<u64> {
    if frame.kind() != Some(Kind::Cancel) {
        return None;
    }
    match Request::decode(frame, &Limits::default()) {
        Ok(Request::Cancel { request_id }) => Some(request_id),
        _ => None,
    }
}

impl<S: AsyncRead + Unpin> ClientConnection<S> {
    /// Waits for the next message. Between two messages a known client has no time limit; inside one its
    /// [`Patience`] counts.
    ///
    /// May be dropped at any await: bytes that have come stay. Time in which the server did not read,
    /// because it worked on a request, does not count against the client.
    ///
    /// # Errors
    /// [`SessionError`]: how the client was too slow, or what is wrong with the stream.
    pub async fn next_frame(&mut self) -> Result<Incoming, SessionError> {
        self.next_frame_up_to(usize::MAX).await
    }

    /// Waits for the next frame of at most `len_max` bytes, header included; of a longer one the header
    /// is returned as soon as it has come.
    ///
    /// # Errors
    /// The same as those of [`Self::next_frame`].
    pub async fn next_frame_up_to(&mut self, len_max: usize) -> Result<Incoming, SessionError> {
        if let Some(Ahead { frame, received, is_cancelled }) = self.ahead.pop_front() {
            self.ahead_bytes = self.ahead.iter().map(|one| one.frame.header.frame_len()).sum();
            return Ok(match is_cancelled {
                true => Incoming::Cancelled { header: frame.header },
                false => Incoming::Request { frame, received },
            });
        }
        self.ahead_bytes = 0;
        let start = match self.waiting_since {
            Some(start) => start,
            None => {
                let start = Instant::now();
                let is_inside = self.connection.is_inside_frame();
                self.connection.stream_mut().first_read = is_inside.then_some(start);
                self.waiting_since = Some(start);
                start
            }
        };
        let next = self.frame_since(start, len_max).await;
        if !matches!(next, Ok(Incoming::Silent)) {
            self.waiting_since = None;
        }
        next
    }

    async fn frame_since(
        &mut self,
        start: Instant,
        len_max: usize,
    ) -> Result<Incoming, SessionError> {
        loop {
            if let Some(frame) = self.connection.frame_received().map_err(ConnectionError::from)? {
                return Ok(Incoming::Request { frame, received: self.room.hand_over() });
            }
            if self.connection.header().is_some_and(|header| header.frame_len() > len_max) {
                return Ok(Incoming::Longer);
            }
            if let Err((header, why)) = self.make_room().await {
                self.connection.pass_over();
                self.room.give_up();
                return Ok(Incoming::NoRoom { header, why });
            }
            let (until, too_slow) = self.deadline(start);
            let now = Instant::now();
            if until <= now {
                return match too_slow {
                    Some(error) => Err(error),
                    None => continue,
                };
            }
            let alive_at = self.alive_at();
            if alive_at.is_some_and(|at| at <= now) {
                return Ok(Incoming::Silent);
            }
            let until = alive_at.map_or(until, |at| at.min(until));
            // Bytes may come meanwhile: then the time begins anew from the last of them.
            match timeout_at(until, self.connection.read_ahead()).await {
                Ok(Ok(true)) | Err(_) => {}
                Ok(Ok(false)) => {
                    self.connection.finish().map_err(ConnectionError::from)?;
                    return Ok(Incoming::End);
                }
                Ok(Err(error)) => return Err(error.into()),
            }
        }
    }

    /// Reserves the memory that the next read takes; waiting for it does not count against the client.
    async fn make_room(&mut self) -> Result<(), (Header, NoRoom)> {
        let Some(header) = self.connection.header() else { return Ok(()) };
        let whole = header.frame_len();
        let begin = Instant::now();
        let made = match self.room.check(whole) {
            Ok(()) => self.room.grow(self.connection.len_wanted(), whole).await,
            never => never,
        };
        if begin < Instant::now() {
            self.connection.stream_mut().last_read = Instant::now();
        }
        made.map_err(|why| (header, why))
    }

    /// Ends when the client has cancelled the request that is worked on, or has gone: its connection is
    /// broken, or it has closed its side for too long. Meanwhile reads a little of what it sends.
    ///
    /// May be dropped at any await: bytes that have come stay.
    pub async fn watch(&mut self, request_id: u64) -> Watched {
        loop {
            if self.collect(Some(request_id)) {
                return Watched::Cancelled;
            }
            let alive_at = self.alive_at();
            let silent = async {
                match alive_at {
                    Some(at) => sleep_until(at).await,
                    None => std::future::pending().await,
                }
            };
            let may_read = self.connection.received() + self.ahead_bytes < READ_AHEAD_MAX;
            tokio::select! {
                read = self.connection.read_ahead(), if may_read => match read {
                    Ok(true) => {}
                    Ok(false) => {
                        sleep(HALF_CLOSED_MAX).await;
                        return Watched::Gone(SessionError::Gone);
                    }
                    Err(_) => return Watched::Gone(SessionError::Gone),
                },
                () = silent => return Watched::Silent,
            }
        }
    }

    /// Whether a newer request has come that supersedes one about this model.
    pub async fn has_newer(&mut self, model: ModelHash) -> bool {
        if self.connection.received() < READ_AHEAD_MAX {
            // What lies in the socket, without waiting for more.
            tokio::select! {
                biased;
                _ = self.connection.read_ahead() => {}
                () = std::future::ready(()) => {}
            }
        }
        self.collect(None);
        self.ahead
            .iter()
            .any(|one| !one.is_cancelled && Ask::kept_model(&one.frame) == Some((model, true)))
    }

    /// Time at which to look at the client again, and the error if it has not gone on by then; `None` for
    /// a client that may be silent.
    fn deadline(&self, start: Instant) -> (Instant, Option<SessionError>) {
        let Patience { stall, greeting, idle, .. } = self.patience;
        let stream = self.connection.stream();
        let received = self.connection.received();
        let is_inside = self.connection.is_inside_frame();
        // What is passed over has had its header.
        let has_header = received >= HEADER_LEN || (is_inside && received == 0);
        let stalled =
            is_inside.then(|| (stream.last_read.max(start) + stall, SessionError::Stalled(stall)));
        let first_read = stream.first_read.unwrap_or(start);
        let no_header = (received > 0 && !has_header)
            .then(|| (first_read + greeting, SessionError::NoHeader(greeting)));
        // Without a token a first request may be a large one: its header is waited for so long.
        let stranger_until = self.stranger_until.filter(|_| self.wants_token || !has_header);
        let stranger = stranger_until.map(|until| (until, SessionError::Stranger(greeting)));
        let idle = idle.filter(|_| !is_inside);
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
    /// Writes all bytes of one or more frames within the time limit.
    ///
    /// # Errors
    /// [`SessionError`]; the session is to be given up, for a part may have been written.
    pub async fn write_bytes(&mut self, bytes: &[u8]) -> Result<(), SessionError> {
        let for_size = Duration::from_secs(bytes.len() as u64 / REPLY_BYTES_PER_S);
        let limit = self.patience.reply + for_size;
        self.last_sent = Instant::now();
        match timeout(limit, self.connection.write_bytes(bytes)).await {
            Ok(written) => Ok(written?),
            Err(_) => Err(SessionError::NotTaken(limit)),
        }
    }
}

/// Stream that records when bytes came.
struct TimedStream<S> {
    stream: S,
    /// Time of the first read since this was last set to `None`.
    first_read: Option<Instant>,
    last_read: Instant,
    /// Bytes read since other sessions could run.
    since_rest: usize,
}

/// Bytes after which a client that sends without a pause is interrupted, so that other sessions can run.
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
mod tests;
