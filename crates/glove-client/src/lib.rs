//! Client of Softgrasp: devices, grasp loop, link to the server, commands.
//!
//! The way of one tick, [`grasp_loop`]: device bytes ([`devices`], [`scripted`]) → hand pose
//! ([`hand_reader`]) → contacts and grasp (`softgrasp_core::grasp`) → request ([`link`]) → answer →
//! deformed object ([`soft_object`]). What can take longer than a tick is done beside it
//! ([`beside`]).

mod answering;
pub mod arrival;
pub mod beside;
pub mod calculix_deck;
pub mod commands;
pub mod connection;
pub mod contact_model;
pub mod control;
pub mod deformation;
pub mod devices;
pub mod digest;
pub mod discretisation;
pub mod displacement_table;
pub mod endpoint;
pub mod file_writing;
pub mod forecast;
pub mod foreign_recording;
pub mod grasp_loop;
pub mod hand_choice;
pub mod hand_reader;
pub mod hand_request;
pub mod hand_setup;
pub mod hand_source;
pub mod inspection;
pub mod interruption;
pub mod joints;
pub mod joints_reader;
mod keep;
mod keeping;
pub mod latency;
pub mod link;
pub mod live_hand;
pub mod loading;
pub mod mending_summary;
pub mod mesh_file;
pub mod mesh_writing;
pub mod model_upload;
pub mod mouse;
pub mod notice;
pub mod object_changes;
mod object_control;
pub mod object_work;
pub mod pace;
pub mod prefetch;
pub mod progress;
pub mod recording;
pub mod rest_shape;
pub mod run_clock;
pub mod run_report;
mod run_words;
pub mod saving;
pub mod scene;
pub mod scripted;
pub mod sent;
pub mod serial;
pub mod server_stream;
pub mod session;
pub mod shape_history;
pub mod soft_object;
pub mod solve_report;
pub mod solve_settings;
mod springback;
pub mod status_line;
pub mod tick_budget;
pub mod tick_loop;
pub mod tick_outcome;
pub mod tick_thread;
pub mod unanswered;
pub mod view;
#[cfg(feature = "window")]
pub mod window;
