//! Glove and tracker on serial ports: a thread each opens the port, sets the device up, and hands
//! over what arrives.

mod arrivals;
mod driver;
mod facts;
mod glove_driver;
mod listening;
mod port;
mod record_assembler;
mod serial_devices;
mod settings;
mod source;
mod tracker_driver;

pub mod motion;
pub mod probe;

pub use arrivals::Arrived;
pub use driver::DeviceState;
pub use facts::{GloveFacts, TrackerFacts};
pub use serial_devices::{SerialDevices, SerialError};
pub use settings::settings_of_hand;
pub use settings::{
    GloveMode, GloveSettings, SerialSettings, SettingsError, TrackerFilter, TrackerMode,
    TrackerSettings,
};
pub use source::{PortName, SerialSource, SerialSourceError};
