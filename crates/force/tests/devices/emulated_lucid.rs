//! A LucidGlove at the far end of a pair of pseudo-terminals: lines of flexion out, lines of servos in.

use std::path::PathBuf;
use std::sync::{Arc, Mutex};
use std::thread::JoinHandle;
use std::time::Duration;

use serial2::SerialPort;

/// The glove, which sends a line and hears one in turn.
pub struct EmulatedLucid {
    /// Port that a client opens.
    pub path: PathBuf,
    heard: Arc<Mutex<Heard>>,
    thread: Option<JoinHandle<()>>,
    /// Kept open, so that a client may close and open it.
    _client_end: SerialPort,
}

#[derive(Debug, Default)]
struct Heard {
    lines: Vec<String>,
    ends: bool,
}

impl EmulatedLucid {
    /// Plugs the glove in.
    pub fn start() -> Self {
        let (mut device, client_end) = SerialPort::pair().expect("the system has pseudo-terminals");
        device.set_read_timeout(Duration::from_millis(5)).expect("a time can be set");
        device.set_write_timeout(Duration::from_millis(5)).expect("a time can be set");
        let path = nix::unistd::ttyname(&client_end).expect("a pseudo-terminal has a name");
        let heard = Arc::new(Mutex::new(Heard::default()));
        let of_thread = Arc::clone(&heard);
        let thread = std::thread::spawn(move || play(&device, &of_thread));
        Self { path, heard, thread: Some(thread), _client_end: client_end }
    }

    /// Servo numbers of the newest whole line, thumb first; `None` before the first.
    pub fn servos(&self) -> Option<[u32; 5]> {
        let heard = self.heard.lock().expect("the glove goes on");
        heard.lines.last().map(|line| servos_of(line))
    }
}

impl Drop for EmulatedLucid {
    fn drop(&mut self) {
        self.heard.lock().expect("the glove goes on").ends = true;
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}

fn play(device: &SerialPort, heard: &Mutex<Heard>) {
    let mut text = String::new();
    let mut bytes = [0u8; 256];
    while !heard.lock().expect("the test goes on").ends {
        let _ = device.write_all(b"A512B512C512D512E512F0G0\n");
        if let Ok(count) = device.read(&mut bytes) {
            text.push_str(&String::from_utf8_lossy(&bytes[..count]));
        }
        while let Some(end) = text.find('\n') {
            let line: String = text.drain(..=end).collect();
            heard.lock().expect("the test goes on").lines.push(line);
        }
        std::thread::sleep(Duration::from_millis(2));
    }
}

fn servos_of(line: &str) -> [u32; 5] {
    let mut rest = line.trim_end();
    std::array::from_fn(|finger| {
        let letter = char::from(b'A' + finger as u8);
        rest = rest.strip_prefix(letter).expect("the letters come in their order");
        let end = rest.find(|c: char| !c.is_ascii_digit()).unwrap_or(rest.len());
        let number = rest[..end].parse().expect("a servo has a number");
        rest = &rest[end..];
        assert!(number <= 1000, "{line}");
        number
    })
}
