//! Constants of the format, on which every reader and writer must agree.

use crate::VersionRange;

/// First bytes of every frame.
pub const MAGIC: [u8; 4] = *b"SGRP";
/// Version of the format this crate reads and writes.
pub const VERSION: u16 = 4;
/// Lowest and highest version that this crate reads and writes; of those that both sides know they
/// take the highest.
pub const VERSIONS: VersionRange = VersionRange { lowest: VERSION, highest: VERSION };
/// Bytes of a header.
pub const HEADER_LEN: usize = 32;
/// Most bytes the part of a payload may take; part of the format.
pub const PART_LEN_MAX: usize = 64 * 1024;
