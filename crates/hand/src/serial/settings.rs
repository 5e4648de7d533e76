//! How glove and tracker are to be set up.

use std::path::{Path, PathBuf};

use super::source::{PortName, SerialSource};
use crate::devices::cyberglove::{GloveEncoding, RecordOptions, SensorCount};
use crate::devices::fastrak::{Encoding, FastrakFormat, LengthUnit, OutputList, Station};
use crate::hand_setup::{GloveMode as Asked, HandConfiguration};

/// How the records of the glove are asked for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum GloveMode {
    /// One request per record: it cannot lose its place for long and needs no stop.
    Polled {
        /// Requests per second, fewer if the replies are slower.
        hz: f64,
    },
    /// The glove sends by itself.
    Streamed {
        /// Records per second that the glove is told to send.
        hz: f64,
    },
}

/// Settings of the glove and its interface unit.
#[derive(Clone, Debug, PartialEq)]
pub struct GloveSettings {
    /// Serial port of the glove.
    pub port: PortName,
    /// How records are asked for: polled or streamed.
    pub mode: GloveMode,
    /// Number of sensors; `None` asks the glove.
    pub sensors: Option<SensorCount>,
    /// Whether records are bytes or lines of text.
    pub encoding: GloveEncoding,
    /// Time stamp and status in its records; only in bytes.
    pub options: RecordOptions,
    /// Whether the filter of the interface unit is on; without it sampling is quicker and noisier.
    pub filter: bool,
    /// Whether the unit is restarted (some 2 s) when its port is opened.
    pub restart: bool,
}

impl GloveSettings {
    /// What suits most gloves: polled at 100 Hz, bytes without options, filtered, restarted.
    pub fn new(port: PortName) -> Self {
        Self {
            port,
            mode: GloveMode::Polled { hz: 100.0 },
            sensors: None,
            encoding: GloveEncoding::Binary,
            options: RecordOptions::default(),
            filter: true,
            restart: true,
        }
    }
}

/// How the records of the tracker are asked for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum TrackerMode {
    /// One request per record (`P`).
    Polled {
        /// Requests per second, fewer if the replies are slower.
        hz: f64,
    },
    /// The tracker sends by itself (`C`), 120 records per second.
    Continuous,
}

/// One of the tracker's adaptive filters.
///
/// Each new value is `α·measured + (1 − α)·old`; α moves between the limits, the sooner to the upper
/// one the more the receiver moves.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum TrackerFilter {
    /// The filter is off.
    Off,
    /// The filter is on; all numbers are from 0 to 1.
    On {
        /// How readily α follows motion.
        sensitivity: f64,
        /// Lowest α.
        low: f64,
        /// Highest α.
        high: f64,
        /// How much α may fall from record to record.
        factor: f64,
    },
}

/// How the tracker is to be set up; everything is set, because what it was left with is not known.
#[derive(Clone, Debug, PartialEq)]
pub struct TrackerSettings {
    /// Serial port of the tracker.
    pub port: PortName,
    /// The receiver on the hand; all others are switched off, which makes this one faster.
    pub station: Station,
    /// Output list of a record, text or floats, and unit of position.
    pub format: FastrakFormat,
    /// Direction from the transmitter into the half of space where the hand is; zero lets the tracker
    /// follow the receiver.
    ///
    /// Frame: transmitter (X forward, Y right, Z down).
    pub hemisphere: [f64; 3],
    /// Filter of position.
    pub position_filter: TrackerFilter,
    /// Filter of attitude.
    pub attitude_filter: TrackerFilter,
    /// How records are asked for: polled or continuous.
    pub mode: TrackerMode,
}

impl TrackerSettings {
    /// Continuous quaternions as floats, centimetres, hand before the transmitter, no filter: a
    /// filter adds up to 158 ms of delay.
    pub fn new(port: PortName) -> Self {
        Self {
            port,
            station: Station::FIRST,
            format: FastrakFormat {
                encoding: Encoding::Binary,
                output: OutputList::PositionQuaternion,
                units: LengthUnit::Centimetres,
            },
            hemisphere: [1.0, 0.0, 0.0],
            position_filter: TrackerFilter::Off,
            attitude_filter: TrackerFilter::Off,
            mode: TrackerMode::Continuous,
        }
    }
}

/// The devices that are used.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SerialSettings {
    /// The glove, if it is used.
    pub glove: Option<GloveSettings>,
    /// The tracker, if it is used.
    pub tracker: Option<TrackerSettings>,
}

impl From<&SerialSource> for SerialSettings {
    fn from(source: &SerialSource) -> Self {
        Self {
            glove: source.glove.clone().map(GloveSettings::new),
            tracker: source.tracker.clone().map(TrackerSettings::new),
        }
    }
}

/// Why settings can never work.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum SettingsError {
    /// Neither glove nor tracker.
    #[error("neither a glove nor a tracker is named")]
    Nothing,
    /// A device has no path.
    #[error("the {device} has no path")]
    NoPath {
        /// `glove` or `tracker`.
        device: &'static str,
    },
    /// Both devices are on one port.
    #[error("glove and tracker cannot share the port {path}")]
    SamePort {
        /// Path of the port.
        path: PathBuf,
    },
    /// A line cannot have this speed.
    #[error("{baud} baud is no speed of a serial line; there are 300 to 4000000")]
    Baud {
        /// Speed that was asked for, bits per second.
        baud: u32,
    },
    /// A device cannot send records at this rate.
    #[error("{hz} records per second cannot be asked of the {device}; there are 1 to 1000")]
    Rate {
        /// `glove` or `tracker`.
        device: &'static str,
        /// Rate that was asked for, records per second.
        hz: f64,
    },
    /// Options that text records do not have.
    #[error("time stamps and status come in binary records of the glove only")]
    TextOptions,
    /// The hemisphere is not a direction.
    #[error("a hemisphere is three finite numbers below 1000")]
    Hemisphere,
    /// A number of a filter is not from 0 to 1.
    #[error("the numbers of a tracker's filter are from 0 to 1")]
    Filter,
}

