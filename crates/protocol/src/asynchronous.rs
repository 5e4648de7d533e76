//! Frames over a tokio stream, whole or split into a reading and a writing half.

use std::io::ErrorKind;

use tokio::io::{AsyncRead, AsyncReadExt, AsyncWrite, AsyncWriteExt};

use crate::{ConnectionError, Frame, FrameBuffer, FrameError, Header, Limits};

/// A stream, or one half of it, that frames are read from and written to.
///
/// Knows nothing of the format: what comes goes into a [`FrameBuffer`], what goes is bytes. Time
/// limits are the caller's (`tokio::time::timeout` around a call).
#[derive(Debug)]
pub struct Connection<S> {
    stream: S,
    buffer: FrameBuffer,
}

impl<S> Connection<S> {
    /// Connection over `stream`, which is open already; `limits` hold for the frames that are read.
    pub fn new(stream: S, limits: Limits) -> Self {
        Self { stream, buffer: FrameBuffer::new(limits) }
    }

    /// The underlying stream.
    pub fn stream(&self) -> &S {
        &self.stream
    }

    /// The underlying stream for changes: to shut it down.
    pub fn stream_mut(&mut self) -> &mut S {
        &mut self.stream
    }

    /// Sets the limits on frames that are read, from the next header on.
    pub fn set_limits(&mut self, limits: Limits) {
        self.buffer.set_limits(limits);
    }

    /// Whether a frame has begun to come and has not ended; an idle peer may be waited for longer
    /// than one that stops inside a frame.
    pub fn is_inside_frame(&self) -> bool {
        !self.buffer.is_at_border()
    }

    /// Bytes of memory that the next read brings the buffer to.
    pub fn len_wanted(&self) -> usize {
        self.buffer.len_wanted()
    }

    /// Header of the unfinished frame at the front, once it is there.
    pub fn header(&self) -> Option<Header> {
        self.buffer.header()
    }

    /// Gives up the unfinished frame at the front; see [`FrameBuffer::pass_over`].
    pub fn pass_over(&mut self) {
        self.buffer.pass_over();
    }

    /// The next frame if all its bytes have come; `Ok(None)` means "not yet".
    ///
    /// # Errors
    /// [`FrameError`] for damaged or foreign bytes: the stream is to be given up.
    pub fn frame_received(&mut self) -> Result<Option<Frame>, FrameError> {
        self.buffer.next_frame()
    }

    /// Judges the end of the stream, once [`frame_received`](Self::frame_received) has said `Ok(None)`.
    ///
    /// # Errors
    /// [`FrameError::Truncated`] inside a frame.
    pub fn finish(&self) -> Result<(), FrameError> {
        self.buffer.finish()
    }

    /// Bytes of an unfinished frame that have come; tells a slow peer from one that has stopped.
    pub fn received(&self) -> usize {
        self.buffer.received()
    }
}

impl<S: AsyncRead + Unpin> Connection<S> {
    /// Next frame; `None` when the peer has closed between two frames.
    ///
    /// May be dropped at any await: bytes that have come stay in the buffer.
    ///
    /// # Errors
    /// [`ConnectionError::Frame`] for bad or cut bytes: give the stream up.
    pub async fn read_frame(&mut self) -> Result<Option<Frame>, ConnectionError> {
        loop {
            if let Some(frame) = self.buffer.next_frame()? {
                return Ok(Some(frame));
            }
            match self.stream.read(read_room(&mut self.buffer)).await {
                Ok(0) => {
                    self.buffer.finish()?;
                    return Ok(None);
                }
                Ok(count) => self.buffer.advance(count),
                Err(error) => match error.kind() {
                    ErrorKind::Interrupted => {}
                    // Streams with a timeout of their own may say so.
                    ErrorKind::TimedOut => {
                        let received = self.buffer.received();
                        return Err(ConnectionError::ReadTimedOut { received });
                    }
                    _ => return Err(error.into()),
                },
            }
        }
    }
}

impl<S: AsyncRead + Unpin> Connection<S> {
    /// Takes bytes that come while no frame is wanted yet; `false` when the peer sends no more. How much
    /// is taken is the caller's choice, by [`Connection::received`].
    ///
    /// May be dropped at any await: bytes that have come stay in the buffer.
    ///
    /// # Errors
    /// [`ConnectionError`] of the stream: the peer has gone.
    pub async fn read_ahead(&mut self) -> Result<bool, ConnectionError> {
        let count = self.stream.read(read_room(&mut self.buffer)).await?;
        self.buffer.advance(count);
        Ok(count > 0)
    }
}

impl<S: AsyncWrite + Unpin> Connection<S> {
    /// Writes all bytes of one or more frames and flushes.
    ///
    /// Must not be dropped at an await if the stream is used further: the next frame would start
    /// inside this one.
    ///
    /// # Errors
    /// [`ConnectionError`]; the stream is to be given up, except after `WriteTimedOut`, where the
    /// rest of the same bytes may follow.
    pub async fn write_bytes(&mut self, bytes: &[u8]) -> Result<(), ConnectionError> {
        let mut written = 0;
        while let Some(rest) = bytes.get(written..).filter(|rest| !rest.is_empty()) {
            match self.stream.write(rest).await {
                Ok(0) => return Err(ConnectionError::Closed { written }),
                Ok(count) => written += count,
                Err(error) => keep_writing(error, written)?,
            }
        }
        loop {
            match self.stream.flush().await {
                Ok(()) => return Ok(()),
                Err(error) => keep_writing(error, written)?,
            }
        }
    }
}

/// Bytes that one read takes at most, so that a peer that sends without a pause leaves time for other
/// peers.
const READ_LEN_MAX: usize = 64 * 1024;

fn read_room(buffer: &mut FrameBuffer) -> &mut [u8] {
    let room = buffer.spare_mut();
    let len = room.len().min(READ_LEN_MAX);
    &mut room[..len]
}

/// `Ok` if a failed write is to be tried again at once, else the error with the `written` bytes.
fn keep_writing(error: std::io::Error, written: usize) -> Result<(), ConnectionError> {
    match error.kind() {
        ErrorKind::Interrupted => Ok(()),
        ErrorKind::TimedOut => Err(ConnectionError::WriteTimedOut { written }),
        _ => Err(error.into()),
    }
}
