//! Streams that give and take a few bytes at a time, interrupt, time out and close.

use std::collections::VecDeque;
use std::io::{self, ErrorKind, Read, Write};
use std::pin::Pin;
use std::task::{Context, Poll};

use softgrasp_protocol::*;
use tokio::io::{AsyncRead, AsyncWrite, AsyncWriteExt, ReadBuf};

use crate::raw::{Random, fuzz_plan, only_frame};
use crate::samples::{Message, conversation};

/// One call of a scripted stream.
#[derive(Clone, Debug)]
enum Step {
    /// Gives these bytes, or takes as many.
    Bytes(Vec<u8>),
    /// Fails once with this kind of error.
    Fault(ErrorKind),
}

/// Stream that plays its steps; at their end it is closed for reading.
#[derive(Debug, Default)]
struct Script {
    steps: VecDeque<Step>,
    written: Vec<u8>,
}

impl Script {
    fn reading(steps: impl IntoIterator<Item = Step>) -> Self {
        Self { steps: steps.into_iter().collect(), written: vec![] }
    }
}

impl Read for Script {
    fn read(&mut self, into: &mut [u8]) -> io::Result<usize> {
        match self.steps.pop_front() {
            None => Ok(0),
            Some(Step::Fault(kind)) => Err(kind.into()),
            Some(Step::Bytes(mut bytes)) => {
                let count = bytes.len().min(into.len());
                into[..count].copy_from_slice(&bytes[..count]);
                if count < bytes.len() {
                    self.steps.push_front(Step::Bytes(bytes.split_off(count)));
                }
                Ok(count)
            }
        }
    }
}

