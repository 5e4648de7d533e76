//! What the devices have told about themselves while they were set up.

use softgrasp_grasp::hand::Handedness;

use crate::devices::cyberglove::SensorCount;

/// What the glove's interface unit answered; `None` where it did not answer.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct GloveFacts {
    /// Number of sensors, 18 or 22 (`?S`).
    pub sensors: Option<SensorCount>,
    /// Number of sensors (`?S`), where it is neither 18 nor 22.
    pub other_sensors: Option<u8>,
    /// Hand that the glove is made for (`?R`).
    pub hand: Option<Handedness>,
    /// Whether the unit is initialised and a glove is plugged in (`?G`).
    pub ready: Option<bool>,
    /// Flags of the unit (`?P`).
    pub flags: Option<[u8; 3]>,
    /// Mask of the slots that have a sensor (`?K`).
    pub hardware_mask: Option<u32>,
    /// Name by which the glove identifies itself (`?i`).
    pub identity: Option<String>,
    /// Version of the unit's firmware (`?v`).
    pub firmware: Option<String>,
}

/// What the tracker answered.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct TrackerFacts {
    /// Status record, without CR LF; `None` where the tracker did not answer.
    pub status: Option<String>,
    /// Error records that the tracker sent while it was set up.
    pub complaints: Vec<String>,
    /// How the tracker's status after all commands differs from what was commanded; lengths are read in
    /// the unit that was commanded.
    pub disobeys: Option<String>,
}