impl SerialSettings {
    /// Refuses what can never work; whether the ports are there is not looked at.
    ///
    /// # Errors
    /// [`SettingsError`].
    pub fn check(&self) -> Result<(), SettingsError> {
        if let Some(glove) = &self.glove {
            check_port("glove", &glove.port)?;
            let (GloveMode::Polled { hz } | GloveMode::Streamed { hz }) = glove.mode;
            check_rate("glove", hz)?;
            let RecordOptions { timestamp, status } = glove.options;
            if glove.encoding == GloveEncoding::Ascii && (timestamp || status) {
                return Err(SettingsError::TextOptions);
            }
        }
        if let Some(tracker) = &self.tracker {
            check_port("tracker", &tracker.port)?;
            if let TrackerMode::Polled { hz } = tracker.mode {
                check_rate("tracker", hz)?;
            }
            if !tracker.hemisphere.iter().all(|x| x.abs() < 1000.0) {
                return Err(SettingsError::Hemisphere);
            }
            for filter in [tracker.position_filter, tracker.attitude_filter] {
                check_filter(filter)?;
            }
        }
        match (&self.glove, &self.tracker) {
            (None, None) => Err(SettingsError::Nothing),
            (Some(glove), Some(tracker)) if glove.port.path == tracker.port.path => {
                Err(SettingsError::SamePort { path: glove.port.path.clone() })
            }
            _ => Ok(()),
        }
    }
}

fn check_port(device: &'static str, port: &PortName) -> Result<(), SettingsError> {
    if port.path == Path::new("") {
        return Err(SettingsError::NoPath { device });
    }
    match PortName::BAUDS.contains(&port.baud) {
        true => Ok(()),
        false => Err(SettingsError::Baud { baud: port.baud }),
    }
}

fn check_rate(device: &'static str, hz: f64) -> Result<(), SettingsError> {
    match (1.0..=1000.0).contains(&hz) {
        true => Ok(()),
        false => Err(SettingsError::Rate { device, hz }),
    }
}

fn check_filter(filter: TrackerFilter) -> Result<(), SettingsError> {
    match filter {
        TrackerFilter::On { sensitivity, low, high, factor }
            if ![sensitivity, low, high, factor].iter().all(|x| (0.0..=1.0).contains(x)) =>
        {
            Err(SettingsError::Filter)
        }
        _ => Ok(()),
    }
}

/// Readings per second of a glove, polled or streamed.
const GLOVE_HZ: f64 = 100.0;

/// The devices on these ports, set up as the configuration says; the speed of a line is the
/// port's.
pub fn settings_of_hand(
    source: &SerialSource,
    configuration: &HandConfiguration,
) -> SerialSettings {
    let HandConfiguration { setup, glove, tracker, .. } = configuration;
    let mode = match glove.mode {
        Asked::Polled => GloveMode::Polled { hz: GLOVE_HZ },
        Asked::Streamed => GloveMode::Streamed { hz: GLOVE_HZ },
    };
    let glove = source.glove.clone().map(|port| GloveSettings {
        mode,
        options: setup.glove_options,
        ..GloveSettings::new(port)
    });
    let tracker = source.tracker.clone().map(|port| TrackerSettings {
        station: tracker.station,
        format: setup.tracker,
        hemisphere: tracker.hemisphere.direction(),
        ..TrackerSettings::new(port)
    });
    SerialSettings { glove, tracker }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn both() -> SerialSettings {
        let source: SerialSource = "glove=/dev/a,tracker=/dev/b".parse().unwrap();
        SerialSettings::from(&source)
    }

    fn refused(change: impl Fn(&mut GloveSettings, &mut TrackerSettings)) -> SettingsError {
        let mut settings = both();
        let SerialSettings { glove: Some(glove), tracker: Some(tracker) } = &mut settings else {
            panic!("both are named")
        };
        change(glove, tracker);
        settings.check().unwrap_err()
    }

    #[test]
    fn what_can_never_work_is_refused() {
        assert_eq!(both().check(), Ok(()));
        assert_eq!(SerialSettings::default().check(), Err(SettingsError::Nothing));
        let same = refused(|glove, tracker| glove.port.path = tracker.port.path.clone());
        assert!(matches!(same, SettingsError::SamePort { .. }));
        let rate = refused(|glove, _| glove.mode = GloveMode::Streamed { hz: f64::NAN });
        assert!(matches!(rate, SettingsError::Rate { device: "glove", .. }));
        let rate = refused(|_, tracker| tracker.mode = TrackerMode::Polled { hz: 0.0 });
        assert!(matches!(rate, SettingsError::Rate { device: "tracker", .. }));
        let text = refused(|glove, _| {
            glove.encoding = GloveEncoding::Ascii;
            glove.options.status = true;
        });
        assert_eq!(text, SettingsError::TextOptions);
        let side = refused(|_, tracker| tracker.hemisphere[1] = f64::INFINITY);
        assert_eq!(side, SettingsError::Hemisphere);
        let filter = TrackerFilter::On { sensitivity: 0.2, low: 0.2, high: 1.8, factor: 0.9 };
        assert_eq!(refused(|_, t| t.attitude_filter = filter), SettingsError::Filter);
        assert_eq!(refused(|_, t| t.port.baud = 0), SettingsError::Baud { baud: 0 });
        let path = refused(|glove, _| glove.port.path = PathBuf::new());
        assert_eq!(path, SettingsError::NoPath { device: "glove" });
    }
}
