//! Emulated devices behind pseudo-terminals, which a client opens as it opens a serial port.

use std::io;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use nalgebra::Isometry3;
use serial2::SerialPort;
use softgrasp_hand::devices::cyberglove::RawSensors;
use softgrasp_hand::devices::fastrak::Station;

use crate::{EmulatedGlove, EmulatedTracker};
use softgrasp_hand::serial::motion::Motion;

/// Why the pseudo-terminal of a device cannot be made.
#[derive(Debug, thiserror::Error)]
pub enum EmulateError {
    /// The system gives no pseudo-terminal.
    #[error("the system gives no pseudo-terminal")]
    Terminal(#[source] io::Error),
    /// The link cannot be made.
    #[error("the link {path} to the pseudo-terminal cannot be made")]
    Link {
        /// Path at which the link was to stand.
        path: PathBuf,
        /// Error of the operating system.
        source: io::Error,
    },
    /// Something else stands where the link was to stand.
    #[error("{path} is there already and is no link")]
    InTheWay {
        /// Path at which the link was to stand.
        path: PathBuf,
    },
}

/// A pair of pseudo-terminals: the device's end is ours, the other has a name.
///
/// Dropping it is unplugging: the client's port is hung up, and the link goes.
#[derive(Debug)]
pub struct PseudoTerminal {
    device_end: SerialPort,
    /// Kept open, so that a client may close and open it, and its speed can be seen.
    client_end: SerialPort,
    name: PathBuf,
    link: Option<PathBuf>,
}

impl PseudoTerminal {
    /// Opens a pair; with `link` the client's end can also be opened by that name.
    ///
    /// # Errors
    /// [`EmulateError`].
    pub fn open(link: Option<&Path>) -> Result<Self, EmulateError> {
        let open = || {
            let (mut device_end, client_end) = SerialPort::pair()?;
            device_end.set_read_timeout(Duration::ZERO)?;
            device_end.set_write_timeout(Duration::ZERO)?;
            let name = nix::unistd::ttyname(&client_end)?;
            Ok(Self { device_end, client_end, name, link: None })
        };
        let mut terminal = open().map_err(EmulateError::Terminal)?;
        if let Some(link) = link {
            make_link(&terminal.name, link)?;
            terminal.link = Some(link.to_owned());
        }
        Ok(terminal)
    }

    /// Path by which a client opens the pseudo-terminal: that of the link, if there is one.
    pub fn path(&self) -> &Path {
        self.link.as_deref().unwrap_or(&self.name)
    }

    /// Speed that the client has set, bits per second.
    pub fn baud(&self) -> Option<u32> {
        self.client_end.get_configuration().and_then(|settings| settings.get_baud_rate()).ok()
    }

    /// Bytes that the client has sent since the last call; empty if it has sent none.
    pub fn read(&self) -> Vec<u8> {
        let mut all = Vec::new();
        let mut bytes = [0; 1024];
        while let Ok(count @ 1..) = self.device_end.read(&mut bytes) {
            all.extend_from_slice(&bytes[..count]);
            if count < bytes.len() {
                break;
            }
        }
        all
    }

    /// Sends bytes to the client; what does not fit because nobody reads is lost, as on a real line.
    pub fn write(&self, mut bytes: &[u8]) {
        while !bytes.is_empty() {
            match self.device_end.write(bytes) {
                Ok(count @ 1..) => bytes = bytes.get(count..).unwrap_or_default(),
                _ => return,
            }
        }
    }
}

impl Drop for PseudoTerminal {
    fn drop(&mut self) {
        if let Some(link) = &self.link
            && std::fs::read_link(link).is_ok_and(|target| target == self.name)
        {
            let _ = std::fs::remove_file(link);
        }
    }
}

fn make_link(name: &Path, link: &Path) -> Result<(), EmulateError> {
    let failed = |source| EmulateError::Link { path: link.to_owned(), source };
    match std::fs::symlink_metadata(link) {
        // Left behind by an emulator that ended abruptly.
        Ok(found) if found.is_symlink() => std::fs::remove_file(link).map_err(failed)?,
        Ok(_) => return Err(EmulateError::InTheWay { path: link.to_owned() }),
        Err(_) => {}
    }
    std::os::unix::fs::symlink(name, link).map_err(failed)
}

/// What a line at the wrong speed makes of a byte.
fn garbled(bytes: &[u8]) -> Vec<u8> {
    bytes.iter().map(|byte| byte.rotate_left(3) ^ 0x5a).collect()
}

/// An emulated glove on a serial line.
#[derive(Debug)]
pub struct GloveLine {
    /// The line, as a pseudo-terminal.
    pub terminal: PseudoTerminal,
    /// The emulated glove.
    pub glove: EmulatedGlove,
}

impl GloveLine {
    /// Lets the glove take the bytes that the client has sent.
    pub fn hear(&mut self, now_s: f64) {
        let heard = self.terminal.read();
        if !heard.is_empty() {
            let fits = self.terminal.baud() == Some(self.glove.kind().baud);
            let heard = if fits { heard } else { garbled(&heard) };
            self.glove.receive(&heard, now_s);
        }
    }