impl Write for Script {
    fn write(&mut self, from: &[u8]) -> io::Result<usize> {
        let count = match self.steps.pop_front() {
            None => 0,
            Some(Step::Fault(kind)) => return Err(kind.into()),
            Some(Step::Bytes(bytes)) => bytes.len().min(from.len()),
        };
        self.written.extend_from_slice(&from[..count]);
        Ok(count)
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

impl AsyncRead for Script {
    fn poll_read(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
        into: &mut ReadBuf<'_>,
    ) -> Poll<io::Result<()>> {
        let count = match Read::read(&mut *self, into.initialize_unfilled()) {
            // tokio's streams say this by coming back later.
            Err(error) if error.kind() == ErrorKind::WouldBlock => {
                context.waker().wake_by_ref();
                return Poll::Pending;
            }
            other => other?,
        };
        into.advance(count);
        Poll::Ready(Ok(()))
    }
}

impl AsyncWrite for Script {
    fn poll_write(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
        from: &[u8],
    ) -> Poll<io::Result<usize>> {
        match Write::write(&mut *self, from) {
            Err(error) if error.kind() == ErrorKind::WouldBlock => {
                context.waker().wake_by_ref();
                Poll::Pending
            }
            other => Poll::Ready(other),
        }
    }

    fn poll_flush(self: Pin<&mut Self>, _: &mut Context<'_>) -> Poll<io::Result<()>> {
        Poll::Ready(Ok(()))
    }

    fn poll_shutdown(self: Pin<&mut Self>, _: &mut Context<'_>) -> Poll<io::Result<()>> {
        Poll::Ready(Ok(()))
    }
}

fn recording() -> (Vec<u8>, Vec<Frame>) {
    let encoded: Vec<Vec<u8>> = conversation().iter().map(Message::encode).collect();
    (encoded.concat(), encoded.iter().map(|bytes| only_frame(bytes)).collect())
}

/// `bytes` in random pieces with random faults between.
fn random_steps(bytes: &[u8], random: &mut Random) -> Vec<Step> {
    let piece_len_max = [1, 9, 300][random.below(3)];
    let mut steps = vec![];
    let mut rest = bytes;
    while !rest.is_empty() {
        while random.chance(3) {
            let kinds = [ErrorKind::Interrupted, ErrorKind::WouldBlock];
            steps.push(Step::Fault(kinds[random.below(2)]));
        }
        let (piece, later) = rest.split_at((1 + random.below(piece_len_max)).min(rest.len()));
        steps.push(Step::Bytes(piece.to_vec()));
        rest = later;
    }
    steps
}

/// All frames a blocking stream gives; read timeouts are tried again.
fn read_blocking(script: Script) -> (Vec<Frame>, Result<(), ConnectionError>) {
    let mut connection = blocking::Connection::new(script, Limits::default());
    let mut frames = vec![];
    loop {
        match connection.read_frame() {
            Ok(Some(frame)) => frames.push(frame),
            Ok(None) => return (frames, Ok(())),
            Err(ConnectionError::ReadTimedOut { received }) => {
                assert_eq!(connection.is_inside_frame(), received > 0);
            }
            Err(error) => return (frames, Err(error)),
        }
    }
}

async fn read_asynchronous(script: Script) -> (Vec<Frame>, Result<(), ConnectionError>) {
    let mut connection = asynchronous::Connection::new(script, Limits::default());
    let mut frames = vec![];
    loop {
        match connection.read_frame().await {
            Ok(Some(frame)) => frames.push(frame),
            Ok(None) => return (frames, Ok(())),
            Err(error) => return (frames, Err(error)),
        }
    }
}

#[tokio::test]
async fn a_pause_after_every_byte_changes_nothing() {
    let (bytes, frames) = recording();
    for cut in 0..=bytes.len() {
        let steps = [
            Step::Bytes(bytes[..cut].to_vec()),
            Step::Fault(ErrorKind::Interrupted),
            Step::Fault(ErrorKind::WouldBlock),
            Step::Bytes(bytes[cut..].to_vec()),
        ];
        // A step without bytes would say that the stream has ended.
        let steps =
            steps.into_iter().filter(|step| !matches!(step, Step::Bytes(b) if b.is_empty()));
        let steps: Vec<Step> = steps.collect();
        let (out, end) = read_blocking(Script::reading(steps.clone()));
        end.unwrap();
        assert_eq!(out, frames, "cut after {cut} bytes");
        let (out, end) = read_asynchronous(Script::reading(steps)).await;
        end.unwrap();
        assert_eq!(out, frames, "cut after {cut} bytes");
    }
}

#[tokio::test]
async fn an_end_at_every_byte_is_clean_or_truncated() {
    let (bytes, frames) = recording();
    let mut borders = vec![0];
    for frame in &frames {
        borders.push(borders.last().unwrap() + HEADER_LEN + frame.payload.len());
    }
    for cut in 0..=bytes.len() {
        let script = || Script::reading((cut > 0).then(|| Step::Bytes(bytes[..cut].to_vec())));
        for (out, end) in [read_blocking(script()), read_asynchronous(script()).await] {
            let whole = borders.partition_point(|border| *border <= cut) - 1;
            assert_eq!(out, frames[..whole]);
            match end {
                Ok(()) => assert_eq!(borders[whole], cut),
                Err(ConnectionError::Frame(FrameError::Truncated { received, .. })) => {
                    assert!(received > 0 && received == cut - borders[whole]);
                }
                Err(other) => panic!("closed after {cut} bytes: {other}"),
            }
        }
    }
}

#[tokio::test]
async fn random_pieces_and_faults_change_nothing_for_the_reader() {
    let (bytes, frames) = recording();
    for seed in fuzz_plan(11, 60) {
        println!("SEED={seed}");
        let steps = random_steps(&bytes, &mut Random::new(seed));
        let (out, end) = read_blocking(Script::reading(steps.clone()));
        end.unwrap();
        assert_eq!(out, frames);
        let (out, end) = read_asynchronous(Script::reading(steps)).await;
        end.unwrap();
        assert_eq!(out, frames);
    }
}

#[tokio::test]
async fn random_pieces_and_faults_change_nothing_for_the_writer() {
    let (bytes, _) = recording();
    for seed in fuzz_plan(12, 60) {
        println!("SEED={seed}");
        let steps = random_steps(&bytes, &mut Random::new(seed));
        let script = Script::reading(steps.clone());
        let mut connection = blocking::Connection::new(script, Limits::default());
        let mut rest = bytes.as_slice();
        loop {
            match connection.write_bytes(rest) {
                Ok(()) => break,
                Err(ConnectionError::WriteTimedOut { written }) => rest = &rest[written..],
                Err(other) => panic!("{other}"),
            }
        }
        assert_eq!(connection.stream().written, bytes);
        let script = Script::reading(steps);
        let mut connection = asynchronous::Connection::new(script, Limits::default());
        connection.write_bytes(&bytes).await.unwrap();
        assert_eq!(connection.stream().written, bytes);
    }
}

#[tokio::test]
async fn a_stream_that_takes_nothing_more_is_closed() {
    let script = || Script::reading([Step::Bytes(vec![0; 5])]);
    let mut connection = blocking::Connection::new(script(), Limits::default());
    let error = connection.write_bytes(&[7; 9]).unwrap_err();
    assert!(matches!(error, ConnectionError::Closed { written: 5 }));
    let mut connection = asynchronous::Connection::new(script(), Limits::default());
    let error = connection.write_bytes(&[7; 9]).await.unwrap_err();
    assert!(matches!(error, ConnectionError::Closed { written: 5 }));
}

#[tokio::test]
async fn other_faults_come_out_as_they_are() {
    let reset = || Script::reading([Step::Fault(ErrorKind::ConnectionReset)]);
    let is_reset = |error: ConnectionError| matches!(error, ConnectionError::Io(error) if error.kind() == ErrorKind::ConnectionReset);
    assert!(is_reset(read_blocking(reset()).1.unwrap_err()));
    assert!(is_reset(read_asynchronous(reset()).await.1.unwrap_err()));
    let mut connection = blocking::Connection::new(reset(), Limits::default());
    assert!(is_reset(connection.write_bytes(&[1]).unwrap_err()));
    let mut connection = asynchronous::Connection::new(reset(), Limits::default());
    assert!(is_reset(connection.write_bytes(&[1]).await.unwrap_err()));
}

#[tokio::test]
async fn a_pipe_of_one_byte_carries_the_conversation() {
    let (bytes, frames) = recording();
    let (near, far) = tokio::io::duplex(1);
    let mut writer = asynchronous::Connection::new(near, Limits::default());
    let mut reader = asynchronous::Connection::new(far, Limits::default());
    let write = async move { writer.write_bytes(&bytes).await };
    let read = async {
        let mut out = vec![];
        while let Some(frame) = reader.read_frame().await.unwrap() {
            out.push(frame);
        }
        out
    };
    let (written, out) = tokio::join!(write, read);
    written.unwrap();
    assert_eq!(out, frames);
}

#[tokio::test]
async fn a_dropped_read_loses_nothing() {
    let (bytes, frames) = recording();
    let (mut near, far) = tokio::io::duplex(1 << 20);
    let mut reader = asynchronous::Connection::new(far, Limits::default());
    let mut out = vec![];
    for piece in bytes.chunks(10) {
        near.write_all(piece).await.unwrap();
        loop {
            tokio::select! {
                biased;
                frame = reader.read_frame() => out.push(frame.unwrap().unwrap()),
                () = std::future::ready(()) => break,
            }
        }
    }
    assert_eq!(out, frames);
    assert!(!reader.is_inside_frame());
}

#[test]
fn a_silent_peer_on_a_socket_times_out_and_is_heard_later() {
    let listener = std::net::TcpListener::bind("127.0.0.1:0").unwrap();
    let near = std::net::TcpStream::connect(listener.local_addr().unwrap()).unwrap();
    let (far, _) = listener.accept().unwrap();
    near.set_read_timeout(Some(std::time::Duration::from_millis(5))).unwrap();
    let mut near = blocking::Connection::new(near, Limits::default());
    let mut far = blocking::Connection::new(far, Limits::default());
    let timeout = near.read_frame().unwrap_err();
    assert!(matches!(timeout, ConnectionError::ReadTimedOut { received: 0 }));
    let mut bytes = vec![];
    Reply::Pong { nonce: 3 }.encode_into(9, &Limits::default(), &mut bytes).unwrap();
    far.write_bytes(&bytes).unwrap();
    near.stream().set_read_timeout(None).unwrap();
    let frame = near.read_frame().unwrap().unwrap();
    let reply = Reply::decode(&frame, &Limits::default()).unwrap();
    assert_eq!(reply, Reply::Pong { nonce: 3 });
    drop(far);
    assert!(near.read_frame().unwrap().is_none());
}

/// A stream whose system reports that the peer's machine does not answer any more.
#[cfg(unix)]
struct Dead;

#[cfg(unix)]
impl Read for Dead {
    fn read(&mut self, _: &mut [u8]) -> io::Result<usize> {
        // ETIMEDOUT of Linux.
        Err(io::Error::from_raw_os_error(110))
    }
}

#[cfg(unix)]
#[test]
fn machine_that_does_not_answer_any_more_is_not_called_a_slow_one() {
    let mut connection = softgrasp_protocol::blocking::Connection::new(Dead, Limits::default());
    let error = connection.read_frame().unwrap_err();
    match (cfg!(target_os = "linux"), error) {
        (true, ConnectionError::Io(_)) | (false, _) => {}
        (true, other) => panic!("{other:?}"),
    }
}
