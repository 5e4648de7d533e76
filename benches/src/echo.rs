//! The least a round trip can cost: the same bytes to and fro, without any work.

use std::io::{Error, ErrorKind, Read, Write};
use std::net::{Shutdown, TcpListener, TcpStream};
use std::thread::JoinHandle;

/// A thread that answers every request on a loopback socket with the same bytes, and the client's
/// side of it.
pub struct Echo {
    stream: TcpStream,
    request: Vec<u8>,
    reply: Vec<u8>,
    received: Vec<u8>,
    thread: Option<JoinHandle<()>>,
}

impl Echo {
    /// Starts the thread and connects; both sides send at once (TCP_NODELAY), as the system does.
    ///
    /// # Errors
    /// The system's.
    pub fn start(request_bytes: usize, reply: &[u8]) -> std::io::Result<Self> {
        let listener = TcpListener::bind(("127.0.0.1", 0))?;
        let address = listener.local_addr()?;
        let answer = reply.to_vec();
        let thread = std::thread::Builder::new().name("echo".to_owned()).spawn(move || {
            // An error here is one on the other side too, where it is reported.
            let _ = serve(&listener, request_bytes, &answer);
        })?;
        let stream = TcpStream::connect(address)?;
        stream.set_nodelay(true)?;
        Ok(Self {
            stream,
            request: vec![0x5a; request_bytes],
            reply: reply.to_vec(),
            received: vec![0; reply.len()],
            thread: Some(thread),
        })
    }

    /// One round trip.
    ///
    /// # Errors
    /// The system's, or `InvalidData` if other bytes came back.
    pub fn trip(&mut self) -> std::io::Result<()> {
        self.stream.write_all(&self.request)?;
        self.stream.read_exact(&mut self.received)?;
        if self.received != self.reply {
            return Err(Error::new(ErrorKind::InvalidData, "other bytes came back"));
        }
        Ok(())
    }
}

fn serve(listener: &TcpListener, request_bytes: usize, reply: &[u8]) -> std::io::Result<()> {
    let (mut stream, _) = listener.accept()?;
    stream.set_nodelay(true)?;
    let mut request = vec![0; request_bytes];
    loop {
        stream.read_exact(&mut request)?;
        stream.write_all(reply)?;
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
    fn large_replies_come_back_whole_and_the_thread_ends() {
        let reply: Vec<u8> = (0..1_000_000u32).map(|i| (i * 7 % 251) as u8).collect();
        let mut echo = Echo::start(600, &reply).unwrap();
        for _ in 0..5 {
            echo.trip().unwrap();
        }
        echo.reply[999_999] ^= 1;
        assert_eq!(echo.trip().unwrap_err().kind(), ErrorKind::InvalidData);
        drop(echo);
    }
}
