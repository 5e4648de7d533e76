//! The `fea-server` program and its access rules: connections that have not introduced themselves, status
//! pages, tokens, certificates, and what the log says of clients.

#![cfg(unix)]
#![allow(clippy::unwrap_used, reason = "helpers of tests fail like tests")]

mod certificates;
mod log;
mod pages;
mod running;
mod strangers;
mod tokens;
