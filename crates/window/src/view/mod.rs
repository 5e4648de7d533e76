//! What a person sees, worked out without a window: frames of the run, the eye, skins, colours.

pub mod action;
pub mod blend;
pub mod camera;
pub mod colour_map;
pub mod colouring;
pub mod control;
pub mod directed_eye;
pub mod display;
pub mod eye_place;
pub mod eye_search;
pub mod frame;
pub mod hand_skin;
pub mod history;
pub mod legend;
pub mod loading;
pub mod moment;
pub mod nice_number;
pub mod object_skin;
pub mod outlet;
pub mod pointer;
pub mod ray_hit;
pub mod shaded_object;
pub mod shading;
pub mod steady_range;
pub mod texture;
pub mod toggle;
