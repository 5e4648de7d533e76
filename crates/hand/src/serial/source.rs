//! Which serial ports glove and tracker are on, as written on the command line.

use std::fmt;
use std::path::PathBuf;
use std::str::FromStr;

/// A serial port and its speed.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PortName {
    /// Device file; `COM3` and the like on Windows.
    pub path: PathBuf,
    /// Speed, bits per second.
    pub baud: u32,
}

/// The ports of glove and tracker; at least one of them.
///
/// Text: `glove=PATH[@BAUD],tracker=PATH[@BAUD]` in either order, 115200 baud if none is given. A
/// path may hold `@`, which is the speed's only before the digits at the end, but no comma.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SerialSource {
    /// Port of the glove.
    pub glove: Option<PortName>,
    /// Port of the tracker.
    pub tracker: Option<PortName>,
}

/// Why a text names no serial devices.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum SerialSourceError {
    /// A part is not `glove=…` or `tracker=…`.
    #[error("'{part}' is not glove=PATH[@BAUD] or tracker=PATH[@BAUD]")]
    Part {
        /// The part of the text.
        part: String,
    },
    /// A device is named twice.
    #[error("the {device} is named twice")]
    Twice {
        /// `glove` or `tracker`.
        device: &'static str,
    },
    /// A device has no path.
    #[error("the {device} has no path")]
    NoPath {
        /// `glove` or `tracker`.
        device: &'static str,
    },
    /// A line cannot have this speed.
    #[error("{text} baud is no speed of a serial line; there are 300 to 4000000")]
    Baud {
        /// Text of the speed.
        text: String,
    },
    /// Both devices are on one port.
    #[error("glove and tracker cannot share the port {path}")]
    SamePort {
        /// Path of the port.
        path: PathBuf,
    },
}

impl PortName {
    /// Speed where none is given, bits per second.
    pub const BAUD_DEFAULT: u32 = 115_200;
    /// Speeds that can be asked for, bits per second.
    pub const BAUDS: std::ops::RangeInclusive<u32> = 300..=4_000_000;

    fn parse(device: &'static str, text: &str) -> Result<Self, SerialSourceError> {
        let is_speed = |text: &str| !text.is_empty() && text.bytes().all(|b| b.is_ascii_digit());
        let (path, baud) = match text.rsplit_once('@').filter(|(_, speed)| is_speed(speed)) {
            None => (text, Self::BAUD_DEFAULT),
            Some((path, speed)) => match speed.parse() {
                Ok(baud) if Self::BAUDS.contains(&baud) => (path, baud),
                _ => return Err(SerialSourceError::Baud { text: speed.to_owned() }),
            },
        };
        if path.is_empty() {
            return Err(SerialSourceError::NoPath { device });
        }
        Ok(Self { path: path.into(), baud })
    }
}

impl fmt::Display for PortName {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}@{}", self.path.display(), self.baud)
    }
}

impl FromStr for SerialSource {
    type Err = SerialSourceError;

    fn from_str(text: &str) -> Result<Self, SerialSourceError> {
        let mut source = Self { glove: None, tracker: None };
        for part in text.split(',') {
            let (device, slot, name) = match part.split_once('=') {
                Some(("glove", name)) => ("glove", &mut source.glove, name),
                Some(("tracker", name)) => ("tracker", &mut source.tracker, name),
                _ => return Err(SerialSourceError::Part { part: part.to_owned() }),
            };
            if slot.replace(PortName::parse(device, name)?).is_some() {
                return Err(SerialSourceError::Twice { device });
            }
        }
        match (&source.glove, &source.tracker) {
            (Some(glove), Some(tracker)) if glove.path == tracker.path => {
                Err(SerialSourceError::SamePort { path: glove.path.clone() })
            }
            _ => Ok(source),
        }
    }
}

impl fmt::Display for SerialSource {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let named = [("glove", &self.glove), ("tracker", &self.tracker)];
        let mut comma = "";
        for (device, port) in named {
            if let Some(port) = port {
                write!(f, "{comma}{device}={port}")?;
                comma = ",";
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn port(path: &str, baud: u32) -> Option<PortName> {
        Some(PortName { path: path.into(), baud })
    }

    #[test]
    fn both_orders_one_device_and_speeds_are_read() {
        let read = |text: &str| text.parse::<SerialSource>().unwrap();
        let both = read("tracker=/dev/ttyUSB1@38400,glove=/dev/ttyUSB0");
        assert_eq!(both.glove, port("/dev/ttyUSB0", 115_200));
        assert_eq!(both.tracker, port("/dev/ttyUSB1", 38_400));
        assert_eq!(both.to_string(), "glove=/dev/ttyUSB0@115200,tracker=/dev/ttyUSB1@38400");
        let alone = read("tracker=COM3");
        assert_eq!((alone.glove, alone.tracker), (None, port("COM3", 115_200)));
        assert_eq!(read("glove=/dev/a@b@9600").glove, port("/dev/a@b", 9600));
        assert_eq!(read("glove=/dev/a@b").glove, port("/dev/a@b", 115_200));
        assert_eq!(read("glove=/dev/by=id").glove, port("/dev/by=id", 115_200));
    }

    #[test]
    fn what_names_no_devices_is_refused_in_plain_words() {
        for (text, words) in [
            ("", "is not glove=PATH"),
            ("hand=/dev/x", "is not glove=PATH"),
            ("glove=/dev/x,", "is not glove=PATH"),
            ("glove=/dev/x,glove=/dev/y", "named twice"),
            ("glove=", "no path"),
            ("tracker=@9600", "no path"),
            ("glove=/dev/x@0", "no speed"),
            ("glove=/dev/x@99999999999999", "no speed"),
            ("glove=/dev/x,tracker=/dev/x", "cannot share"),
        ] {
            let error = text.parse::<SerialSource>().unwrap_err().to_string();
            assert!(error.contains(words), "{text}: {error}");
        }
    }

    proptest! {
        #[test]
        fn what_is_written_is_read_back(path in "[a-zA-Z0-9/@=._-]{1,20}[a-z]", baud in 300u32..=4_000_000) {
            let source = SerialSource { glove: port(&path, baud), tracker: port("/dev/t", 9600) };
            prop_assert_eq!(source.to_string().parse::<SerialSource>(), Ok(source));
        }

        #[test]
        fn any_text_is_survived(text in any::<String>()) {
            let _ = text.parse::<SerialSource>();
        }
    }
}
