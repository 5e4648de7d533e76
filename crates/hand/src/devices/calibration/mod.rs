//! Raw sensor counts ⇄ joint angles: one straight line per sensor and the rules around it.

mod checks;
mod defaults;
mod file;
mod fit;
mod fit_quality;
mod form;
mod joint_xml;
mod linear;
mod point_list;
mod sensor_names;
mod slope_matrix;
mod straight_line;
mod thumb;
mod thumb_fit;
mod virtual_hand;
mod virtual_hand_notes;
mod virtual_hand_reading;

pub use checks::CalibrationError;
pub use file::{read_toml, toml_text, with_sensor};
pub use fit::{
    FitRefusal, FitReport, Gesture, SensorFit, fit_gestures, fit_two_gestures, thumb_across,
};
pub use fit_quality::{Complaint, SensorQuality};
pub use form::{Form, read_calibration};
pub use linear::{Calibration, DipRule, SensorCalibration, sensor_angle};
pub use sensor_names::sensor_name;
pub use thumb::ThumbCoupling;
pub use thumb_fit::ThumbFit;
pub use virtual_hand::{CalibrationHeader, virtual_hand_text};
