//! Constants of the format, on which every reader and writer must agree.

/// First bytes of every frame.
pub const MAGIC: [u8; 4] = *b"SGRP";
/// Version of the format this crate reads and writes.
pub const VERSION: u16 = 3;
/// Bytes of a header.
pub const HEADER_LEN: usize = 32;
/// Most bytes the bincode part of a payload may take; part of the format.
pub const PART_LEN_MAX: usize = 64 * 1024;
