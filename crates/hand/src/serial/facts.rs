//! What the devices have told about themselves while they were set up.

use softgrasp_grasp::hand::Handedness;

use crate::devices::cyberglove::SensorCount;

/// What the glove told; `None` where it did not answer.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct GloveFacts {
    /// Its sensors (`?S`).
    pub sensors: Option<SensorCount>,
    /// Sensors it told that are neither 18 nor 22.
    pub other_sensors: Option<u8>,
    /// Its hand (`?R`).
    pub hand: Option<Handedness>,
    /// Initialised, and a glove plugged in (`?G`).
    pub ready: Option<bool>,
    /// Flags of its unit (`?P`).
    pub flags: Option<[u8; 3]>,
    /// Slots that have a sensor (`?K`).
    pub hardware_mask: Option<u32>,
    /// What it calls itself (`?i`).
    pub identity: Option<String>,
    /// Version of its firmware (`?v`).
    pub firmware: Option<String>,
}

/// What the tracker told.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct TrackerFacts {
    /// Its status record, without CR LF; `None` where it did not answer.
    pub status: Option<String>,
    /// Its complaints about what it was set to.
    pub complaints: Vec<String>,
    /// In what it is not as it was told to be, by its status after all orders; lengths are read in
    /// the unit that it was told.
    pub disobeys: Option<String>,
}
