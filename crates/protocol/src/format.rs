//! Constants of the format, on which every reader and writer must agree.

use wincode::{SchemaRead, SchemaWrite};

/// Range of versions of the wire that one side reads and writes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, SchemaRead, SchemaWrite)]
pub struct VersionRange {
    /// Oldest version of the range.
    pub lowest: u16,
    /// Newest version of the range.
    pub highest: u16,
}

/// First bytes of every frame.
pub const MAGIC: [u8; 4] = *b"SGRP";
/// Version of the format this crate reads and writes.
pub const VERSION: u16 = 4;
/// Versions of the wire that this crate reads and writes. Two sides use the highest version that both
/// know.
pub const VERSIONS: VersionRange = VersionRange { lowest: VERSION, highest: VERSION };
/// Bytes of a header.
pub const HEADER_LEN: usize = 32;
/// Most bytes that the part of a payload may take; fixed by the format.
pub const PART_LEN_MAX: usize = 64 * 1024;

impl VersionRange {
    /// The highest version that both ranges contain, if there is one.
    pub fn common(self, other: Self) -> Option<u16> {
        let highest = self.highest.min(other.highest);
        (highest >= self.lowest.max(other.lowest)).then_some(highest)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_highest_version_of_both_is_taken() {
        let range = |lowest, highest| VersionRange { lowest, highest };
        assert_eq!(range(4, 6).common(range(5, 9)), Some(6));
        assert_eq!(range(4, 4).common(range(4, 5)), Some(4));
        assert_eq!(range(4, 5).common(range(6, 7)), None);
        assert_eq!(range(6, 7).common(range(4, 5)), None);
        assert_eq!(range(5, 4).common(range(4, 5)), None, "nothing lies in an empty range");
    }
}
