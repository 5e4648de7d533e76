//! Recognises the format of a file by its content; the file's extension is not looked at.

use super::cursor::{Cursor, find, words};
use super::number::parse_integer;
use super::{Foreign, Format, encoding, tetgen, thesis_lists};

/// A format known by its content.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Sniffed {
    /// Can be read.
    Readable(Format),
    /// Is only recognised.
    Foreign(Foreign),
}

/// Format of the bytes, or of what gzip packed in them; `None` if nothing known begins like this.
pub fn sniff(bytes: &[u8]) -> Option<Sniffed> {
    match encoding::is_gzip(bytes) {
        true => sniff_unpacked(&encoding::beginning(bytes)),
        false => sniff_unpacked(bytes),
    }
}

/// Format of bytes that are not packed, or not any more.
pub(super) fn sniff_unpacked(bytes: &[u8]) -> Option<Sniffed> {
    let bytes = without_mark(bytes);
    // The number one, then version 1 to 4, in either byte order.
    if let [1, 0, 0, 0, 1..=4, 0, 0, 0, ..] | [0, 0, 0, 1, 0, 0, 0, 1..=4, ..] = bytes {
        return Some(Sniffed::Readable(Format::MeditBinary));
    }
    if let Some(foreign) = by_magic(bytes) {
        return Some(Sniffed::Foreign(foreign));
    }
    let text = bytes.trim_ascii_start();
    let start = text.get(..200).unwrap_or(text).to_ascii_lowercase();
    let readable = |format| Some(Sniffed::Readable(format));
    let foreign = |format| Some(Sniffed::Foreign(format));
    match start.as_slice() {
        [b'$', ..] => gmsh_version(text),
        s if s.starts_with(b"# vtk datafile") => readable(Format::VtkLegacy),
        s if s.starts_with(thesis_lists::MAGIC.as_bytes()) => readable(Format::ThesisLists),
        s if s.starts_with(b"mfem ") => foreign(Foreign::Mfem),
        s if s.starts_with(b"#usda") => foreign(Foreign::Usd),
        s if s.starts_with(b"ply") && s.get(3).is_some_and(u8::is_ascii_whitespace) => {
            foreign(Foreign::Ply)
        }
        s if is_off(s) => foreign(Foreign::Off),
        [b'{', ..] if find(text, b"\"asset\"").is_some() => foreign(Foreign::Gltf),
        s if s.starts_with(b"solid") && find(text, b"facet").is_some() => foreign(Foreign::Stl),
        [b'(', b'0'..=b'9', ..] => foreign(Foreign::Fluent),
        [b'<', ..] => by_xml(text),
        _ => by_first_line(text),
    }
    .or_else(|| by_length(bytes).map(Sniffed::Foreign))
}

/// The bytes without the mark that some editors put in front of UTF-8.
pub(super) fn without_mark(bytes: &[u8]) -> &[u8] {
    bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes)
}

/// Whether a text begins like OFF, perhaps with the letters of what every
/// point has besides its place.
fn is_off(start: &[u8]) -> bool {
    [&b"off"[..], b"coff", b"noff", b"cnoff", b"stoff"].iter().any(|word| {
        start.starts_with(word) && start.get(word.len()).is_none_or(u8::is_ascii_whitespace)
    })
}

fn by_magic(bytes: &[u8]) -> Option<Foreign> {
    const MAGICS: [(&[u8], Foreign); 12] = [
        (b"glTF", Foreign::Gltf),
        (b"\x1f\x8b", Foreign::Gzip),
        (b"PK\x03\x04", Foreign::Zip),
        (b"PK\x05\x06", Foreign::Zip),
        (b"\xfd7zXZ\x00", Foreign::OtherCompression),
        (b"BZh", Foreign::OtherCompression),
        (b"\x28\xb5\x2f\xfd", Foreign::OtherCompression),
        (b"PXR-USDC", Foreign::Usd),
        (b"\x89HDF", Foreign::Hdf5),
        (b"CDF\x01", Foreign::NetCdf),
        (b"CDF\x02", Foreign::NetCdf),
        (b"CDF\x05", Foreign::NetCdf),
    ];
    MAGICS.iter().find(|(magic, _)| bytes.starts_with(magic)).map(|&(_, foreign)| foreign)
}

/// Binary surfaces without a magic number have a length that follows from their counts.
fn by_length(bytes: &[u8]) -> Option<Foreign> {
    let count = |at: usize| {
        bytes.get(at..at + 4)?.try_into().ok().map(|b| u64::from(u32::from_le_bytes(b)))
    };
    let length = bytes.len() as u64;
    if let Some(triangles) = count(80)
        && length == 84 + 50 * triangles
    {
        return Some(Foreign::Stl);
    }
    let (vertices, normals, texcoords, faces) = (count(0)?, count(4)?, count(8)?, count(12)?);
    let mujoco = 16 + 12 * vertices + 12 * normals + 8 * texcoords + 12 * faces;
    (length == mujoco && vertices > 0).then_some(Foreign::MujocoLegacy)
}

