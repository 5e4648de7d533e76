//! Writes a file completely, or leaves an older one as it was.

use std::path::{Path, PathBuf};

/// A file that cannot be written.
#[derive(Debug, thiserror::Error)]
pub enum FileWriteError {
    /// The path is a folder's.
    #[error("cannot write {path}: it is a directory")]
    Directory {
        /// As given.
        path: PathBuf,
    },
    /// The system does not let it be written.
    #[error("cannot write {path}: {source}")]
    System {
        /// As given.
        path: PathBuf,
        /// The system's reason.
        source: std::io::Error,
    },
}

/// Writes a file; a reader never sees half of it, and a failure leaves an older file as it was.
///
/// # Errors
/// [`FileWriteError`] with the path and the system's reason.
pub fn write_file(path: &Path, bytes: &[u8]) -> Result<(), FileWriteError> {
    let system = |source| FileWriteError::System { path: path.to_owned(), source };
    if path.is_dir() {
        return Err(FileWriteError::Directory { path: path.to_owned() });
    }
    // Devices and pipes (/dev/stdout) cannot be replaced by renaming.
    if path.exists() && !path.is_file() {
        return std::fs::write(path, bytes).map_err(system);
    }
    let mut name = path.file_name().unwrap_or_default().to_owned();
    name.push(format!(".{}.part", std::process::id()));
    let part = path.with_file_name(name);
    let written = std::fs::write(&part, bytes).and_then(|()| std::fs::rename(&part, path));
    if written.is_err() {
        // Best effort: the error that matters is the one reported below.
        let _ = std::fs::remove_file(&part);
    }
    written.map_err(system)
}
