//! CyberGlove and its interface unit: sensors, records and the parser of their byte stream.

mod parser;
mod record;
mod sensor;
mod sensor_health;

pub use parser::{GloveError, GloveEvent, GloveFault, GloveFaultKind, GloveParser};
pub use record::{
    GloveEncoding, GloveRecord, GloveStatus, GloveTicks, RecordKind, RecordOptions, encode_line,
    encode_record,
};
pub use sensor::{RawSensors, RawSensorsError, Sensor, SensorCount, SensorSet};
pub use sensor_health::SensorHealth;
pub(crate) use sensor_health::is_rail;