/// Version and encoding of a file that begins with a `$` section, which may be `$Comments`.
fn gmsh_version(text: &[u8]) -> Option<Sniffed> {
    let Some(at) = find(text, b"$MeshFormat") else {
        return find(text, b"$NOD").map(|_| Sniffed::Readable(Format::GmshMsh1));
    };
    let mut cursor = Cursor::new("", text.get(at + 11..)?);
    let version = cursor.token().unwrap_or_default();
    let binary = cursor.token() == Some(b"1");
    let format = match (version.first(), binary) {
        (Some(b'2'), false) => Format::GmshMsh2Ascii,
        (Some(b'2'), true) => Format::GmshMsh2Binary,
        (Some(b'4') | None, false) => Format::GmshMsh4Ascii,
        (Some(b'4') | None, true) => Format::GmshMsh4Binary,
        _ => return Some(Sniffed::Foreign(Foreign::GmshOther)),
    };
    Some(Sniffed::Readable(format))
}

/// By the root element, which comes after declarations and comments.
fn by_xml(text: &[u8]) -> Option<Sniffed> {
    let mut cursor = Cursor::new("", text);
    let root = loop {
        match super::xml::next_event(&mut cursor).ok()? {
            Some(super::xml::Event::Open { name, .. }) => break name,
            Some(_) => {}
            None => return None,
        }
    };
    Some(match root.to_ascii_lowercase().as_slice() {
        b"vtkfile" => Sniffed::Readable(Format::Vtu),
        b"febio_spec" => Sniffed::Readable(Format::Febio),
        b"xdmf" => Sniffed::Readable(Format::Xdmf),
        b"dolfin" => Sniffed::Foreign(Foreign::DolfinXml),
        _ => return None,
    })
}

/// Text formats without a magic word, by their first line that is not a comment.
fn by_first_line(text: &[u8]) -> Option<Sniffed> {
    if text.starts_with(b"#") && comment_mentions(text, b"ndim npoint ncell") {
        return Some(Sniffed::Foreign(Foreign::Gemlab));
    }
    let mut cursor = Cursor::with_comments("", text, b'#');
    let line = cursor.line()?;
    let first = words(line).next()?;
    if first.eq_ignore_ascii_case(b"MeshVersionFormatted") {
        return Some(Sniffed::Readable(Format::Medit));
    }
    if first == b"mesh3d" {
        return Some(Sniffed::Readable(Format::Netgen));
    }
    if first.starts_with(b"*") {
        return star_keywords(text);
    }
    if matches!(
        first,
        b"v" | b"vn" | b"vt" | b"t" | b"f" | b"o" | b"g" | b"s" | b"mtllib" | b"usemtl"
    ) {
        return letter_lines(text);
    }
    parse_integer(first)?;
    tetgen::half(text).map(|_| Sniffed::Readable(Format::TetGen))
}

fn comment_mentions(text: &[u8], phrase: &[u8]) -> bool {
    text.split(|&b| b == b'\n')
        .take_while(|line| line.trim_ascii().is_empty() || line.trim_ascii().starts_with(b"#"))
        .any(|line| find(line, phrase).is_some())
}

/// Vega and Abaqus both have sections that begin with a star; the names of the sections differ.
fn star_keywords(text: &[u8]) -> Option<Sniffed> {
    for line in text.split(|&b| b == b'\n').filter(|line| line.starts_with(b"*")) {
        let keyword = line.split(|&b| b == b',').next()?.trim_ascii().to_ascii_uppercase();
        let has_comma = line.contains(&b',');
        match words(&keyword).next().unwrap_or_default() {
            b"*VERTICES" | b"*ELEMENTS" | b"*REGION" | b"*SET" => {
                return Some(Sniffed::Readable(Format::Vega));
            }
            b"*INCLUDE" if !has_comma => return Some(Sniffed::Readable(Format::Vega)),
            b"*INCLUDE" | b"*NODE" | b"*ELEMENT" | b"*HEADING" | b"*PART" | b"*NSET"
            | b"*ELSET" | b"*ASSEMBLY" => return Some(Sniffed::Readable(Format::Deck)),
            _ => {}
        }
    }
    None
}

/// `.tet` and OBJ share the lines `v x y z`; then come `t` or `f`.
fn letter_lines(text: &[u8]) -> Option<Sniffed> {
    let mut cursor = Cursor::with_comments("", text, b'#');
    while let Some(line) = cursor.line() {
        match words(line).next() {
            Some(b"t") => return Some(Sniffed::Readable(Format::Tet)),
            Some(b"v") => {}
            _ => return Some(Sniffed::Foreign(Foreign::Obj)),
        }
    }
    Some(Sniffed::Readable(Format::Tet))
}
