//! Which kind of hand acts, and the hand that is asked for on the command line.

use std::fmt;
use std::net::SocketAddr;
use std::path::PathBuf;
use std::str::FromStr;

use crate::foreign_recording::is_foreign;
use crate::scripted::ScriptName;
use crate::serial::SerialSource;
use crate::xr_runtime::{RuntimeError, WantedHands};

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
    /// The hands that an OpenXR runtime tracks.
    OpenXr(WantedHands),
}

impl HandRequest {
    /// Kind of the hand that is asked for.
    pub fn choice(&self) -> HandChoice {
        match self {
            Self::Scripted(script) => HandChoice::Scripted(*script),
            Self::Mouse => HandChoice::Mouse,
            Self::Replay(_) => HandChoice::Replay,
            Self::Serial(_) | Self::Joints(_) | Self::Xr | Self::OpenXr(_) => HandChoice::Live,
        }
    }
}

impl HandRequest {
    /// Whether live devices or senders determine what comes and when.
    pub fn is_live(&self) -> bool {
        self.choice() == HandChoice::Live
    }

    /// Whether the hand moves evenly between its samples: one whose samples do not come with the ticks. A
    /// recording of ours says itself how its hand moved.
    pub fn is_even(&self) -> bool {
        self.is_live() || matches!(self, Self::Replay(path) if is_foreign(path))
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
            ("openxr", _) if !cfg!(feature = "openxr") => Err(RuntimeError::NotBuilt.to_string()),
            ("openxr", name) => Ok(Self::OpenXr(name.parse().map_err(|e| format!("{e}"))?)),
            ("replay", "") => Err("replay needs the file of a recording: replay:F.mcap".into()),
            ("replay", path) => Ok(Self::Replay(path.into())),
            ("serial", source) => Ok(Self::Serial(source.parse().map_err(|e| format!("{e}"))?)),
            ("joints", address) => {
                let address = address.parse();
                Ok(Self::Joints(address.map_err(|_| "joints needs IP:PORT to listen on")?))
            }
            _ => Err("there are scripted[:NAME], mouse, replay:F.mcap, \
                      serial:glove=PATH[@BAUD],tracker=PATH[@BAUD], joints:IP:PORT, xr and openxr[:left|:right]"
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
            Self::OpenXr(wanted) => wanted.fmt(f),
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

#[cfg(test)]
mod tests {
    use softgrasp_grasp::hand::Handedness;

    use super::*;

    #[test]
    fn every_word_of_a_hand_is_read_as_it_is_written() {
        let words = ["mouse", "xr", "scripted:lift", "joints:127.0.0.1:7879", "replay:a.mcap"];
        for word in words {
            assert_eq!(word.parse::<HandRequest>().map(|hand| hand.to_string()), Ok(word.into()));
        }
        for (word, wanted) in [
            ("openxr", WantedHands::Both),
            ("openxr:left", WantedHands::One(Handedness::Left)),
            ("openxr:right", WantedHands::One(Handedness::Right)),
        ] {
            assert_eq!(HandRequest::OpenXr(wanted).to_string(), word);
            let sides = wanted.sides().len();
            assert_eq!(sides, if wanted == WantedHands::Both { 2 } else { 1 });
        }
    }

    #[test]
    fn hands_of_a_runtime_are_refused_by_a_build_that_asks_none() {
        let read = |word: &str| word.parse::<HandRequest>();
        if cfg!(feature = "openxr") {
            assert_eq!(read("openxr"), Ok(HandRequest::OpenXr(WantedHands::Both)));
            let left = WantedHands::One(Handedness::Left);
            assert_eq!(read("openxr:left"), Ok(HandRequest::OpenXr(left)));
            assert!(read("openxr:middle").unwrap_err().contains("there is no \"middle\""));
        } else {
            let refused = read("openxr").unwrap_err();
            assert!(refused.contains("with its feature `openxr`"), "{refused}");
        }
    }
}
