//! What a window is opened with.

use crate::loading::ObjectRequest;
use crate::run_report::RunReport;
use crate::tick_thread::RunError;
use crate::view::camera::ViewCamera;
use crate::view::display::Display;

/// What a window is opened for.
pub struct Opening {
    /// What is shown at first.
    pub display: Display,
    /// Where the eye is at first.
    pub camera: ViewCamera,
    /// Whether the person chose where the eye is; else the first hand does.
    pub eye_is_chosen: bool,
    /// Whether the person chose the level of drawing; else the machine does.
    pub level_is_chosen: bool,
    /// The object, for other objects of the same size.
    pub object: ObjectRequest,
    /// Material of the object.
    pub material: softgrasp_core::fem::Material,
    /// Tells how the run ended and ends the process, where the display was lost.
    pub when_lost: WhenLost,
}

/// What is done with the report of a run that has lost its window; it ends the process.
pub type WhenLost = Box<dyn FnOnce(Result<RunReport, RunError>) + Send>;