    /// Sends to the client what has left the glove by now.
    pub fn speak(&mut self, now_s: f64, pose: impl FnMut(f64) -> RawSensors) {
        let bytes = self.glove.send(now_s, pose);
        if !bytes.is_empty() {
            let fits = self.terminal.baud() == Some(self.glove.kind().baud);
            self.terminal.write(&if fits { bytes } else { garbled(&bytes) });
        }
    }
}

/// An emulated tracker on a serial line.
#[derive(Debug)]
pub struct TrackerLine {
    /// The line, as a pseudo-terminal.
    pub terminal: PseudoTerminal,
    /// The emulated tracker.
    pub tracker: EmulatedTracker,
}

impl TrackerLine {
    /// Lets the tracker take the bytes that the client has sent.
    pub fn hear(&mut self, now_s: f64) {
        let heard = self.terminal.read();
        if !heard.is_empty() {
            let fits = self.terminal.baud() == Some(self.tracker.kind().baud);
            let heard = if fits { heard } else { garbled(&heard) };
            self.tracker.receive(&heard, now_s);
        }
    }

    /// Sends to the client what has left the tracker by now.
    pub fn speak(&mut self, now_s: f64, pose: impl FnMut(Station, f64) -> Isometry3<f64>) {
        let bytes = self.tracker.send(now_s, pose);
        if !bytes.is_empty() {
            let fits = self.terminal.baud() == Some(self.tracker.kind().baud);
            self.terminal.write(&if fits { bytes } else { garbled(&bytes) });
        }
    }
}

/// Glove and tracker that feel the same motion, in real time.
#[derive(Debug)]
pub struct Emulation {
    /// The emulated glove on its line.
    pub glove: GloveLine,
    /// The emulated tracker on its line.
    pub tracker: TrackerLine,
    motion: Motion,
    begun: Instant,
    /// When the motion began, s.
    motion_from_s: Option<f64>,
    /// When the first device was asked, s.
    asked_s: Option<f64>,
    asked: [bool; 2],
    records: u64,
}

/// Time after the first device was asked for records at which the motion begins without the other, s.
const WAIT_FOR_OTHER_S: f64 = 5.0;

impl Emulation {
    /// Both devices, at rest until a client asks for records.
    pub fn new(glove: GloveLine, tracker: TrackerLine, motion: Motion) -> Self {
        Self {
            glove,
            tracker,
            motion,
            begun: Instant::now(),
            motion_from_s: None,
            asked_s: None,
            asked: [false; 2],
            records: 0,
        }
    }

    /// Number of glove records sent so far.
    pub fn glove_records(&self) -> u64 {
        self.records
    }

    /// How long the devices have been on, s.
    pub fn on_for_s(&self) -> f64 {
        self.begun.elapsed().as_secs_f64()
    }

    /// Takes and sends the bytes that are due; to be called about every millisecond.
    pub fn step(&mut self) {
        let now_s = self.on_for_s();
        self.glove.hear(now_s);
        self.tracker.hear(now_s);
        self.asked[0] |= self.glove.glove.is_asked();
        self.asked[1] |= self.tracker.tracker.is_asked();
        if self.asked.contains(&true) {
            let asked_s = *self.asked_s.get_or_insert(now_s);
            if self.asked == [true; 2] || now_s - asked_s > WAIT_FOR_OTHER_S {
                self.motion_from_s.get_or_insert(now_s);
            }
        }
        let from_s = self.motion_from_s.unwrap_or(f64::INFINITY);
        let (motion, records) = (&self.motion, &mut self.records);
        self.glove.speak(now_s, |time_s| {
            *records += 1;
            motion.raw(time_s - from_s)
        });
        self.tracker.speak(now_s, |_, time_s| motion.stand_from_receiver(time_s - from_s));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_link_is_replaced_and_a_file_is_not() {
        let folder = tempfile::tempdir().unwrap();
        let link = folder.path().join("glove");
        std::os::unix::fs::symlink("/dev/left-behind", &link).unwrap();
        let terminal = PseudoTerminal::open(Some(&link)).unwrap();
        assert_eq!(std::fs::read_link(&link).unwrap(), terminal.name);
        drop(terminal);
        assert!(std::fs::symlink_metadata(&link).is_err());
        std::fs::write(&link, "a file").unwrap();
        let refused = PseudoTerminal::open(Some(&link)).unwrap_err();
        assert!(matches!(refused, EmulateError::InTheWay { .. }), "{refused}");
        assert_eq!(std::fs::read_to_string(&link).unwrap(), "a file");
    }
}
