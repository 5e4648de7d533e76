//! Client of Softgrasp: devices, grasp loop, link to the server, commands.

pub mod commands;
pub mod connection;
pub mod devices;
pub mod displacement_table;
pub mod mesh_file;
pub mod progress;
pub mod solve_report;
