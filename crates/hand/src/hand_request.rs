//! Which kind of hand acts, and the hand that is asked for on the command line.

use std::fmt;
use std::net::SocketAddr;
use std::path::PathBuf;
use std::str::FromStr;

use crate::scripted::ScriptName;
use crate::serial::SerialSource;

/// A hand, and where it comes from.
#[derive(Clone, Debug, PartialEq)]
pub enum HandRequest {
    /// A scripted hand, played by the program.
    Scripted(ScriptName),
    /// A hand driven by mouse and keyboard, in a window.
    Mouse,
    /// A recording that is played again.
    Replay(PathBuf),
    /// Glove and tracker on serial ports.
    Serial(SerialSource),
    /// A stream of joints that arrives here, over TCP or UDP.
    Joints(SocketAddr),
    /// The hand that a headset tracks and the page for browsers sends.
    Xr,
}

impl HandRequest {
    /// Kind of the hand that is asked for.
    pub fn choice(&self) -> HandChoice {
        match self {
            Self::Scripted(script) => HandChoice::Scripted(*script),
            Self::Mouse => HandChoice::Mouse,
            Self::Replay(_) => HandChoice::Replay,
            Self::Serial(_) | Self::Joints(_) | Self::Xr => HandChoice::Live,
        }
    }
}

impl HandRequest {
    /// Whether live devices or senders determine what comes and when.
    pub fn is_live(&self) -> bool {
        matches!(self, Self::Serial(_) | Self::Joints(_) | Self::Xr)
    }
}

impl FromStr for HandRequest {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match text.split_once(':').unwrap_or((text, "")) {
            ("scripted", "") => Ok(Self::Scripted(ScriptName::default())),
            ("scripted", name) => Ok(Self::Scripted(name.parse().map_err(|e| format!("{e}"))?)),
            ("mouse", "") => Ok(Self::Mouse),
            ("xr", "") => Ok(Self::Xr),
            ("replay", "") => Err("replay needs the file of a recording: replay:F.mcap".into()),
            ("replay", path) => Ok(Self::Replay(path.into())),
            ("serial", source) => Ok(Self::Serial(source.parse().map_err(|e| format!("{e}"))?)),
            ("joints", address) => {
                let address = address.parse();
                Ok(Self::Joints(address.map_err(|_| "joints needs IP:PORT to listen on")?))
            }
            _ => Err("there are scripted[:NAME], mouse, replay:F.mcap, \
                      serial:glove=PATH[@BAUD],tracker=PATH[@BAUD], joints:IP:PORT and xr"
                .into()),
        }
    }
}

impl fmt::Display for HandRequest {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Scripted(script) => write!(f, "scripted:{script}"),
            Self::Mouse => f.write_str("mouse"),
            Self::Replay(path) => write!(f, "replay:{}", path.display()),
            Self::Serial(source) => write!(f, "serial:{source}"),
            Self::Joints(address) => write!(f, "joints:{address}"),
            Self::Xr => f.write_str("xr"),
        }
    }
}

/// Kind of hand: where its motion comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum HandChoice {
    /// A scripted hand, played by the program as device bytes.
    Scripted(ScriptName),
    /// A hand driven by mouse and keyboard, in a window.
    Mouse,
    /// A person's own hand, through a glove and a tracker, or tracked otherwise.
    Live,
    /// A recording that is played again.
    Replay,
}

impl HandChoice {
    /// Whether the hand is played by the program, so that it can be paused; a person cannot.
    pub fn is_played(self) -> bool {
        matches!(self, Self::Scripted(_) | Self::Replay)
    }
}
