//! Client of Softgrasp: devices, grasp loop, link to the server, commands.

pub mod devices;
