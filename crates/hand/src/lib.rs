//! Where the hand comes from: devices, joints, scripts, a mouse, recordings.
//!
//! Every source ([`hand_source`]) brings bytes with their times ([`sent`]): [`serial`] reads a glove and a
//! tracker ([`devices`]), [`joints`] a stream of tracked joints, [`xr_runtime`] asks an OpenXR runtime for
//! them, [`scripted`] plays a person, [`mouse`] has one with a mouse, [`recording`] and [`foreign_recording`]
//! repeat what was. [`hand_reader`] makes a pose of the hand of them, by the dimensions, calibration and mount
//! of [`hand_setup`], and moves it evenly between samples ([`even_motion`]); [`hand_readers`] does so for a
//! left and a right hand at once.
//!
//! ```
//! use softgrasp_hand::devices::cyberglove::{GloveEvent, GloveParser, RecordOptions, SensorCount};
//!
//! let mut parser = GloveParser::new(SensorCount::Eighteen, RecordOptions::default());
//! // A record: its letter, a byte for each sensor, and a zero.
//! let record = [&b"G"[..], &[100; 18], &[0]].concat();
//! let mut records = 0;
//! parser.feed_all(&record, |event| records += usize::from(matches!(event, GloveEvent::Record(_))));
//! assert_eq!(records, 1);
//! ```

#[cfg(test)]
mod damaged_lines_tests;
pub mod devices;
pub mod even_motion;
pub mod foreign_recording;
pub mod hand_reader;
pub mod hand_readers;
pub mod hand_request;
pub mod hand_setup;
pub mod hand_source;
pub mod joints;
pub mod joints_reader;
pub mod live_hand;
pub mod loaded_object;
pub mod mouse;
pub mod notice;
pub mod recording;
pub mod scripted;
pub mod sent;
pub mod serial;
pub mod xr_runtime;
