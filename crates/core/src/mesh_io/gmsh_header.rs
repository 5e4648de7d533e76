//! The `$MeshFormat` section of Gmsh files, and the end marks that all sections share.

use super::cursor::Cursor;
use super::error::MeshFileError;
use super::number::parse_integer;
use super::scalar::ByteOrder;

/// What `$MeshFormat` says; MSH 1 has no such section.
#[derive(Clone, Copy, Debug)]
pub(super) struct Header {
    /// Version of the format: 2 or 4.
    pub(super) major: i64,
    /// Digits after the point.
    pub(super) minor: i64,
    /// Byte order of binary sections; `None` in a text file.
    pub(super) binary: Option<ByteOrder>,
    /// Size of `size_t` in binary MSH 4, 4 or 8 bytes.
    pub(super) size_bytes: i64,
}

/// Moves past the end mark of a section; a file cut short lacks it.
pub(super) fn end_section(cursor: &mut Cursor, mark: &str) -> Result<(), MeshFileError> {
    cursor.word(mark)
}

/// Reads the section after its name, end mark included.
pub(super) fn read_header(cursor: &mut Cursor) -> Result<Header, MeshFileError> {
    cursor.skip_space();
    let here = cursor.clone();
    let version = cursor.token().and_then(|token| {
        let mut parts = token.splitn(2, |&b| b == b'.');
        let major = parse_integer(parts.next()?)?;
        // Gmsh writes 4 for 4.0.
        Some((major, parts.next().map_or(Some(0), parse_integer)?))
    });
    let Some((major @ (2 | 4), minor)) = version else {
        return Err(here.expected("version 2.x or 4.x"));
    };
    let file_type = cursor.integer("file type 0 (text) or 1 (binary)")?;
    let size_bytes = cursor.integer("the size of a number in bytes")?;
    let mut header = Header { major, minor, binary: None, size_bytes };
    if file_type == 1 {
        if major == 4 && minor == 0 {
            return Err(here.unsupported("binary MSH 4.0"));
        }
        if !matches!((major, size_bytes), (2, 8) | (4, 4 | 8)) {
            return Err(here.unsupported(&format!("binary MSH with numbers of {size_bytes} bytes")));
        }
        cursor.end_of_line()?;
        cursor.set_binary(true);
        let before = cursor.clone();
        header.binary = match cursor.take_array("the number one in binary")? {
            [1, 0, 0, 0] => Some(ByteOrder::Little),
            [0, 0, 0, 1] => Some(ByteOrder::Big),
            _ => return Err(before.expected("the number one in binary")),
        };
    }
    // TetWild and PyMesh put no newline between the binary one and the end mark.
    end_section(cursor, "$EndMeshFormat")?;
    Ok(header)
}
