//! Gmsh MSH files: the header and the sections that versions 1, 2 and 4 share.

use super::cursor::{Cursor, words};
use super::error::MeshFileError;
use super::msh1::{end_section, read_header};
use super::number::parse_integer;
use super::raw_mesh::RawMesh;
use super::{msh1, msh2, msh4};

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
