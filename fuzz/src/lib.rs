//! The parsers that are fuzzed: the list that the tests use as well.

#[path = "../../tests/src/parsers.rs"]
pub mod parsers;
#[path = "../../tests/src/raw_session.rs"]
mod raw_session;
