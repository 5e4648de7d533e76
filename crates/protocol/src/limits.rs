//! Upper limits on everything that comes from the other side.

use wincode::{SchemaRead, SchemaWrite};

use crate::DecodeError;

/// Limits that one side puts on what it reads; the server sends its own in `Welcome`.
///
/// Units: bytes for `…_len_max`, entries for `…_count_max`. Announced counts are compared with
/// these and with the bytes that are really there before memory is taken.
#[derive(Clone, Copy, Debug, PartialEq, Eq, SchemaRead, SchemaWrite)]
pub struct Limits {
    /// Length of one payload, bytes.
    pub payload_len_max: u32,
    /// Number of vertices of a mesh, of nodes asked for, and of nodes answered.
    pub node_count_max: u32,
    /// Number of tetrahedra of a mesh.
    pub tet_count_max: u32,
    /// Number of entries of one list of degrees of freedom (known, forces, fixed, reactions).
    pub dof_count_max: u32,
    /// Number of entries of the material table.
    pub material_count_max: u32,
    /// Length of one text, bytes.
    pub text_len_max: u32,
}

impl Default for Limits {
    /// Chosen: 400 000 nodes and six elements per node come to 61 MiB, a quarter of the payload.
    fn default() -> Self {
        Self {
            payload_len_max: 256 * 1024 * 1024,
            node_count_max: 400_000,
            tet_count_max: 2_400_000,
            dof_count_max: 1_200_000,
            material_count_max: 65_536,
            text_len_max: 16 * 1024,
        }
    }
}

impl Limits {
    /// The most that a server can be told to read, and that a client reads: sixteen million nodes and six
    /// elements for each come to 1.8 GiB, less than half of what the header can tell of a payload. The
    /// leanest method needs 60 GiB for so many.
    pub const LARGEST: Self = Self {
        payload_len_max: 2 * 1024 * 1024 * 1024,
        node_count_max: 16_000_000,
        tet_count_max: 96_000_000,
        dof_count_max: 48_000_000,
        material_count_max: 65_536,
        text_len_max: 16 * 1024,
    };

    /// Checks that a text is not longer than `text_len_max`.
    ///
    /// # Errors
    /// [`DecodeError::TextTooLong`] with the name of the text.
    pub(crate) fn check_text(&self, what: &'static str, text: &str) -> Result<(), DecodeError> {
        let (len, len_max) = (text.len(), self.text_len_max);
        if len > len_max as usize {
            return Err(DecodeError::TextTooLong { what, len, len_max });
        }
        Ok(())
    }
}

/// `count` as an array length, if it is within `count_max`.
///
/// # Errors
/// [`DecodeError::TooMany`] with the name of the array.
pub(crate) fn check_count(
    what: &'static str,
    count: u32,
    count_max: u32,
) -> Result<usize, DecodeError> {
    if count > count_max {
        return Err(DecodeError::TooMany { what, count, count_max });
    }
    Ok(count as usize)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_count_at_the_limit_passes_and_one_more_does_not() {
        assert_eq!(check_count("vertices", 7, 7).unwrap(), 7);
        assert!(matches!(
            check_count("vertices", 8, 7),
            Err(DecodeError::TooMany { what: "vertices", count: 8, count_max: 7 })
        ));
    }

    #[test]
    fn a_text_at_the_limit_passes_and_one_more_byte_does_not() {
        let limits = Limits { text_len_max: 2, ..Limits::default() };
        assert!(limits.check_text("client", "é").is_ok());
        assert!(limits.check_text("client", "éa").is_err());
    }
}
