//! The commands of `glove-client`, one file each; `main` only parses and prints the error.

mod access_arguments;
pub mod align;
pub mod arguments;
mod arm_recording;
pub mod calibrate;
mod collecting;
pub mod command_line;
mod contact_arguments;
mod device_sentences;
pub mod devices;
mod display_arguments;
mod elasticity_arguments;
pub mod emulate;
mod field_arguments;
pub mod fill;
mod force_arguments;
mod further_setup;
mod gestures;
mod gradient_arguments;
mod hand_arguments;
mod hand_files;
pub mod inspect;
pub mod interruption;
mod key_frames;
mod live_samples;
mod load_arguments;
pub mod mesh;
mod numbers;
mod object_plan;
mod output;
mod page_arguments;
pub mod press;
pub mod record;
mod recorded_object;
mod recorded_samples;
mod recorded_settings;
mod region_arguments;
pub mod replay;
pub mod run;
mod run_arguments;
#[cfg_attr(not(feature = "xr"), path = "no_page.rs")]
mod run_page;
#[cfg_attr(not(feature = "window"), path = "no_pictures.rs")]
mod run_pictures;
mod run_plan;
mod run_recording;
mod run_series;
mod run_setup;
#[cfg(feature = "window")]
mod run_window;
mod sensor_bars;
pub mod solve;
mod solve_cases;
mod solve_words;
mod tell_report;
