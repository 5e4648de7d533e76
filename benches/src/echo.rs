//! An echo of the same bytes without any work: the least that a round trip can cost.

use std::io::{Error, ErrorKind, Read, Write};
use std::net::{Shutdown, TcpListener, TcpStream};
use std::thread::JoinHandle;

use glove_client::pace::be_urgent;

/// How one end of a connection waits for bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Waiting {
    /// The system wakes the thread when bytes have come.
    Asleep,
    /// The thread looks repeatedly, and yields between two looks.
    Awake,
}

/// How both ends of a connection wait.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Ends {
    /// The client's end.
    pub client: Waiting,
    /// The server's end.
    pub server: Waiting,
}

impl Ends {
    /// Both ends sleep.
    pub const ASLEEP: Self = Self { client: Waiting::Asleep, server: Waiting::Asleep };
    /// The client stays awake; the server sleeps, as `fea-server` always does.
    pub const CLIENT_AWAKE: Self = Self { client: Waiting::Awake, server: Waiting::Asleep };
    /// Neither end sleeps: the shortest round trip, which keeps two processors busy.
    pub const AWAKE: Self = Self { client: Waiting::Awake, server: Waiting::Awake };
}

/// Thread that answers every request on a loopback socket with the same bytes, and the client's side of
/// it.
pub struct Echo {
    stream: TcpStream,
    request: Vec<u8>,
    reply: Vec<u8>,
    received: Vec<u8>,
    thread: Option<JoinHandle<()>>,
}

impl Echo {
    /// Starts the thread and connects; both sides send at once (TCP_NODELAY), as client and server do. A
    /// thread that sleeps asks for real-time scheduling, as that of the server's sockets does.
    ///
    /// # Errors
    /// Error of the operating system.
    pub fn start(request_bytes: usize, reply: &[u8], ends: Ends) -> std::io::Result<Self> {
        let listener = TcpListener::bind(("127.0.0.1", 0))?;
        let address = listener.local_addr()?;
        let answer = reply.to_vec();
        let thread = std::thread::Builder::new().name("echo".to_owned()).spawn(move || {
            if ends.server == Waiting::Asleep {
                be_urgent();
            }
            // An error here is one on the other side too, where it is reported.
            let _ = serve(&listener, request_bytes, &answer, ends.server);
        })?;
        let stream = TcpStream::connect(address)?;
        prepare(&stream, ends.client)?;
        Ok(Self {
            stream,
            request: vec![0x5a; request_bytes],
            reply: reply.to_vec(),
            received: vec![0; reply.len()],
            thread: Some(thread),
        })
    }

    /// Makes one round trip.
    ///
    /// # Errors
    /// Error of the operating system, or `InvalidData` if other bytes came back.
    pub fn trip(&mut self) -> std::io::Result<()> {
        write_all(&mut self.stream, &self.request)?;
        read_exact(&mut self.stream, &mut self.received)?;
        if self.received != self.reply {
            return Err(Error::new(ErrorKind::InvalidData, "other bytes came back"));
        }
        Ok(())
    }
}

/// Sets a stream up: an end that stays awake does not block.
fn prepare(stream: &TcpStream, waiting: Waiting) -> std::io::Result<()> {
    stream.set_nodelay(true)?;
    stream.set_nonblocking(waiting == Waiting::Awake)
}

fn serve(
    listener: &TcpListener,
    request_bytes: usize,
    reply: &[u8],
    waiting: Waiting,
) -> std::io::Result<()> {
    let (mut stream, _) = listener.accept()?;
    prepare(&stream, waiting)?;
    let mut request = vec![0; request_bytes];
    loop {
        read_exact(&mut stream, &mut request)?;
        write_all(&mut stream, reply)?;
    }
}

fn read_exact(stream: &mut TcpStream, mut bytes: &mut [u8]) -> std::io::Result<()> {
    while !bytes.is_empty() {
        let count = awake(|| stream.read(bytes))?;
        if count == 0 {
            return Err(ErrorKind::UnexpectedEof.into());
        }
        bytes = &mut bytes[count..];
    }
    Ok(())
}

fn write_all(stream: &mut TcpStream, mut bytes: &[u8]) -> std::io::Result<()> {
    while !bytes.is_empty() {
        let count = awake(|| stream.write(bytes))?;
        bytes = &bytes[count..];
    }
    Ok(())
}

/// Repeats an attempt while the system has no bytes; a stream that blocks never reports this.
fn awake(mut attempt: impl FnMut() -> std::io::Result<usize>) -> std::io::Result<usize> {
    loop {
        match attempt() {
            Err(error) if error.kind() == ErrorKind::WouldBlock => std::thread::yield_now(),
            Err(error) if error.kind() == ErrorKind::Interrupted => {}
            done => return done,
        }
    }
}

impl Drop for Echo {
    fn drop(&mut self) {
        // Ends the thread's read.
        let _ = self.stream.shutdown(Shutdown::Both);
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn large_replies_come_back_whole_and_the_thread_ends_however_it_waits() {
        let reply: Vec<u8> = (0..1_000_000u32).map(|i| (i * 7 % 251) as u8).collect();
        for ends in [Ends::ASLEEP, Ends::CLIENT_AWAKE, Ends::AWAKE] {
            let mut echo = Echo::start(600, &reply, ends).unwrap();
            for _ in 0..5 {
                echo.trip().unwrap();
            }
            echo.reply[999_999] ^= 1;
            assert_eq!(echo.trip().unwrap_err().kind(), ErrorKind::InvalidData);
            drop(echo);
        }
    }
}
