//! Reads a mesh from the bytes of a file: recognises the format, reads, checks.

use super::companion::{Companion, FindCompanion};
use super::cursor::{Cursor, quote};
use super::encoding::{Unpacker, is_gzip};
use super::error::{Fault, MeshFileError};
use super::sniff::{Sniffed, sniff_unpacked, without_mark};
use super::{
    Format, MeshFile, deck, febio, gmsh, medit, netgen, tet, tetgen, thesis_lists, vega,
    vtk_legacy, vtu, xdmf,
};

/// Reads a mesh file of any known format.
///
/// `name` is for errors only; the format is found by content, and gzip is unpacked. `companion` is
/// asked for the other files that some formats need, and returns their bytes or `None`.
///
/// # Errors
/// [`MeshFileError`]: one line that names the file, the place, what was expected and what was
/// found. Bytes from outside never make this panic or allocate by an announced count.
pub fn parse(
    name: &str,
    bytes: &[u8],
    companion: &mut dyn FnMut(&Companion) -> Option<Vec<u8>>,
) -> Result<MeshFile, MeshFileError> {
    let mut unpacker = Unpacker::default();
    if !is_gzip(bytes) {
        return parse_unpacked(name, bytes, &mut unpacker, companion);
    }
    let unpacked = unpacker.unpack(name, bytes)?;
    let mut file = parse_unpacked(name, &unpacked, &mut unpacker, companion)?;
    file.findings.note("unpacked from gzip");
    Ok(file)
}

fn parse_unpacked(
    name: &str,
    bytes: &[u8],
    unpacker: &mut Unpacker,
    companion: &mut FindCompanion,
) -> Result<MeshFile, MeshFileError> {
    let bytes = without_mark(bytes);
    let refuse = |fault| MeshFileError { file: name.to_owned(), fault };
    let start = bytes.trim_ascii_start();
    if start.is_empty() {
        return Err(refuse(Fault::Empty));
    }
    match sniff_unpacked(bytes) {
        Some(Sniffed::Readable(format)) => {
            let mut find = |wanted: &Companion| {
                companion(wanted).and_then(|bytes| unpacker.companion(wanted, bytes))
            };
            let raw = read(name, bytes, format, &mut find);
            // A companion that cannot be unpacked is not one that is missing.
            match unpacker.fault.take() {
                Some(fault) => Err(fault),
                None => raw?.finish(name, format),
            }
        }
        Some(Sniffed::Foreign(what)) => Err(refuse(Fault::Foreign { what })),
        None => Err(refuse(Fault::Unknown { start: quote(start) })),
    }
}

fn read(
    name: &str,
    bytes: &[u8],
    format: Format,
    companion: &mut FindCompanion,
) -> Result<super::raw_mesh::RawMesh, MeshFileError> {
    let plain = Cursor::new(name, bytes);
    let commented = Cursor::with_comments(name, bytes, b'#');
    match format {
        Format::GmshMsh1
        | Format::GmshMsh2Ascii
        | Format::GmshMsh2Binary
        | Format::GmshMsh4Ascii
        | Format::GmshMsh4Binary => gmsh::read(plain),
        Format::VtkLegacy => vtk_legacy::read(plain),
        Format::Vtu => vtu::read(plain),
        Format::TetGen => tetgen::read(name, bytes, companion),
        Format::Medit => medit::read(commented),
        Format::MeditBinary => medit::read_binary(plain),
        Format::Netgen => netgen::read(commented),
        Format::Febio => febio::read(name, bytes, companion),
        Format::Xdmf => xdmf::read(name, bytes, companion),
        Format::Deck => deck::read(name, bytes, companion),
        Format::Vega => vega::read(name, bytes, companion),
        Format::Tet => tet::read(commented),
        Format::ThesisLists => thesis_lists::read(commented),
    }
}
