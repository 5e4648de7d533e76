//! Frames over a std stream: a socket, a pipe, a file.

use std::io::{ErrorKind, Read, Write};

use crate::{ConnectionError, Frame, FrameBuffer, Limits};

/// A stream that frames are read from and written to.
///
/// Knows nothing of the format: bytes that come go into a [`FrameBuffer`], and bytes go out as they are
/// given. The stream's own timeouts (`TcpStream::set_read_timeout` and `set_write_timeout`) end as
/// [`ConnectionError::ReadTimedOut`] and [`ConnectionError::WriteTimedOut`].
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

    /// The underlying stream, to set timeouts or to shut it down.
    pub fn stream(&self) -> &S {
        &self.stream
    }

    /// The underlying stream for changes: to look whether bytes have come.
    pub fn stream_mut(&mut self) -> &mut S {
        &mut self.stream
    }

    /// Whether a frame has begun to come and has not ended.
    pub fn is_inside_frame(&self) -> bool {
        self.buffer.received() > 0
    }
}

impl<S: Read> Connection<S> {
    /// Next frame, waiting for it; `None` when the peer has closed between two frames.
    ///
    /// # Errors
    /// [`ConnectionError::Frame`] for damaged, foreign or cut bytes: the stream is to be given up.
    /// [`ConnectionError::ReadTimedOut`]: call again, nothing is lost.
    pub fn read_frame(&mut self) -> Result<Option<Frame>, ConnectionError> {
        loop {
            if let Some(frame) = self.buffer.next_frame()? {
                return Ok(Some(frame));
            }
            // A short read is no error (thesis 5.1.4); the buffer knows how to go on.
            match self.stream.read(self.buffer.spare_mut()) {
                Ok(0) => {
                    self.buffer.finish()?;
                    return Ok(None);
                }
                Ok(count) => self.buffer.advance(count),
                Err(error) => match error.kind() {
                    ErrorKind::Interrupted => {}
                    // Unix says the former, Windows the latter when a timeout has passed.
                    ErrorKind::WouldBlock | ErrorKind::TimedOut if !is_dead(&error) => {
                        let received = self.buffer.received();
                        return Err(ConnectionError::ReadTimedOut { received });
                    }
                    _ => return Err(error.into()),
                },
            }
        }
    }
}

impl<S: Write> Connection<S> {
    /// Writes all bytes of one or more frames and flushes.
    ///
    /// # Errors
    /// [`ConnectionError::WriteTimedOut`] says how many bytes the stream has taken; go on with the
    /// rest of the same bytes, or give the stream up: another frame would start inside this one.
    pub fn write_bytes(&mut self, bytes: &[u8]) -> Result<(), ConnectionError> {
        let mut written = 0;
        while let Some(rest) = bytes.get(written..).filter(|rest| !rest.is_empty()) {
            match self.stream.write(rest) {
                Ok(0) => return Err(ConnectionError::Closed { written }),
                Ok(count) => written += count,
                Err(error) => keep_writing(error, written)?,
            }
        }
        loop {
            match self.stream.flush() {
                Ok(()) => return Ok(()),
                Err(error) => keep_writing(error, written)?,
            }
        }
    }
}

/// Whether the system says that the peer's machine does not answer any more: on Unix a read or write that
/// only took too long says `WouldBlock`.
fn is_dead(error: &std::io::Error) -> bool {
    cfg!(unix) && error.kind() == ErrorKind::TimedOut && error.raw_os_error().is_some()
}

/// `Ok` if a failed write is to be tried again at once, else the error with the `written` bytes.
fn keep_writing(error: std::io::Error, written: usize) -> Result<(), ConnectionError> {
    match error.kind() {
        ErrorKind::Interrupted => Ok(()),
        ErrorKind::WouldBlock | ErrorKind::TimedOut if !is_dead(&error) => {
            Err(ConnectionError::WriteTimedOut { written })
        }
        _ => Err(error.into()),
    }
}
