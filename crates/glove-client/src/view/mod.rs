//! What a person sees, worked out without a window: frames of the run, the eye, skins, colours.

pub mod action;
pub mod camera;
pub mod colour_map;
pub mod colouring;
pub mod display;
pub mod frame;
pub mod hand_skin;
pub mod history;
pub mod legend;
pub mod moment;
pub mod object_skin;
pub mod observer;
pub mod outlet;
pub mod pointer;
pub mod shaded_object;
pub mod shading;
pub mod toggle;
