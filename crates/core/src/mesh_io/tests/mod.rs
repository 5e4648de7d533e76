//! Tests of whole files: real ones, the quirks of each format, round trips, hostile bytes.

mod real_files;
