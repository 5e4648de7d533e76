//! Shared by the system tests: questions, clients, faulty connections, checks of files.

pub mod conversation;
pub mod curved;
pub mod fake_server;
pub mod faulty_pipe;
pub mod faulty_proxy;
pub mod heard;
pub mod imports;
pub mod parsers;
pub mod questions;
pub mod quoting;
pub mod random;
pub mod raw_session;
pub mod server_process;
pub mod shared;
pub mod watchdog;
