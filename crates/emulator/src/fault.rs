//! The faults that an emulator can be told to have, and which records they hit.

use std::fmt;
use std::str::FromStr;

use super::chance::Chance;

/// Something that goes wrong with a device or its line.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fault {
    /// Glove: sensors that show one end of their range only.
    DeadSensor,
    /// Glove: a zero among the sensor bytes.
    ZeroByte,
    /// Glove: not plugged into its unit for one record (`eg` before the NUL).
    NotPluggedIn,
    /// Glove: the rate could not be kept for one record (`es` before the NUL).
    TooFast,
    /// Tracker: a run of records on the opposite side of the transmitter.
    HemisphereFlip,
    /// Tracker: the letter of a failed self-test in a record.
    StationError,
    /// Tracker: an error record between the data records.
    ErrorRecord,
    /// Both: the end of a record is lost.
    Truncated,
    /// Both: random bytes instead of a record, as at the wrong speed of the line.
    Noise,
    /// Both: a record comes twice.
    Duplicate,
    /// Both: everything is held back for a while and then comes at once.
    Burst,
    /// Both: the device neither hears nor speaks for a while.
    Silence,
}

impl Fault {
    /// All faults.
    pub const ALL: [Self; 12] = [
        Self::DeadSensor,
        Self::ZeroByte,
        Self::NotPluggedIn,
        Self::TooFast,
        Self::HemisphereFlip,
        Self::StationError,
        Self::ErrorRecord,
        Self::Truncated,
        Self::Noise,
        Self::Duplicate,
        Self::Burst,
        Self::Silence,
    ];

    /// Name of the fault on the command line.
    pub const fn as_str(self) -> &'static str {
        match self {
            Self::DeadSensor => "dead-sensor",
            Self::ZeroByte => "zero-byte",
            Self::NotPluggedIn => "not-plugged-in",
            Self::TooFast => "too-fast",
            Self::HemisphereFlip => "hemisphere-flip",
            Self::StationError => "station-error",
            Self::ErrorRecord => "error-record",
            Self::Truncated => "truncated",
            Self::Noise => "noise",
            Self::Duplicate => "duplicate",
            Self::Burst => "burst",
            Self::Silence => "silence",
        }
    }

    /// Share of records that the fault hits, or begins at, where no rate is asked for.
    pub const fn default_rate(self) -> f64 {
        match self {
            Self::DeadSensor => 0.1,
            Self::HemisphereFlip => 0.005,
            Self::Silence => 0.002,
            Self::Burst => 0.02,
            _ => 0.05,
        }
    }
}

impl fmt::Display for Fault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.as_str())
    }
}

/// A fault that is switched on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FaultSetting {
    /// The fault that is switched on.
    pub fault: Fault,
    /// Share of the records that it hits, 0 to 1; for a dead sensor, share of the sensors.
    pub rate: f64,
}

/// Why a text names no fault.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum UnknownFault {
    /// No fault has this name.
    #[error("no fault is called '{name}'; there are {}", names())]
    Name {
        /// Name that was given.
        name: String,
    },
    /// The rate is not a share.
    #[error("the rate of a fault is a number from 0 to 1, not '{text}'")]
    Rate {
        /// Text behind the colon.
        text: String,
    },
}

fn names() -> String {
    Fault::ALL.map(Fault::as_str).join(", ")
}

impl FromStr for FaultSetting {
    type Err = UnknownFault;

    fn from_str(text: &str) -> Result<Self, UnknownFault> {
        let (name, rate) = match text.split_once(':') {
            Some((name, rate)) => (name, Some(rate)),
            None => (text, None),
        };
        let fault = Fault::ALL.into_iter().find(|fault| fault.as_str() == name);
        let fault = fault.ok_or_else(|| UnknownFault::Name { name: name.to_owned() })?;
        let rate = match rate {
            None => fault.default_rate(),
            Some(text) => match text.parse() {
                Ok(rate) if (0.0..=1.0).contains(&rate) => rate,
                _ => return Err(UnknownFault::Rate { text: text.to_owned() }),
            },
        };
        Ok(Self { fault, rate })
    }
}

/// The faults that are on, and the chance that decides which records they hit.
#[derive(Clone, Debug)]
pub(super) struct Faults {
    settings: Vec<FaultSetting>,
    pub(super) chance: Chance,
}

impl Faults {
    pub(super) fn new(settings: &[FaultSetting], seed: u64) -> Self {
        Self { settings: settings.to_vec(), chance: Chance::new(seed) }
    }

    /// Rate of a fault, if it is on.
    pub(super) fn rate(&self, fault: Fault) -> Option<f64> {
        self.settings.iter().find(|on| on.fault == fault).map(|on| on.rate)
    }

    /// Whether a fault hits the next record.
    pub(super) fn hits(&mut self, fault: Fault) -> bool {
        self.rate(fault).is_some_and(|rate| self.chance.share() < rate)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn faults_are_read_with_and_without_a_rate() {
        for fault in Fault::ALL {
            let plain: FaultSetting = fault.as_str().parse().unwrap();
            assert_eq!(plain, FaultSetting { fault, rate: fault.default_rate() });
            let rated: FaultSetting = format!("{fault}:0.25").parse().unwrap();
            assert_eq!(rated, FaultSetting { fault, rate: 0.25 });
        }
        for wrong in ["", "bursts", "burst:", "burst:2", "burst:nan", "burst:-0.1", "burst:0.1:1"] {
            assert!(wrong.parse::<FaultSetting>().is_err(), "{wrong}");
        }
        let message = "x".parse::<FaultSetting>().unwrap_err().to_string();
        assert!(message.contains("hemisphere-flip"), "{message}");
    }

    #[test]
    fn a_fault_hits_about_its_share_and_only_when_it_is_on() {
        let on = FaultSetting { fault: Fault::Noise, rate: 0.25 };
        let mut faults = Faults::new(&[on], 3);
        let hits = (0..4000).filter(|_| faults.hits(Fault::Noise)).count();
        assert!((800..1200).contains(&hits), "{hits}");
        assert!(!(0..100).any(|_| faults.hits(Fault::Burst)));
    }
}
