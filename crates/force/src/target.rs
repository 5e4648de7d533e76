//! Where the forces go: the value of the option `--force`.

use std::path::PathBuf;
use std::str::FromStr;

use crate::limits::DeviceLimits;
use crate::rendering::PORTS;

/// Device, or file, that takes the forces.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Target {
    /// Haply Inverse3 by the WebSocket of its service: newtons at one point.
    Haply {
        /// Address of the service, `ws://HOST:PORT`.
        url: String,
    },
    /// LucidGloves on a serial port: a servo for each finger.
    Lucid {
        /// Serial port.
        port: PathBuf,
    },
    /// A level for each finger as datagrams, for the bridge to a glove of another make.
    Level {
        /// Host and port.
        address: String,
    },
    /// A file of comma-separated values.
    Record {
        /// File that is written.
        path: PathBuf,
    },
}

/// Where the service of Haply listens if nothing else is said.
pub const HAPLY_URL: &str = "ws://localhost:10001";

/// Why a text names no target.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum TargetError {
    /// No device has this name.
    #[error(
        "`{text}` names no device; it is haply[:ws://HOST:PORT], lucid:PORT, level:HOST:PORT or record:FILE"
    )]
    Unknown {
        /// The text.
        text: String,
    },
    /// A device whose address is missing.
    #[error("{device} needs an address: {expected}")]
    Missing {
        /// Name of the device.
        device: &'static str,
        /// Form of the address.
        expected: &'static str,
    },
    /// An address of another kind.
    #[error("`{address}` is no address of {device}: {expected}")]
    Address {
        /// Name of the device.
        device: &'static str,
        /// The address.
        address: String,
        /// Form of the address.
        expected: &'static str,
    },
}

impl FromStr for Target {
    type Err = TargetError;

    fn from_str(text: &str) -> Result<Self, TargetError> {
        let (device, address) = text.split_once(':').unwrap_or((text, ""));
        let missing = |device, expected| TargetError::Missing { device, expected };
        let wrong = |device, expected| TargetError::Address {
            device,
            address: address.to_owned(),
            expected,
        };
        match (device, address) {
            ("haply", "") => Ok(Self::Haply { url: HAPLY_URL.to_owned() }),
            ("haply", url) if url.starts_with("ws://") => Ok(Self::Haply { url: url.to_owned() }),
            ("haply", _) => Err(wrong("haply", "haply:ws://HOST:PORT")),
            ("lucid", "") => Err(missing("lucid", "lucid:SERIAL_PORT")),
            ("lucid", port) => Ok(Self::Lucid { port: port.into() }),
            ("level", "") => Err(missing("level", "level:HOST:PORT")),
            ("level", address) => {
                let bare = address.strip_prefix("udp://").unwrap_or(address);
                let has_port = bare.rsplit_once(':').is_some_and(|(host, port)| {
                    !host.is_empty() && !host.contains('/') && port.parse::<u16>().is_ok()
                });
                match has_port {
                    true => Ok(Self::Level { address: bare.to_owned() }),
                    false => Err(wrong("level", "level:HOST:PORT or level:udp://HOST:PORT")),
                }
            }
            ("record", "") => Err(missing("record", "record:FILE")),
            ("record", path) => Ok(Self::Record { path: path.into() }),
            _ => Err(TargetError::Unknown { text: text.to_owned() }),
        }
    }
}

impl Target {
    /// Name of the device in reports.
    pub const fn name(&self) -> &'static str {
        match self {
            Self::Haply { .. } => "haply",
            Self::Lucid { .. } => "lucid",
            Self::Level { .. } => "level",
            Self::Record { .. } => "record",
        }
    }

    /// What the device can render.
    pub const fn limits(&self) -> DeviceLimits {
        match self {
            Self::Haply { .. } | Self::Record { .. } => DeviceLimits::desktop(),
            Self::Lucid { .. } | Self::Level { .. } => DeviceLimits::brakes(),
        }
    }

    /// Port that feels a finger, thumb first, or the palm after the little finger. An arm on the desk
    /// feels the whole hand at its one point; a glove has nothing at the palm.
    pub const fn port_of(&self, finger: usize) -> Option<usize> {
        match self {
            Self::Haply { .. } => Some(0),
            _ if finger < PORTS => Some(finger),
            _ => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn texts_name_devices() {
        let parsed = |text: &str| text.parse::<Target>();
        assert_eq!(parsed("haply"), Ok(Target::Haply { url: HAPLY_URL.to_owned() }));
        let url = "ws://localhost:9".to_owned();
        assert_eq!(parsed("haply:ws://localhost:9"), Ok(Target::Haply { url }));
        assert_eq!(parsed("lucid:COM3"), Ok(Target::Lucid { port: "COM3".into() }));
        let address = "localhost:7000".to_owned();
        assert_eq!(
            parsed("level:udp://localhost:7000"),
            Ok(Target::Level { address: address.clone() })
        );
        assert_eq!(parsed("level:localhost:7000"), Ok(Target::Level { address }));
        assert_eq!(parsed("record:f.csv"), Ok(Target::Record { path: "f.csv".into() }));
        for wrong in ["", "falcon", "haply:10001", "lucid", "level:", "level:http://a:1", "record"]
        {
            assert!(parsed(wrong).is_err(), "{wrong}");
        }
    }

    #[test]
    fn an_arm_feels_the_whole_hand_and_a_glove_each_finger() {
        let haply = Target::Haply { url: HAPLY_URL.to_owned() };
        assert_eq!([0, 4, 5].map(|f| haply.port_of(f)), [Some(0); 3]);
        let lucid = Target::Lucid { port: "p".into() };
        assert_eq!([0, 4, 5].map(|f| lucid.port_of(f)), [Some(0), Some(4), None]);
    }
}
