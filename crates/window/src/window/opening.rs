//! What a window is opened with.

use softgrasp_core::fem::Material;
use softgrasp_grasp::object::{ContactModel, ObjectChoice};

use crate::view::camera::ViewCamera;
use crate::view::display::Display;
use crate::view::loading::LoadObject;

/// What a window is opened for.
pub struct Opening {
    /// What is shown at first.
    pub display: Display,
    /// Where the eye is at first.
    pub camera: ViewCamera,
    /// Whether the person chose what the colours show; else a script shows strain while it squeezes.
    pub shading_is_chosen: bool,
    /// Whether the person chose where the eye is; else the first hand does.
    pub eye_is_chosen: bool,
    /// Whether the person chose the level of drawing; else the machine does.
    pub level_is_chosen: bool,
    /// The object.
    pub object: ObjectChoice,
    /// What the fingertips of hands hold that the person chooses.
    pub contact: ContactModel,
    /// Loads another object in its place.
    pub load: LoadObject,
    /// Material of the object.
    pub material: Material,
}
