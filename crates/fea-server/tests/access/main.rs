//! The `fea-server` program towards those who may come and those who may not: strangers, watchers,
//! tokens, certificates, and what the log says of them.

#![cfg(unix)]
#![allow(clippy::unwrap_used, reason = "helpers of tests fail like tests")]

mod certificates;
mod log;
mod pages;
mod running;
mod strangers;
mod tokens;
