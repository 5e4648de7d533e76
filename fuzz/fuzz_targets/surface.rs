//! Fuzzes what takes surface from outside; see the list in `tests/src/parsers.rs`.

#![no_main]

use libfuzzer_sys::fuzz_target;
use softgrasp_fuzz::parsers::Parser;

fuzz_target!(|bytes: &[u8]| Parser::Surface.take(bytes));
