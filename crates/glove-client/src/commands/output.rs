//! Prints what a command has to say, and writes its reports.

use std::io::Write as _;
use std::path::Path;

use anyhow::Context;

use crate::object::file_writing::write_file_by;

/// Writes a value as indented JSON with a final newline.
///
/// # Errors
/// The system's reason with the path.
pub(crate) fn write_json(path: &Path, value: &impl serde::Serialize) -> anyhow::Result<()> {
    Ok(write_file_by(path, |file| {
        serde_json::to_writer_pretty(&mut *file, value)?;
        file.write_all(b"\n")
    })?)
}

/// Prints to standard output; a closed pipe (`| head`) is not an error worth words.
///
/// # Errors
/// Any other failure to write.
pub(crate) fn print(text: &str) -> anyhow::Result<()> {
    let mut out = std::io::stdout().lock();
    match out.write_all(text.as_bytes()).and_then(|()| out.flush()) {
        Err(error) if error.kind() != std::io::ErrorKind::BrokenPipe => {
            Err(error).context("cannot write to standard output")
        }
        _ => Ok(()),
    }
}
