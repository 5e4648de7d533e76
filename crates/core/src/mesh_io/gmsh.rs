//! Gmsh MSH files: the header and the sections that versions 1, 2 and 4 share.

use super::byte_order::ByteOrder;
use super::cursor::{Cursor, words};
use super::error::MeshFileError;
use super::number::parse_integer;
use super::raw_mesh::RawMesh;
use super::{msh1, msh2, msh4};

/// What `$MeshFormat` says; MSH 1 has no such section.
#[derive(Clone, Copy, Debug)]
pub(super) struct Header {
    /// 2 or 4.
    pub(super) major: i64,
    /// Digits after the point.
    pub(super) minor: i64,
    /// Byte order of binary sections; `None` in a text file.
    pub(super) binary: Option<ByteOrder>,
    /// Size of `size_t` in binary MSH 4, 4 or 8 bytes.
    pub(super) size_bytes: i64,
}

/// Reads an MSH file of version 1, 2 or 4.
///
/// # Errors
/// [`MeshFileError`]: the file ends too early, or something else stands where data should be.
///
/// Source: Gmsh reference manual, "MSH file format" and "Legacy formats".
pub(super) fn read(mut cursor: Cursor) -> Result<RawMesh, MeshFileError> {
    let mut raw = RawMesh::default();
    let mut header = None;
    let mut entities = msh4::Entities::default();
    loop {
        let start = cursor.clone();
        let Some(token) = cursor.token() else { break };
        match (token, header) {
            (b"$MeshFormat", _) => header = Some(read_header(&mut cursor)?),
            (b"$NOD", _) => msh1::read_nodes(&mut cursor, &mut raw)?,
            (b"$ELM", _) => msh1::read_elements(&mut cursor, &mut raw)?,
            (b"$Nodes", Some(h)) if h.major == 2 => msh2::read_nodes(&mut cursor, h, &mut raw)?,
            (b"$Nodes", Some(h)) => msh4::read_nodes(&mut cursor, h, &mut raw)?,
            (b"$Elements", Some(h)) if h.major == 2 => {
                msh2::read_elements(&mut cursor, h, &mut raw)?;
            }
            (b"$Elements", Some(h)) => {
                msh4::read_elements(&mut cursor, h, &entities, &mut raw)?;
            }
            (b"$Entities", Some(h)) if h.major == 4 => {
                entities = msh4::read_entities(&mut cursor, h)?;
            }
            (b"$PhysicalNames", _) => read_physical_names(&mut cursor, &mut raw)?,
            ([b'$', section @ ..], _) => {
                raw.findings.skip(section);
                if !skip_section(&mut cursor, section) {
                    let section = section.escape_ascii();
                    raw.findings.note(format!("the file ends inside section ${section}"));
                    break;
                }
            }
            _ => return Err(start.expected("a section ($…)")),
        }
    }
    Ok(raw)
}

/// Moves past the end mark of a section; a file cut short lacks it.
pub(super) fn end_section(cursor: &mut Cursor, mark: &str) -> Result<(), MeshFileError> {
    cursor.word(mark)
}

fn read_header(cursor: &mut Cursor) -> Result<Header, MeshFileError> {
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

/// Names of volume groups: lines `dimension tag "name"`.
fn read_physical_names(cursor: &mut Cursor, raw: &mut RawMesh) -> Result<(), MeshFileError> {
    let count = cursor.count("the number of physical names")?;
    cursor.check_count(count, 4, "physical names")?;
    for _ in 0..count {
        let line = cursor.line().unwrap_or_default();
        let mut fields = words(line).map(parse_integer);
        let (Some(Some(dimension)), Some(Some(tag))) = (fields.next(), fields.next()) else {
            return Err(cursor.expected_instead("a line: dimension, tag, \"name\"", line));
        };
        if dimension == 3 {
            let mut quoted = line.splitn(3, |&b| b == b'"');
            let name = quoted.nth(1).unwrap_or_default();
            raw.region_names.insert(tag, String::from_utf8_lossy(name).into_owned());
        }
    }
    end_section(cursor, "$EndPhysicalNames")
}

/// Moves past `$End…` or `$END…`; false when there is none.
///
/// One pass, so that a file of thousands of sections takes no longer than its length.
fn skip_section(cursor: &mut Cursor, section: &[u8]) -> bool {
    let mut here = cursor.clone();
    while here.skip_past(b"$") {
        let is_end = here.rest().split_first_chunk::<3>().is_some_and(|(word, after)| {
            let name_ends = after.get(section.len()).is_none_or(u8::is_ascii_whitespace);
            word.eq_ignore_ascii_case(b"end") && after.starts_with(section) && name_ends
        });
        if is_end {
            here.token();
            *cursor = here;
            return true;
        }
    }
    false
}
