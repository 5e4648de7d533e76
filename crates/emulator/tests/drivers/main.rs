//! The drivers against the emulators over pseudo-terminals, at real rates.

#![cfg(unix)]

mod completeness;
mod probing;
mod reader;
mod recovery;
mod served;
