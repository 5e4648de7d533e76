//! Raw sensor counts ⇄ joint angles: one straight line per sensor and the rules around it.

mod defaults;
mod file;
mod fit;
mod linear;

pub use file::CalibrationError;
pub use fit::{FitReport, SensorFit, fit_two_gestures};
pub use linear::{Calibration, DipRule, SensorCalibration, sensor_angle};
